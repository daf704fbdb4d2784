"""Feet: locked to their footprint while loaded, rolling from heel to ball, swinging between.

Step k is taken by foot (first + k) % 2, leaves the floor at start + k * period and lands a fixed
swing later. Steps may be gone back: then their time runs backwards.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z, BALL_X, BALL_Z, HEEL_X
from hrc_env.motion.curves import about, cruise, hump, min_jerk, placed, shift
from hrc_env.motion.state import Pair, Worker

STRIKE_PITCH, PUSH_PITCH = -0.35, 1.0
"""Foot's pitch at heel strike and push-off of a full stride [rad] (Winter, Biomechanics)."""
FLAT_S, ROLL_SHARE = 0.10, 0.62
"""Heel strike to foot flat [s]; heel-off to toe-off as a share of the period of a step."""
RAMP_SHARE, LIFT_BASE_M, LIFT_STRIDE_M = 0.29, 0.025, 0.045
"""Share of a swing in which the foot gathers (and again loses) speed; its rise above its roll: of
any step, and more with the stride [m]."""
RUN_RAMP_SHARE, KICK_M, KICK_PITCH = 0.36, 0.20, 1.3
"""The same of runners; how far their heels come up behind; their push-off beside a walker's;
judgement."""


@kernel
def _roll(t: float, lift: float, land: float, period: float, stride: float) -> Pair:
    """Pitch that one step adds: heel up round the ball, then toes up round the heel."""
    swing = land - lift
    rising = min(ROLL_SHARE * period, lift)  # the first step's heel stays down until time 0
    up = min_jerk((t - lift + rising) / (rising + 0.12 * swing))
    if up == 0.0:
        return 0.0, 0.0
    down = min_jerk((t - lift - 0.10 * swing) / (0.72 * swing))
    toes_up = min_jerk((t - lift - 0.50 * swing) / (0.50 * swing))
    flat = min_jerk((t - land) / FLAT_S)
    return stride * PUSH_PITCH * (up - down), stride * STRIKE_PITCH * (toes_up - flat)


@kernel
def step_time(t: float, me: Worker) -> float:
    """The time that counts for feet: it turns round when the steps are gone back."""
    undo = me.undo_at
    return t if undo <= 0.0 or t < undo else 2.0 * undo - t


@kernel
def foot(t: float, side: int, prints: Floats, stance: Floats, me: Worker) -> None:
    """Write the ankle columns of one side at time t into the control vector."""
    q = me.q
    x, y, yaw, ground = stance[side, 0], stance[side, 1], stance[side, 2], stance[side, 4]
    heel_up, toes_up, rise, flown = 0.0, 0.0, 0.0, 0.0
    count = me.step_count
    if count > 0:
        start, period, swing = me.step_start, me.step_period, me.step_swing
        first = (side + me.step_first) % 2
        k = math.floor((t - start) / period)  # the foot's latest step that has left the floor
        k = min(k - (k - first) % 2, count - 1 - (count - 1 - first) % 2)
        coming = max(k + 2, first)
        if coming < count:
            lift, stride = start + coming * period, prints[coming, 3]
            land = lift + swing + me.flight_s * stride
            heel_up, toes_up = _roll(t, lift, land, period, stride)
        if k >= first:
            lift = start + k * period
            aloft = swing + me.flight_s * prints[k, 3]
            w = (t - lift) / aloft
            if k >= 2 + first:
                x, y, yaw = prints[k - 2, 0], prints[k - 2, 1], prints[k - 2, 2]
                ground = prints[k - 2, 4]
            gathers = RUN_RAMP_SHARE if me.flight_s > 0.0 else RAMP_SHARE
            share, stride = cruise(w, gathers), prints[k, 3]
            x, y = x + share * (prints[k, 0] - x), y + share * (prints[k, 1] - y)
            yaw += min_jerk(w) * (prints[k, 2] - yaw)
            heel, toes = _roll(t, lift, lift + aloft, period, stride)
            heel_up, toes_up = heel_up + heel, toes_up + toes
            step_up = prints[k, 4] - ground
            if step_up != 0.0:  # up early, before the foot comes over the tread; down late
                ground += step_up * min_jerk((w if step_up > 0.0 else w - 0.4) / 0.6)
            rise = (LIFT_BASE_M + LIFT_STRIDE_M * stride) * hump(w)
            flown = min_jerk(2.0 * w) if w < 1.0 else 0.0
            if me.flight_s > 0.0 and w < 1.0:
                rise += KICK_M * stride * hump(w * (1.7 - 0.7 * w))
    if me.flight_s > 0.0:
        heel_up *= KICK_PITCH
    at = c.ANKLE + 6 * side
    ahead, above = about(heel_up, me.size[BALL_X], me.size[BALL_Z])
    behind, below = about(toes_up, me.size[HEEL_X], -me.size[ANKLE_Z])
    q[at], q[at + 1] = placed(x, y, yaw, ahead + behind, 0.0)
    q[at + 2] = me.size[ANKLE_Z] + above + below + rise + ground
    q[at + 3], q[at + 4], q[at + 5] = yaw, heel_up + toes_up, heel_up * flown + toes_up


@kernel
def feet(t: float, me: Worker) -> None:
    for side in range(2):
        foot(t, side, me.prints, me.stance, me)


@kernel
def raise_heel(side: int, pitch: float, me: Worker) -> None:
    """Pitch a standing foot about its ball, where the toes stay (negative: about its heel)."""
    q = me.q
    at = c.ANKLE + 6 * side
    ahead, above = about(pitch, me.size[BALL_X], me.size[BALL_Z])
    if pitch < 0.0:
        ahead, above = about(pitch, me.size[HEEL_X], -me.size[ANKLE_Z])
    shift(q, at, q[at + 3], ahead, 0.0)
    q[at + 2] += above
    q[at + 4] += pitch
