"""How a body moves when nobody looks: damped joints on a root that drifts.

Each joint is a second-order Gauss-Markov process (a damped oscillator driven by white noise)
about an anchor: the root (middle of the torso) plus the joint's mean place on the body,
turned as the body is (`axes`). All joints share the root's error: what the torso does not know, no
joint knows, and damping towards the anchor must not make it smaller.
"""

import functools

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.tracking.models.axes import part_of

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
def learn_offsets(tree, root, axes, dt):
    """Joints that are known well teach their mean places (J, 3) on the body, in place.

    `axes` are as `axes.set_axes` fills them, `root` begins with the middle of the torso.
    """
    body, cov, offset, offset_count = tree.body, tree.cov, tree.offset, tree.offset_count
    for j in range(len(body)):
        if cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2] > 3.0 * _OFFSET_STD_M**2:
            continue
        offset_count[j] += 1.0
        trust = max(1.0 / offset_count[j], dt / _OFFSET_TAU_S)
        own = axes[part_of(j)]
        for k in range(3):
            there = 0.0
            for i in range(3):
                there += own[i, k] * (body[j, i] - root[i])
            offset[j, k] += trust * (there - offset[j, k])
