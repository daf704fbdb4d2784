"""Learning: what a hypothesis keeps of a frame for later ones, true noise and lengths of bones.

True errors of a detector may be larger or smaller than it reports, and they may persist for about
half a second. Per worker and camera a factor on the reported variance is learnt with which a
filter for white noise is honest (docs/tracking.md, "Measurement noise"):

factor = V (1 - L + L (1 + a r) / (1 - a r)).

V is true over reported variance: each joint is triangulated from this frame alone, without the
prediction, in which a camera's persistent error is already believed; the square of a camera's
residual is divided by how much of it the point could not absorb, its redundancy (Foerstner,
Zeitschrift fuer Vermessungswesen 104, 1979). L is the share of the variance that persists, from
the products of these residuals with those of the update before; r the correlation of that part
over one update; a the weight of the prediction in the estimate, the mean over joints of
tr(posterior covariance, predicted covariance^-1) / 3.

The length of each bone has a scalar Kalman filter, which learns while two views see both ends.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, inverse3
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.state import EDGE_STIFFNESS_M

_TURNS = 2
"""Every update looks at every so-manieth joint, which costs less and tells as much: neighbouring
frames are alike."""
_CAMERA_WEIGHT = 50.0
"""The reported noise counts as so much redundancy, so that the first frames decide little."""
_JOINT_WEIGHT = 100.0
"""A camera's noise counts as so much redundancy of each joint's."""
_SHARE_WEIGHT = 600.0
"""The share that persists, as told, counts as so many squared residuals: two views alone show
it late."""
_CHANCE = 0.07
"""Twice the standard deviation of the share that persists where nothing does."""
_CORRELATED_UPDATES, _GATE_SIGMA, _LEAST_VARIANCE = 10.0, 3.0, 1e-5
"""Of the lengths of bones: updates for which errors last, gate, least variance [m^2]."""
_OPEN_M = 0.5
"""Two views triangulate no joint along a ray that they share: it stays within this [m]."""
_LEAST_BELIEF = 0.5
_REORDER = {"reassoc", "contract", "arcp", "nsz"}  # NaN and infinity keep their meaning


class NoiseModel(NamedTuple):
    """What the kernels need to learn the factors."""

    keep: float
    """Share of what was learnt of a joint that its next turn leaves."""
    persists: float
    """Correlation r over one update of errors that persist."""
    share: float
    """L before anything was learnt."""
    least: float
    most: float
    """Bounds of the factor on the variance; equal: nothing is learnt."""


def noise_model(config: ParticleConfig, ctrl_dt: float) -> NoiseModel:
    """The constants for updates that are `ctrl_dt` [s] apart."""
    least, most = config.noise_bounds
    keep, persists = (
        math.exp(-ctrl_dt / tau) for tau in (config.noise_tau_s, config.noise_persists_s)
    )
    return NoiseModel(keep**_TURNS, persists, config.noise_share, least, most)


@kernel
def learn_from_frame(frame, tree, learnt, model, w):
    """Learn lengths of bones and factors on the noise from a tree that was updated, in place."""
    learn_lengths(tree, w.n_views)
    learn_noise(frame, tree, learnt, model, w)


@kernel
def learn_noise(frame, tree, learnt, model, w):
    """Learn the factors of `learnt` (J, C), records of `tree.state.NOISE`, from one update, in
    place.

    `frame` has sigma as scaled by `scale_sigma`, w.predicted (J, 3, 3) the covariances before the
    update.
    """
    if model.least == model.most:
        return
    mean, cov, predicted = tree.body, tree.cov, w.predicted
    view, spread, grows = frame.looks, w.spread, w.grows
    turn = learnt[0, 0].sums[4]
    learnt[0, 0].sums[4] = (turn + 1.0) % _TURNS
    for j in range(len(mean)):
        n_views, grows[j] = 0, -1.0
        if j % _TURNS == turn:
            n_views = _look(frame, mean[j], j, view, spread)
        if n_views < 2:
            for c in range(learnt.shape[1]):
                learnt[j, c].last[0] *= model.persists
                learnt[j, c].last[1] *= model.persists
        else:
            _compare(view, spread, learnt[j], model)
        if n_views > 0:
            follows = min(_remembered(cov[j], predicted[j], spread), 1.0) * model.persists
            grows[j] = (1.0 + follows) / (1.0 - follows)
    _set_factors(learnt, grows, model)


@kernel(fastmath=_REORDER)
def _look(frame, body, j, view, spread):
    """Triangulate joint j linearly about `body`, from the cameras that are believed; how many.

    Fills view (C, 8) by `_linearise` (a residual of infinity: the camera does not count) and spread
    (3, 4): covariance of the point, and in the last column where it is from `body`.
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
def _linearise(p, body, pixel, sigma, out):
    """Jacobians of u and of v and the residuals of both, all over sigma, into out (8,), if it
    sees."""
    x, y, z = body[0], body[1], body[2]
    depth = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3]
    if not depth > NEAREST_DEPTH_M:
        return False
    near = 1.0 / (depth * sigma)  # over sigma; the only division
    nearer, inverse = near * sigma, near * depth
    u = (p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3]) * nearer
    v = (p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3]) * nearer
    for i in range(3):
        out[i], out[3 + i] = (p[0, i] - u * p[2, i]) * near, (p[1, i] - v * p[2, i]) * near
    out[6], out[7] = (pixel[0] - u) * inverse, (pixel[1] - v) * inverse
    return True


