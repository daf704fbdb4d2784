"""Bone lengths: population values to begin with, learnt for each worker, kept as soft bounds.

A scalar Kalman filter per bone learns the length from joints that two cameras see; a
pseudo-measurement pulls the joints' distance to it. Two joints share the root's error, which
no bone can make smaller, so that only what they do not share is corrected.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT
from hrc_env.core.typing import Floats
from hrc_env.tracking.models.motion import relative_covariance, shared_covariance

POPULATION_SHARE = 0.10
"""Standard deviation of a bone's length over people, as a share of it."""
STIFFNESS_M: Floats = np.where(np.any(JOINT["nose"] == BONES, axis=-1), 0.05, 0.02)
"""How much a distance changes in one person [m]: the head turns on its neck."""
_CORRELATED_UPDATES = 10.0
_GATE_SIGMA, _LEAST_VARIANCE = 3.0, 1e-5
_ENDS = tuple((int(a), int(b)) for a, b in BONES)
_STIFFNESS = tuple(float(s) for s in STIFFNESS_M)


def population(shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Lengths [m] and their variances [m^2] of workers of whom nothing is known: (*shape, 16)."""
    length = np.tile(BONE_LENGTH_M, (*shape, 1))
    return length, (POPULATION_SHARE * length) ** 2


@kernel(makes_arrays=True)
def use_bones(body, cov, n_views, length, variance):
    """Learn lengths (16,) and correct body (J, 6), cov (J, 6, 6) by them, in place."""
    shared = shared_covariance(cov)
    share, work = np.empty(len(body)), np.empty((2, 6, 6))
    for j in range(len(body)):
        share[j] = relative_covariance(cov[j], shared, work[0], work[1])
    along, gain_a, gain_b = np.empty(3), np.empty(6), np.empty(6)
    for k in range(len(_ENDS)):
        a, b = _ENDS[k]
        now = _direction(body[a], body[b], along)
        spread = _gain(cov[a], share[a], shared, along, gain_a)
        spread += _gain(cov[b], share[b], shared, along, gain_b)
        if n_views[a] >= 2 and n_views[b] >= 2:
            total = -3.0 * (share[a] + share[b]) * shared[0]
            for i in range(3):
                total += cov[a, i, i] + cov[b, i, i]
            measured = now - 0.5 * (total - spread) / now  # errors across a bone lengthen it
            learn_length(measured, max(spread, _STIFFNESS[k] ** 2), k, length, variance)
        miss = length[k] - now
        innovation = spread + _STIFFNESS[k] ** 2 + variance[k]
        innovation = max(innovation, miss * miss / 16.0)  # no more than four standard deviations
        _correct(body[a], cov[a], gain_a, miss, innovation)
        _correct(body[b], cov[b], gain_b, -miss, innovation)


@kernel
def learn_length(measured, spread, k, length, variance):
    """Kalman update of length[k] by a measurement whose errors last for several updates."""
    noise = _CORRELATED_UPDATES * spread
    miss = measured - length[k]
    if miss * miss > _GATE_SIGMA**2 * (noise + variance[k]):
        return
    gain = variance[k] / (variance[k] + noise)
    length[k] += gain * miss
    variance[k] = max((1.0 - gain) * variance[k], _LEAST_VARIANCE)


@kernel
def _direction(a, b, out):
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    length = math.sqrt(x * x + y * y + z * z) + 1e-6
    out[0], out[1], out[2] = x / length, y / length, z / length
    return length


@kernel
def _gain(cov, share, shared, along, out):
    """Covariance of a joint's own part of (position, velocity) with its place along the bone.

    Fills `out` (6,) and returns the variance along the bone.
    """
    for i in range(3):
        p = cov[i, 0] * along[0] + cov[i, 1] * along[1] + cov[i, 2] * along[2]
        v = cov[3 + i, 0] * along[0] + cov[3 + i, 1] * along[1] + cov[3 + i, 2] * along[2]
        out[i] = p - share * shared[0] * along[i]
        out[3 + i] = v - share * shared[1] * along[i]
    return out[0] * along[0] + out[1] * along[1] + out[2] * along[2]


@kernel
def _correct(body, cov, gain, miss, innovation):
    for i in range(6):
        body[i] += gain[i] * miss / innovation
        for k in range(6):
            cov[i, k] -= gain[i] * gain[k] / innovation
