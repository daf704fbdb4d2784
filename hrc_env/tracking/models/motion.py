"""How a body moves when nobody looks: damped joints on a root that drifts.

Each joint is a second-order Gauss-Markov process (a damped oscillator driven by white noise)
about an anchor: the root (middle of the torso) plus the joint's mean place on the body,
turned as the body is. All joints share the root's error: what the torso does not know, no
joint knows, and damping towards the anchor must not make it smaller.
"""

import functools
import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import TORSO
from hrc_env.core.typing import Floats
from hrc_env.tracking.models.acquisition import heading

SPREAD_M: Floats = np.array(
    [.06, .04, .04, .12, .12, .20, .20, .04, .04, .12, .12, .20, .20, .22, .22]
)  # fmt: skip
"""Standard deviation of a joint about its mean place on the body [m]; a judgement."""
SPEED_M_S: Floats = np.array(
    [.2, .2, .2, .5, .5, .95, .95, .2, .2, .5, .5, .9, .9, .95, .95]
)  # fmt: skip
"""Standard deviation of its speed relative to the body [m/s]; a judgement: those of people at
work are near it, and twice as much makes every prediction twice as uncertain as it is wrong."""
STANDING_COUNT = 5.0
"""Updates that the standing body's offsets are worth before any was learnt."""
_SHARES = (0.9, 0.6, 0.3, 0.1)
_OFFSET_TAU_S, _OFFSET_STD_M = 2.0, 0.06
_TORSO = tuple(int(j) for j in TORSO)


@functools.lru_cache(maxsize=16)
def damped_joints(dt_s: float, damping: float, root_acceleration: float) -> tuple[Floats, Floats]:
    """Exact discretisation over `dt_s`.

    Args:
        dt_s: time step [s].
        damping: ratio in (0, 1).
        root_acceleration: spectral density of the whole body's acceleration [m^2/s^3].

    Returns:
        F (J, 2, 2), which moves (position, velocity) relative to the anchor, and Q (J, 2, 2),
        the process noise: what keeps the stationary spreads, plus the body's acceleration.
    """
    frequency = SPEED_M_S / SPREAD_M
    damped = frequency * np.sqrt(1 - damping**2)
    decay, cos, sin = (
        np.exp(-damping * frequency * dt_s),
        np.cos(damped * dt_s),
        np.sin(damped * dt_s),
    )
    slope = damping * frequency / damped * sin
    F = np.empty((len(frequency), 2, 2))
    F[:, 0, 0], F[:, 0, 1] = decay * (cos + slope), decay * sin / damped
    F[:, 1, 0], F[:, 1, 1] = -decay * frequency**2 / damped * sin, decay * (cos - slope)
    stationary = np.zeros_like(F)
    stationary[:, 0, 0], stationary[:, 1, 1] = SPREAD_M**2, SPEED_M_S**2
    Q = stationary - F @ stationary @ F.swapaxes(1, 2)
    Q += whole_body_noise(dt_s, root_acceleration)
    return F, Q


def whole_body_noise(dt_s: float, root_acceleration: float) -> Floats:
    """(2, 2) noise of position and velocity that all joints share over `dt_s` [s]."""
    return root_acceleration * np.array([[dt_s**3 / 3, dt_s**2 / 2], [dt_s**2 / 2, dt_s]])


@kernel(makes_arrays=True)
def predict_body(body, cov, offset, offset_count, F, Q, dt):
    """Move one worker by dt: body (J, 6), cov (J, 6, 6), in place; learns the offsets (J, 3)."""
    root = root_of(body, cov)
    cos, sin, known = heading(body)
    if known:
        learn_offsets(body, cov, root, cos, sin, dt, offset, offset_count)
    shared = shared_covariance(cov)
    relative, factor = np.empty((6, 6)), np.empty((6, 6))
    for j in range(len(body)):
        forward, left = offset[j, 0], offset[j, 1]
        anchor = (
            root[0] + cos * forward - sin * left,
            root[1] + sin * forward + cos * left,
            root[2] + offset[j, 2],
        )
        for i in range(3):
            p, v = body[j, i] - anchor[i], body[j, 3 + i] - root[3 + i]
            body[j, i] = anchor[i] + dt * root[3 + i] + F[j, 0, 0] * p + F[j, 0, 1] * v
            body[j, 3 + i] = root[3 + i] + F[j, 1, 0] * p + F[j, 1, 1] * v
        share = relative_covariance(cov[j], shared, relative, factor)
        _move_covariance(relative, F[j], cov[j])
        _add_isotropic(cov[j], Q[j, 0, 0], Q[j, 0, 1], Q[j, 1, 1])
        pp, pv, vv = share * shared[0], share * shared[1], share * shared[2]
        _add_isotropic(cov[j], pp + dt * (2.0 * pv + dt * vv), pv + dt * vv, vv)


