"""Quality of dark pictures: a model of the detector on developed pictures (`exposure`).

It is for the emulator, which has no pictures. `python -m benchmarks.perception.dim` prints the
errors of crops to which it was fitted.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Bools, Floats
from hrc_env.perception.exposure import LEAST_CONTRAST, ROUNDING, noise_factor
from hrc_env.perception.faults.corruptions import GAMMA, darkness_noise

SPAN = 166.0
"""Grey levels between dark and bright parts in usual light, the median of the lab and the site."""
OF_GREY = 0.67
"""Noise of the grey levels as a share of that of the colours, which is independent."""
TEXTURE = 0.04
"""Noise that is measured because of fine patterns of the scene, as a share of the span."""
CONTRAST = 0.21
"""Coarse contrast (`exposure.is_blank`) as a share of the span."""
BLANK = (0.59, 0.92)
"""Contrasts in units of `LEAST_CONTRAST` at which all parts of a picture are blank, and none
are."""
USELESS = 0.18
"""Limit of the noise as in `exposure.USELESS`, by the noise that is modelled here."""
NOISE: Floats = np.array([0.160, 0.170, 0.200, 0.230, 0.260])
"""Noise as a share of the span at which `MISSED` is given."""
MISSED: Floats = np.array([0.0, 0.015, 0.2, 0.8, 1.0])
"""Additional share of the time in which a camera misses people at `NOISE`: from ten episodes each
with the fault `darkness` of amounts 0.01 to 0.003."""


class Quality(NamedTuple):
    """The quality of pictures, in arrays of one shape."""

    doubt: Floats
    """Factor on the errors of joints and on their reported deviations."""
    missed: Floats
    """Additional share of the time in which people are missed."""
    blank: Bools
    """Whether the pictures show nothing, and hence do not prove absence."""


def picture_quality(light: float, darkness: Sequence[float] = ()) -> Quality:
    """Return the quality of pictures in some light.

    Args:
        light: strength of all light, as in `AppearanceConfig`; 1 is as the scene was built.
        darkness: amounts of the camera's faults `darkness`, in the order of their application.
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
