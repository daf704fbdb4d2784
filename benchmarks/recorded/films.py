"""Recorded videos as an image source that provides one frame of each camera at a time."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.core.typing import Image
from hrc_env.perception.blazepose import crop_window


class Films:
    """An `ImageSource` with the current frames of the videos of a rig, which are read in step."""

    def __init__(self, paths: Sequence[Path]) -> None:
        """Open the videos; raise `ConfigError` if a file is not a video."""
        self.frames: list[Image] = []
        """Current frame of each camera, (H, W, 3) RGB; the list is empty before `advance`."""
        self._films = [cv2.VideoCapture(str(path)) for path in paths]
        for path, film in zip(paths, self._films, strict=True):
            if not film.isOpened():
                raise ConfigError(f"{path} cannot be read as a film; expected a video file.")

    @property
    def frames_per_s(self) -> float:
        """Frame rate of the first video [Hz]."""
        return float(self._films[0].get(cv2.CAP_PROP_FPS))

    @property
    def sizes_px(self) -> list[tuple[int, int]]:
        """Width and height of each camera's frames [px]."""
        return [
            (int(film.get(cv2.CAP_PROP_FRAME_WIDTH)), int(film.get(cv2.CAP_PROP_FRAME_HEIGHT)))
            for film in self._films
        ]

    @property
    def n_frames(self) -> int:
        """Number of frames of the shortest video, according to the file headers."""
        return min(int(film.get(cv2.CAP_PROP_FRAME_COUNT)) for film in self._films)

    def advance(self) -> bool:
        """Read the next frame of each video; return False at the end of a video."""
        read = [film.read() for film in self._films]
        if not all(ok for ok, _ in read):
            return False
        self.frames = [
            np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8) for _, bgr in read
        ]
        return True

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return an upright crop of a camera's current frame, (256, 256, 3) RGB."""
        return crop_window(self.frames[camera_index], window)

    def close(self) -> None:
        """Close the video files."""
        for film in self._films:
            film.release()
