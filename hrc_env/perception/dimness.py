"""How well dark pictures show people: a model of the detector on developed pictures (`exposure`).

The emulator uses it, as it has no pictures. `python -m benchmarks.perception.dim` prints the errors
of crops to which it was fitted.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.perception.exposure import LEAST_CONTRAST, ROUNDING, doubt_of
from hrc_env.perception.faults.corruptions import GAMMA, darkness_noise

SPAN = 166.0
"""Grey levels between dark and bright parts in usual light: the median of the lab and the site."""
OF_GREY = 0.67
"""Noise of the grey levels as a share of that of the colours: it is each colour's own."""
TEXTURE = 0.04
"""Fine patterns of the scene are measured as noise of this share of the span."""
CONTRAST = 0.21
"""Coarse contrast (`exposure.is_blank`) as a share of the span."""
SPREAD = 0.25
"""Relative spread of the contrast between the parts of a picture, some of which are blank first."""
NOISE: Floats = np.array([0.06, 0.09, 0.13, 0.16, 0.18, 0.20])
MISSED: Floats = np.array([0.0, 0.05, 0.10, 0.22, 0.35, 0.55])
"""Additional share of the time in which a camera misses people, by noise as a share of the span."""


class Quality(NamedTuple):
    """How well pictures show people; arrays of one shape."""

    doubt: Floats
    """Factor on the errors of joints and on their reported deviations."""
    missed: Floats
    """Additional share of the time in which people are missed."""
    blank: Bools
    """Whether the pictures show nothing, and hence do not prove absence."""


def quality_of(light: float, darkness: Sequence[float] = ()) -> Quality:
    """Return the quality of pictures in some light.

    Args:
        light: strength of all light, as of `AppearanceConfig`; 1 is as the scene was built.
        darkness: amounts of the faults `darkness` of the camera, which follow each other.
    """
    span, noise = SPAN * light, 0.0
    for share in darkness:
        left = share ** (1.0 / GAMMA)
        span, noise = span * left, math.hypot(noise * left, OF_GREY * darkness_noise(share))
    seen = math.hypot(noise, TEXTURE * span, ROUNDING)
    contrast = CONTRAST * span / LEAST_CONTRAST
    blank = min(max((1.0 + SPREAD - contrast) / (2.0 * SPREAD), 0.0), 1.0)
    missed = max(blank, float(np.interp(seen / max(span, 1.0), NOISE, MISSED)))
    return Quality(np.array(doubt_of(seen, span)), np.array(missed), np.array(blank == 1.0))
