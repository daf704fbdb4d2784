"""An update of one Gaussian on the tree, step by step.

`state` and `s` are `state.Trees` and `settings.Settings`; a worker's measurements are
z (J, C, 2), sigma (J, C), ok (J, C) as `measurements.read_worker` fills them.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.acquisition import count_conflict
from hrc_env.tracking.models.track_management import (
    acquire_anew,
    check,
    find_joints_again,
)
from hrc_env.tracking.tree.bone_lengths import learn_lengths, stiff_lengths
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.search import find_pose
from hrc_env.tracking.tree.update import shift_to_mean, update_tree


@kernel
def keep_positions(cov, out):
    """Copy the covariances of the positions (J, 3, 3) out of those of the joints (J, 6, 6)."""
    for j in range(len(cov)):
        for i in range(3):
            for k in range(3):
                out[j, i, k] = cov[j, i, k]


@kernel
def follow(state, b, w, seen, s, work):
    """Update a tracked worker: search, condition, correct the mean, learn the bones."""
    condition(state, b, w, seen, s, work)
    correct_mean(state, b, w, seen, s, work)


@kernel
def condition(state, b, w, seen, s, work):
    """Search the mode and condition the tree there; seen.belief says what was believed."""
    give = work.bone_variance
    body, cov, slope = state.body[b, w], state.cov[b, w], state.slope[b, w]
    stiff_lengths(state.bone_variance[b, w], s.bone_give, give)
    bones = (state.bone_length[b, w], give)
    how = (s.inlier_odds, s.floor_std_m, s.gauss_newton_steps)
    find_pose(body, cov, slope, seen, bones, *how, work)
    update_tree(body, cov, slope, work)


@kernel
def correct_mean(state, b, w, seen, s, work):
    """Go from the mode to the mean, and learn what is to be learnt from it."""
    if s.mean_correction > 0.0:
        gaussian = (state.body[b, w], state.cov[b, w], state.slope[b, w])
        shift_to_mean(*gaussian, seen, s.mean_correction, work)
    update_ages(state, b, w, seen, work.n_views)


@kernel
def update_ages(state, b, w, seen, n_views):
    """Ages, conflicts and bone lengths of a worker who has been updated."""
    ok, belief = seen.ok, seen.belief
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        if n_supporting > 0:
            state.age_s[b, w, j] = 0.0
        conflict = state.conflict[b, w, j]
        state.conflict[b, w, j] = count_conflict(n_views[j], n_supporting, conflict)
    bones = (state.bone_length[b, w], state.bone_variance[b, w])
    learn_lengths(state.body[b, w], state.cov[b, w], state.slope[b, w], n_views, *bones)


@kernel
def recover(state, b, w, seen, standing, s, work):
    """Find joints or the whole body again where the views say so; notice a body that is lost.

    What is known of a joint that was put somewhere is its own.
    """
    P, z, sigma, ok, placed = seen.P, seen.z, seen.sigma, seen.ok, work.placed
    placed[:] = acquire_anew(state, b, w, P, z, sigma, ok, standing, s)
    find_joints_again(state, b, w, P, z, sigma, ok, s, placed)
    for j in range(len(placed)):
        if placed[j] or (PARENT[j] >= 0 and placed[PARENT[j]]):
            state.slope[b, w, j] = 0.0
    if not check(state, b, w, s):
        state.slope[b, w] = 0.0
