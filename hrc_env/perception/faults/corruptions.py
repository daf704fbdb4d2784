"""Simulation of the effects of camera faults on images."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Roi
from hrc_env.core.typing import Floats, Image, Points2
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.blazepose import image_from_crop
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.perception.faults.schedule import draws

GAMMA = 2.2
"""Exponent of the images' gamma: the amount of light is the pixel value raised to this power."""
DIRT_RGB = (72, 64, 54)
"""Colour of dirt on the lens, in RGB."""
N_SPOTS = 14
"""Number of spots on a dirty lens."""
COVER = 0.9
"""Fraction of the light that is blocked by the centre of a spot."""
RIM = 1.25
"""Outer radius of a spot, in units of its nominal radius. The width of the blur at its edge is half
of the nominal radius."""
GLARE_REACH = 0.25
"""Radius of the haze around a light that shines into the lens, as a fraction of the image's
width."""
GLARE_VEIL = 0.35
"""Uniform haze in the whole image, as a fraction of the haze at the light."""
DARK_NOISE = 5.0
"""Standard deviation of the noise in an image with 1/20 of the normal light [grey levels]. The
value is an assumption about low-cost sensors."""


class CropView(NamedTuple):
    """A crop of an image to which a fault is applied."""

    crop: Image
    """(n, n, 3) RGB crop, which is not changed."""
    camera: PinholeCamera
    """Camera of the image."""
    window: Roi
    """Window of the image that the crop shows [px]."""
    seeds: tuple[int, ...]
    """Seeds of the fault's random numbers: seed of the episode's faults, and numbers of the fault,
    the camera and the step."""


def darkness_noise(share: float) -> float:
    """Return the standard deviation of the noise [grey levels] at a fraction of normal light."""
    return DARK_NOISE * math.sqrt(max(1.0 - share, 0.0) / 0.95)


def corrupt(view: CropView, fault: FaultConfig) -> Image:
    """Apply a fault of the group `IMAGE`, except motion blur (see `CameraFilm`), to a crop."""
    return _CORRUPT[fault.kind](view, fault.max_amount)


def _defocus(view: CropView, radius_px: float) -> Image:
    """Defocus a crop: points become discs of a given radius in the image [px]."""
    radius = radius_px * len(view.crop) / view.window.side_px
    reach = math.ceil(radius)
    away = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1])
    disc = np.clip(radius + 0.5 - away, 0.0, 1.0)
    return _image(cv2.filter2D(view.crop, -1, disc / disc.sum(), borderType=cv2.BORDER_REPLICATE))


def _add_noise(view: CropView, levels: float) -> Image:
    """Add noise to a crop that is independent for each camera pixel [grey levels].

    If the resolution of the crop is higher than that of the image, the noise is enlarged with the
    image.
    """
    crop = view.crop
    n = min(max(round(view.window.side_px), 8), len(crop))
    noise = levels * draws(*view.seeds).standard_normal((n, n, 3), np.float32)
    if n < len(crop):
        noise = cv2.resize(noise, crop.shape[:2], interpolation=cv2.INTER_LINEAR)
    return _image(crop + noise)


def _add_dirt(view: CropView, share: float) -> Image:
    """Add spots to a crop that hide a fraction of the image and are constant over an episode.

    The spots are blurred, because dirt on the lens is out of focus.
    """
    crop, rng, size_px = view.crop, draws(*view.seeds[:3]), _size_px(view)
    middles = rng.uniform(0.0, 1.0, (N_SPOTS, 2)) * size_px
    area = rng.uniform(0.3, 1.0, N_SPOTS)
    area *= -math.log(1.0 - share) * size_px.prod() / area.sum()  # spots overlap
    at, scale = _in_crop(middles, view), len(crop) / view.window.side_px
    free = np.ones(crop.shape[:2])
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    for (x, y), radius in zip(at, np.sqrt(area / math.pi) * scale, strict=True):
        if math.hypot(x - len(crop) / 2, y - len(crop) / 2) < RIM * radius + len(crop):
            away = np.hypot(columns - x, rows - y) / max(radius, 1e-6)
            free *= 1.0 - COVER * np.clip(2.0 * (RIM - away), 0.0, 1.0)
    return _image(crop * free[..., None] + np.array(DIRT_RGB) * (1.0 - free[..., None]))


def _tint(view: CropView, share: float) -> Image:
    """Increase the red and reduce the blue values of a crop by a fraction of them."""
    return _image(view.crop * np.array([1.0 + share, 1.0, 1.0 - share]))


def _expose(view: CropView, stops: float) -> Image:
    """Increase the exposure of a crop by a number of stops."""
    values = 255.0 * (np.arange(256) / 255.0) * 2.0 ** (stops / GAMMA)
    return _image(cv2.LUT(view.crop, _image(values)))


def _darken(view: CropView, share: float) -> Image:
    """Reduce the light of a crop to a fraction, and add the corresponding noise."""
    return _add_noise(view._replace(crop=_expose(view, math.log2(share))), darkness_noise(share))


def _add_glare(view: CropView, share: float) -> Image:
    """Add haze around a light to a crop, at a position that is constant over an episode."""
    crop = view.crop
    middle = draws(*view.seeds[:3]).uniform(0.2, 0.8, (1, 2)) * _size_px(view)
    (x, y), scale = _in_crop(middle, view)[0], len(crop) / view.window.side_px
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    away = np.hypot(columns - x, rows - y) / (scale * GLARE_REACH * view.camera.width_px)
    haze = share * (GLARE_VEIL + (1.0 - GLARE_VEIL) * np.exp(-(away**2)))
    return _image(crop + (255.0 - crop) * haze[..., None])


_CORRUPT: dict[str, Callable[..., Image]] = {
    "defocus": _defocus,
    "noise": _add_noise,
    "dirt": _add_dirt,
    "white_balance": _tint,
    "exposure": _expose,
    "darkness": _darken,
    "glare": _add_glare,
}


def _size_px(view: CropView) -> Floats:
    """Return width and height (2,) of the camera's image [px]."""
    return np.array([view.camera.width_px, view.camera.height_px], float)


def _in_crop(px: Points2, view: CropView) -> Points2:
    """Convert image pixels (n, 2) to pixels of the crop."""
    matrix = image_from_crop(view.window, len(view.crop))
    return (px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T


def _image(values: NDArray[Any]) -> Image:
    """Round and clip values to grey levels of uint8."""
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
