"""How far a joint may be off, by which it is and how visible the network says it is: one mapping
for the real pipeline and for its emulator."""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import KIND, POSTURES, VISIBILITY, read_calibration

ERROR: Floats = read_calibration().sigma
"""(P, K, V) standard deviation of each image coordinate, a share of stature, by posture and kind of
joint (`calibration.KINDS`) at `VISIBILITY`; see docs/emulator.md."""
STANDING = (1.0, *(0.0,) * (len(POSTURES) - 1))


def sigma_px(
    confidence: Floats, stature_px: Floats | float, posture: Sequence[float] = STANDING
) -> Floats:
    """Standard deviation of each coordinate of a detected joint [px].

    Args:
        confidence: (..., J) visibility in [0, 1]; 0 means that there is no measurement.
        stature_px: how long the worker's stature is at their distance [px]; broadcasts.
        posture: how far the body counts as each of `calibration.POSTURES` (`outline.posture_of`).

    Returns:
        (..., J) finite and positive, infinite where the confidence is 0.
    """
    confidence = np.asarray(confidence, float)
    check_shape("confidence", confidence.shape[-1:], (len(KIND),), "one a joint")
    error = np.tensordot(np.asarray(posture, float), ERROR, 1)
    parts = [np.interp(confidence[..., j], VISIBILITY, error[k]) for j, k in enumerate(KIND)]
    share = np.stack(parts, -1)
    return np.where(confidence > 0, share * stature_px, np.inf)


@kernel
def error_share(confidence: float, visibility: Floats, error: Floats) -> float:
    """`sigma_px` of one joint and a stature of one, for kernels: the tables are passed in."""
    if not confidence > 0.0:
        return np.inf
    if confidence <= visibility[0]:
        return error[0]
    for k in range(1, len(visibility)):
        if confidence <= visibility[k]:
            part = (confidence - visibility[k - 1]) / (visibility[k] - visibility[k - 1])
            return error[k - 1] + part * (error[k] - error[k - 1])
    return error[-1]
