"""Dark and dull pictures are developed before the networks see them.

Grey levels between the dark and the bright parts are spread, and noise is smoothed. Pictures of
usual contrast are returned unchanged, bit for bit. Blank pictures are returned unchanged as well:
their noise must not be amplified into the shape of a person.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats, Image

LEAST_CONTRAST = 3.0
"""Least standard deviation of a colour channel of a picture that is not blank, in `COARSE_PX`."""
LEAST_EDGES, EDGE_SHARE = 0.06, 0.98
"""How much the sharpest parts of a picture, beyond this quantile, differ from their surroundings at
least, as a share of the span of grey levels: in rooms 0.1 and more, on slopes 0.05 at most."""
EDGE_PX, EDGE_SIGMA_PX, EDGE_BORDER_PX = 64, 2.0, 6
"""Size of the picture in which edges are looked for, the Gaussian that makes the surroundings, and
the border that is left out [px]."""
COARSE_PX = 32
"""Contrast is measured on a picture of this size [px]: the noise of pixels averages out."""
DULL, DULLEST = 75.0, 60.0
"""Pictures that span fewer grey levels than the first number are spread, and those below the second
in full."""
SPAN = 150.0
"""Grey levels between the dark and bright parts of a picture that was spread in full; the lab as it
was built has 166."""
ENDS = (0.01, 0.75, 0.99)
"""Quantiles of the grey levels that count as dark, usual and bright."""
GLARE = 2.0
"""Parts brighter than the usual level times this number are windows and lamps, which saturate."""
MOST_NOISE = 20.0
"""Noise is amplified to at most this standard deviation [grey levels]."""
SMOOTHED = (4.0, 10.0)
"""Noise at which smoothing begins, and at which it is complete [grey levels]."""
ROUNDING = math.sqrt(1.0 / 12.0)
"""Standard deviation of the error of rounding to whole grey levels."""
UNEVEN: NDArray[np.float32] = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
"""This filter amplifies noise six times and removes edges and slopes (Immerkaer 1996)."""
NOISE_STEP = 4
"""Noise is measured on a picture reduced by this factor."""
OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
DOUBT, MOST_DOUBT = 7.0, 3.0
"""Noise as a share of a dull picture's span, times the first number, is an independent error in
units of the usual one; the second number bounds the factor. Fitted to crops
(`benchmarks.perception.dim`)."""
USELESS = 0.165
"""From this share of noise in the span on, people are missed in dull pictures."""
SIGMA_PX = 0.6
"""Of the Gaussian by which noise is smoothed [pixels of a crop]."""


class Developed(NamedTuple):
    """A picture for the networks."""

    picture: Image
    """The crop itself, or a new one."""
    doubt: float = 1.0
    """Factor on the deviations of joints that are found in it; 1 in pictures of usual contrast."""
    shows: bool = True
    """Whether people would be found in it: it is neither blank nor mostly noise."""


class _Tones(NamedTuple):
    dark: float
    bright: float
    grey: Image

    @property
    def span(self) -> float:
        return max(self.bright - self.dark, 1.0)


def is_blank(crop: Image, mask: Image | None = None) -> bool:
    """Return whether a crop is dark, white, of one colour, or mere noise.

    Args:
        crop: (n, n, 3) RGB.
        mask: (n, n), 0 outside of the camera's image; None: the crop is inside.
    """
    size = (COARSE_PX, COARSE_PX)
    coarse = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    seen = None if mask is None else cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
    _, deviation = cv2.meanStdDev(coarse, mask=seen)
    return bool(deviation.max() < LEAST_CONTRAST)


def has_edges(crop: Image) -> bool:
    """Return whether a crop (n, n, 3) shows any edge: a covered lens, fog or a light that shines
    into the camera show slopes only, however much of the range of grey levels they span."""
    tones = _tones(crop, None)
    size = (EDGE_PX, EDGE_PX)
    small = cv2.resize(tones.grey.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    off = np.abs(small - cv2.GaussianBlur(small, (0, 0), EDGE_SIGMA_PX))
    inner = off[EDGE_BORDER_PX:-EDGE_BORDER_PX, EDGE_BORDER_PX:-EDGE_BORDER_PX]
    return bool(np.quantile(inner, EDGE_SHARE) >= LEAST_EDGES * tones.span)


def develop(crop: Image, mask: Image | None = None) -> Developed:
    """Spread the grey levels of a crop with less than the usual contrast, and smooth its noise.

    Args:
        crop: (n, n, 3) RGB; it is not changed.
        mask: (n, n), 0 outside of the camera's image; None: the crop is inside.
    """
    tones = _tones(crop, mask)
    if is_blank(crop, mask):
        return Developed(crop, shows=False)
    if tones.span >= DULL:
        return Developed(crop)
    noise = math.hypot(noise_of(tones.grey), ROUNDING)
    wanted = tones.span + _ramp(tones.span, DULL, DULLEST) * (SPAN - tones.span)
    gain = max(min(wanted / tones.span, MOST_NOISE / noise), 1.0)
    picture = _smooth(_spread(crop, tones, gain), gain * noise)
    return Developed(picture, doubt_of(noise, tones.span), noise < USELESS * tones.span)


def noise_of(grey: Image) -> float:
    """Return the standard deviation of the noise of a picture (n, n) [grey levels], from its median
    unevenness at a reduced size: enlarged pictures have coarse noise."""
    n = len(grey) // NOISE_STEP
    small = cv2.resize(grey.astype(np.float32), (n, n), interpolation=cv2.INTER_AREA)
    uneven = np.abs(cv2.filter2D(small, cv2.CV_32F, UNEVEN))
    return NOISE_STEP * float(np.median(uneven)) / (6.0 * OF_NORMAL)


def doubt_of(noise: float, span: float) -> float:
    """Return the factor on the deviations of joints in a picture of this noise and span [grey
    levels]."""
    added = _ramp(span, DULL, DULLEST) * DOUBT * noise / max(span, 1.0)
    return min(math.hypot(1.0, added), MOST_DOUBT)


def _tones(crop: Image, mask: Image | None) -> _Tones:
    """Return the grey levels of the dark and of the bright parts, without windows and lamps."""
    grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY), np.uint8)
    count: Floats = cv2.calcHist([grey], [0], mask, [256], [0, 256]).ravel().cumsum()
    dark, usual, bright = np.searchsorted(count, np.array(ENDS) * count[-1]).tolist()
    return _Tones(dark, min(bright, max(GLARE * usual, dark + 1.0)), grey)


def _spread(crop: Image, tones: _Tones, gain: float) -> Image:
    """Stretch grey levels; the span keeps its place between black and white."""
    added = (gain - 1.0) * tones.span
    first = tones.dark - added * tones.dark / max(255.0 - tones.span, 1.0)
    levels = first + gain * (np.arange(256) - tones.dark)
    return np.asarray(cv2.LUT(crop, np.clip(np.round(levels), 0, 255).astype(np.uint8)), np.uint8)


def _smooth(picture: Image, noise: float) -> Image:
    share = _ramp(noise, *SMOOTHED)
    if share == 0.0:
        return picture
    smooth = cv2.GaussianBlur(picture, (0, 0), SIGMA_PX)
    return np.asarray(cv2.addWeighted(picture, 1.0 - share, smooth, share, 0.0), np.uint8)


def _ramp(value: float, none: float, whole: float) -> float:
    """Return a share that rises smoothly from 0 at `none` to 1 at `whole`."""
    share = min(max((value - none) / (whole - none), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)
