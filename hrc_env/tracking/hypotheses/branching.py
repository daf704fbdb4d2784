"""New hypotheses, where one view carries the body or a limb.

A whole body may be turned the other way (`yaw_flip`). For a limb the search for the posterior's
mode is begun again with the limb reflected in depth (`depth_flip`), under the same prediction and
frames: a mode several posterior deviations from the known ones, with evidence that is not
negligible, becomes a hypothesis.
"""

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
from hrc_env.tracking.hypotheses.slots import copy_slot, slot_distance
from hrc_env.tracking.hypotheses.yaw_flip import heads_like, turn_body, turn_of
from hrc_env.tracking.tree.bone_lengths import stiff_lengths
from hrc_env.tracking.tree.evidence import log_evidence
from hrc_env.tracking.tree.filter import condition, correct_mean
from hrc_env.tracking.tree.search import find_pose_near
from hrc_env.tracking.tree.update import update_tree

_NEARER_M = 0.05
"""A search that ends with every joint nearer than this has found nothing new [m]."""


@kernel
def is_ambiguous(P, body, cov, ok, m):
    """Whether one view alone carries a part of the body whose depth is open.

    `P` (C, 3, 4); `body` (J, 6) and `cov` (J, 6, 6) are what is predicted, `ok` (J, C) is what
    is seen, `m` the `mixture.MixtureSettings`.
    """
    ambiguous = False
    for part in range(N_MIRRORS):
        ambiguous = ambiguous or camera_of(part, P, body, cov, ok, m) >= 0
    return ambiguous


@kernel
def camera_of(part, P, body, cov, ok, m):
    """The camera that leaves the depth of a part open that is asked about, or -1.

    One view in this update is not enough: what other views said a moment ago is still known.
    """
    if not (m.mirror_body if part == WHOLE_BODY else m.mirror_limbs):
        return -1
    camera = lone_camera(part, ok)
    return camera if camera >= 0 and open_depth(part, P[camera], body, cov) > m.open_m else -1


@kernel(makes_arrays=True)
def branch(state, b, w, prior, evidence, seen, s, m, work):
    """Look for other bodies beside the heaviest hypothesis, and keep them as hypotheses.

    Args:
        state: `hypotheses.slots.Hypotheses`; the worker's first hypothesis has been updated.
        b, w: environment, worker.
        prior: its body (J, 6), cov, slope (J, 6, 6) before the update.
        evidence: log-evidence of that update.
        seen: `measurements.Seen`.
        s, m: settings.
        work: scratch, a record of `WORK`.
    """
    limit = state.trees.shape[1] // state.n_alive.shape[1]
    own = w * limit
    trees = state.trees[b, own:]
    for part in range(N_MIRRORS):
        n = state.n_alive[b, w]
        camera = camera_of(part, seen.P, prior[0], prior[1], seen.ok, m) if n < limit else -1
        if camera < 0:
            continue
        new = own + n
        copy_slot(state, b, own, new)
        if part == WHOLE_BODY:
            penalty = _turn(trees, n, camera, prior, seen, s, m, work)
        else:
            where = (part, camera, prior, evidence)
            penalty = _reflect(trees, n, where, seen, s, m, work)
        if penalty < np.inf:
            tree = trees[n]
            before, tree.pose_log_prior = tree.pose_log_prior, m.anatomy * anatomy(tree.body)
            tree.log_weight += tree.pose_log_prior - before - penalty
            state.n_alive[b, w] = n + 1


@kernel(makes_arrays=True)
def _turn(trees, n, camera, prior, seen, s, m, work):
    """Make tree n the body that is turned the other way; its penalty [nat].

    It is infinite where one of the n hypotheses is turned alike.
    """
    new = trees[n]
    turn = turn_of(seen.P[camera], prior[0])
    penalty = 0.5 * (turn / m.turn) ** 2
    if penalty > m.most_penalty:
        return np.inf
    body, cov, slope = new.body, new.cov, new.slope
    body[:], cov[:], slope[:] = prior[0], prior[1], prior[2]
    turn_body(seen.P[camera], turn, body, cov, slope)
    if _turned_alike(trees, n):
        return np.inf
    condition(new, seen, s, work)
    correct_mean(new, seen, s, work)
    return np.inf if _turned_alike(trees, n) else penalty


@kernel
def _turned_alike(trees, n):
    """Whether tree n is turned as one of those before it."""
    alike = False
    for k in range(n):
        alike |= heads_like(trees[n].body, trees[k].body)
    return alike


@kernel(makes_arrays=True)
def _reflect(trees, n, where, seen, s, m, work):
    """Condition tree n at the mode next to a reflected limb; 0, or infinity for none.

    There is none where the search ends at one of the n hypotheses, or where the evidence is
    negligible beside that of the search from the prediction.
    """
    part, camera, prior, evidence = where
    give = work.bone_variance
    new = trees[n]
    body, cov, slope = new.body, new.cov, new.slope
    if not reflect(part, seen.P[camera], body, work.point):
        return np.inf
    stiff_lengths(new.bone_variance, s.bone_give, give)
    bones = (new.bone_length, give)
    how = (s.inlier_odds, s.floor_std_m, m.search_steps, 0.0)
    find_pose_near(prior[0], prior[1], prior[2], seen, bones, *how, work)
    moved = 0.0
    for j in range(len(body)):
        for i in range(3):
            moved = max(moved, abs(work.point[j, i] - body[j, i]))
    if not moved > _NEARER_M:
        return np.inf
    body[:], cov[:], slope[:] = prior[0], prior[1], prior[2]
    update_tree(body, cov, slope, work)
    found = log_evidence(prior, (body, cov, slope), seen, bones, s.inlier_odds, s.floor_std_m, work)
    if not found - evidence > m.log_least:
        return np.inf
    correct_mean(new, seen, s, work)
    for k in range(n):
        if not slot_distance(trees[k], new, work) > m.distinct:
            return np.inf
    return 0.0
