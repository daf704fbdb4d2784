"""Hypotheses about one body: slots with a Gaussian tree each, weighted, merged and dropped.

A worker has H slots, of which the first `n_alive` are in use, the heaviest first.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tree.state import Hypotheses


@kernel(makes_arrays=True)
def worker_slots(state, b, w):
    """Worker w of environment b alone: views (H, ...); `n_alive`, `waited_s` and `pace` (1,)."""
    trees, views, noise = state.trees[b, w], state.views[b, w], state.noise[b, w]
    n_alive, waited_s = state.n_alive[b, w : w + 1], state.waited_s[b, w : w + 1]
    return Hypotheses(trees, views, noise, n_alive, waited_s, state.pace[b, w : w + 1])
