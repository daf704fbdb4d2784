"""Images of the rig's cameras that are rendered for observations."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import one
from hrc_env.core.errors import ConfigError, check_integer, make_unknown_name_error
from hrc_env.core.records import Roi
from hrc_env.core.typing import Image
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.observations import IMAGE
from hrc_env.perception.lenses import LensRenderer
from hrc_env.pipeline.sensor_input import SensorInput
from hrc_env.scene.build import Scene
from hrc_env.scene.camera_images import SMOOTHING, CameraImages, ImageConfig
from hrc_env.scene.domain_randomization import Look

Images = dict[str, NDArray[np.uint8]]
"""Images (B, H, W, 3) by name of the image in the observation."""


class ObservedImages:
    """A renderer of images for observations, based only on the scene, its appearance and the rig.

    Args:
        scene: the scene with the rig's cameras.
        config: settings of the images.
        bends: whether cameras of an episode may have lenses even if those of the scene have none.

    Raises:
        ConfigError: a chosen camera is not in the rig or is chosen twice.
        RenderingError: OpenGL is not available.
    """

    def __init__(self, scene: Scene, config: ImageConfig, bends: bool = False) -> None:
        self.cameras = _select_cameras(scene.cameras, config.cameras)
        self.shape = config.height, config.width, 3
        self._bends = bends or any(camera.lens is not None for camera in self.cameras)
        squares = [_square_px(each, config) for each in self.cameras] if self._bends else []
        self._renderer = CameraImages(scene, config.height, config.width, max(squares, default=1))
        self._viewer = LensRenderer(self._renderer, self.cameras)
        self._renderer.show()  # a missing OpenGL raises its error here, not in an episode

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
        """Return the images (B, H, W, 3) of environments, by name.

        Args:
            now: the scene, with one row per environment.
            looks: (B,) appearance of each environment; None for the default appearance.
            rigs: (B,) cameras of each episode; images of all other cameras are black.
        """
        images = {name: np.zeros((len(now.ids), *self.shape), np.uint8) for name in self.names}
        for row, (b, look) in enumerate(zip(now.ids.tolist(), looks, strict=True)):
            self._renderer.dress(b, look)
            self._renderer.pose(now.qpos[row], one(now.motion, row))
            for camera in rigs[row]:
                if (name := f"{IMAGE}{camera.name}") in images:
                    images[name][row] = self._image(camera)
        return images

    def check(self, rig: Sequence[CameraConfig]) -> None:
        """Raise `ConfigError` if the images of a rig cannot be rendered."""
        for camera in rig:
            bent = camera.lens.model != "none" and f"{IMAGE}{camera.name}" in self.names
            if bent and not self._bends:
                raise ConfigError(
                    f"Camera {camera.name!r} of an episode has a lens model, but the environment "
                    "was created to observe images of cameras without one: create it with cameras= "
                    "that have lens models, or without observe_images."
                )

    def close(self) -> None:
        """Free the graphics context."""
        self._renderer.close()

    def _image(self, camera: PinholeCamera) -> Image:
        """Render the image (H, W, 3) of a camera in the present scene."""
        if camera.lens is None:
            return self._renderer.image(camera)
        side_px = max(camera.width_px, camera.height_px)
        middle = Roi((camera.width_px / 2, camera.height_px / 2), float(side_px), 0.0)
        return _shrink(self._viewer.view(camera, middle), camera, self.shape)


def _select_cameras(
    rig: tuple[PinholeCamera, ...], choices: Sequence[int | str] | None
) -> tuple[PinholeCamera, ...]:
    """Return the cameras of a rig with the given names or indices; for None, all cameras."""
    names = [camera.name for camera in rig]
    chosen: list[int] = []
    for choice in range(len(rig)) if choices is None else choices:
        if isinstance(choice, str):
            if choice not in names:
                raise make_unknown_name_error("camera of observe_images", choice, names)
            chosen.append(names.index(choice))
        else:
            label = f"Camera of observe_images (of {', '.join(names)})"
            chosen.append(check_integer(label, choice, 0, len(rig) - 1))
    for index in chosen:
        if chosen.count(index) > 1:
            raise ConfigError(
                f"Camera {names[index]!r} is in observe_images more than once: name it once."
            )
    return tuple(rig[index] for index in chosen)


def _square_px(camera: PinholeCamera, config: ImageConfig) -> int:
    """Return the side of the full-resolution square from which an image is cropped [px]."""
    side_px = max(camera.width_px, camera.height_px)
    shares = config.width / camera.width_px, config.height / camera.height_px
    return int(np.ceil(SMOOTHING * side_px * max(shares)))


def _shrink(square: Image, camera: PinholeCamera, shape: tuple[int, int, int]) -> Image:
    """Crop a square to the part that a camera's image covers, and resize it to (H, W, 3)."""
    scale = len(square) / max(camera.width_px, camera.height_px)
    high, wide = round(scale * camera.height_px), round(scale * camera.width_px)
    top, left = (len(square) - high) // 2, (len(square) - wide) // 2
    cut = np.ascontiguousarray(square[top : top + high, left : left + wide])
    return np.asarray(cv2.resize(cut, shape[1::-1], interpolation=cv2.INTER_AREA), np.uint8)
