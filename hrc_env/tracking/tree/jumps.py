"""Joints that moved as the prediction did not think they could.

Where several views agree with each other and not with the prediction, the prediction was too sure:
a limb was jerked, somebody turned over. What a joint does by itself, given its parent, then counts
as less certain, and the pose is searched for anew. With d from the predicted joint to where it is
seen, C its covariance and R the part of it that is not the parent's, R is multiplied by

    1 + (|d|^4 - d'C d) / d'R d,

so that the variance along d is |d|^2, which is the likeliest (covariance matching: Mehra, IEEE
Transactions on Automatic Control 17, 1972, doi:10.1109/TAC.1972.1100100).
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import consensus_point
from hrc_env.tracking.tree.gaussian import (
    ORDER,
    PARENT,
    invert3,
    multiply,
    multiply_transposed,
)

_FAR = 16.0
"""Squared Mahalanobis distance of a jump: by chance a joint is as far once in 900 updates."""
_SURE_VIEWS, _AGREEING_VIEWS = 1.5, 3
"""Where more views than this are believed, the pose that was found counts; where not, it takes so
many that agree: two may err alike."""


@kernel(makes_arrays=True)
def widen_jumped(tree, seen, s, w):
    """Widen the predicted covariance, in place, of joints that have jumped; whether any has.

    `w` is as `tree.search.find_pose` leaves it.
    """
    cov, grown, jumped = tree.cov, w.moved, False
    use, point, spread = np.empty(len(seen.P), np.bool_), np.empty(3), np.empty((3, 3))
    for j in ORDER:
        grown[j] = 0.0
        if jumped and PARENT[j] >= 0:  # who hangs on a joint that jumped goes with it
            multiply(tree.slope[j], grown[PARENT[j]], w.a)
            multiply_transposed(w.a, tree.slope[j], grown[j])
        if _has_jumped(j, tree, seen, s, (point, spread, use, w)):
            jumped |= _grow(j, tree, point, w)
    for j in ORDER:
        if not jumped:
            break
        for i in range(6):
            for k in range(6):
                cov[j, i, k] += grown[j, i, k]
    return jumped


@kernel
def _grow(j, tree, point, w):
    """Add to w.moved[j] what makes the predicted variance as large as the jump to `point`."""
    q, body, cov, inherited = PARENT[j], tree.body[j], tree.cov[j], w.b
    for i in range(6):
        for k in range(6):
            inherited[i, k] = 0.0
    if q >= 0:
        multiply(tree.slope[j], tree.cov[q], w.a)
        multiply_transposed(w.a, tree.slope[j], inherited)
    squared = known = own = 0.0
    for i in range(3):
        d = point[i] - body[i]
        squared += d * d
        for k in range(3):
            product = d * (point[k] - body[k])
            known += product * (cov[i, k] + w.moved[j, i, k])
            own += product * (cov[i, k] - inherited[i, k])
    if not (own > 0.0 and squared * squared > known):
        return False
    more = (squared * squared - known) / own
    for i in range(6):
        for k in range(6):
            w.moved[j, i, k] += more * (cov[i, k] - inherited[i, k])
    return True


@kernel(makes_arrays=True)
def _has_jumped(j, tree, seen, s, scratch):
    """Whether views agree that a joint is where it was not expected; then `point` is there."""
    point, spread, use, w = scratch
    ok, body, cov = seen.ok[j], tree.body[j], tree.cov[j]
    n_believed = 0.0
    for c in range(len(ok)):
        n_believed += seen.belief[j, c] if ok[c] else 0.0
    if n_believed > _SURE_VIEWS:
        for i in range(3):
            point[i] = w.point[j, i]
        return _is_far(point, body, cov, w.c)
    views = (seen.P, seen.z[j], seen.sigma[j], ok)
    if ok.sum() < _AGREEING_VIEWS:
        return False
    if consensus_point(*views, s.gate_sigma, point, spread, use) < _AGREEING_VIEWS:
        return False
    for i in range(3):
        for k in range(3):
            spread[i, k] += cov[i, k]
    return _is_far(point, body, spread, w.c)


@kernel
def _is_far(point, body, cov, inverse):
    invert3(cov, inverse)
    squared = 0.0
    for i in range(3):
        for k in range(3):
            squared += (point[i] - body[i]) * inverse[i, k] * (point[k] - body[k])
    return squared > _FAR
