"""Quality of dark images: a model of the detector's errors on enhanced images (`exposure`).

The model is used by the emulator, which has no images. `python -m benchmarks.perception.dim` prints
the errors in crops to which it was fitted.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.perception.exposure import LEAST_CONTRAST, ROUNDING, noise_factor
from hrc_env.perception.faults.corruptions import GAMMA, darkness_noise

SPAN = 166.0
"""Span between the grey levels of dark and bright parts in normal light: the median over images of
the lab and the site."""
OF_GREY = 0.67
"""Ratio of the noise of grey levels to that of the colour channels, in which noise is
independent."""
TEXTURE = 0.04
"""Apparent noise due to fine textures of the scene, as a fraction of the span."""
CONTRAST = 0.21
"""Contrast at low resolution (see `exposure.is_blank`), as a fraction of the span."""
BLANK = (0.59, 0.92)
"""Contrasts below which all parts of an image are blank, and above which none is, in units of
`LEAST_CONTRAST`."""
USELESS = 0.18
"""Noise above which people are missed, like `exposure.USELESS`, but for the noise that is modelled
here."""
NOISE: Floats = np.array([0.160, 0.170, 0.200, 0.230, 0.260])
"""Noise levels at which `MISSED` is given, as fractions of the span."""
MISSED: Floats = np.array([0.0, 0.015, 0.2, 0.8, 1.0])
"""Additional fraction of the time in which a camera misses people at `NOISE`. It was measured in
ten episodes for each of several amounts of the fault `darkness` from 0.01 to 0.003."""


class Quality(NamedTuple):
    """The quality of images, as arrays of equal shape."""

    doubt: Floats
    """Factor on the errors of joints and on their reported standard deviations."""
    missed: Floats
    """Additional fraction of the time in which people are missed."""
    blank: Bools
    """Whether the images are blank, so that they do not prove the absence of people."""


def picture_quality(light: float, darkness: Sequence[float] = ()) -> Quality:
    """Return the quality of images in a given light.

    Args:
        light: relative light intensity, as in `AppearanceConfig`; 1 is the default of the scene.
        darkness: amounts of the camera's `darkness` faults, in the order of their application.
    """
    span, noise = SPAN * light, 0.0
    for share in darkness:
        left = share ** (1.0 / GAMMA)
        span, noise = span * left, math.hypot(noise * left, OF_GREY * darkness_noise(share))
    seen = math.hypot(noise, TEXTURE * span, ROUNDING)
    contrast = CONTRAST * span / LEAST_CONTRAST
    blank = float(np.interp(contrast, BLANK, (1.0, 0.0)))
    missed = max(blank, float(np.interp(seen / max(span, 1.0), NOISE, MISSED)))
    is_blank = blank == 1.0 or seen > USELESS * span
    return Quality(np.array(noise_factor(seen, span)), np.array(missed), np.array(is_blank))
