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
from hrc_env.perception.calibration import (
    HAND,
    KIND,
    POSTURES,
    VISIBILITY,
    Calibration,
    read_calibration,
)
from hrc_env.perception.outline import facing, mix, novelty_m, posture_of

ERROR: Floats = read_calibration().sigma
"""(P, K, V) standard deviation of each image coordinate, a share of stature, by posture and kind of
joint (`calibration.KINDS`) at `VISIBILITY`; see docs/emulator.md."""
FARTHEST_M = 0.25
"""Bodies that are further from poses that are known are no less known [m]."""
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


def our_joints(estimate: PoseEstimate, known: Calibration | None = None) -> PoseEstimate:
    """An estimate (B, W, ...) of what the network means, as one of joints.

    Means move by where the network means a joint to be (`offset_m`). Covariances grow by how far
    that differs from moment to moment and from body to body (`wander_m`, `between_m`), which no
    number of cameras and frames averages out, and by how far the body is from all poses to which
    this was fitted (`novel`): it is new, or it is wrong. The prior of who is not tracked stays, as
    velocities do. known: a calibration; None: the package's.
    """
    known = known or read_calibration()
    variance_m2 = known.wander_m**2 + known.between_m**2
    tables = np.concatenate([known.offset_m, variance_m2], -1).reshape(len(POSTURES), -1)
    mean_world, cov_world = estimate.mean_world.copy(), estimate.cov_world.copy()
    seen = (estimate.velocity_world, estimate.tracked)
    new = (known.poses, float(known.near_m), known.novel)
    _put_right(mean_world, cov_world, *seen, tables, new, (KIND, HAND))
    return replace(estimate, mean_world=mean_world, cov_world=cov_world)


@kernel(makes_arrays=True)
def _put_right(mean, cov, velocity, tracked, tables, new, of_joints):
    row, (poses, near_m, novel), (kinds, hands) = np.empty(tables.shape[1]), new, of_joints
    told = row.reshape(-1, 6)
    for b in range(len(mean)):
        for w in range(mean.shape[1]):
            if not tracked[b, w]:
                continue
            joints = mean[b, w]
            front = facing(joints)
            mix(posture_of(joints, velocity[b, w]), tables, row)
            new_m = min(max(novelty_m(joints, poses) - near_m, 0.0), FARTHEST_M)
            for j in range(len(joints)):
                _move(joints[j], cov[b, w, j], front, told[kinds[j]], hands[j])
                for i in range(3):
                    cov[b, w, j, i, i] += (novel[kinds[j]] * new_m**2) ** 2


@kernel
def _move(joint, cov, front, told, hand):
    """Move a joint (3) by what is told of its kind (6), and add to its covariance (3, 3)."""
    x, y = front
    ahead, left, up = told[0], hand * told[1], told[2]
    joint[0] -= x * ahead - y * left
    joint[1] -= y * ahead + x * left
    joint[2] -= up
    cov[0, 0] += x * x * told[3] + y * y * told[4]
    cov[1, 1] += y * y * told[3] + x * x * told[4]
    across = x * y * (told[3] - told[4])
    cov[0, 1] += across
    cov[1, 0] += across
    cov[2, 2] += told[5]
