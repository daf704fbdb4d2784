"""Poses that the tables were fitted to, and how much less is known of others.

A joint's offset is known of the poses of the fit. Where an estimate is far from all of them, either
the person's pose is new, or the estimate is wrong by about as much: both times the deviation that
is told must grow with the distance, whatever else is told.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.cluster.vq import kmeans2

from assets.emulator.clips import WARM_UP
from assets.emulator.watch import Watched
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import MIRROR
from hrc_env.core.typing import Bools, Floats
from hrc_env.perception.calibration import KIND, KINDS, N_POSES, Calibration
from hrc_env.perception.noise import FARTHEST_M, our_joints
from hrc_env.perception.outline import novelty_m, pose_of

EVERY = 3
"""Frames of a clip of which one is taken."""
COVERED, SHORT, CHI2_95_3D = 0.95, 0.02, 7.815
"""Share of the errors that the reported region is to hold, how much less it may be on average over
distances, and its squared size."""
FEW = 200
"""Joints of a kind, in a class of distances, that tell something."""
CLASS_M = 0.03
"""Width of a class of distances [m]."""
MOST = 20.0
"""No joint is less certain than by so many times the square of the distance [1/m]."""


def poses_of(clips: Sequence[Watched]) -> tuple[Floats, float]:
    """(J, 3, M) poses that stand for those of clips, mirrored ones with them; how far the true
    poses are from the nearest, the median [m]."""
    bodies = np.concatenate([clip.joints_world[::EVERY] for clip in clips])
    poses = np.array([pose_of(body) for body in bodies])
    both = np.concatenate([poses, poses[:, MIRROR] * [1.0, -1.0, 1.0]]).reshape(2 * len(poses), -1)
    centres = kmeans2(both, N_POSES, minit="++", rng=np.random.default_rng(0))[0]
    kept = np.ascontiguousarray(centres.T.reshape(*poses.shape[1:], N_POSES))
    return kept, float(np.median([novelty_m(body, kept) for body in bodies]))


def novel_of(draft: Calibration, clips: Sequence[Watched]) -> Floats:
    """(K,) what times the square of how much further than `near_m` an estimate is from known poses
    is to be added to deviations [1/m]: the least with which the region holds what it claims, on
    average over distances. The square is likelier of the fit's clips than the distance itself."""
    parts = [_told(replace(draft, novel=np.zeros(len(KINDS))), clip) for clip in clips]
    error, cov, new_m = (np.concatenate(each) for each in zip(*parts, strict=True))
    novel = np.zeros(len(KINDS))
    for kind in range(len(KINDS)):
        mine = np.flatnonzero(kind == KIND)
        low, high = 0.0, MOST
        for _ in range(20):
            middle = 0.5 * (low + high)
            grown = cov[:, mine] + ((middle * new_m**2) ** 2)[:, None, None, None] * np.eye(3)
            enough = _coverage(_inside(error[:, mine], grown), new_m) >= COVERED - SHORT
            low, high = (low, middle) if enough else (middle, high)
        novel[kind] = high
    return novel


def new_of(bodies: Floats, known: Calibration) -> Floats:
    """(N,) how much further than `near_m` bodies (N, J, 3) are from known poses [m]."""
    away_m = np.array([novelty_m(body, known.poses) for body in bodies])
    return np.clip(away_m - known.near_m, 0.0, FARTHEST_M)


def _told(known: Calibration, clip: Watched) -> tuple[Floats, Floats, Floats]:
    """Of the frames (N) in which somebody was tracked: errors of joints, covariances that are told,
    and how much further than `near_m` the body is from known poses [m]."""
    rows = np.flatnonzero(clip.tracked[WARM_UP:]) + WARM_UP
    mean, cov, velocity = (
        each[rows, None]
        for each in (clip.tracker_mean_world, clip.tracker_cov_world, clip.tracker_velocity_world)
    )
    new_m = new_of(mean[:, 0], known)
    nobody = np.zeros(mean.shape[:-1])
    tracked = np.ones(mean.shape[:2], np.bool_)
    belief = our_joints(PoseEstimate(mean, cov, velocity, nobody, tracked), known)
    return belief.mean_world[:, 0] - clip.joints_world[rows], belief.cov_world[:, 0], new_m


def _inside(error: Floats, cov: Floats) -> Bools:
    squared = np.einsum("nji,njik,njk->nj", error, np.linalg.inv(cov), error)
    return squared < CHI2_95_3D


def _coverage(inside: Bools, new_m: Floats) -> float:
    """Mean over classes of distances, at most `COVERED` of each."""
    class_ = (new_m / CLASS_M).astype(int)
    shares = [
        min(float(inside[class_ == k].mean()), COVERED)
        for k in np.unique(class_[new_m > 0])
        if (class_ == k).sum() * inside.shape[1] >= FEW
    ]
    return float(np.mean(shares)) if shares else COVERED
