"""Dark and dull pictures are developed before the networks see them, as a photographer would.

Grey levels between the darkest and the brightest parts are spread, and noise is smoothed. Pictures
of usual contrast stay as they are, bit for bit, and so do those that show nothing: noise alone is
never made to look like a person.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats, Image

LEAST_CONTRAST = 3.0
"""Least standard deviation of a colour channel of a picture that is not blank, in `COARSE_PX`."""
COARSE_PX = 32
"""Noise of single pixels averages out in a picture of so many rows and columns."""
DULL, DULLEST = 75.0, 60.0
"""Grey levels are spread in pictures that span fewer, and wholly in those that span as few."""
SPAN = 150.0
"""So many grey levels lie between dark and bright parts then; 166 in the lab as it was built."""
ENDS = (0.01, 0.75, 0.99)
"""Shares of pixels that are darker than the dark parts, the usual ones and the bright ones."""
GLARE = 2.0
"""What is brighter than so many times the usual parts shines by itself: a window, a lamp."""
MOST_NOISE = 20.0
"""Noise is not made stronger than this [grey levels], with which the networks cope."""
SMOOTHED = (4.0, 10.0)
"""Noise [grey levels] from which a picture is smoothed, and from which wholly."""
ROUNDING = math.sqrt(1.0 / 12.0)
"""Standard deviation of what rounding to whole grey levels adds."""
UNEVEN: NDArray[np.float32] = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
"""Noise passes this filter six times as strong; edges and slopes do not pass (Immerkaer 1996)."""
NOISE_STEP = 4
"""Noise is measured in a picture that is so many times smaller."""
OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
DOUBT, MOST_DOUBT = 7.0, 3.0
"""Noise that is a share of a dull picture's span adds so many times that share of the usual errors
to these, as variances add; and the greatest factor. Fitted to crops (docs/emulator.md)."""
SIGMA_PX = 0.6
"""Of the Gaussian by which noise is smoothed [pixels of a crop]."""


class Developed(NamedTuple):
    """A picture for the networks."""

    picture: Image
    """The crop itself, or a new one."""
    doubt: float
    """Factor on the deviations of joints that are found in it; 1 in pictures of usual contrast."""


class _Tones(NamedTuple):
    dark: float
    bright: float
    grey: Image

    @property
    def span(self) -> float:
        return max(self.bright - self.dark, 1.0)


def is_blank(crop: Image, mask: Image | None = None) -> bool:
    """Whether a crop (n, n, 3) shows nothing: is dark, white, of one colour, or mere noise. The
    mask (n, n) is 0 where the camera does not see."""
    size = (COARSE_PX, COARSE_PX)
    coarse = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    seen = None if mask is None else cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
    _, deviation = cv2.meanStdDev(coarse, mask=seen)
    return bool(deviation.max() < LEAST_CONTRAST)


def develop(crop: Image, mask: Image | None = None) -> Developed:
    """Spread the grey levels of a crop (n, n, 3) whose contrast is less than usual, and smooth
    what noise that shows; the mask (n, n) is 0 where the camera does not see."""
    tones = _tones(crop, mask)
    if tones.span >= DULL or is_blank(crop, mask):
        return Developed(crop, 1.0)
    noise = math.hypot(noise_of(tones.grey), ROUNDING)
    wanted = tones.span + _ramp(tones.span, DULL, DULLEST) * (SPAN - tones.span)
    gain = max(min(wanted / tones.span, MOST_NOISE / noise), 1.0)
    return Developed(_smooth(_spread(crop, tones, gain), gain * noise), doubt_of(noise, tones.span))


def noise_of(grey: Image) -> float:
    """Standard deviation of the noise [grey levels] of a picture (n, n), by how uneven most of it
    is after `NOISE_STEP` pixels have become one: noise of enlarged pictures is as coarse."""
    n = len(grey) // NOISE_STEP
    small = cv2.resize(grey.astype(np.float32), (n, n), interpolation=cv2.INTER_AREA)
    uneven = np.abs(cv2.filter2D(small, cv2.CV_32F, UNEVEN))
    return NOISE_STEP * float(np.median(uneven)) / (6.0 * OF_NORMAL)


def doubt_of(noise: float, span: float) -> float:
    """Factor on the deviations of joints in a picture with so much noise and contrast [levels]."""
    added = _ramp(span, DULL, DULLEST) * DOUBT * noise / max(span, 1.0)
    return min(math.hypot(1.0, added), MOST_DOUBT)


def _tones(crop: Image, mask: Image | None) -> _Tones:
    """The grey levels of what is dark and of what is bright and does not shine."""
    grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY), np.uint8)
    count: Floats = cv2.calcHist([grey], [0], mask, [256], [0, 256])[:, 0].cumsum()
    dark, usual, bright = np.searchsorted(count, np.array(ENDS) * count[-1]).tolist()
    return _Tones(dark, min(bright, max(GLARE * usual, dark + 1.0)), grey)


def _spread(crop: Image, tones: _Tones, gain: float) -> Image:
    """Stretch grey levels about one that stays: as far from black in the span as in all levels."""
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
    """From 0 at `none` smoothly to 1 at `whole`."""
    share = min(max((value - none) / (whole - none), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)
