"""What faults do to an image."""

import math
from collections.abc import Callable
from typing import NamedTuple

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


class Shown(NamedTuple):
    """A part of an image that is to be spoilt."""

    crop: Image  # (n, n, 3) RGB; it stays as it is
    camera: PinholeCamera
    window: Roi
    seeds: tuple[int, ...]  # the numbers of episode, fault, camera and step


def darkness_noise(share: float) -> float:
    """Standard deviation of the noise [grey levels] of an image with a share of the light."""
    return DARK_NOISE * math.sqrt(max(1.0 - share, 0.0) / 0.95)


def spoil(shown: Shown, fault: FaultConfig) -> Image:
    """A crop with one fault of the group `IMAGE`; motion blur is made as the image is taken."""
    return _SPOIL[fault.kind](shown, fault.how_much)


def _defocused(shown: Shown, radius_px: float) -> Image:
    radius = radius_px * len(shown.crop) / shown.window.side_px
    reach = math.ceil(radius)
    away = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1])
    disc = np.clip(radius + 0.5 - away, 0.0, 1.0)
    return _image(cv2.filter2D(shown.crop, -1, disc / disc.sum(), borderType=cv2.BORDER_REPLICATE))


def _noisy(shown: Shown, levels: float) -> Image:
    """Every pixel of the camera for itself; where the crop is finer, noise is coarser than it."""
    crop = shown.crop
    n = min(max(round(shown.window.side_px), 8), len(crop))
    noise = levels * draws(*shown.seeds).standard_normal((n, n, 3), np.float32)
    if n < len(crop):
        noise = cv2.resize(noise, crop.shape[:2], interpolation=cv2.INTER_LINEAR)
    return _image(crop + noise)


def _dirty(shown: Shown, share: float) -> Image:
    """The same spots for the whole episode, blurred: they are far before the focus."""
    crop, rng, size_px = shown.crop, draws(*shown.seeds[:3]), _size_px(shown)
    middles = rng.uniform(0.0, 1.0, (N_SPOTS, 2)) * size_px
    area = rng.uniform(0.3, 1.0, N_SPOTS)
    area *= -math.log(1.0 - share) * size_px.prod() / area.sum()  # spots overlap
    at, scale = _in_crop(middles, shown), len(crop) / shown.window.side_px
    free = np.ones(crop.shape[:2])
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    for (x, y), radius in zip(at, np.sqrt(area / math.pi) * scale, strict=True):
        if math.hypot(x - len(crop) / 2, y - len(crop) / 2) < RIM * radius + len(crop):
            away = np.hypot(columns - x, rows - y) / max(radius, 1e-6)
            free *= 1.0 - COVER * np.clip(2.0 * (RIM - away), 0.0, 1.0)
    return _image(crop * free[..., None] + np.array(DIRT_RGB) * (1.0 - free[..., None]))


def _tinted(shown: Shown, share: float) -> Image:
    return _image(shown.crop * np.array([1.0 + share, 1.0, 1.0 - share]))


def _exposed(shown: Shown, stops: float) -> Image:
    values = 255.0 * (np.arange(256) / 255.0) * 2.0 ** (stops / GAMMA)
    return _image(cv2.LUT(shown.crop, _image(values)))


def _dark(shown: Shown, share: float) -> Image:
    return _noisy(shown._replace(crop=_exposed(shown, math.log2(share))), darkness_noise(share))


def _glaring(shown: Shown, share: float) -> Image:
    """A light somewhere in the image, in one place for the whole episode, and haze round it."""
    crop = shown.crop
    middle = draws(*shown.seeds[:3]).uniform(0.2, 0.8, (1, 2)) * _size_px(shown)
    (x, y), scale = _in_crop(middle, shown)[0], len(crop) / shown.window.side_px
    rows, columns = np.indices(crop.shape[:2]) + 0.5
    away = np.hypot(columns - x, rows - y) / (scale * GLARE_REACH * shown.camera.width_px)
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


def _size_px(shown: Shown) -> Floats:
    return np.array([shown.camera.width_px, shown.camera.height_px], float)


def _in_crop(px: Points2, shown: Shown) -> Points2:
    """Image pixels (n, 2) to pixels of the crop."""
    matrix = image_from_crop(shown.window, len(shown.crop))
    return (px - matrix[:, 2]) @ np.linalg.inv(matrix[:, :2]).T


def _image(values: NDArray) -> Image:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
