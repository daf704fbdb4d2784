"""Learning of the measurement noise and of bone lengths by each hypothesis.

The errors of a detector may be larger or smaller than it reports, and they may persist for about
half a second. For each joint and camera, a factor on the reported variance is learnt with which a
filter for white noise has consistent covariances (docs/tracking.md, "Measurement noise"):

factor = V (1 - L + L (1 + a r) / (1 - a r)).

V is the ratio of true to reported variance. To estimate it, each joint is triangulated from the
present frame alone, because the prediction already includes a camera's persistent error. The square
of a camera's residual is divided by its redundancy, the fraction that the triangulated point does
not absorb (Foerstner, Zeitschrift fuer Vermessungswesen 104, 1979). L is the fraction of the
variance that persists, estimated from the products of these residuals with those of the previous
update; r is the correlation of the persistent part over one update; a is the weight of the
prediction in the estimate of the joint, tr(posterior covariance, predicted covariance^-1) / 3.

Each bone length is estimated by a scalar Kalman filter, which is updated while two views see both
ends of the bone.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records2
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, inverse3
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.state import (
    EDGE_STIFFNESS_M,
    LAST_SQUARES,
    PRODUCTS,
    REDUNDANCY,
    SQUARES,
    TURN,
    Noise,
    Tree,
    Work,
)

_TURNS = 2
"""Number of groups of joints, of which only one is used for learning in each update. Successive
frames are similar; therefore this saves time without loss of information."""
_CAMERA_WEIGHT = 50.0
"""Weight of the reported noise as a prior for the camera's noise, in units of redundancy."""
_JOINT_WEIGHT = 100.0
"""Weight of the camera's noise as a prior for the noise of each joint, in units of redundancy."""
_SHARE_WEIGHT = 600.0
"""Weight of the prior for the fraction of persistent variance, as a number of squared residuals. It
is large because two views alone reveal the true fraction only slowly."""
_CHANCE = 0.07
"""Twice the standard deviation of the estimated fraction of persistent variance if no error
persists."""
_CORRELATED_UPDATES = 10.0
"""Number of updates for which the errors of a measured bone length persist."""
_GATE_SIGMA = 3.0
"""Number of standard deviations beyond which a measurement of a bone's length is ignored."""
_LEAST_VARIANCE = 1e-5
"""Minimum variance of a bone's length [m^2]."""
_OPEN_M = 0.5
"""Prior standard deviation of a joint about its mean in the triangulation [m]. It regularises
positions on a ray that two views share."""
_LEAST_BELIEF = 0.5
"""Inlier probability up to which a measurement is not used for learning."""
_REORDER = {"reassoc", "contract", "arcp", "nsz"}  # NaN and infinity keep their meaning


class NoiseModel(NamedTuple):
    """Constants for learning the factors applied to the variances that the detector reports."""

    keep: float
    """Fraction of a joint's statistics that is retained when the joint is used again."""
    correlation: float
    """Correlation r of persistent errors over one update."""
    share: float
    """Prior fraction L of the variance that persists."""
    min_factor: float
    """Lower bound of the learnt factors."""
    max_factor: float
    """Upper bound of the learnt factors; equal to the lower bound if nothing is learnt."""


def make_noise_model(config: ParticleConfig, ctrl_dt: float) -> NoiseModel:
    """Return the constants for updates every `ctrl_dt` [s]."""
    min_factor, max_factor = config.noise_bounds
    keep, correlation = (
        math.exp(-ctrl_dt / tau) for tau in (config.noise_tau_s, config.noise_correlation_s)
    )
    return NoiseModel(keep**_TURNS, correlation, config.noise_share, min_factor, max_factor)


@kernel
def learn_from_frame(
    frame: Frame, tree: Tree, noise: Records2[Noise], model: NoiseModel, work: Work
) -> None:
    """Learn bone lengths and factors on the variances from an updated hypothesis.

    Args:
        frame: the measurements, with `sigma` after `measurements.scale_sigma`.
        tree: the hypothesis; its lengths are changed in place.
        noise: (J, C) measurement noise of the hypothesis, changed in place.
        model: constants for learning the factors.
        work: work arrays with `n_views` and with `predicted`, the covariances before the update.
    """
    learn_lengths(tree, work.n_views)
    if model.min_factor == model.max_factor:
        return
    view, spread, persistence = frame.joint_views, work.spread, work.persistence
    turn = noise[0, 0].sums[TURN]
    noise[0, 0].sums[TURN] = (turn + 1.0) % _TURNS
    for j in range(len(tree.body)):
        n_views, persistence[j] = 0, -1.0
        if j % _TURNS == turn:
            n_views = _triangulate(frame, tree.body[j], j, view, spread)
        if n_views < 2:
            for c in range(noise.shape[1]):
                noise[j, c].last_residual[0] *= model.correlation
                noise[j, c].last_residual[1] *= model.correlation
        else:
            _add_residuals(view, spread, noise[j], model)
        if n_views > 0:
            weight = min(_find_prediction_weight(tree.cov[j], work.predicted[j], spread), 1.0)
            lasting = weight * model.correlation
            persistence[j] = (1.0 + lasting) / (1.0 - lasting)
    _set_factors(noise, persistence, model)


