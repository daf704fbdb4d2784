"""What all cameras have in common: where in space the detector means a joint to be."""

import numpy as np

from hrc_env.experiments.calibration.fit.cells import FEW, N_K, N_P, class_of
from hrc_env.experiments.calibration.samples import Samples
from hrc_env.perception.calibration import HAND, KIND
from hrc_env.typing import Floats


def offsets_of(samples: Samples) -> tuple[Floats, Floats]:
    """Offsets in space, and how far they vary."""
    offset, wander = np.zeros((N_P, N_K, 3)), np.full((N_P, N_K, 3), 0.003)
    ok = np.isfinite(samples.offset_m[..., 0]) & samples.counts[..., None]
    class_ = np.broadcast_to(class_of(samples.posture)[..., None], ok.shape)
    for kind in range(N_K):
        for posture in range(N_P):
            mine = ok & (class_ == posture) & (kind == KIND)
            values, n = samples.offset_m[mine], int(mine.sum())
            if n < 30:
                offset[posture, kind], wander[posture, kind] = offset[0, kind], wander[0, kind]
                continue
            middle = np.median(values, 0)
            variance = _robust_std(values - middle) ** 2 - np.median(samples.noise[mine], 0)
            trust = n / (n + FEW) if posture else 1.0
            offset[posture, kind] = offset[0, kind] + trust * (middle - offset[0, kind])
            wander[posture, kind] = np.sqrt(np.maximum(variance, 0.002**2))
    return offset, wander


def _robust_std(values: Floats) -> Floats:
    """Standard deviation along the first axis from the middle 80 %."""
    low, high = np.percentile(values, [10, 90], axis=0)
    return (high - low) / 2.563


def projected(samples: Samples, offset: Floats) -> Floats:
    """(L, T, C, J, 2) what offsets in space (P, K, 3) look like."""
    at = np.einsum("ltp,pja->ltja", samples.posture, offset[:, KIND])
    shown = np.einsum("ltcjka,ltja->ltcjk", samples.shown, at)
    return shown * np.stack([HAND, np.ones_like(HAND)], -1)


def space_variance(samples: Samples, wander: Floats) -> Floats:
    """(L, T, C, J) mean variance of a coordinate by what varies in space."""
    at = np.einsum("ltp,pja->ltja", samples.posture, wander[:, KIND]) ** 2
    return 0.5 * np.einsum("ltcjka,ltja->ltcj", samples.shown**2, at)
