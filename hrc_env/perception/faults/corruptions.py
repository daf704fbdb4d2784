"""What faults do to an image: functions of a crop, its window and what was drawn for them."""

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Roi
from hrc_env.core.typing import Image, Points2
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.blazepose import image_from_crop
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.perception.faults.schedule import draws

GAMMA = 2.2
"""Of the images: light is their value to this power."""
DIRT_RGB = (72, 64, 54)
N_SPOTS = 14
COVER = 0.9
"""How much of the light a spot takes away in its middle."""
RIM = 1.25
"""A spot ends at so many of its radii; from there inwards it grows darker over half a radius."""
GLARE_REACH = 0.25
"""Of a light in the lens: the radius of its disc of haze as a share of the image's width."""
GLARE_VEIL = 0.35
"""Haze all over the image as a share of that in the middle of the disc."""
DARK_NOISE = 5.0
"""Standard deviation of the noise [grey levels] of an image with 1/20 of the light; it falls with
the root of the light. A judgement, of cheap sensors."""


def spoil(
    crop: Image,
    camera: PinholeCamera,
    window: Roi,
    fault: FaultConfig,
    seeds: tuple[int, ...],
) -> Image:
    """A crop with one fault.

    Args:
        crop: (n, n, 3) RGB; it stays as it is.
        camera: whose image it is from.
        window: which part of it.
        fault: of the group `IMAGE`; motion blur is made as the image is taken, not here.
        seeds: the numbers of the episode, of the fault, of the camera and of the step.
    """
    return _SPOIL[fault.kind](crop, camera, window, fault.how_much, seeds)


def _defocused(
    crop: Image, camera: PinholeCamera, window: Roi, radius_px: float, seeds: tuple[int, ...]
) -> Image:
    radius = radius_px * len(crop) / window.side_px
    reach = math.ceil(radius)
    away = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1])
    disc = np.clip(radius + 0.5 - away, 0.0, 1.0)
    return _image(cv2.filter2D(crop, -1, disc / disc.sum(), borderType=cv2.BORDER_REPLICATE))


def _noisy(
    crop: Image, camera: PinholeCamera, window: Roi, levels: float, seeds: tuple[int, ...]
) -> Image:
    """Every pixel of the camera for itself; where the crop is finer, noise is coarser than it."""
    n = min(max(round(window.side_px), 8), len(crop))
    noise = levels * draws(*seeds).standard_normal((n, n, 3), np.float32)
    if n < len(crop):
        noise = cv2.resize(noise, crop.shape[:2], interpolation=cv2.INTER_LINEAR)
    return _image(crop + noise)


def _dirty(
    crop: Image, camera: PinholeCamera, window: Roi, share: float, seeds: tuple[int, ...]
) -> Image:
    """The same spots for the whole episode, blurred: they are far before the focus."""
    rng = draws(*seeds[:3])
    size_px = np.array([camera.width_px, camera.height_px], float)
    middles = rng.uniform(0.0, 1.0, (N_SPOTS, 2)) * size_px
    area = rng.uniform(0.3, 1.0, N_SPOTS)
    area *= -math.log(1.0 - share) * size_px.prod() / area.sum()  # spots overlap
    at, scale = _in_crop(middles, window, len(crop)), len(crop) / window.side_px
    free = np.ones(crop.shape[:2])
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    for (x, y), radius in zip(at, np.sqrt(area / math.pi) * scale, strict=True):
        if math.hypot(x - len(crop) / 2, y - len(crop) / 2) < RIM * radius + len(crop):
            away = np.hypot(columns - x, rows - y) / max(radius, 1e-6)
            free *= 1.0 - COVER * np.clip(2.0 * (RIM - away), 0.0, 1.0)
    return _image(crop * free[..., None] + np.array(DIRT_RGB) * (1.0 - free[..., None]))


def _tinted(
    crop: Image, camera: PinholeCamera, window: Roi, share: float, seeds: tuple[int, ...]
) -> Image:
    return _image(crop * np.array([1.0 + share, 1.0, 1.0 - share]))


def _exposed(
    crop: Image, camera: PinholeCamera, window: Roi, stops: float, seeds: tuple[int, ...]
) -> Image:
    values = 255.0 * (np.arange(256) / 255.0) * 2.0 ** (stops / GAMMA)
    return _image(cv2.LUT(crop, _image(values)))


def _dark(
    crop: Image, camera: PinholeCamera, window: Roi, share: float, seeds: tuple[int, ...]
) -> Image:
    dim = _exposed(crop, camera, window, math.log2(share), seeds)
    levels = DARK_NOISE * math.sqrt(max(1.0 - share, 0.0) / 0.95)
    return _noisy(dim, camera, window, levels, seeds)


def _glaring(
    crop: Image, camera: PinholeCamera, window: Roi, share: float, seeds: tuple[int, ...]
) -> Image:
    """A light somewhere in the image, in one place for the whole episode, and haze round it."""
    size_px = np.array([camera.width_px, camera.height_px], float)
    middle = draws(*seeds[:3]).uniform(0.2, 0.8, (1, 2)) * size_px
    (x, y), scale = _in_crop(middle, window, len(crop))[0], len(crop) / window.side_px
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    away = np.hypot(columns - x, rows - y) / (scale * GLARE_REACH * camera.width_px)
    haze = share * (GLARE_VEIL + (1.0 - GLARE_VEIL) * np.exp(-(away**2)))
    return _image(crop + (255.0 - crop) * haze[..., None])


_SPOIL: dict[str, Callable[..., Image]] = {
    "defocus": _defocused,
    "noise": _noisy,
    "dirt": _dirty,
    "white_balance": _tinted,
    "exposure": _exposed,
    "darkness": _dark,
    "glare": _glaring,
}


def _in_crop(px: Points2, window: Roi, size: int) -> Points2:
    """Image pixels (n, 2) to pixels of a crop."""
    matrix = image_from_crop(window, size)
    return (px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T


def _image(values: NDArray) -> Image:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
