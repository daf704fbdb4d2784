"""Bone lengths on the edges of the tree: population values to begin with, learnt for each worker.

Every update measures each edge's length by what is known of it (`stiff_lengths`), so that the
bones are always on; a scalar Kalman filter per bone learns it while two views see both ends.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.state import EDGE_STIFFNESS_M

_CORRELATED_UPDATES = 10.0
_GATE_SIGMA, _LEAST_VARIANCE = 3.0, 1e-5


@kernel
def stiff_lengths(variance, give, out):
    """Variances (J,) of the lengths as measurements: what is not known of them, and the give."""
    for j in range(len(variance)):
        out[j] = variance[j] + (give * EDGE_STIFFNESS_M[j]) ** 2


@kernel
def learn_lengths(tree, n_views):
    """Learn a tree's bone lengths, in place, from the joints that two views see (J,)."""
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in range(len(body)):
        q = PARENT[j]
        if q < 0 or n_views[j] < 2 or n_views[q] < 2:
            continue
        x, y, z = body[j, 0] - body[q, 0], body[j, 1] - body[q, 1], body[j, 2] - body[q, 2]
        now = math.sqrt(x * x + y * y + z * z) + 1e-6
        along = (x / now, y / now, z / now)
        spread, total = 0.0, 0.0
        for i in range(3):
            for k in range(3):
                edge = 0.0
                for h in range(6):
                    edge += slope[j, i, h] * cov[q, h, k]
                difference = cov[j, i, k] + cov[q, i, k] - 2.0 * edge
                spread += along[i] * along[k] * difference
                total += difference if i == k else 0.0
        measured = now - 0.5 * (total - spread) / now  # errors across a bone lengthen it
        _learn_length(tree, j, measured, max(spread, EDGE_STIFFNESS_M[j] ** 2))


@kernel
def _learn_length(tree, j, measured, spread):
    """Kalman update of one length by a measurement whose errors last for several updates."""
    length, variance = tree.bone_length, tree.bone_variance
    noise = _CORRELATED_UPDATES * spread
    miss = measured - length[j]
    if miss * miss > _GATE_SIGMA**2 * (noise + variance[j]):
        return
    gain = variance[j] / (variance[j] + noise)
    length[j] += gain * miss
    variance[j] = max((1.0 - gain) * variance[j], _LEAST_VARIANCE)
