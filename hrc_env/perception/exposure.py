"""Development: enhancement of dark and low-contrast images before they are passed to the networks.

The range of grey levels between the dark and bright parts is stretched, and noise is smoothed.
Images with normal contrast are returned unchanged, bit for bit. Blank images are also returned
unchanged, because amplified noise might look like a person.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Floats, Image

LEAST_CONTRAST = 3.0
"""Minimum standard deviation of a colour channel of an image that is not blank, after a reduction
of the image to size `COARSE_PX` [grey levels]."""
LEAST_EDGES, EDGE_SHARE = 0.06, 0.98
"""Minimum contrast of edges, as a fraction of the span of grey levels, and the quantile of local
contrasts that is compared with it. Images of rooms have values of at least 0.1, and smooth
gradients of at most 0.05."""
EDGE_PX, EDGE_SIGMA_PX, EDGE_BORDER_PX = 64, 2.0, 6
"""Size of the image in which edges are measured, standard deviation of the Gaussian that smooths it
for comparison, and width of the border that is ignored [px]."""
COARSE_PX = 32
"""Size of the image in which contrast is measured, small enough to average out pixel noise [px]."""
DULL, DULLEST = 75.0, 60.0
"""Spans of grey levels below which the contrast of an image is partly stretched and fully
stretched, respectively."""
SPAN = 150.0
"""Span between the grey levels of the dark and bright parts of a fully stretched image. The default
scene of the lab has 166."""
ENDS = (0.01, 0.75, 0.99)
"""Quantiles of the grey levels that are considered dark, typical and bright."""
GLARE = 2.0
"""Ratio to the typical grey level above which parts are considered windows or lamps, which may
saturate."""
MOST_NOISE = 20.0
"""Maximum standard deviation to which noise is amplified [grey levels]."""
SMOOTHED = (4.0, 10.0)
"""Standard deviations of the noise at which smoothing begins and is complete, respectively [grey
levels]."""
ROUNDING = math.sqrt(1.0 / 12.0)
"""Standard deviation of the rounding error of grey levels."""
UNEVEN: NDArray[np.float32] = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
"""Filter that removes edges and gradients and multiplies noise by six (Immerkaer 1996)."""
NOISE_STEP = 4
"""Factor by which the size of an image is reduced before its noise is measured."""
OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
DOUBT, MOST_DOUBT = 7.0, 3.0
"""Additional independent error in low-contrast images, in units of the normal error and per noise
as a fraction of the span; and the maximum factor on errors. Both were fitted to crops
(`benchmarks.perception.dim`)."""
USELESS = 0.165
"""Noise, as a fraction of the span, above which people are missed in low-contrast images."""
SIGMA_PX = 0.6
"""Standard deviation of the Gaussian that smooths noise [pixels of a crop]."""


class Developed(NamedTuple):
    """An image that is passed to the networks."""

    picture: Image
    """(n, n, 3) the original crop, or an enhanced copy."""
    doubt: float = 1.0
    """Factor on the standard deviations of joints found in the image; 1 at normal contrast."""
    is_usable: bool = True
    """Whether people can be found in the image, that is, it is neither blank nor mostly noise."""


class _Tones(NamedTuple):
    """Range of the grey levels of an image."""

    dark: float
    """Grey level of the dark parts."""
    bright: float
    """Grey level of the bright parts, without windows and lamps."""
    grey: Image
    """(n, n) image converted to grey levels."""

    @property
    def span(self) -> float:
        """Difference between the grey levels of the bright and the dark parts, at least 1."""
        return max(self.bright - self.dark, 1.0)


def is_blank(crop: Image, mask: Image | None = None) -> bool:
    """Return whether a crop is dark, white, of a single colour, or only noise.

    Args:
        crop: (n, n, 3) RGB.
        mask: (n, n) 0 outside the camera's image; None if the crop is entirely inside.
    """
    size = (COARSE_PX, COARSE_PX)
    coarse = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    seen = None if mask is None else cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST)
    _, deviation = cv2.meanStdDev(coarse, mask=seen)
    return bool(deviation.max() < LEAST_CONTRAST)


def has_edges(crop: Image) -> bool:
    """Return whether a crop (n, n, 3) shows any edge.

    A covered lens, fog or a light that shines into the camera causes only smooth gradients, even if
    these span a wide range of grey levels.
    """
    tones = _tones(crop, None)
    size = (EDGE_PX, EDGE_PX)
    small = cv2.resize(tones.grey.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    off = np.abs(small - cv2.GaussianBlur(small, (0, 0), EDGE_SIGMA_PX))
    inner = off[EDGE_BORDER_PX:-EDGE_BORDER_PX, EDGE_BORDER_PX:-EDGE_BORDER_PX]
    return bool(np.quantile(inner, EDGE_SHARE) >= LEAST_EDGES * tones.span)


def develop(crop: Image, mask: Image | None = None) -> Developed:
    """Stretch the grey levels of a crop with low contrast, and smooth its noise.

    Args:
        crop: (n, n, 3) RGB; it is not changed.
        mask: (n, n) 0 outside the camera's image; None if the crop is entirely inside.
    """
    tones = _tones(crop, mask)
    if is_blank(crop, mask):
        return Developed(crop, is_usable=False)
    if tones.span >= DULL:
        return Developed(crop)
    noise = math.hypot(measure_noise(tones.grey), ROUNDING)
    wanted = tones.span + _ramp(tones.span, DULL, DULLEST) * (SPAN - tones.span)
    gain = max(min(wanted / tones.span, MOST_NOISE / noise), 1.0)
    picture = _smooth(_spread(crop, tones, gain), gain * noise)
    return Developed(picture, noise_factor(noise, tones.span), noise < USELESS * tones.span)


def measure_noise(grey: Image) -> float:
    """Estimate the standard deviation of the noise of an image (n, n) [grey levels].

    The estimate is based on the median of the image's second differences at a reduced size, because
    enlarged images have coarse noise.
    """
    n = len(grey) // NOISE_STEP
    small = cv2.resize(grey.astype(np.float32), (n, n), interpolation=cv2.INTER_AREA)
    uneven = np.abs(cv2.filter2D(small, cv2.CV_32F, UNEVEN))
    return NOISE_STEP * float(np.median(uneven)) / (6.0 * OF_NORMAL)


def noise_factor(noise: float, span: float) -> float:
    """Return the factor on standard deviations of joints, given noise and span [grey levels]."""
    added = _ramp(span, DULL, DULLEST) * DOUBT * noise / max(span, 1.0)
    return min(math.hypot(1.0, added), MOST_DOUBT)


def _tones(crop: Image, mask: Image | None) -> _Tones:
    """Return the range of grey levels of a crop inside its mask."""
    grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY), np.uint8)
    count: Floats = cv2.calcHist([grey], [0], mask, [256], [0, 256]).ravel().cumsum()
    dark, usual, bright = np.searchsorted(count, np.array(ENDS) * count[-1]).tolist()
    return _Tones(dark, min(bright, max(GLARE * usual, dark + 1.0)), grey)


def _spread(crop: Image, tones: _Tones, gain: float) -> Image:
    """Stretch the grey levels of a crop by a gain, in proportion to the margins below and above."""
    added = (gain - 1.0) * tones.span
    first = tones.dark - added * tones.dark / max(255.0 - tones.span, 1.0)
    levels = first + gain * (np.arange(256) - tones.dark)
    return np.asarray(cv2.LUT(crop, np.clip(np.round(levels), 0, 255).astype(np.uint8)), np.uint8)


def _smooth(picture: Image, noise: float) -> Image:
    """Smooth an image to a degree that depends on its noise [grey levels]."""
    share = _ramp(noise, *SMOOTHED)
    if share == 0.0:
        return picture
    smooth = cv2.GaussianBlur(picture, (0, 0), SIGMA_PX)
    return np.asarray(cv2.addWeighted(picture, 1.0 - share, smooth, share, 0.0), np.uint8)


def _ramp(value: float, none: float, whole: float) -> float:
    """Return a weight that rises smoothly from 0 at `none` to 1 at `whole`."""
    share = min(max((value - none) / (whole - none), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)
