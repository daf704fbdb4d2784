"""An update of one Gaussian on the tree, step by step.

`tree` is a record of `tree.state.TREE`, `seen` is `measurements.Seen`, `s` are `settings.Settings`
and `work` is a record of `tree.state.WORK`.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.models.track_management import acquire_anew, check, find_joints_again
from hrc_env.tracking.tree.gaussian import PARENT


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
