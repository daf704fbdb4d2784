"""Poses that the tables were fitted to, and the greater uncertainty of other poses.

A joint's offset is known for the poses of the fit. If an estimate is far from all of them, either
the person's pose is new, or the estimate is wrong by about as much. In both cases the reported
deviation must grow with the distance.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.cluster.vq import kmeans2

from assets.emulator.clips import WARM_UP
from assets.emulator.watch import Watched
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import MIRROR
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import KIND, KINDS, N_POSES, Calibration
from hrc_env.perception.noise import FARTHEST_M, our_joints
from hrc_env.perception.outline import novelty_m, pose_of

EVERY = 3
"""Every such frame of a clip is used."""
MOST = 20.0
"""Upper limit of the factor on the square of the distance by which a joint's uncertainty grows
[1/m]."""


def poses_of(clips: Sequence[Watched]) -> tuple[Floats, float]:
    """Return poses (J, 3, M) that represent those of clips and their mirror images, and the median
    distance of the true poses from the nearest one [m]."""
    bodies = np.concatenate([clip.joints_world[::EVERY] for clip in clips])
    poses = np.array([pose_of(body) for body in bodies])
    both = np.concatenate([poses, poses[:, MIRROR] * [1.0, -1.0, 1.0]]).reshape(2 * len(poses), -1)
    centres = kmeans2(both, N_POSES, minit="++", rng=np.random.default_rng(0))[0]
    kept = np.ascontiguousarray(centres.T.reshape(*poses.shape[1:], N_POSES))
    return kept, float(np.median([novelty_m(body, kept) for body in bodies]))


def novel_of(draft: Calibration, clips: Sequence[Watched]) -> Floats:
    """Return the factor on the squared distance beyond `near_m` of an estimate from known poses,
    (K,) [1/m].

    The product is added to the deviations. With it they equal the root mean square of the errors
    over the frames that are further away.
    """
    parts = [_reported(replace(draft, novel=np.zeros(len(KINDS))), clip) for clip in clips]
    squared, variance, new_m = (np.concatenate(each) for each in zip(*parts, strict=True))
    far = new_m > 0.0
    if not far.any():
        return np.zeros(len(KINDS))
    missing_m2 = (squared - variance)[far].mean(0)
    of_kind = np.array([missing_m2[kind == KIND].mean() for kind in range(len(KINDS))])
    return np.minimum(np.sqrt(np.maximum(of_kind, 0.0) / (3.0 * np.mean(new_m[far] ** 4))), MOST)


def new_of(bodies: Floats, known: Calibration) -> Floats:
    """Return the distance beyond `near_m` of bodies (N, J, 3) from known poses, (N,) [m]."""
    away_m = np.array([novelty_m(body, known.poses) for body in bodies])
    return np.clip(away_m - known.near_m, 0.0, FARTHEST_M)


def _reported(known: Calibration, clip: Watched) -> tuple[Floats, Floats, Floats]:
    """Return errors, variances and distances of the frames (N) with a tracked worker.

    These are the squares of the joints' errors and their reported variances, (N, J) [m^2], and the
    distance beyond `near_m` of the body from known poses [m].
    """
    rows = np.flatnonzero(clip.tracked[WARM_UP:]) + WARM_UP
    mean, cov, velocity = (
        each[rows, None]
        for each in (clip.tracker_mean_world, clip.tracker_cov_world, clip.tracker_velocity_world)
    )
    new_m = new_of(mean[:, 0], known)
    nobody = np.zeros(mean.shape[:-1])
    tracked = np.ones(mean.shape[:2], np.bool_)
    belief = our_joints(PoseEstimate(mean, cov, velocity, nobody, tracked), known)
    error = belief.mean_world[:, 0] - clip.joints_world[rows]
    variance = np.trace(belief.cov_world[:, 0], axis1=-2, axis2=-1)
    return np.sum(error**2, -1), variance, new_m
