"""The tree after a set of frames: one exact linear-Gaussian update, then the mean correction.

Cameras inform single joints, bones inform edges, so that the posterior is again a Gaussian on
the same tree: elimination from the leaves to the root and substitution back give its marginals
and slopes exactly.
"""

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread
from hrc_env.tracking.tree.gaussian import (
    LEAVES_FIRST,
    ORDER,
    PARENT,
    invert,
    multiply,
    multiply_transposed,
    transposed_multiply,
)

_NEAREST_M = 0.3
"""The mean correction knows no joint nearer to a lens than this."""
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def update_tree(tree, w):
    """Condition a tree on cameras and bones, in place.

    Covariances with the parents (edge) and what cameras and bones say (information and gradient)
    are in `w` as `tree.search.find_pose` leaves them. Keeps the factors for `shift_to_mean`.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in LEAVES_FIRST:
        _split(j, cov, slope, w)
        _load_measurements(j, w)
    for j in LEAVES_FIRST:
        _eliminate(j, slope, w)
    for j in ORDER:
        _marginalise(j, cov, slope, w)
    for j in range(len(body)):
        for i in range(3):
            w.gradient[j, i] = w.camera_gradient[j, i]
            w.gradient[j, 3 + i] = 0.0
    for j in range(len(body)):
        q = PARENT[j]
        if q >= 0:
            for i in range(3):
                w.gradient[j, i] += w.edge_gradient[j, i]
                w.gradient[q, i] -= w.edge_gradient[j, i]
    _substitute(body, slope, w)


@kernel
def _split(j, cov, slope, w):
    """What a joint knows by itself, given its parent."""
    own, rest, shared = w.own[j], w.a, w.b
    if PARENT[j] >= 0:
        multiply_transposed(w.edge[j], slope[j], shared)
    for i in range(6):
        for k in range(6):
            rest[i, k] = cov[j, i, k] - (shared[i, k] if PARENT[j] >= 0 else 0.0)
    if not invert(rest, own):  # cut the edge rather than believe it
        slope[j] = 0.0
        own[:] = 0.0
        for i in range(6):
            own[i, i] = 1.0 / cov[j, i, i]
    if PARENT[j] >= 0:
        multiply(own, slope[j], w.pull[j])
        transposed_multiply(slope[j], w.pull[j], w.back[j])


@kernel
def _load_measurements(j, w):
    """Cameras inform a joint; bones it, its parent and what ties the two."""
    w.known[j] = 0.0
    for i in range(3):
        for k in range(3):
            w.known[j, i, k] = w.camera_information[j, i, k]
            if PARENT[j] >= 0:
                bone = w.edge_information[j, i, k]
                w.own[j, i, k] += bone
                w.pull[j, i, k] += bone
                w.back[j, i, k] += bone


@kernel
def _eliminate(j, slope, w):
    """Posterior slope and inverse Hessian of a joint, and what it tells its parent."""
    hessian, message, q = w.a, w.b, PARENT[j]
    for i in range(6):
        for k in range(6):
            hessian[i, k] = w.own[j, i, k] + w.known[j, i, k]
    invert(hessian, w.inverse[j])
    if q >= 0:
        multiply(w.inverse[j], w.pull[j], slope[j])
        transposed_multiply(w.pull[j], slope[j], message)
        for i in range(6):
            for k in range(6):
                w.known[q, i, k] += w.back[j, i, k] - message[i, k]


@kernel
def _marginalise(j, cov, slope, w):
    """C_j = inverse Hessian + B_j C_parent B_j'."""
    q = PARENT[j]
    if q >= 0:
        multiply(slope[j], cov[q], w.a)
        multiply_transposed(w.a, slope[j], w.b)
    for i in range(6):
        for k in range(i + 1):
            shared = w.b[i, k] if q >= 0 else 0.0
            cov[j, i, k] = cov[j, k, i] = shared + w.inverse[j, i, k]


@kernel
def _substitute(body, slope, w):
    """Add to the means what w.gradient asks for, by the factors of the elimination."""
    for j in LEAVES_FIRST:
        q = PARENT[j]
        if q >= 0:
            for i in range(6):
                for k in range(6):
                    w.gradient[q, k] += slope[j, i, k] * w.gradient[j, i]
    for j in ORDER:
        q = PARENT[j]
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += w.inverse[j, i, k] * w.gradient[j, k]
                if q >= 0:
                    total += slope[j, i, k] * w.step[q, k]
            w.step[j, i] = total
            body[j, i] += total


@kernel
def shift_to_mean(tree, seen, share, w):
    """Lead the means from the mode towards the mean of the posterior (Laplace's next term).

    A camera's information falls with the square of the depth: there is more room behind the mode
    than before it. With J the Jacobian of joint j's pixel, n the camera's optical axis (both in the
    world), d the depth and S_j the posterior covariance, mean - mode = H^-1 g with g_j = sum over
    cameras of n tr(S_j J'J / sigma^2) / d, H being the Hessian of all joints, whose factors
    `update_tree` left. `share` of it is applied.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    P, sigma, ok, belief = seen.P, seen.sigma, seen.ok, seen.belief
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
