"""How far a joint may be off, from how visible the network says it is.

One mapping for the real pipeline and for its emulator, so that an estimator tuned on one
meets the same numbers in the other.
"""

import numba
import numpy as np

from hrc_env.compiled import LEAN
from hrc_env.typing import Floats

VISIBILITY: Floats = np.array([0.10, 0.35, 0.65, 0.875, 0.975])
"""Middles of the bins of visibility in which errors were measured."""

ERROR: Floats = np.array([0.089, 0.058, 0.031, 0.016, 0.0144])
"""Standard deviation of each image coordinate in those bins, as a share of stature.

From errors of BlazePose `full` on rendered workers: medians 4.1, 3.1, 2.1, 1.3, 1.3 % of
stature; 90th percentiles 19 % in the first bin and 3.1 % in the last. The tails are heavier
than a Rayleigh distribution's, so the 90th percentile (divided by 2.146) was taken; between
the measured ones its ratio to the median was interpolated."""


def sigma_px(confidence: Floats, stature_px: Floats | float) -> Floats:
    """Standard deviation of each coordinate of a detected joint [px].

    Args:
        confidence: (...,) visibility in [0, 1]; 0 means that there is no measurement.
        stature_px: how long the worker's stature is at their distance [px]; broadcasts.

    Returns:
        (...,) finite and positive, infinite where the confidence is 0.
    """
    share = np.interp(confidence, VISIBILITY, ERROR)
    return np.where(confidence > 0, share * stature_px, np.inf)


@numba.njit(**LEAN)
def error_share(confidence: float, visibility: Floats, error: Floats) -> float:
    """`sigma_px` of a stature of one, for kernels: the tables are passed in."""
    if not confidence > 0.0:
        return np.inf
    if confidence <= visibility[0]:
        return error[0]
    for k in range(1, len(visibility)):
        if confidence <= visibility[k]:
            part = (confidence - visibility[k - 1]) / (visibility[k] - visibility[k - 1])
            return error[k - 1] + part * (error[k] - error[k - 1])
    return error[-1]
