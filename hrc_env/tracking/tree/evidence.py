"""Weights of the hypotheses about a worker; pruning and merging.

A hypothesis is weighted by Laplace's approximation of its evidence. For a predicted Gaussian
N(m, C), a posterior that is Gaussian about its mode x with covariance S, and the robust likelihood
L of the frame and the bones,

log p(frame) = log L(x) - 1/2 (x - m)' C^-1 (x - m) + 1/2 log det S - 1/2 log det C.

The logarithms of both determinants and the quadratic form are sums over the tree's joints: with the
conditional covariance R_j = C_j - B_j C_q B_j' of joint j given its parent q, det C is the product
of all det R_j. Terms that all hypotheses share are omitted.

Bodies have nose, toes and knees in front, but a body that is tracked mirrored in depth has them
behind. Therefore the weight also contains the plausibility of the current pose, which replaces that
of the previous pose and does not accumulate over frames.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.gaussian import ORDER, PARENT, multiply, multiply_transposed
from hrc_env.tracking.tree.state import Tree, Work, WorkerHypotheses

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]


class Feature(NamedTuple):
    """Distribution of a joint's position along the heading, relative to two other joints."""

    joint: int
    """Index of the joint."""
    first: int
    """Index of the first of the two other joints."""
    second: int
    """Index of the second of the two other joints."""
    ahead_m: float
    """Mean distance by which the joint is in front of the mean position of the two others [m]."""
    std_m: float
    """Standard deviation of that distance [m]."""


_FEATURES = (
    Feature(0, 1, 2, 0.12, 0.10),  # the nose in front of the shoulders
    Feature(13, 11, 11, 0.12, 0.10),  # the toes in front of the ankles
    Feature(14, 12, 12, 0.12, 0.10),
    Feature(9, 7, 11, 0.06, 0.12),  # the knees in front of the legs
    Feature(10, 8, 12, 0.06, 0.12),
    Feature(3, 1, 5, -0.05, 0.12),  # the elbows behind the arms
    Feature(4, 2, 6, -0.05, 0.12),
)
"""Expected positions of nose, toes, knees and elbows, estimated from typical body proportions. The
standard deviations allow for turned heads and feet."""
_MOST = 4.5
"""Upper bound of the penalty of one feature [nat], which corresponds to three standard
deviations."""
_CLOSE = 2.0
"""Distance below which two hypotheses are merged, in posterior standard deviations."""


class TreeMeasure(NamedTuple):
    """Mahalanobis length of a change of the body under a Gaussian on the tree; its determinant."""

    squared: float
    """Squared Mahalanobis length of the change."""
    log_det: float
    """Logarithm of the determinant of the covariance of all joints."""


class Heading(NamedTuple):
    """The direction in which a body faces, projected onto the floor."""

    cos: float
    """Cosine of the angle from the world's x axis; 0 if the heading is unknown."""
    sin: float
    """Sine of the angle from the world's x axis; 0 if the heading is unknown."""
    is_known: bool
    """Whether the left and right joints are far enough apart, seen from above, for a heading."""


@kernel
def log_evidence(prior: Tree, tree: Tree, frame: Frame, settings: Settings, work: Work) -> float:
    """Return the log-evidence of one update, up to terms that all hypotheses share.

    Args:
        prior: the hypothesis before the update.
        tree: the hypothesis after `update.update_tree`, before the correction of the mean.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays with the bones' variances as measurements; `a`, `b`, `c`, `d` and `step`
            are overwritten.
    """
    body = tree.body
    for j in range(len(body)):
        for i in range(6):
            work.step[j, i] = body[j, i] - prior.body[j, i]
    before = measure_change(prior, work.step, work)
    for j in range(len(body)):
        for i in range(6):
            work.step[j, i] = 0.0
    after = measure_change(tree, work.step, work)
    likelihood = _log_likelihood_of_pixels(body, frame, settings.inlier_odds)
    bones = _log_likelihood_of_bones(body, tree.bone_length, work.bone_variance)
    likelihood += bones + _log_likelihood_of_floor(body, settings.floor_std_m)
    return likelihood - 0.5 * before.squared + 0.5 * (after.log_det - before.log_det)


@kernel
def _log_likelihood_of_pixels(body: Floats, frame: Frame, inlier_odds: float) -> float:
    """Return the log-likelihood of all pixels, relative to the case that all are outliers.

    An inlier is Gaussian about the projected joint, an outlier is uniform in the image. The result
    is the sum over joints and cameras of log(1 + odds exp(-|error|^2 / (2 sigma^2))), in which
    odds = inlier_odds / sigma^2 are the odds of an inlier without error.

    Args:
        body: (J, 6) positions [m] and velocities [m/s] of the joints in the world frame.
        frame: the measurements: `P` (C, 3, 4) projections, `z` (J, C, 2) pixels, `sigma` (J, C)
            their standard deviations [px], `ok` (J, C) whether there is a measurement.
        inlier_odds: odds that a measurement without residual is an inlier, times its pixel variance
            [px^2].
    """
    projections, pixels, sigma, ok = frame.P, frame.z, frame.sigma, frame.ok
    total = 0.0
    for j in range(len(ok)):
        for c in range(len(projections)):
            if not ok[j, c]:
                continue
            u, v, depth_m = pixel_of(projections[c], body[j, 0], body[j, 1], body[j, 2])
            if depth_m > NEAREST_DEPTH_M:  # otherwise it counts as an outlier
                precision = 1.0 / (sigma[j, c] * sigma[j, c])
                squared_error = (pixels[j, c, 0] - u) ** 2 + (pixels[j, c, 1] - v) ** 2
                odds = inlier_odds * precision
                total += math.log1p(odds * math.exp(-0.5 * squared_error * precision))
    return total


