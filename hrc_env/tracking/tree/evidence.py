"""Evidence: how likely each hypothesis about a worker is; prune and merge.

A hypothesis is weighed by Laplace's approximation. For a predicted Gaussian N(m, C), a posterior
that is Gaussian about its mode x with covariance S, and the robust likelihood L of the frame and
the bones,

log p(frame) = log L(x) - 1/2 (x - m)' C^-1 (x - m) + 1/2 log det S - 1/2 log det C,

and both determinants and the square are sums over the tree's joints, because with the part R_j =
C_j - B_j C_q B_j' that joint j does not share with its parent q, det C is the product of det R_j.
Terms that all hypotheses share are left out.

Bodies have the nose, the toes and the knees in front, and a body that is tracked mirrored in depth
has them behind. That weighs hypotheses as a potential of the pose that is believed now, not anew
with every frame: it does not add up.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, multiply, multiply_transposed

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]
_FEATURES = (
    (0, 1, 2, 0.12, 0.10),  # the nose before the middle of the shoulders
    (13, 11, 11, 0.12, 0.10), (14, 12, 12, 0.12, 0.10),  # toes before the ankles
    (9, 7, 11, 0.06, 0.12), (10, 8, 12, 0.06, 0.12),  # knees before the middle of the leg
    (3, 1, 5, -0.05, 0.12), (4, 2, 6, -0.05, 0.12),  # elbows behind the middle of the arm
)  # fmt: skip
"""A joint, two others, how far it is before their middle [m], and its deviation [m]: judgements
from common proportions, wide enough for turned heads and feet."""
_MOST = 4.5
"""No feature counts for more than three deviations."""
_CLOSE = 2.0
"""Hypotheses within so many posterior deviations are one."""


@kernel
def log_evidence(prior, tree, frame, s, w):
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
    likelihood = log_likelihood(body, frame, s.inlier_odds)
    likelihood += _bones(body, tree.bone_length, w.bone_variance) + _floor(body, s.floor_std_m)
    return likelihood - 0.5 * square + 0.5 * (log_det_after - log_det)


@kernel
def log_likelihood(body, frame, inlier_odds):
    """Log-likelihood of all pixels at positions (J, 6), relative to all being outliers."""
    P, z, sigma, ok = frame.P, frame.z, frame.sigma, frame.ok
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


@kernel
def anatomy(body):
    """Log-potential of a pose (J, 6): 0 at best; 0 if the heading is unknown."""
    cos, sin, known = heading(body)
    total = 0.0
    if known:
        for joint, one, other, ahead, std in _FEATURES:
            x = body[joint, 0] - 0.5 * (body[one, 0] + body[other, 0])
            y = body[joint, 1] - 0.5 * (body[one, 1] + body[other, 1])
            total -= min(0.5 * ((cos * x + sin * y - ahead) / std) ** 2, _MOST)
    return total


@kernel
def heading(points):
    """(cos, sin, known) of the body's heading, from shoulders and hips; (0, 0, False) unknown."""
    return find_heading(points, True, True)


@kernel
def find_heading(points, shoulders, hips):
    """The heading, from the shoulders or hips that are known."""
    x, y = 0.0, 0.0
    for left, known in ((1, shoulders), (7, hips)):
        if known:
            x += points[left, 0] - points[left + 1, 0]
            y += points[left, 1] - points[left + 1, 1]
    length = math.sqrt(x * x + y * y)
    if length < 0.05:
        return 0.0, 0.0, False
    return y / length, -x / length, True


@kernel
def weigh_pose(tree, several, gain, s):
    """Weigh a hypothesis by its evidence, and by its pose in the place of the last one."""
    pose_log_prior = s.anatomy_trust * anatomy(tree.body)
    if several:
        tree.log_weight += gain + pose_log_prior - tree.pose_log_prior
    tree.pose_log_prior = pose_log_prior


@kernel(makes_arrays=True)
def prune_and_merge(own, s, work):
    """Drop hypotheses that are lost or too light, and merge those that have come close."""
    for h in range(own.n_alive[0] - 1, -1, -1):
        if own.n_alive[0] > 1 and not own.trees[h].tracked:
            drop(own, h)
    normalise(own, s.log_least_weight)
    merge(own, _CLOSE**2, work)
    normalise(own, s.log_least_weight)


@kernel(makes_arrays=True)
def copy_slot(own, source, target):
    """Make slot `target` of a worker a copy of `source`."""
    own.trees[target] = own.trees[source]
    own.views[target] = own.views[source]
    own.noise[target] = own.noise[source]


@kernel(makes_arrays=True)
def exchange_slots(own, one, other):
    """Exchange two slots of a worker."""
    tree = own.trees[one : one + 1].copy()
    views, noise = own.views[one].copy(), own.noise[one].copy()
    copy_slot(own, other, one)
    own.trees[other] = tree[0]
    own.views[other], own.noise[other] = views, noise


@kernel(makes_arrays=True)
def drop(own, h):
    """Drop hypothesis h of a worker who has others; the last one takes its place."""
    last = own.n_alive[0] - 1
    if h != last:
        copy_slot(own, last, h)
    own.n_alive[0] = last


@kernel(makes_arrays=True)
def normalise(own, log_least):
    """Drop what is lighter than `log_least`; the weights of the others sum to one, best first."""
    trees = own.trees
    _share_out(trees, own.n_alive[0])
    for h in range(own.n_alive[0] - 1, -1, -1):
        if trees[h].log_weight < log_least and own.n_alive[0] > 1:
            drop(own, h)
    _share_out(trees, own.n_alive[0])
    best = 0
    for h in range(own.n_alive[0]):
        best = h if trees[h].log_weight > trees[best].log_weight else best
    if best > 0:
        exchange_slots(own, 0, best)


@kernel
def _share_out(trees, n):
    """Make the weights of the first n sum to one."""
    most, total = -np.inf, 0.0
    for h in range(n):
        most = max(most, trees[h].log_weight)
    for h in range(n):
        total += math.exp(trees[h].log_weight - most)
    for h in range(n):
        trees[h].log_weight -= most + math.log(total)


@kernel(makes_arrays=True)
def merge(own, least_distance, work):
    """Hypotheses that have come close are one: the heavier stays, with the weight of both.

    `least_distance` is squared, in posterior deviations.
    """
    trees, h = own.trees, 0
    while h < own.n_alive[0]:
        for k in range(own.n_alive[0] - 1, h, -1):
            if distance_between(trees[h], trees[k], work) < least_distance:
                both = np.logaddexp(trees[h].log_weight, trees[k].log_weight)
                if trees[k].log_weight > trees[h].log_weight:
                    exchange_slots(own, h, k)
                trees[h].log_weight = both
                drop(own, k)
        h += 1
