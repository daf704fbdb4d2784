"""What is known of pictures without drawing them: how well they show who is in them.

The emulator is told by this what dark pictures cost the detector, which develops them first
(`exposure`). `python -m benchmarks.perception.dim` measures both on crops, and prints them.
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
"""Share of the span that fine patterns of the scene add to what is measured as noise."""
CONTRAST = 0.21
"""Coarse contrast (`exposure.is_blank`) as a share of the span."""
SPREAD = 0.25
"""Parts of a picture have as much more or less contrast: some are blank before all are."""
NOISE: Floats = np.array([0.06, 0.09, 0.13, 0.16, 0.18, 0.20])
MISSED: Floats = np.array([0.0, 0.05, 0.10, 0.22, 0.35, 0.55])
"""Share of the time that a camera misses who is in its picture, by the share of the span that is
noise; beside the misses in usual light."""


class Quality(NamedTuple):
    """How well pictures show who is in them, each (...)."""

    doubt: Floats
    """Factor on the errors of joints, and on the deviations that are told."""
    missed: Floats
    """Share of the time that people are missed, beside what is usual."""
    blank: Bools
    """Whether they show nothing, and prove nothing."""


def quality_of(light: float, darkness: Sequence[float] = ()) -> Quality:
    """Quality of a picture in light of a strength (1 as built), with faults of the kind `darkness`
    of these amounts one after the other."""
    span, noise = SPAN * light, 0.0
    for share in darkness:
        left = share ** (1.0 / GAMMA)
        span, noise = span * left, math.hypot(noise * left, OF_GREY * darkness_noise(share))
    seen = math.hypot(noise, TEXTURE * span, ROUNDING)
    contrast = CONTRAST * span / LEAST_CONTRAST
    blank = min(max((1.0 + SPREAD - contrast) / (2.0 * SPREAD), 0.0), 1.0)
    missed = max(blank, float(np.interp(seen / max(span, 1.0), NOISE, MISSED)))
    return Quality(np.array(doubt_of(seen, span)), np.array(missed), np.array(blank == 1.0))
