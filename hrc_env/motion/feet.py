"""Feet: locked to their footprint while loaded, rolling from heel to ball, swinging between.

Step k of a plan is taken by foot (first + k) % 2, leaves the floor at start + k * period and
lands a fixed swing later. A footprint is where the ankle's shadow falls: x, y, heading; and
the share of a full stride of the step that made it, which scales its roll and its height.
"""

import math

import numba

from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import ANKLE_Z, BALL_X, BALL_Z, HEEL_X
from hrc_env.motion.curves import cruise, hump, min_jerk
from hrc_env.typing import Floats

STRIKE_PITCH, PUSH_PITCH = -0.35, 1.0
"""Foot's pitch at heel strike and greatest at push-off of a full stride [rad]: about -20 and
57 degrees in level walking (Winter, Biomechanics and Motor Control of Human Movement)."""
FLAT_S, ROLL_SHARE = 0.10, 0.62
"""Heel strike to foot flat [s]; heel-off to toe-off as a share of the period of a step."""
RAMP_SHARE = 0.30
"""Share of a swing in which the foot gathers (and again loses) speed."""
LIFT_BASE_M, LIFT_STRIDE_M = 0.025, 0.045
"""Rise of the foot above its roll: of any step, and more with the stride [m]."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _roll(t: float, lift: float, land: float, period: float, stride: float) -> float:
    """Pitch of the foot that one step adds: up on the ball, through the air, down on the heel."""
    swing = land - lift
    up = min_jerk((t - lift + ROLL_SHARE * period) / (ROLL_SHARE * period + 0.12 * swing))
    if up == 0.0:
        return 0.0
    down = min_jerk((t - lift - 0.10 * swing) / (0.72 * swing))
    toe_up = min_jerk((t - lift - 0.50 * swing) / (0.50 * swing))
    flat = min_jerk((t - land) / FLAT_S)
    return stride * (PUSH_PITCH * (up - down) + STRIKE_PITCH * (toe_up - flat))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def foot(
    t: float, side: int, plan: Floats, prints: Floats, stance: Floats, size: Floats, q: Floats
) -> None:
    """Write the ankle columns of one side at time t into the control vector."""
    start, period, swing = plan[pl.STEP_START], plan[pl.STEP_PERIOD], plan[pl.STEP_SWING]
    count = int(plan[pl.STEP_COUNT])
    first = (side + int(plan[pl.STEP_FIRST])) % 2
    x, y, yaw, pitch, rise, flown = stance[side, 0], stance[side, 1], stance[side, 2], 0.0, 0.0, 0.0
    k = -1
    if count > first:
        k = math.floor((t - start) / period)
        k = k - 1 if (k - first) % 2 else k
        k = min(k, count - 1 if (count - 1 - first) % 2 == 0 else count - 2)
        following = max(k + 2, first)
        if following < count:
            lift = start + following * period
            pitch += _roll(t, lift, lift + swing, period, prints[following, 3])
    if k >= first:
        lift = start + k * period
        w = (t - lift) / swing
        if k >= 2 + first:
            x, y, yaw = prints[k - 2, 0], prints[k - 2, 1], prints[k - 2, 2]
        share, stride = cruise(w, RAMP_SHARE), prints[k, 3]
        x, y = x + share * (prints[k, 0] - x), y + share * (prints[k, 1] - y)
        yaw += min_jerk(w) * (prints[k, 2] - yaw)
        pitch += _roll(t, lift, lift + swing, period, stride)
        rise = (LIFT_BASE_M + LIFT_STRIDE_M * stride) * hump(w)
        flown = min_jerk(2.0 * w) if w < 1.0 else 0.0
    _place(x, y, yaw, pitch, rise, flown, c.ANKLE + 6 * side, size, q)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _place(
    x: float, y: float, yaw: float, pitch: float, rise: float, flown: float,
    at: int, size: Floats, q: Floats,
) -> None:  # fmt: skip
    """Turn the foot about the ball (heel up) or the heel (toes up), which stays on the floor."""
    if pitch > 0.0:
        pivot_x, pivot_z = size[BALL_X], size[BALL_Z]
        toes = pitch * flown
    else:
        pivot_x, pivot_z = size[HEEL_X], -size[ANKLE_Z]
        toes = pitch
    cos, sin = math.cos(pitch), math.sin(pitch)
    ahead = pivot_x - pivot_x * cos - pivot_z * sin
    above = pivot_z + pivot_x * sin - pivot_z * cos
    q[at] = x + math.cos(yaw) * ahead
    q[at + 1] = y + math.sin(yaw) * ahead
    q[at + 2] = size[ANKLE_Z] + above + rise
    q[at + 3], q[at + 4], q[at + 5] = yaw, pitch, toes