@kernel(makes_arrays=True)
def measure_change(tree: Tree, change: Floats, work: Work) -> TreeMeasure:
    """Return the Mahalanobis length of a change (J, 6) under a tree, and the tree's determinant.

    A conditional covariance that is not positive definite is replaced by its diagonal. The matrices
    `a`, `b`, `c` and `d` of `work` are overwritten.
    """
    cov, slope, squared, log_det = tree.cov, tree.slope, 0.0, 0.0
    for j in ORDER:
        q: int = PARENT[j]
        rest, own, factor = work.a, work.b, work.c
        rest[:] = cov[j]
        for i in range(6):
            own[0, i] = change[j, i]
        if q >= 0:
            multiply(slope[j], cov[q], work.d)
            multiply_transposed(work.d, slope[j], factor)
            for i in range(6):
                for k in range(6):
                    rest[i, k] -= factor[i, k]
                    own[0, i] -= slope[j, i, k] * change[q, k]
        joint = _measure_joint(rest, own[0], factor)
        squared += joint.squared
        log_det += joint.log_det
    return TreeMeasure(squared, log_det)


@kernel
def _measure_joint(a: Floats, x: Floats, factor: Floats) -> TreeMeasure:
    """Return x' a^-1 x and log det a by Cholesky factorisation.

    Args:
        a: (6, 6) symmetric matrix.
        x: (6,) vector, overwritten.
        factor: (6, 6) work array.
    """
    squared, product = 0.0, 1.0
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
        squared += x[i] * x[i]
        product *= rest
    return TreeMeasure(squared, math.log(product))


@kernel
def _measure_diagonal(a: Floats, x: Floats) -> TreeMeasure:
    """Return x' d^-1 x and log det d for the diagonal d of a matrix `a` (6, 6)."""
    squared, log_det = 0.0, 0.0
    for i in range(6):
        variance = max(a[i, i], 1e-12)
        squared += x[i] * x[i] / variance
        log_det += math.log(variance)
    return TreeMeasure(squared, log_det)


@kernel
def _log_likelihood_of_bones(body: Floats, length: Floats, variance: Floats) -> float:
    """Return the log-likelihood of the bones on the tree's edges and of the nose's second bone.

    Args:
        body: (J, 6) positions and velocities.
        length: (J,) lengths of the edges [m].
        variance: (J,) variances of the lengths [m^2].
    """
    total = _log_likelihood_of_bone(body, _NOSE, _RIGHT_SHOULDER, length[_NOSE], variance[_NOSE])
    for j in ORDER[1:]:
        total += _log_likelihood_of_bone(body, j, PARENT[j], length[j], variance[j])
    return total


@kernel
def _log_likelihood_of_bone(body: Floats, j: int, q: int, length: float, variance: float) -> float:
    """Return the log-likelihood of the distance between joints `j` and `q`."""
    x, y, z = body[j, 0] - body[q, 0], body[j, 1] - body[q, 1], body[j, 2] - body[q, 2]
    return -0.5 * (math.sqrt(x * x + y * y + z * z) - length) ** 2 / variance


@kernel
def _log_likelihood_of_floor(body: Floats, std_m: float) -> float:
    """Return the log-likelihood of the heights of joints that are below the floor."""
    total = 0.0
    for j in range(len(body)):
        total -= 0.5 * (min(body[j, 2], 0.0) / std_m) ** 2
    return total


@kernel
def distance_between(one: Tree, other: Tree, work: Work) -> float:
    """Return the squared Mahalanobis distance between two trees under the wider Gaussian."""
    least = np.inf
    for tree in (one, other):
        for j in range(len(one.body)):
            for i in range(6):
                work.step[j, i] = one.body[j, i] - other.body[j, i]
        least = min(least, measure_change(tree, work.step, work).squared)
    return least


@kernel
def score_pose(body: Floats) -> float:
    """Return the log-plausibility of a pose (J, 3+), at most 0; 0 if the heading is unknown."""
    heading = find_heading(body)
    total = 0.0
    if heading.is_known:
        for feature in _FEATURES:
            j, one, other = feature.joint, feature.first, feature.second
            x = body[j, 0] - 0.5 * (body[one, 0] + body[other, 0])
            y = body[j, 1] - 0.5 * (body[one, 1] + body[other, 1])
            ahead = heading.cos * x + heading.sin * y
            total -= min(0.5 * ((ahead - feature.ahead_m) / feature.std_m) ** 2, _MOST)
    return total


