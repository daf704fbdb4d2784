"""Samples sorted by what the tables of a calibration distinguish."""

import numpy as np

from assets.emulator.samples import Samples
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import HAND, KIND, KINDS, N_VIEWS, POSTURES, SIGHTS

N_K, N_P, N_S = len(KINDS), len(POSTURES), len(SIGHTS)
FEW = 300
"""A cell of a table with fewer samples is drawn towards the cell that stands for it."""
SHARP = 0.06
"""Errors below this share of the side are no gross ones: means and correlations are theirs."""


CLEAR = 0.5
"""A body counts as of a class from this share on."""


def class_of(posture: Floats) -> Ints:
    """(...) which of `POSTURES` shares (..., P) clearly are; -1: none."""
    return np.where(posture.max(-1) >= CLEAR, posture.argmax(-1), -1)


class Cells:
    """Samples sorted by kind of joint, left and right together."""

    def __init__(self, samples: Samples) -> None:
        self.mirrored = samples.error * np.stack([HAND, np.ones_like(HAND)], -1)
        self.found = np.isfinite(samples.error[..., 0]) & samples.counts[..., None, None]
        self.sight, self.confidence = samples.sight, samples.confidence
        class_ = class_of(samples.posture)[..., None, None]
        self.posture = np.broadcast_to(class_, self.found.shape)
        view = samples.view[..., None] * HAND
        self.view_bin = np.round(view * N_VIEWS / (2 * np.pi)).astype(int) % N_VIEWS

    def pick(self, posture: int | None, sight: int, kind: int) -> Bools:
        """Which samples are of a cell."""
        found = self.found & (self.sight == sight) & (kind == KIND)
        return found if posture is None else found & (self.posture == posture)


def mix(a: float, b: float, part: float) -> float:
    """From a to b."""
    return a + part * (b - a)
