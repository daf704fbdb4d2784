"""What Gaussian estimators do for a track besides filtering: begin it, repair it, give it up.

`tree` is a record of `tree.state.TREE`, `seen` is `measurements.Seen`, `s` are `settings.Settings`.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.acquisition import distance, find_again, find_body, middle_of
from hrc_env.tracking.tracks import age_worker
from hrc_env.tracking.tree.gaussian import is_positive_definite

_FOUND_SPEED_STD_M_S = 1.0
_FURTHEST_STD = 8.0
"""A body further than this many prior deviations from the prior has been lost."""


@kernel
def grow_older(tree, dt, s):
    """Count ages up by dt [s]; give up a track that nothing supports, let a lost one relax."""
    body, ages = tree.body, (tree.age_s, tree.conflict)
    gaussian = (body[:, :3], tree.cov[:, :3, :3], body[:, 3:])
    tree.tracked = age_worker(*gaussian, *ages, tree.tracked, dt, s)


@kernel(makes_arrays=True)
def acquire(tree, seen, s):
    """Start a track when two views agree on enough joints; whether one was started."""
    n_joints = len(tree.body)
    points, spread = np.empty((n_joints, 3)), np.empty((n_joints, 3, 3))
    found = np.empty(n_joints, np.bool_)
    if not find_body(seen, s, points, spread, found):
        return False
    for j in range(n_joints):
        place(tree.body[j], tree.cov[j], points[j], spread[j])
        if found[j]:
            tree.age_s[j] = 0.0
    tree.tracked = True
    return True


@kernel(makes_arrays=True)
def place(body, cov, point, spread):
    """Put a joint at rest at a point."""
    body[:3], body[3:] = point, 0.0
    cov[:] = 0.0
    cov[:3, :3] = spread
    for i in range(3):
        cov[3 + i, 3 + i] = _FOUND_SPEED_STD_M_S**2


@kernel(makes_arrays=True)
def find_joints_again(tree, seen, s, placed):
    """Put joints where two views have seen them for a while; `placed` (J,) says which."""
    everyone, middle = np.ones(len(placed), np.bool_), np.empty(3)
    point, spread = np.empty(3), np.empty((3, 3))
    for j in range(len(placed)):
        if tree.conflict[j] < s.conflict_frames:
            continue
        middle_of(tree.body, everyone, middle)
        if find_again(seen, j, s, middle, point, spread):
            place(tree.body[j], tree.cov[j], point, spread)
            tree.age_s[j], tree.conflict[j], placed[j] = 0.0, 0, True


@kernel
def acquire_anew(tree, seen, s):
    """Start over when the views have long agreed on another body; whether that happened."""
    n_wrong = 0
    for j in range(len(tree.conflict)):
        n_wrong += tree.conflict[j] >= s.conflict_frames
    if n_wrong < s.acquire_min_joints or not acquire(tree, seen, s):
        return False
    tree.conflict[:] = 0
    return True


@kernel
def check(tree, s):
    """Keep covariances positive definite, lose a body that has left the world; was all well?"""
    body, cov, inside, well = tree.body, tree.cov, True, True
    for j in range(len(body)):
        if not is_positive_definite(cov[j]):
            well = False
            for i in range(6):
                variance = cov[j, i, i]
                cov[j, i, :], cov[j, :, i] = 0.0, 0.0
                cov[j, i, i] = max(variance, 1e-4)
        away = distance(body[j], s.prior_mean_world)
        variances, numbers = 0.0, 0.0
        for i in range(6):
            variances += cov[j, i, i]  # where these are finite, what lies between them is
            numbers += body[j, i]
        inside &= away < _FURTHEST_STD * s.prior_std_m and math.isfinite(variances + numbers)
    if inside:
        return well
    _lose(tree, s)
    return False


@kernel
def _lose(tree, s):
    """Put a worker who has left the world back to the prior."""
    body, cov = tree.body, tree.cov
    tree.tracked = False
    for j in range(len(body)):
        tree.age_s[j] = s.max_age_s
        for i in range(6):
            body[j, i] = s.prior_mean_world[i] if i < 3 else 0.0
            for k in range(6):
                cov[j, i, k] = s.prior_std_m**2 if i == k else 0.0
