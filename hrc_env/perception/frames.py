"""An `ImageSource` of whole images of a calibrated rig."""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.brought import describe
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.core.typing import Image
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.blazepose import crop_window


class Frames:
    """The present images of all cameras.

    Args:
        cameras: the rig.
        images: (C,) images of the cameras, (H, W, 3) RGB of uint8 each, of the sizes for which the
            cameras are calibrated.

    Raises:
        ConfigError: an image is missing, or has the wrong size or type.
    """

    def __init__(self, cameras: Sequence[PinholeCamera], images: Sequence[Image]) -> None:
        is_array = isinstance(images, np.ndarray) and images.ndim > 0
        if not (is_array or isinstance(images, list | tuple)) or len(images) != len(cameras):
            raise ConfigError(
                f"There must be one image for each of {len(cameras)} cameras, or an object with "
                f"crop(camera_index, window), got {describe(images)}."
            )
        for c, (camera, image) in enumerate(zip(cameras, images, strict=True)):
            size = (camera.height_px, camera.width_px, 3)
            right = isinstance(image, np.ndarray) and image.dtype == np.uint8
            if not right or image.shape != size:
                raise ConfigError(
                    f"The image of camera {c} must be an array of uint8 with shape {size}, as the "
                    "camera is calibrated: rows, columns, RGB from 0 to 255; got "
                    f"{describe(image)}. Convert the image, or calibrate the camera for its size."
                )
        self.images = list(images)

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return a window (256, 256, 3) of a camera's image."""
        return crop_window(self.images[camera_index], window)
