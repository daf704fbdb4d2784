"""How well a hypothesis explained a set of frames: Laplace's approximation on the tree.

For a predicted Gaussian N(m, C), a posterior that is Gaussian about its mode x with covariance
S, and the robust likelihood L of the frames and the bones,

    log p(frames) = log L(x) - 1/2 (x - m)' C^-1 (x - m) + 1/2 log det S - 1/2 log det C,

and both determinants and the square are sums over the tree's joints, because with the part
R_j = C_j - B_j C_q B_j' that joint j does not share with its parent q, det C is the product of
det R_j. What all hypotheses have in common is left out.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, multiply, multiply_transposed

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]


@kernel
def log_evidence(prior, tree, seen, s, w):
    """Log of the evidence of one update, up to what all hypotheses share.

    `prior` is the tree before the update, `tree` what `tree.update.update_tree` made of it, before
    the mean correction; `w` has the variances of the bones as measurements, its a, b, c, d and step
    are used.
    """
    body = tree.body
    for j in range(len(body)):
        for i in range(6):
            w.step[j, i] = body[j, i] - prior.body[j, i]
    square, log_det = tree_measure(prior, w.step, w)
    for j in range(len(body)):
        for i in range(6):
            w.step[j, i] = 0.0
    _, log_det_after = tree_measure(tree, w.step, w)
    likelihood = log_likelihood(body, seen, s.inlier_odds)
    likelihood += _bones(body, tree.bone_length, w.bone_variance) + _floor(body, s.floor_std_m)
    return likelihood - 0.5 * square + 0.5 * (log_det_after - log_det)


@kernel
def log_likelihood(body, seen, inlier_odds):
    """Log-likelihood of all pixels at positions (J, 6), relative to all being outliers."""
    P, z, sigma, ok = seen.P, seen.z, seen.sigma, seen.ok
    total = 0.0
    for j in range(len(ok)):
        for c in range(len(P)):
            if not ok[j, c]:
                continue
            u, v, depth = pixel_of(P[c], body[j, 0], body[j, 1], body[j, 2])
            if depth > NEAREST_DEPTH_M:
                near = 1.0 / (sigma[j, c] * sigma[j, c])
                miss = (z[j, c, 0] - u) ** 2 + (z[j, c, 1] - v) ** 2
                total += math.log1p(inlier_odds * near * math.exp(-0.5 * miss * near))
    return total


@kernel(makes_arrays=True)
def tree_measure(tree, change, w):
    """Squared Mahalanobis length of `change` (J, 6) under a tree, and log det of the tree.

    A conditional covariance that is not positive definite counts by its diagonal.
    """
    cov, slope, square, log_det = tree.cov, tree.slope, 0.0, 0.0
    for m in range(len(ORDER)):
        j = ORDER[m]
        q = PARENT[j]
        rest, own, factor = w.a, w.b, w.c
        rest[:] = cov[j]
        for i in range(6):
            own[0, i] = change[j, i]
        if q >= 0:
            multiply(slope[j], cov[q], w.d)
            multiply_transposed(w.d, slope[j], factor)
            for i in range(6):
                for k in range(6):
                    rest[i, k] -= factor[i, k]
                    own[0, i] -= slope[j, i, k] * change[q, k]
        s, d = _measure(rest, own[0], factor)
        square += s
        log_det += d
    return square, log_det


@kernel
def _measure(a, x, factor):
    """x' a^-1 x and log det a for a symmetric 6x6 matrix; x (6,) is used up."""
    square, product = 0.0, 1.0
    for i in range(6):
        for k in range(i):
            rest = a[i, k]
            for m in range(k):
                rest -= factor[i, m] * factor[k, m]
            factor[i, k] = rest * factor[k, k]
            x[i] -= factor[i, k] * x[k]
        rest = a[i, i]
        for m in range(i):
            rest -= factor[i, m] * factor[i, m]
        if not rest > 1e-13:
            return _measure_diagonal(a, x)
        factor[i, i] = 1.0 / math.sqrt(rest)
        x[i] *= factor[i, i]
        square += x[i] * x[i]
        product *= rest
    return square, math.log(product)


@kernel
def _measure_diagonal(a, x):
    square, log_det = 0.0, 0.0
    for i in range(6):
        variance = max(a[i, i], 1e-12)
        square += x[i] * x[i] / variance
        log_det += math.log(variance)
    return square, log_det


@kernel
def _bones(body, length, variance):
    """Log-likelihood of the bones' lengths, those of the tree's edges and the nose's second."""
    total = _bone(body, _NOSE, _RIGHT_SHOULDER, length[_NOSE], variance[_NOSE])
    for m in range(1, len(ORDER)):
        j = ORDER[m]
        total += _bone(body, j, PARENT[j], length[j], variance[j])
    return total


@kernel
def _floor(body, std_m):
    """Log-likelihood of the floor: of what is below it."""
    total = 0.0
    for j in range(len(body)):
        total -= 0.5 * (min(body[j, 2], 0.0) / std_m) ** 2
    return total


@kernel
def _bone(body, j, q, length, variance):
    x, y, z = body[j, 0] - body[q, 0], body[j, 1] - body[q, 1], body[j, 2] - body[q, 2]
    return -0.5 * (math.sqrt(x * x + y * y + z * z) - length) ** 2 / variance


@kernel
def distance_between(one, other, w):
    """Squared Mahalanobis distance of two trees under the wider of them."""
    least = np.inf
    for tree in (one, other):
        for j in range(len(one.body)):
            for i in range(6):
                w.step[j, i] = one.body[j, i] - other.body[j, i]
        square, _ = tree_measure(tree, w.step, w)
        least = min(least, square)
    return least
