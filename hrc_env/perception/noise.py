"""Mean offsets and standard deviations of the network's joints relative to our skeleton.

The pipeline with images and its emulator use the same values. BlazePose's hips are 17 mm above
those of our skeleton and, if a person bends, 60 mm ahead of them. Trackers estimate the network's
joints; the estimates that are passed on are converted to the joints of our skeleton.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import change_fields
from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Bools, Covariances3, Floats, Points3, Velocities3
from hrc_env.perception.calibration import (
    HAND,
    KIND,
    POSTURES,
    VISIBILITY,
    Calibration,
    read_calibration,
)
from hrc_env.perception.outline import STANDING, Facing, facing, mix, novelty_m, posture_of

ERROR: Floats = read_calibration().sigma
"""(P, K, V) standard deviation of each image coordinate, as a fraction of the stature, by posture,
kind of joint (`calibration.KINDS`) and visibility (`VISIBILITY`); see docs/emulator.md."""
FARTHEST_M = 0.25
"""Distance from known poses above which the uncertainty of a body does not increase further [m]."""


class Offsets(NamedTuple):
    """The part of a calibration that relates the network's joints to those of our skeleton."""

    tables: Floats
    """(P, K * 6) mean offset (3) [m] and its variance (3) [m^2], by posture and kind of joint, in
    the directions ahead, to the joint's side of the body, and up."""
    poses: Floats
    """(J, 3, M) known poses, in the coordinates of `outline.pose_of`."""
    near_m: float
    """Distance from the nearest known pose up to which a body counts as known [m]."""
    novel: Floats
    """(K,) factor on the squared distance beyond `near_m`; the product is added to the standard
    deviation [1/m]."""


def sigma_px(
    confidence: Floats,
    stature_px: Floats | float,
    posture: Sequence[float] = STANDING,
    known: Floats = ERROR,
) -> Floats:
    """Return the standard deviation of each coordinate of joints.

    Args:
        confidence: (..., J) reported visibilities.
        stature_px: stature at the joints' distance, broadcast to `confidence` [px].
        posture: weights of the postures, as returned by `outline.posture_of`.
        known: table `sigma` of a calibration.

    Returns:
        (..., J) standard deviations, infinite where the confidence is 0 [px].
    """
    confidence = np.asarray(confidence, float)
    check_shape("confidence", confidence.shape[-1:], (len(KIND),), "one entry per joint")
    error = np.tensordot(np.asarray(posture, float), known, 1)
    parts = [np.interp(confidence[..., j], VISIBILITY, error[k]) for j, k in enumerate(KIND)]
    share = np.stack(parts, -1)
    return np.where(confidence > 0, share * stature_px, np.inf)


@kernel
def error_share(confidence: float, visibility: Floats, error: Floats) -> float:
    """Return the standard deviation of a joint's coordinates, as a fraction of the stature.

    Args:
        confidence: reported visibility.
        visibility: (V,) visibilities at which the standard deviation is given.
        error: (V,) standard deviation at each of them.
    """
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
    """Convert an estimate of the network's joints to an estimate of our skeleton's joints.

    Means are shifted by the mean offset of the network's joints (`offset_m`). Covariances increase
    by the variance of this offset over time and between bodies (`wander_m`, `between_m`), which are
    not averaged out over cameras and frames. They also increase with the distance of the body from
    all known poses (`novel`), because a distant pose is either new or wrong. Velocities and the
    priors of workers without a track are not changed.

    Args:
        estimate: (B, W, ...) estimate of the network's joints.
        known: a calibration; None for the calibration of the package.
    """
    offsets = _make_offsets(known or read_calibration())
    mean_world, cov_world = estimate.mean_world.copy(), estimate.cov_world.copy()
    _correct_joints(mean_world, cov_world, estimate.velocity_world, estimate.tracked, offsets)
    return change_fields(estimate, mean_world=mean_world, cov_world=cov_world)


@lru_cache(maxsize=8)
def _make_offsets(known: Calibration) -> Offsets:
    """Return the offsets of a calibration."""
    variance_m2 = known.wander_m**2 + known.between_m**2
    tables = np.concatenate([known.offset_m, variance_m2], -1).reshape(len(POSTURES), -1)
    return Offsets(tables, known.poses, float(known.near_m), known.novel)


@kernel(makes_arrays=True)
def _correct_joints(
    mean: Points3, cov: Covariances3, velocity: Velocities3, tracked: Bools, offsets: Offsets
) -> None:
    """Convert the network's joints to those of our skeleton, in place.

    Args:
        mean: (B, W, J, 3) means of the positions, which are changed [m].
        cov: (B, W, J, 3, 3) covariances, which are changed [m^2].
        velocity: (B, W, J, 3) velocities [m/s].
        tracked: (B, W) mask of the workers to convert.
        offsets: offsets of the calibration.
    """
    row = np.empty(offsets.tables.shape[1])
    of_kind = row.reshape(-1, 6)
    for b in range(len(mean)):
        for w in range(mean.shape[1]):
            if not tracked[b, w]:
                continue
            joints = mean[b, w]
            front = facing(joints)
            mix(posture_of(joints, velocity[b, w]), offsets.tables, row)
            new_m = min(max(novelty_m(joints, offsets.poses) - offsets.near_m, 0.0), FARTHEST_M)
            for j in range(len(joints)):
                _correct_joint(joints[j], cov[b, w, j], front, of_kind[KIND[j]], HAND[j])
                for i in range(3):
                    cov[b, w, j, i, i] += (offsets.novel[KIND[j]] * new_m**2) ** 2


@kernel
def _correct_joint(
    joint: Points3, cov: Covariances3, front: Facing, offset: Floats, hand: float
) -> None:
    """Subtract the mean offset from a joint's position, and add the offset's variance.

    Args:
        joint: (3,) mean position, which is changed [m].
        cov: (3, 3) covariance, which is changed [m^2].
        front: horizontal unit vector towards the front of the body.
        offset: (6,) mean offset [m] and variance [m^2]: ahead, to the joint's side, up.
        hand: -1 for a right joint, 1 for others.
    """
    x, y = front.x, front.y
    ahead, left, up = offset[0], hand * offset[1], offset[2]
    joint[0] -= x * ahead - y * left
    joint[1] -= y * ahead + x * left
    joint[2] -= up
    cov[0, 0] += x * x * offset[3] + y * y * offset[4]
    cov[1, 1] += y * y * offset[3] + x * x * offset[4]
    across = x * y * (offset[3] - offset[4])
    cov[0, 1] += across
    cov[1, 0] += across
    cov[2, 2] += offset[5]
