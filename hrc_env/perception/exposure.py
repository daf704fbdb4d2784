"""Development of dark and dull pictures before the networks get them.

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
"""Least standard deviation of a colour channel, at size `COARSE_PX`, of a picture that is not blank
[grey levels]."""
LEAST_EDGES, EDGE_SHARE = 0.06, 0.98
"""Least contrast of edges as a share of the span of grey levels, and the quantile of the local
contrasts that is compared with it. Rooms have 0.1 and more, slopes 0.05 at most."""
EDGE_PX, EDGE_SIGMA_PX, EDGE_BORDER_PX = 64, 2.0, 6
"""Size of the picture in which edges are measured, deviation of the Gaussian that smooths it for
comparison, and border that is left out [px]."""
COARSE_PX = 32
"""Size of the picture on which contrast is measured [px]; the noise of pixels averages out."""
DULL, DULLEST = 75.0, 60.0
"""Spans of grey levels below which a picture begins to be spread, and below which it is spread in
full."""
SPAN = 150.0
"""Grey levels between the dark and bright parts of a picture that was spread in full; the lab as it
was built has 166."""
ENDS = (0.01, 0.75, 0.99)
"""Quantiles of the grey levels that count as dark, usual and bright."""
GLARE = 2.0
"""Ratio to the usual grey level beyond which parts are windows and lamps, which may saturate."""
MOST_NOISE = 20.0
"""Greatest standard deviation to which noise is amplified [grey levels]."""
SMOOTHED = (4.0, 10.0)
"""Noise at which smoothing begins, and at which it is complete [grey levels]."""
ROUNDING = math.sqrt(1.0 / 12.0)
"""Standard deviation of the error of rounding to whole grey levels."""
UNEVEN: NDArray[np.float32] = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
"""This filter amplifies noise six times and removes edges and slopes (Immerkaer 1996)."""
NOISE_STEP = 4
"""Factor by which a picture is reduced before its noise is measured."""
OF_NORMAL = 0.6745
"""Median of the absolute value of a standard normal variable."""
DOUBT, MOST_DOUBT = 7.0, 3.0
"""Ratio of an additional independent error, in units of the usual one, to the noise as a share of a
dull picture's span; and the greatest factor on errors. Both are fitted to crops
(`benchmarks.perception.dim`)."""
USELESS = 0.165
"""Share of noise in the span from which on people are missed in dull pictures."""
SIGMA_PX = 0.6
"""Deviation of the Gaussian that smooths noise [pixels of a crop]."""


class Developed(NamedTuple):
    """A picture for the networks."""

    picture: Image
    """(n, n, 3) the crop itself, or a new picture."""
    doubt: float = 1.0
    """Factor on the deviations of joints that are found in it; 1 at usual contrast."""
    is_usable: bool = True
    """Whether people would be found in it: it is neither blank nor mostly noise."""


class _Tones(NamedTuple):
    """The range of a picture's grey levels."""

    dark: float
    """Grey level of the dark parts."""
    bright: float
    """Grey level of the bright parts, without windows and lamps."""
    grey: Image
    """(n, n) the picture in grey levels."""

    @property
    def span(self) -> float:
        """Number of grey levels between the dark and the bright parts, at least 1."""
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
    """Return whether a crop (n, n, 3) shows any edge.

    A covered lens, fog or a light that shines into the camera only show slopes, however large a
    part of the grey levels these span.
    """
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
        return Developed(crop, is_usable=False)
    if tones.span >= DULL:
        return Developed(crop)
    noise = math.hypot(measure_noise(tones.grey), ROUNDING)
    wanted = tones.span + _ramp(tones.span, DULL, DULLEST) * (SPAN - tones.span)
    gain = max(min(wanted / tones.span, MOST_NOISE / noise), 1.0)
    picture = _smooth(_spread(crop, tones, gain), gain * noise)
    return Developed(picture, noise_factor(noise, tones.span), noise < USELESS * tones.span)


def measure_noise(grey: Image) -> float:
    """Return the standard deviation of the noise of a picture (n, n) [grey levels].

    It is estimated by the median of the picture's second differences at a reduced size, as enlarged
    pictures have coarse noise.
    """
    n = len(grey) // NOISE_STEP
    small = cv2.resize(grey.astype(np.float32), (n, n), interpolation=cv2.INTER_AREA)
    uneven = np.abs(cv2.filter2D(small, cv2.CV_32F, UNEVEN))
    return NOISE_STEP * float(np.median(uneven)) / (6.0 * OF_NORMAL)


def noise_factor(noise: float, span: float) -> float:
    """Return the factor on the deviations of joints for a noise and a span [grey levels]."""
    added = _ramp(span, DULL, DULLEST) * DOUBT * noise / max(span, 1.0)
    return min(math.hypot(1.0, added), MOST_DOUBT)


def _tones(crop: Image, mask: Image | None) -> _Tones:
    """Return the range of grey levels of a crop inside of its mask."""
    grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY), np.uint8)
    count: Floats = cv2.calcHist([grey], [0], mask, [256], [0, 256]).ravel().cumsum()
    dark, usual, bright = np.searchsorted(count, np.array(ENDS) * count[-1]).tolist()
    return _Tones(dark, min(bright, max(GLARE * usual, dark + 1.0)), grey)


def _spread(crop: Image, tones: _Tones, gain: float) -> Image:
    """Return a crop with its grey levels stretched by a gain, away from black and white."""
    added = (gain - 1.0) * tones.span
    first = tones.dark - added * tones.dark / max(255.0 - tones.span, 1.0)
    levels = first + gain * (np.arange(256) - tones.dark)
    return np.asarray(cv2.LUT(crop, np.clip(np.round(levels), 0, 255).astype(np.uint8)), np.uint8)


def _smooth(picture: Image, noise: float) -> Image:
    """Return a picture smoothed as far as its noise [grey levels] demands."""
    share = _ramp(noise, *SMOOTHED)
    if share == 0.0:
        return picture
    smooth = cv2.GaussianBlur(picture, (0, 0), SIGMA_PX)
    return np.asarray(cv2.addWeighted(picture, 1.0 - share, smooth, share, 0.0), np.uint8)


def _ramp(value: float, none: float, whole: float) -> float:
    """Return a share that rises smoothly from 0 at `none` to 1 at `whole`."""
    share = min(max((value - none) / (whole - none), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)