@kernel
def find_heading(points: Floats) -> Heading:
    """Return the heading of a body (J, 3+) from its shoulders and hips."""
    return find_heading_from(points, True, True)


@kernel
def find_heading_from(points: Floats, has_shoulders: bool, has_hips: bool) -> Heading:
    """Return the heading of a body from its shoulders, its hips or both.

    Args:
        points: (J, 3+) positions [m].
        has_shoulders: whether the shoulders are used.
        has_hips: whether the hips are used.
    """
    x, y = 0.0, 0.0
    for left, is_used in ((1, has_shoulders), (7, has_hips)):
        if is_used:
            x += points[left, 0] - points[left + 1, 0]
            y += points[left, 1] - points[left + 1, 1]
    length = math.sqrt(x * x + y * y)
    if length < 0.05:
        return Heading(0.0, 0.0, False)
    return Heading(y / length, -x / length, True)


@kernel
def weigh_pose(tree: Tree, has_rivals: bool, gain: float, settings: Settings) -> None:
    """Update the weight of a hypothesis by its evidence and by the plausibility of its pose.

    Args:
        tree: the updated hypothesis, changed in place.
        has_rivals: whether there are other hypotheses; a single one keeps its weight.
        gain: log-evidence of the frame, times `evidence_exponent`.
        settings: settings of the estimator.
    """
    pose_log_prior = settings.anatomy_exponent * score_pose(tree.body)
    if has_rivals:
        tree.log_weight += gain + pose_log_prior - tree.pose_log_prior
    tree.pose_log_prior = pose_log_prior


@kernel(makes_arrays=True)
def prune_and_merge(worker: WorkerHypotheses, settings: Settings, work: Work) -> None:
    """Drop hypotheses that are lost or have too little weight, and merge those that are close."""
    for h in range(worker.n_alive[0] - 1, -1, -1):
        if worker.n_alive[0] > 1 and not worker.trees[h].tracked:
            drop_hypothesis(worker, h)
    normalise_weights(worker, settings.log_min_weight)
    merge_close(worker, _CLOSE**2, work)
    normalise_weights(worker, settings.log_min_weight)


@kernel(makes_arrays=True)
def copy_slot(worker: WorkerHypotheses, source: int, target: int) -> None:
    """Copy the hypothesis in slot `source` of a worker to slot `target`."""
    worker.trees[target] = worker.trees[source]
    worker.views[target] = worker.views[source]
    worker.noise[target] = worker.noise[source]


@kernel(makes_arrays=True)
def exchange_slots(worker: WorkerHypotheses, one: int, other: int) -> None:
    """Swap the hypotheses in two slots of a worker."""
    tree = worker.trees[one : one + 1].copy()
    views, noise = worker.views[one].copy(), worker.noise[one].copy()
    copy_slot(worker, other, one)
    worker.trees[other] = tree[0]
    worker.views[other], worker.noise[other] = views, noise


@kernel(makes_arrays=True)
def drop_hypothesis(worker: WorkerHypotheses, h: int) -> None:
    """Drop hypothesis `h` about a worker and move the last hypothesis to its slot."""
    last = worker.n_alive[0] - 1
    if h != last:
        copy_slot(worker, last, h)
    worker.n_alive[0] = last


@kernel(makes_arrays=True)
def normalise_weights(worker: WorkerHypotheses, log_least: float) -> None:
    """Drop hypotheses below `log_least`, normalise the weights, and put the heaviest first."""
    trees = worker.trees
    _scale_weights(trees, worker.n_alive[0])
    for h in range(worker.n_alive[0] - 1, -1, -1):
        if trees[h].log_weight < log_least and worker.n_alive[0] > 1:
            drop_hypothesis(worker, h)
    _scale_weights(trees, worker.n_alive[0])
    best = 0
    for h in range(worker.n_alive[0]):
        best = h if trees[h].log_weight > trees[best].log_weight else best
    if best > 0:
        exchange_slots(worker, 0, best)


@kernel
def _scale_weights(trees: Records1[Tree], n: int) -> None:
    """Normalise the weights of the first `n` trees to the sum 1."""
    most, total = -np.inf, 0.0
    for h in range(n):
        most = max(most, trees[h].log_weight)
    for h in range(n):
        total += math.exp(trees[h].log_weight - most)
    for h in range(n):
        trees[h].log_weight -= most + math.log(total)


@kernel(makes_arrays=True)
def merge_close(worker: WorkerHypotheses, least_distance: float, work: Work) -> None:
    """Merge hypotheses that are close: the heavier one remains, with the sum of the weights.

    Args:
        worker: the hypotheses about one worker, changed in place.
        least_distance: squared Mahalanobis distance below which two hypotheses are merged.
        work: work arrays.
    """
    trees, h = worker.trees, 0
    while h < worker.n_alive[0]:
        for k in range(worker.n_alive[0] - 1, h, -1):
            if distance_between(trees[h], trees[k], work) < least_distance:
                both = np.logaddexp(trees[h].log_weight, trees[k].log_weight)
                if trees[k].log_weight > trees[h].log_weight:
                    exchange_slots(worker, h, k)
                trees[h].log_weight = both
                drop_hypothesis(worker, k)
        h += 1
