"""Samples sorted by the dimensions of a calibration's tables."""

import numpy as np

from assets.emulator.samples import Samples
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import HAND, KIND, KINDS, N_VIEWS, POSTURES, SIGHTS

N_K, N_P, N_S = len(KINDS), len(POSTURES), len(SIGHTS)
FEW = 300
"""Least number of samples of a table's cell that is not shrunk towards the cell that replaces
it."""
SHARP = 0.06
"""Errors below this share of the window's side are not outliers; means and correlations use only
them."""


CLEAR = 0.5
"""Least share of a class from which a body counts as of this class."""


def class_of(posture: Floats) -> Ints:
    """Return the index of the `POSTURES` that shares (..., P) clearly belong to, (...); -1:
    none."""
    return np.where(posture.max(-1) >= CLEAR, posture.argmax(-1), -1)


class Cells:
    """Samples sorted by kind of joint, with left and right joints pooled."""

    def __init__(self, samples: Samples) -> None:
        self.mirrored = samples.error * np.stack([HAND, np.ones_like(HAND)], -1)
        self.found = np.isfinite(samples.error[..., 0]) & samples.counts[..., None, None]
        self.sight, self.confidence = samples.sight, samples.confidence
        class_ = class_of(samples.posture)[..., None, None]
        self.posture = np.broadcast_to(class_, self.found.shape)
        view = samples.view[..., None] * HAND
        self.view_bin = np.round(view * N_VIEWS / (2 * np.pi)).astype(int) % N_VIEWS

    def pick(self, posture: int | None, sight: int, kind: int) -> Bools:
        """Return a mask of the samples of a cell."""
        found = self.found & (self.sight == sight) & (kind == KIND)
        return found if posture is None else found & (self.posture == posture)


def mix(a: float, b: float, part: float) -> float:
    """Interpolate linearly from a to b."""
    return a + part * (b - a)
