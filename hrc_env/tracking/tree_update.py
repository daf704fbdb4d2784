"""The tree after a set of frames: one exact linear-Gaussian update, then the mean correction.

Cameras inform single joints, bones inform edges, so that the posterior is again a Gaussian on
the same tree: elimination from the leaves to the root and substitution back give its marginals
and slopes exactly.
"""

import numba

from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread
from hrc_env.tracking.tree import (
    ORDER,
    PARENT,
    invert,
    multiply,
    multiply_symmetric,
    transposed_multiply_symmetric,
)

_NEAREST_M = 0.3
"""The mean correction knows no joint nearer to a lens than this."""
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}
_REORDER = {"reassoc", "contract", "nsz"}


@numba.njit(**_JIT)
def update_tree(body, cov, slope, w):
    """Condition (J, 6), (J, 6, 6), (J, 6, 6) on cameras and bones, in place.

    What they say is in camera_information, camera_gradient, edge_information and edge_gradient
    of `w`, as `tree_search.find_pose` leaves it. Keeps the factors for `correct_mean`.
    """
    for j in range(len(body)):
        for i in range(6):
            w.gradient[j, i] = w.camera_gradient[j, i] if i < 3 else 0.0
            for k in range(6):
                inside = i < 3 and k < 3
                w.information[j, i, k] = w.camera_information[j, i, k] if inside else 0.0
    for m in range(len(ORDER) - 1, 0, -1):
        _eliminate(ORDER[m], cov, slope, w)
    root = ORDER[0]
    if invert(cov[root], w.a, w.b):
        for i in range(6):
            for k in range(6):
                w.a[i, k] += w.information[root, i, k]
        invert(w.a, w.inverse[root], w.b)
    else:
        w.inverse[root] = cov[root]
    cov[root] = w.inverse[root]
    for m in range(1, len(ORDER)):
        _marginalise(ORDER[m], cov, slope, w)
    _substitute(body, slope, w)


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _eliminate(j, cov, slope, w):
    """Make a joint's slope and inverse Hessian the posterior ones; tell its parent the rest.

    Of symmetric matrices only the lower three blocks are kept up.
    """
    q = PARENT[j]
    conditional, coupling, through, factor = w.a, w.b, w.c, w.d
    multiply(slope[j], cov[q], through)
    multiply_symmetric(through, slope[j], coupling)
    for i in range(6):
        for k in range(6):
            coupling[i, k] = cov[j, i, k] - coupling[i, k]
    if not invert(coupling, conditional, factor):  # cut the edge rather than believe it
        slope[j] = 0.0
        for i in range(6):
            for k in range(6):
                conditional[i, k] = 1.0 / cov[j, i, i] if i == k else 0.0
    multiply(conditional, slope[j], coupling)
    transposed_multiply_symmetric(slope[j], coupling, through)
    for i in range(3):
        w.gradient[j, i] += w.edge_gradient[j, i]
        w.gradient[q, i] -= w.edge_gradient[j, i]
        for k in range(3):
            coupling[i, k] += w.edge_information[j, i, k]
            conditional[i, k] += w.edge_information[j, i, k]
            through[i, k] += w.edge_information[j, i, k]
    for i in range(6):
        for k in range(6):
            conditional[i, k] += w.information[j, i, k]
            w.information[q, i, k] += through[i, k]
    invert(conditional, w.inverse[j], factor)
    multiply(w.inverse[j], coupling, slope[j])
    transposed_multiply_symmetric(coupling, slope[j], through)
    for i in range(6):
        for k in range(6):
            w.information[q, i, k] -= through[i, k]


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _marginalise(j, cov, slope, w):
    """C_j = inverse Hessian + B_j C_parent B_j'."""
    multiply(slope[j], cov[PARENT[j]], w.a)
    multiply_symmetric(w.a, slope[j], w.b)
    for i in range(3):
        for k in range(3):
            m, n = 3 + i, 3 + k
            cov[j, i, k] = w.inverse[j, i, k] + 0.5 * (w.b[i, k] + w.b[k, i])
            cov[j, m, k] = cov[j, k, m] = w.inverse[j, m, k] + w.b[m, k]
            cov[j, m, n] = w.inverse[j, m, n] + 0.5 * (w.b[m, n] + w.b[n, m])


@numba.njit(fastmath=_REORDER, **_JIT)
def _substitute(body, slope, w):
    """Add to the means what w.gradient asks for; it becomes the gradient after elimination."""
    for m in range(len(ORDER) - 1, 0, -1):
        j = ORDER[m]
        q = PARENT[j]
        for i in range(6):
            pull = 0.0
            for k in range(6):
                pull += slope[j, k, i] * w.gradient[j, k]
            w.gradient[q, i] += pull
    for m in range(len(ORDER)):
        j = ORDER[m]
        q = PARENT[j]
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += w.inverse[j, i, k] * w.gradient[j, k]
            w.step[j, i] = total
        if q >= 0:
            for i in range(6):
                total = 0.0
                for k in range(6):
                    total += slope[j, i, k] * w.step[q, k]
                w.step[j, i] += total
        for i in range(6):
            body[j, i] += w.step[j, i]


@numba.njit(**_JIT)
def correct_mean(body, cov, slope, seen, belief, share, w):
    """Lead the means from the mode towards the mean of the posterior (Laplace's next term).

    A camera's information on a position falls with the square of the depth, so that there is
    more room behind the mode than before it. With J the Jacobian of joint j's pixel, n the
    camera's optical axis (both in the world), d the depth and S_j the posterior covariance,
    mean - mode = H^-1 g with g_j = sum over cameras of n tr(S_j J'J / sigma^2) / d, H being the
    Hessian of all joints, whose factors `update_tree` left. `share` of it is applied.
    """
    P, _, sigma, ok = seen
    for j in range(len(ok)):
        for i in range(6):
            w.gradient[j, i] = 0.0
        for c in range(len(P)):
            if not (ok[j, c] and belief[j, c] > 0.0):
                continue
            p = P[c]
            u, v, depth = pixel_of(p, w.point[j, 0], w.point[j, 1], w.point[j, 2])
            if not depth > NEAREST_DEPTH_M:
                continue
            variance = 2.0 * pixel_spread(p, u, v, depth, cov[j])
            pull = share * belief[j, c] * variance / sigma[j, c] ** 2 / max(depth, _NEAREST_M)
            for i in range(3):
                w.gradient[j, i] += pull * p[2, i]
    _substitute(body, slope, w)
