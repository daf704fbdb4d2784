"""Joints that moved as the prediction did not think they could.

Where several views agree with each other and not with the prediction, the prediction was too
narrow: a limb was jerked, a body fell. What a joint does by itself, given its parent, then counts
as so much less certain that the innovation is what was to be expected, and the pose is searched for
anew. With d from the prediction to the joint, u = d / |d|, C the predicted covariance and R its part
given the parent, R grows by the factor 1 + (|d|^2 - u'C u) / u'R u, the variance of greatest
likelihood (as in the adaptive filters of Mehra, IEEE Trans. Autom. Control 15, 1970).
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import consensus_point
from hrc_env.tracking.tree.gaussian import (
    LEAVES_FIRST,
    ORDER,
    PARENT,
    invert3,
    multiply,
    multiply_transposed,
)

_FAR = 16.0
"""Squared innovation, in predicted variances, beyond which a joint has jumped; by chance of a
normal variable once in 900 updates."""


@kernel(makes_arrays=True)
def widen_jumped(tree, seen, s, w):
    """Widen the predicted covariance, in place, of joints that have jumped; whether any has.

    `w` is as `tree.search.find_pose` leaves it.
    """
    body, cov, slope, grown = tree.body, tree.cov, tree.slope, w.moved
    use, point, spread = np.empty(len(seen.P), np.bool_), np.empty(3), np.empty((3, 3))
    jumped = False
    for j in ORDER:
        q = PARENT[j]
        if q >= 0 and jumped:
            multiply(slope[j], grown[q], w.a)
            multiply_transposed(w.a, slope[j], grown[j])
        else:
            grown[j] = 0.0
        if not _moved(j, body[j], cov[j], seen, s, point, (spread, use, w)):
            continue
        if q >= 0:
            multiply(slope[j], cov[q], w.a)
            multiply_transposed(w.a, slope[j], w.b)
        far = along = alone = 0.0
        for i in range(3):
            a = point[i] - body[j, i]
            far += a * a
            for k in range(3):
                b = point[k] - body[j, k]
                along += a * (cov[j, i, k] + grown[j, i, k]) * b
                alone += a * (cov[j, i, k] - (w.b[i, k] if q >= 0 else 0.0)) * b
        more = (far * far - along) / alone
        if not (alone > 0.0 and more > 0.0):
            continue
        for i in range(6):
            for k in range(6):
                grown[j, i, k] += more * (cov[j, i, k] - (w.b[i, k] if q >= 0 else 0.0))
        jumped = True
    if jumped:
        for j in ORDER:
            for i in range(6):
                for k in range(6):
                    cov[j, i, k] += grown[j, i, k]
    return jumped


@kernel(makes_arrays=True)
def _moved(j, body, cov, seen, s, point, scratch):
    """Whether views agree that a joint is where it was not expected; then `point` is there."""
    spread, use, w = scratch
    n_ok, n_believed = 0, 0.0
    for c in range(len(use)):
        n_ok += seen.ok[j, c]
        n_believed += seen.belief[j, c] if seen.ok[j, c] else 0.0
    if n_ok < 2:
        return False
    if n_believed > 1.5:
        for i in range(3):
            point[i] = w.point[j, i]
        return _squared(point, body, cov, w) > _FAR
    n_agree = consensus_point(seen.P, seen.z[j], seen.sigma[j], seen.ok[j], s.gate_sigma, point, spread, use)
    if n_agree < 3 or 2 * n_agree <= n_ok:
        return False
    for i in range(3):
        for k in range(3):
            spread[i, k] += cov[i, k]
    return _squared(point, body, spread, w) > _FAR


@kernel
def _squared(point, body, cov, w):
    """Squared Mahalanobis distance."""
    invert3(cov, w.c)
    total = 0.0
    for i in range(3):
        for k in range(3):
            total += (point[i] - body[i]) * w.c[i, k] * (point[k] - body[k])
    return total
