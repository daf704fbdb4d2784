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
from hrc_env.core.skeleton import JOINT, N_JOINTS
from hrc_env.core.typing import Bools, Floats
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
_OFFSET_TAU_S, _OFFSET_STD_M = 2.0, 0.06
_SHORT_M = 0.1
IS_LEG: Bools = np.arange(N_JOINTS) >= JOINT["left_knee"]
"""(J,) knees and below."""


@functools.lru_cache(maxsize=16)
def damped_joints(dt_s: float, damping: float, root_acceleration: float) -> tuple[Floats, Floats]:
    """Exact discretisation over `dt_s` [s] of damped joints, `damping` in (0, 1).

    F (J, 2, 2) moves (position, velocity) relative to the anchor; the process noise Q (J, 2, 2)
    keeps the stationary spreads and adds the whole body's acceleration [m^2/s^3].
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


@kernel
def set_axes(body, axes):
    """Fill axes (2, 3, 3): columns forward, left, up of the torso, and of a body that stands as it
    is turned; whether they are known."""
    cos, sin, known = heading(body)
    if not known:
        return False
    torso, level = axes[0], axes[1]
    level[:] = 0.0
    level[0, 0], level[1, 0], level[0, 1], level[1, 1], level[2, 2] = cos, sin, -sin, cos, 1.0
    length = 0.0
    for i in range(3):
        torso[i, 2] = body[1, i] + body[2, i] - body[7, i] - body[8, i]
        torso[i, 1] = body[1, i] - body[2, i] + body[7, i] - body[8, i]
        length += torso[i, 2] * torso[i, 2]
    length = math.sqrt(length)
    if length < _SHORT_M:
        return _same(level, torso)
    along = 0.0
    for i in range(3):
        torso[i, 2] /= length
        along += torso[i, 1] * torso[i, 2]
    length = 0.0
    for i in range(3):
        torso[i, 1] -= along * torso[i, 2]
        length += torso[i, 1] * torso[i, 1]
    length = math.sqrt(length)
    if length < _SHORT_M:
        return _same(level, torso)
    for i in range(3):
        torso[i, 1] /= length
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        torso[i, 0] = torso[a, 1] * torso[b, 2] - torso[b, 1] * torso[a, 2]
    return True


@kernel
def _same(level, torso):
    """Let the torso be upright."""
    for i in range(3):
        for k in range(3):
            torso[i, k] = level[i, k]
    return True


@kernel
def legs_follow(body, root, offset, axes):
    """Whether legs are where the torso's axes put them rather than below it."""
    difference = 0.0
    for j in range(9, 13):
        for i in range(3):
            along = below = body[j, i] - root[i]
            for k in range(3):
                along -= axes[0, i, k] * offset[j, k]
                below -= axes[1, i, k] * offset[j, k]
            difference += along * along - below * below
    return difference < 0.0


@kernel
def learn_offsets(tree, root, axes, legs, dt):
    """Joints that are known well teach their mean places (J, 3) on the body, in place."""
    body, cov, offset, offset_count = tree.body, tree.cov, tree.offset, tree.offset_count
    for j in range(len(body)):
        if cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2] > 3.0 * _OFFSET_STD_M**2:
            continue
        offset_count[j] += 1.0
        trust = max(1.0 / offset_count[j], dt / _OFFSET_TAU_S)
        own = axes[0] if legs or not IS_LEG[j] else axes[1]
        for k in range(3):
            there = 0.0
            for i in range(3):
                there += own[i, k] * (body[j, i] - root[i])
            offset[j, k] += trust * (there - offset[j, k])
