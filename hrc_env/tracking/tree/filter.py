"""An update of one Gaussian on the tree, step by step.

`tree` is a record of `tree.state.TREE`, `seen` is `measurements.Seen`, `s` are `settings.Settings`
and `work` is a record of `tree.state.WORK`.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.acquisition import count_conflict
from hrc_env.tracking.models.track_management import acquire_anew, check, find_joints_again
from hrc_env.tracking.tree.bone_lengths import learn_lengths, stiff_lengths
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.jumps import widen_jumped
from hrc_env.tracking.tree.search import find_pose
from hrc_env.tracking.tree.update import shift_to_mean, update_tree


@kernel
def keep_positions(cov, out):
    """Copy the covariances of the positions (J, 3, 3) out of those of the joints (J, 6, 6)."""
    for j in range(len(cov)):
        for i in range(3):
            for k in range(3):
                out[j, i, k] = cov[j, i, k]


@kernel(makes_arrays=True)
def condition(tree, seen, s, work):
    """Search the mode and condition the tree there; seen.belief says what was believed."""
    stiff_lengths(tree.bone_variance, s.bone_give, work.bone_variance)
    find_pose(tree, seen, s, work)
    if widen_jumped(tree, seen, s, work):
        find_pose(tree, seen, s, work)
    update_tree(tree, work)


@kernel
def correct_mean(tree, seen, s, work):
    """Go from the mode to the mean, and learn what is to be learnt from it."""
    if s.mean_correction > 0.0:
        shift_to_mean(tree, seen, s.mean_correction, work)
    _update_ages(tree, seen, work.n_views)
    learn_lengths(tree, work.n_views)


@kernel
def _update_ages(tree, seen, n_views):
    """Ages and conflicts of a worker who has been updated, and how many cameras saw each joint."""
    ok, belief = seen.ok, seen.belief
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        if n_supporting > 0:
            tree.age_s[j] = 0.0
        tree.conflict[j] = count_conflict(n_views[j], n_supporting, tree.conflict[j])


@kernel
def recover(tree, seen, s, work):
    """Find joints or the whole body again where the views say so; notice a body that is lost."""
    placed = work.placed
    placed[:] = acquire_anew(tree, seen, s)
    find_joints_again(tree, seen, s, placed)
    for j in range(len(placed)):
        if placed[j] or (PARENT[j] >= 0 and placed[PARENT[j]]):
            tree.slope[j] = 0.0
    if not check(tree, s):
        tree.slope[:] = 0.0
