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
def follow(tree, seen, s, work):
    """Update a tracked worker: search, condition, correct the mean, learn the bones."""
    condition(tree, seen, s, work)
    correct_mean(tree, seen, s, work)


@kernel
def condition(tree, seen, s, work):
    """Search the mode and condition the tree there; seen.belief says what was believed."""
    give = work.bone_variance
    body, cov, slope = tree.body, tree.cov, tree.slope
    stiff_lengths(tree.bone_variance, s.bone_give, give)
    bones = (tree.bone_length, give)
    how = (s.inlier_odds, s.floor_std_m, s.gauss_newton_steps)
    find_pose(body, cov, slope, seen, bones, *how, work)
    update_tree(body, cov, slope, work)


@kernel
def correct_mean(tree, seen, s, work):
    """Go from the mode to the mean, and learn what is to be learnt from it."""
    if s.mean_correction > 0.0:
        gaussian = (tree.body, tree.cov, tree.slope)
        shift_to_mean(*gaussian, seen, s.mean_correction, work)
    update_ages(tree, seen, work.n_views)


@kernel
def update_ages(tree, seen, n_views):
    """Ages, conflicts and bone lengths of a worker who has been updated."""
    ok, belief = seen.ok, seen.belief
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        if n_supporting > 0:
            tree.age_s[j] = 0.0
        conflict = tree.conflict[j]
        tree.conflict[j] = count_conflict(n_views[j], n_supporting, conflict)
    bones = (tree.bone_length, tree.bone_variance)
    learn_lengths(tree.body, tree.cov, tree.slope, n_views, *bones)


@kernel
def recover(tree, seen, standing, s, work):
    """Find joints or the whole body again where the views say so; notice a body that is lost.

    What is known of a joint that was put somewhere is its own.
    """
    P, z, sigma, ok, placed = seen.P, seen.z, seen.sigma, seen.ok, work.placed
    placed[:] = acquire_anew(tree, P, z, sigma, ok, standing, s)
    find_joints_again(tree, P, z, sigma, ok, s, placed)
    for j in range(len(placed)):
        if placed[j] or (PARENT[j] >= 0 and placed[PARENT[j]]):
            tree.slope[j] = 0.0
    if not check(tree, s):
        tree.slope[:] = 0.0
