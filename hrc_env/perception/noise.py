"""The network's joints against ours: how far one may be off, and where it is meant to be; the same
numbers for the real pipeline and for its emulator.

A hip of BlazePose is 17 mm above ours, and 60 mm ahead of it in who bends. Trackers follow what the
network means; estimates are of our joints.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import HAND, KIND, POSTURES, VISIBILITY, read_calibration
from hrc_env.perception.outline import facing, mix, posture_of

ERROR: Floats = read_calibration().sigma
"""(P, K, V) standard deviation of each image coordinate, a share of stature, by posture and kind of
joint (`calibration.KINDS`) at `VISIBILITY`; see docs/emulator.md."""
OFFSET_M: Floats = read_calibration().offset_m
"""(P, K, 3) where the network means a joint to be: ahead, to its own side, up [m]."""
STANDING = (1.0, *(0.0,) * (len(POSTURES) - 1))


def sigma_px(
    confidence: Floats,
    stature_px: Floats | float,
    posture: Sequence[float] = STANDING,
    known: Floats = ERROR,
) -> Floats:
    """Standard deviation of each coordinate of joints with these visibilities (..., J) [px],
    infinite of 0; statures at their distance [px] broadcast; posture: `outline.posture_of`;
    known: a calibration's `sigma`."""
    confidence = np.asarray(confidence, float)
    check_shape("confidence", confidence.shape[-1:], (len(KIND),), "one a joint")
    error = np.tensordot(np.asarray(posture, float), known, 1)
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


def our_joints(estimate: PoseEstimate, offset_m: Floats = OFFSET_M) -> PoseEstimate:
    """An estimate (B, W, ...) of what the network means, as one of joints; the prior of who is not
    tracked, covariances and velocities stay. offset_m: a calibration's."""
    mean_world = estimate.mean_world.copy()
    offset_of = offset_m.reshape(len(offset_m), -1)
    _put_right(mean_world, estimate.velocity_world, estimate.tracked, offset_of, KIND, HAND)
    return replace(estimate, mean_world=mean_world)


@kernel(makes_arrays=True)
def _put_right(mean, velocity, tracked, offset_of, kinds, hands):
    row = np.empty(offset_of.shape[1])
    offset = row.reshape(-1, 3)
    for b in range(len(mean)):
        for w in range(mean.shape[1]):
            if not tracked[b, w]:
                continue
            joints = mean[b, w]
            front_x, front_y = facing(joints)
            mix(posture_of(joints, velocity[b, w]), offset_of, row)
            for j in range(len(joints)):
                ahead, up = offset[kinds[j], 0], offset[kinds[j], 2]
                left = hands[j] * offset[kinds[j], 1]
                joints[j, 0] -= front_x * ahead - front_y * left
                joints[j, 1] -= front_y * ahead + front_x * left
                joints[j, 2] -= up
