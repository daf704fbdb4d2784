"""The film of a track: four views side by side, the skeleton and what it is unsure of."""

import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import imageio.v2 as imageio
import numpy as np

from benchmarks.recorded.films import Films
from benchmarks.recorded.metrics import Track
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Image
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.render import overlay

TILE = (480, 852)
HEAD = 60
FRAMES_PER_S = 15
"""A quarter of the recording's speed."""


def film_track(
    path: Path,
    films: tuple[Path, ...],
    cameras: list[PinholeCamera],
    lag_frames: list[int],
    track: Track,
    tick: Callable[[float], None],
) -> None:
    """Write an .mp4 of the films with a track drawn in, and its middle frame as .png.

    The track's first frame is each camera's frame lag - min(lag).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    n_frames = len(track.tracked)
    with (
        closing(Films(films)) as source,
        imageio.get_writer(draft, fps=FRAMES_PER_S, quality=8, macro_block_size=4) as writer,
    ):
        for c, lag in enumerate(lag_frames):
            source.skip(c, lag - min(lag_frames))
        for t in range(n_frames):
            source.advance()
            frame = compose(source.frames, cameras, track, t)
            writer.append_data(frame)  # pyright: ignore[reportAttributeAccessIssue]
            if t == n_frames // 2:
                imageio.imwrite(path.with_suffix(".png"), frame)
            tick(1 / n_frames)
    os.replace(draft, path)


def compose(frames: list[Image], cameras: list[PinholeCamera], track: Track, t: int) -> Image:
    """One picture of the film: the views (C, H, W, 3) with frame `t` of the track."""
    tiles = []
    for frame, camera in zip(frames, cameras, strict=True):
        small = overlay.shrink(frame, *TILE).copy()
        overlay.draw_estimate(small, camera, _estimate(track, t), thickness=2)
        overlay.label(small, camera.name, (10, 10), 20)
        tiles.append(small)
    views = overlay.tile(tiles, len(tiles))
    sheet = np.empty((HEAD + views.shape[0], views.shape[1] - views.shape[1] % 4, 3), np.uint8)
    sheet[:] = overlay.PANEL
    sheet[HEAD:] = views[:, : sheet.shape[1]]
    overlay.write(
        sheet,
        "blue: the left side, orange: the right; green: where a joint may be (2 sigma)",
        (14, 16),
        24,
    )
    return sheet


def _estimate(track: Track, t: int) -> PoseEstimate:
    return PoseEstimate(
        track.mean_world[None, None, t],
        track.cov_world[None, None, t],
        np.zeros_like(track.mean_world[None, None, t]),
        track.age_s[None, None, t],
        track.tracked[None, None, t],
    )