@kernel(fastmath=_REORDER)
def _triangulate(frame: Frame, body: Floats, j: int, view: Floats, spread: Floats) -> int:
    """Triangulate a joint from one set of frames alone, linearised about its mean.

    Args:
        frame: the measurements; only probable inliers are used.
        body: (6,) mean of the joint.
        j: index of the joint.
        view: (C, 8) rows of `_linearise`, filled in; the first residual of an unused camera is
            infinite.
        spread: (3, 4) covariance of the point [m^2] and, in the last column, its offset from the
            mean [m]; filled in.

    Returns:
        The number of cameras that are used.
    """
    h00 = h11 = h22 = 1.0 / _OPEN_M**2
    h01 = h02 = h12 = g0 = g1 = g2 = 0.0
    n_views = 0
    for c in range(len(frame.P)):
        view[c, 6] = np.inf
        if not (frame.ok[j, c] and frame.belief[j, c] > _LEAST_BELIEF):
            continue
        if not _linearise(frame.P[c], body, frame.z[j, c], frame.sigma[j, c], view[c]):
            continue
        n_views += 1
        a0, a1, a2, du = view[c, 0], view[c, 1], view[c, 2], view[c, 6]
        b0, b1, b2, dv = view[c, 3], view[c, 4], view[c, 5], view[c, 7]
        h00 += a0 * a0 + b0 * b0
        h11 += a1 * a1 + b1 * b1
        h22 += a2 * a2 + b2 * b2
        h01 += a0 * a1 + b0 * b1
        h02 += a0 * a2 + b0 * b2
        h12 += a1 * a2 + b1 * b2
        g0 += a0 * du + b0 * dv
        g1 += a1 * du + b1 * dv
        g2 += a2 * du + b2 * dv
    spread[0, 0], spread[1, 1], spread[2, 2] = h00, h11, h22
    spread[0, 1] = spread[1, 0] = h01
    spread[0, 2] = spread[2, 0] = h02
    spread[1, 2] = spread[2, 1] = h12
    inverse3(spread, spread)
    for i in range(3):
        spread[i, 3] = spread[i, 0] * g0 + spread[i, 1] * g1 + spread[i, 2] * g2
    return n_views


@kernel(fastmath=_REORDER)
def _linearise(p: Floats, body: Floats, pixel: Floats, sigma: float, out: Floats) -> bool:
    """Compute the Jacobians and the residuals of a joint's pixel, over its standard deviation.

    Args:
        p: (3, 4) projection.
        body: (3+,) position of the joint [m].
        pixel: (2,) measurement [px].
        sigma: standard deviation of the measurement [px].
        out: (8,) Jacobians of u (3) and of v (3) [1/m] and the two residuals, filled in.

    Returns:
        Whether the joint is in front of the camera.
    """
    x, y, z = body[0], body[1], body[2]
    depth = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3]
    if not depth > NEAREST_DEPTH_M:
        return False
    near = 1.0 / (depth * sigma)  # divided by sigma; the only division
    nearer, inverse = near * sigma, near * depth
    u = (p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3]) * nearer
    v = (p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3]) * nearer
    for i in range(3):
        out[i], out[3 + i] = (p[0, i] - u * p[2, i]) * near, (p[1, i] - v * p[2, i]) * near
    out[6], out[7] = (pixel[0] - u) * inverse, (pixel[1] - v) * inverse
    return True


@kernel(fastmath=_REORDER)
def _add_residuals(view: Floats, spread: Floats, noise: Records1[Noise], model: NoiseModel) -> None:
    """Add one joint's residuals about its triangulated point to the statistics of its noise.

    The stored previous residuals decay as persistent errors do. Therefore the ratio of the products
    to the squares estimates the same fraction after any time.

    Args:
        view: (C, 8) rows of the cameras, from `_triangulate`.
        spread: (3, 4) covariance and offset of the point, from `_triangulate`.
        noise: (C,) the joint's noise in each camera, changed in place.
        model: constants for learning the factors.
    """
    s00, s11, s22 = spread[0, 0], spread[1, 1], spread[2, 2]
    s01, s02, s12 = 2.0 * spread[0, 1], 2.0 * spread[0, 2], 2.0 * spread[1, 2]
    x, y, z = spread[0, 3], spread[1, 3], spread[2, 3]
    for c in range(len(view)):
        if not view[c, 6] < np.inf:
            noise[c].last_residual[0] *= model.correlation
            noise[c].last_residual[1] *= model.correlation
            continue
        a0, a1, a2 = view[c, 0], view[c, 1], view[c, 2]
        b0, b1, b2 = view[c, 3], view[c, 4], view[c, 5]
        scale = math.sqrt(noise[c].factor)  # to reported standard deviations
        du = scale * (view[c, 6] - a0 * x - a1 * y - a2 * z)
        dv = scale * (view[c, 7] - b0 * x - b1 * y - b2 * z)
        absorbed = s00 * (a0 * a0 + b0 * b0) + s11 * (a1 * a1 + b1 * b1)
        absorbed += s22 * (a2 * a2 + b2 * b2) + s01 * (a0 * a1 + b0 * b1)
        absorbed += s02 * (a0 * a2 + b0 * b2) + s12 * (a1 * a2 + b1 * b2)
        u, v = noise[c].last_residual[0], noise[c].last_residual[1]
        noise[c].sums[SQUARES] = model.keep * noise[c].sums[SQUARES] + du * du + dv * dv
        noise[c].sums[REDUNDANCY] = model.keep * noise[c].sums[REDUNDANCY] + 2.0 - absorbed
        noise[c].sums[PRODUCTS] = model.keep * noise[c].sums[PRODUCTS] + du * u + dv * v
        noise[c].sums[LAST_SQUARES] = model.keep * noise[c].sums[LAST_SQUARES] + u * u + v * v
        noise[c].last_residual[0], noise[c].last_residual[1] = du, dv


