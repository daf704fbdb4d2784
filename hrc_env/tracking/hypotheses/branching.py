"""New hypotheses, where one view carries the body or a limb.

A whole body may be turned the other way (`yaw_flip`). For a limb the search for the posterior's
mode is begun again with the limb reflected in depth (`depth_flip`), under the same prediction and
frames: a mode several posterior deviations from the known ones, with evidence that is not
negligible, becomes a hypothesis.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.hypotheses.anatomy import anatomy
from hrc_env.tracking.hypotheses.depth_flip import (
    N_MIRRORS,
    WHOLE_BODY,
    lone_camera,
    open_depth,
    reflect,
)
from hrc_env.tracking.hypotheses.slots import copy_slot
from hrc_env.tracking.hypotheses.yaw_flip import heads_like, turn_body, turn_of
from hrc_env.tracking.tree.evidence import distance_between, log_evidence
from hrc_env.tracking.tree.search import find_pose_near, stiff_lengths
from hrc_env.tracking.tree.update import condition, correct_mean, update_tree

_LOG_LEAST_EVIDENCE = math.log(0.01)
"""A limb's other mode with less evidence than this beside the known one's is none."""
_MOST_PENALTY = 10.0
"""A turned body that is less likely than this is not tried [nat]."""
_DISTINCT = 3.0
"""A mode beyond so many posterior deviations is new."""
_SEARCH_STEPS = 4
"""Gauss-Newton steps from a mirror image."""
_NEARER_M = 0.05
"""A search that ends with every joint nearer than this has found nothing new [m]."""


@kernel
def is_ambiguous(tree, seen, s):
    """Whether one view alone carries a part of the body whose depth is open in a prediction."""
    ambiguous = False
    for part in range(N_MIRRORS):
        ambiguous = ambiguous or _camera_of(part, tree, seen, s) >= 0
    return ambiguous


@kernel
def _camera_of(part, tree, seen, s):
    """The camera that leaves the depth of a part open that may be mirrored, or -1.

    One view in this update is not enough: what other views said a moment ago is still known.
    """
    if not (s.mirrors_body if part == WHOLE_BODY else s.mirrors_limbs):
        return -1
    c = lone_camera(part, seen.ok)
    return c if c >= 0 and open_depth(part, seen.P[c], tree.body, tree.cov) > s.open_depth_m else -1


@kernel(makes_arrays=True)
def branch(own, prior, evidence, seen, s, work):
    """Look for other bodies beside the heaviest hypothesis, and keep them as hypotheses.

    `own` are a worker's `slots.Hypotheses`, of which the first has been updated: `prior` is what it
    was before, `evidence` the update's log-evidence.
    """
    trees = own.trees
    for part in range(N_MIRRORS):
        n = own.n_alive[0]
        camera = _camera_of(part, prior, seen, s) if n < len(trees) else -1
        if camera < 0:
            continue
        copy_slot(own, 0, n)
        penalty = np.inf
        if part == WHOLE_BODY:
            penalty = _turn(trees, n, camera, prior, seen, s, work)
        elif reflect(part, seen.P[camera], trees[0].body, work.point):
            penalty = _settle(trees, n, prior, evidence, seen, s, work)
        if penalty < np.inf:
            tree = trees[n]
            before, tree.pose_log_prior = tree.pose_log_prior, s.anatomy_trust * anatomy(tree.body)
            tree.log_weight += tree.pose_log_prior - before - penalty
            own.n_alive[0] = n + 1


@kernel(makes_arrays=True)
def _turn(trees, n, camera, prior, seen, s, work):
    """Make tree n the body that is turned the other way; its penalty [nat], infinite if it is
    known."""
    new = trees[n]
    turn = turn_of(seen.P[camera], prior.body)
    penalty = 0.5 * (turn / s.turn_std_rad) ** 2
    if penalty > _MOST_PENALTY:
        return np.inf
    _predict_again(new, prior)
    turn_body(seen.P[camera], turn, new.body, new.cov, new.slope)
    if _turned_alike(trees, n):
        return np.inf
    condition(new, seen, s, work)
    correct_mean(new, seen, s, work)
    return np.inf if _turned_alike(trees, n) else penalty


@kernel(makes_arrays=True)
def _predict_again(tree, prior):
    """Give a tree that was updated the Gaussian from before, but not what was learnt before."""
    tree.body[:], tree.cov[:], tree.slope[:] = prior.body, prior.cov, prior.slope


@kernel
def _turned_alike(trees, n):
    """Whether tree n is turned as one of those before it."""
    alike = False
    for k in range(n):
        alike |= heads_like(trees[n].body, trees[k].body)
    return alike


@kernel(makes_arrays=True)
def _settle(trees, n, prior, evidence, seen, s, work):
    """Condition tree n at the mode next to a reflected limb (work.point); 0, or infinity for none.

    There is none where the search ends at a known hypothesis, or with negligible evidence.
    """
    new, known = trees[n], trees[0].body
    _predict_again(new, prior)
    stiff_lengths(new.bone_variance, s.bone_give, work.bone_variance)
    find_pose_near(new, seen, s, _SEARCH_STEPS, 0.0, work)
    moved = 0.0
    for j in range(len(known)):
        for i in range(3):
            moved = max(moved, abs(work.point[j, i] - known[j, i]))
    if not moved > _NEARER_M:
        return np.inf
    update_tree(new, work)
    if not log_evidence(prior, new, seen, s, work) - evidence > _LOG_LEAST_EVIDENCE:
        return np.inf
    correct_mean(new, seen, s, work)
    for k in range(n):
        if not distance_between(trees[k], new, work) > _DISTINCT**2:
            return np.inf
    return 0.0