@kernel(makes_arrays=True)
def root_of(body, cov):
    """(6,) the torso's position and velocity, its joints weighted by what is known of them."""
    root, weight_p, weight_v = np.zeros(6), 0.0, 0.0
    for j in _TORSO:
        p = 1.0 / (cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2])
        v = 1.0 / (cov[j, 3, 3] + cov[j, 4, 4] + cov[j, 5, 5])
        weight_p += p
        weight_v += v
        for i in range(3):
            root[i] += p * body[j, i]
            root[3 + i] += v * body[j, 3 + i]
    root[:3] /= weight_p
    root[3:] /= weight_v
    return root


@kernel
def learn_offsets(body, cov, root, cos, sin, dt, offset, offset_count):
    """Joints that are known well teach their mean places (J, 3) on the body, in place."""
    for j in range(len(body)):
        if cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2] > 3.0 * _OFFSET_STD_M**2:
            continue
        x, y, up = body[j, 0] - root[0], body[j, 1] - root[1], body[j, 2] - root[2]
        offset_count[j] += 1.0
        trust = max(1.0 / offset_count[j], dt / _OFFSET_TAU_S)
        offset[j, 0] += trust * (cos * x + sin * y - offset[j, 0])
        offset[j, 1] += trust * (cos * y - sin * x - offset[j, 1])
        offset[j, 2] += trust * (up - offset[j, 2])


@kernel
def shared_covariance(cov):
    """Variances (position, cross, velocity) per axis of the torso joint known best."""
    best, least = 0, np.inf
    for j in _TORSO:
        spread = cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2]
        if spread < least:
            best, least = j, spread
    cross = cov[best, 0, 3] + cov[best, 1, 4] + cov[best, 2, 5]
    return least / 3.0, cross / 3.0, (cov[best, 3, 3] + cov[best, 4, 4] + cov[best, 5, 5]) / 3.0


@kernel(makes_arrays=True)
def relative_covariance(cov, shared, out, factor):
    """`cov` (6, 6) less the largest share of the root's that leaves it positive definite.

    Fills `out` (6, 6) and returns the share; `factor` (6, 6) is scratch.
    """
    for share in _SHARES:
        out[:] = cov
        _add_isotropic(out, -share * shared[0], -share * shared[1], -share * shared[2])
        if is_positive_definite(out, factor):
            return share
    out[:] = cov
    return 0.0


@kernel
def is_positive_definite(a, factor):
    """Whether a symmetric matrix has a Cholesky factor; `factor` takes its lower part."""
    for i in range(len(a)):
        for k in range(i + 1):
            rest = a[i, k]
            for m in range(k):
                rest -= factor[i, m] * factor[k, m]
            if i > k:
                factor[i, k] = rest / factor[k, k]
            elif rest > 1e-12:
                factor[i, i] = math.sqrt(rest)
            else:
                return False
    return True


@kernel
def _move_covariance(cov, f, out):
    """out = (f x I3) cov (f x I3)' for cov (6, 6) of (position, velocity)."""
    f00, f01, f10, f11 = f[0, 0], f[0, 1], f[1, 0], f[1, 1]
    for i in range(3):
        for k in range(3):
            pp, pv, vp, vv = cov[i, k], cov[i, 3 + k], cov[3 + i, k], cov[3 + i, 3 + k]
            p_pp, p_pv = f00 * pp + f01 * vp, f00 * pv + f01 * vv
            v_pp, v_pv = f10 * pp + f11 * vp, f10 * pv + f11 * vv
            out[i, k], out[i, 3 + k] = p_pp * f00 + p_pv * f01, p_pp * f10 + p_pv * f11
            out[3 + i, k], out[3 + i, 3 + k] = v_pp * f00 + v_pv * f01, v_pp * f10 + v_pv * f11


@kernel
def _add_isotropic(cov, pp, pv, vv):
    for i in range(3):
        cov[i, i] += pp
        cov[i, 3 + i] += pv
        cov[3 + i, i] += pv
        cov[3 + i, 3 + i] += vv
