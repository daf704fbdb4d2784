"""The images that an observation holds: the rig's cameras, drawn for the policy."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import one
from hrc_env.core.errors import ConfigError, unknown, whole
from hrc_env.core.records import Roi
from hrc_env.core.typing import Image
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.observations import IMAGE
from hrc_env.perception.lensed import Lensed
from hrc_env.pipeline.sensor_input import SensorInput
from hrc_env.scene.build import Scene
from hrc_env.scene.camera_images import SMOOTHING, CameraImages, ImageConfig
from hrc_env.scene.domain_randomization import Look

Images = dict[str, NDArray[np.uint8]]
"""(B, H, W, 3) by name."""


class ObservedImages:
    """Draws the chosen cameras of a scene's rig; an image follows from scene and look alone."""

    def __init__(self, scene: Scene, config: ImageConfig, bends: bool = False) -> None:
        """Open a graphics context for the images of `config`.

        Args:
            scene: with the rig.
            config: of the images.
            bends: whether cameras of an episode may have lenses where those of the scene have none.

        Raises:
            ConfigError: a camera that is not in the rig, or twice.
            RenderingError: there is no OpenGL.
        """
        self.cameras = _chosen(scene.cameras, config.cameras)
        self.shape = config.height, config.width, 3
        self._bends = bends or any(camera.lens is not None for camera in self.cameras)
        squares = [_square_px(each, config) for each in self.cameras] if self._bends else []
        self._drawer = CameraImages(scene, config.height, config.width, max(squares, default=1))
        self._lensed = Lensed(self._drawer, self.cameras)
        self._drawer.show()  # without OpenGL it says so here, not in an episode

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the images in an observation."""
        return tuple(f"{IMAGE}{camera.name}" for camera in self.cameras)

    def draw(
        self,
        now: SensorInput,
        looks: Sequence[Look | None],
        rigs: Sequence[Sequence[PinholeCamera]],
    ) -> Images:
        """Return the images (B, H, W, 3) of the environments that are shown, by name.

        Args:
            now: the scene; rows are environments.
            looks: of these environments; None: as it was built.
            rigs: the cameras of their episodes; of one that does not hang the image is black.
        """
        images = {name: np.zeros((len(now.ids), *self.shape), np.uint8) for name in self.names}
        for row, (b, look) in enumerate(zip(now.ids.tolist(), looks, strict=True)):
            self._drawer.dress(b, look)
            self._drawer.pose(now.qpos[row], one(now.motion, row))
            for camera in rigs[row]:
                if (name := f"{IMAGE}{camera.name}") in images:
                    images[name][row] = self._image(camera)
        return images

    def check(self, rig: Sequence[CameraConfig]) -> None:
        """Raise `ConfigError` for a rig of which these images cannot be drawn."""
        for camera in rig:
            bent = camera.lens.model != "none" and f"{IMAGE}{camera.name}" in self.names
            if bent and not self._bends:
                raise ConfigError(
                    f"Camera {camera.name!r} of an episode has a lens, and the environment was "
                    "made to observe images of cameras without: make it with cameras= that have "
                    "lenses, or without observe_images."
                )

    def close(self) -> None:
        """Free the graphics context."""
        self._drawer.close()

    def _image(self, camera: PinholeCamera) -> Image:
        if camera.lens is None:
            return self._drawer.image(camera)
        side_px = max(camera.width_px, camera.height_px)
        middle = Roi((camera.width_px / 2, camera.height_px / 2), float(side_px), 0.0)
        return _squeezed(self._lensed.view(camera, middle), camera, self.shape)


def _chosen(
    rig: tuple[PinholeCamera, ...], asked: Sequence[int | str] | None
) -> tuple[PinholeCamera, ...]:
    """The cameras of a rig that were asked for, by names or indices; None: all."""
    names = [camera.name for camera in rig]
    chosen = []
    for choice in range(len(rig)) if asked is None else asked:
        if isinstance(choice, str):
            if choice not in names:
                raise unknown("camera of observe_images", choice, names)
            chosen.append(names.index(choice))
        else:
            said = f"Camera of observe_images (of {', '.join(names)})"
            chosen.append(whole(said, choice, 0, len(rig) - 1))
    for index in chosen:
        if chosen.count(index) > 1:
            raise ConfigError(
                f"Camera {names[index]!r} is in observe_images more than once: name it once."
            )
    return tuple(rig[index] for index in chosen)


def _square_px(camera: PinholeCamera, config: ImageConfig) -> int:
    """Side of the square of which a lens's image is cut, so that it is fine enough [px]."""
    side_px = max(camera.width_px, camera.height_px)
    shares = config.width / camera.width_px, config.height / camera.height_px
    return int(np.ceil(SMOOTHING * side_px * max(shares)))


def _squeezed(square: Image, camera: PinholeCamera, shape: tuple[int, int, int]) -> Image:
    """The part of a square that a camera's image covers, as (H, W, 3)."""
    scale = len(square) / max(camera.width_px, camera.height_px)
    high, wide = round(scale * camera.height_px), round(scale * camera.width_px)
    top, left = (len(square) - high) // 2, (len(square) - wide) // 2
    cut = np.ascontiguousarray(square[top : top + high, left : left + wide])
    return np.asarray(cv2.resize(cut, shape[1::-1], interpolation=cv2.INTER_AREA), np.uint8)