@kernel(fastmath=_REORDER)
def _compare(view, spread, learnt, model):
    """Add one joint's residuals about its triangulated point to its sums (C, 5), which fade.

    What is left of the last residuals are those, faded as errors that persist would: products
    with them over their squares tell the same however long ago they were.
    """
    keep, persists = model.keep, model.persists
    s00, s11, s22 = spread[0, 0], spread[1, 1], spread[2, 2]
    s01, s02, s12 = 2.0 * spread[0, 1], 2.0 * spread[0, 2], 2.0 * spread[1, 2]
    x, y, z = spread[0, 3], spread[1, 3], spread[2, 3]
    for c in range(len(view)):
        if not view[c, 6] < np.inf:
            learnt[c].last[0] *= persists
            learnt[c].last[1] *= persists
            continue
        a0, a1, a2 = view[c, 0], view[c, 1], view[c, 2]
        b0, b1, b2 = view[c, 3], view[c, 4], view[c, 5]
        scale = math.sqrt(learnt[c].factor)  # to reported standard deviations
        du = scale * (view[c, 6] - a0 * x - a1 * y - a2 * z)
        dv = scale * (view[c, 7] - b0 * x - b1 * y - b2 * z)
        absorbed = s00 * (a0 * a0 + b0 * b0) + s11 * (a1 * a1 + b1 * b1)
        absorbed += s22 * (a2 * a2 + b2 * b2) + s01 * (a0 * a1 + b0 * b1)
        absorbed += s02 * (a0 * a2 + b0 * b2) + s12 * (a1 * a2 + b1 * b2)
        u, v = learnt[c].last[0], learnt[c].last[1]
        learnt[c].sums[0] = keep * learnt[c].sums[0] + du * du + dv * dv
        learnt[c].sums[1] = keep * learnt[c].sums[1] + 2.0 - absorbed
        learnt[c].sums[2] = keep * learnt[c].sums[2] + du * u + dv * v
        learnt[c].sums[3] = keep * learnt[c].sums[3] + u * u + v * v
        learnt[c].last[0], learnt[c].last[1] = du, dv


@kernel(fastmath=_REORDER)
def _remembered(cov, predicted, work):
    """tr(cov predicted^-1) / 3: how much of a position is the prediction's; `work` (3, 3+)."""
    inverse3(predicted, work)
    own = cov[0, 0] * work[0, 0] + cov[1, 1] * work[1, 1] + cov[2, 2] * work[2, 2]
    cross = cov[0, 1] * work[0, 1] + cov[0, 2] * work[0, 2] + cov[1, 2] * work[1, 2]
    return (own + 2.0 * cross) / 3.0


@kernel(fastmath=_REORDER)
def _set_factors(learnt, grows, model):
    """The factors (J, C) that the sums ask for.

    `grows` (J,) is the last bracket of the module's formula; less than 0: the factor stays.
    """
    for c in range(learnt.shape[1]):
        squares = redundancy = _CAMERA_WEIGHT
        products, unchanged = model.persists * model.share * _SHARE_WEIGHT, _SHARE_WEIGHT
        for j in range(len(learnt)):
            squares += learnt[j, c].sums[0]
            redundancy += learnt[j, c].sums[1]
            products += learnt[j, c].sums[2]
            unchanged += learnt[j, c].sums[3]
        of_camera = squares / redundancy
        share = products / (unchanged * model.persists)
        share = min(max((share - _CHANCE) / (1.0 - _CHANCE), 0.0), 1.0)
        for j in range(len(learnt)):
            if grows[j] > 0.0:
                own = learnt[j, c].sums[0] + _JOINT_WEIGHT * of_camera
                variance = own / (learnt[j, c].sums[1] + _JOINT_WEIGHT)
                wanted = variance * (1.0 - share + share * grows[j])
                learnt[j, c].factor = min(max(wanted, model.least), model.most)


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