@kernel(fastmath=_REORDER)
def _find_prediction_weight(cov: Floats, predicted: Floats, work: Floats) -> float:
    """Return the weight of the prediction in a position, tr(cov predicted^-1) / 3.

    Args:
        cov: (3+, 3+) covariance after the update [m^2].
        predicted: (3, 3) covariance before the update [m^2].
        work: (3, 3+) work array.
    """
    inverse3(predicted, work)
    own = cov[0, 0] * work[0, 0] + cov[1, 1] * work[1, 1] + cov[2, 2] * work[2, 2]
    cross = cov[0, 1] * work[0, 1] + cov[0, 2] * work[0, 2] + cov[1, 2] * work[1, 2]
    return (own + 2.0 * cross) / 3.0


@kernel(fastmath=_REORDER)
def _set_factors(noise: Records2[Noise], persistence: Floats, model: NoiseModel) -> None:
    """Compute the factors on the variances from the statistics.

    Args:
        noise: (J, C) the noise, changed in place.
        persistence: (J,) (1 + a r) / (1 - a r) of the module's formula; if it is negative, the
            factors of the joint do not change.
        model: constants for learning the factors.
    """
    for c in range(noise.shape[1]):
        squares = redundancy = _CAMERA_WEIGHT
        products, unchanged = model.correlation * model.share * _SHARE_WEIGHT, _SHARE_WEIGHT
        for j in range(len(noise)):
            squares += noise[j, c].sums[SQUARES]
            redundancy += noise[j, c].sums[REDUNDANCY]
            products += noise[j, c].sums[PRODUCTS]
            unchanged += noise[j, c].sums[LAST_SQUARES]
        of_camera = squares / redundancy
        share = products / (unchanged * model.correlation)
        share = min(max((share - _CHANCE) / (1.0 - _CHANCE), 0.0), 1.0)
        for j in range(len(noise)):
            if persistence[j] > 0.0:
                own = noise[j, c].sums[SQUARES] + _JOINT_WEIGHT * of_camera
                variance = own / (noise[j, c].sums[REDUNDANCY] + _JOINT_WEIGHT)
                factor = variance * (1.0 - share + share * persistence[j])
                noise[j, c].factor = min(max(factor, model.min_factor), model.max_factor)


@kernel
def learn_lengths(tree: Tree, n_views: Ints) -> None:
    """Learn the lengths of bones of which both ends are measured by at least two cameras.

    Each length is estimated by a Kalman filter. Its measurement noise is multiplied by the number
    of updates for which errors persist.

    Args:
        tree: the updated hypothesis, changed in place.
        n_views: (J,) number of cameras that measured each joint.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    length, variance = tree.bone_length, tree.bone_variance
    for j in range(len(body)):
        q: int = PARENT[j]
        if q < 0 or n_views[j] < 2 or n_views[q] < 2:
            continue
        x, y, z = body[j, 0] - body[q, 0], body[j, 1] - body[q, 1], body[j, 2] - body[q, 2]
        apart = math.sqrt(x * x + y * y + z * z) + 1e-6
        along = (x / apart, y / apart, z / apart)
        spread, total = 0.0, 0.0
        for i in range(3):
            for k in range(3):
                edge = 0.0
                for h in range(6):
                    edge += slope[j, i, h] * cov[q, h, k]
                difference = cov[j, i, k] + cov[q, i, k] - 2.0 * edge
                spread += along[i] * along[k] * difference
                total += difference if i == k else 0.0
        measured = apart - 0.5 * (total - spread) / apart  # lateral errors bias the length
        noise = _CORRELATED_UPDATES * max(spread, EDGE_STIFFNESS_M[j] ** 2)
        miss = measured - length[j]
        if miss * miss > _GATE_SIGMA**2 * (noise + variance[j]):
            continue
        gain = variance[j] / (variance[j] + noise)
        length[j] += gain * miss
        variance[j] = max((1.0 - gain) * variance[j], _LEAST_VARIANCE)
