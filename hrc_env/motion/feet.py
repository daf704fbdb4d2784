"""Motion of the feet, which roll from heel to ball at each footprint, and swing between them.

Step k is taken by foot (first + k) % 2, which leaves the floor at start + k * period and lands a
fixed swing time later. Steps are retraced by reversing their time.
"""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z, BALL_X, BALL_Z, HEEL_X
from hrc_env.motion.curves import cruise, hump, min_jerk, move_point, pivot_foot, shift
from hrc_env.motion.state import Worker

STRIKE_PITCH = -0.35
"""Pitch of the foot at heel strike of a full stride [rad] (Winter, Biomechanics)."""
PUSH_PITCH = 1.0
"""Pitch of the foot at push-off of a full stride [rad] (Winter, Biomechanics)."""
FLAT_S = 0.10
"""Time from heel strike to a flat foot [s]."""
ROLL_SHARE = 0.62
"""Time from heel-off to toe-off, as a fraction of the period of a step."""
RAMP_SHARE = 0.29
"""Fraction of a swing during which the foot accelerates, and equally decelerates."""
LIFT_BASE_M = 0.025
"""Rise of the foot in each step, in addition to the rise due to its roll [m]."""
LIFT_STRIDE_M = 0.045
"""Additional rise of the foot in a full stride [m]."""
RUN_RAMP_SHARE = 0.36
"""Value that replaces `RAMP_SHARE` in a run. The value is an estimate."""
KICK_M = 0.20
"""Additional rise of a runner's heel behind the body [m]. The value is an estimate."""
KICK_PITCH = 1.3
"""Ratio of the push-off pitch in a run to that in a walk. The value is an estimate."""


class FootPitch(NamedTuple):
    """Pitch of a foot due to its steps."""

    heel_up: float
    """Pitch about the ball with the heel up [rad]."""
    toes_up: float
    """Pitch about the heel with the toes up [rad]; negative or zero."""


@kernel
def _pitch_foot(t: float, lift: float, land: float, period: float, stride: float) -> FootPitch:
    """Compute the pitch due to one step: first heel up about the ball, then toes up about the heel.

    Args:
        t: time [s].
        lift: time of lift-off [s].
        land: time of landing [s].
        period: period of a step [s].
        stride: length of the step as a fraction of a full stride.
    """
    swing = land - lift
    rising = min(ROLL_SHARE * period, lift)  # the first step's heel stays down until time 0
    up = min_jerk((t - lift + rising) / (rising + 0.12 * swing))
    if up == 0.0:
        return FootPitch(0.0, 0.0)
    down = min_jerk((t - lift - 0.10 * swing) / (0.72 * swing))
    toes_up = min_jerk((t - lift - 0.50 * swing) / (0.50 * swing))
    flat = min_jerk((t - land) / FLAT_S)
    heel_up = stride * PUSH_PITCH * (up - down)
    return FootPitch(heel_up, stride * STRIKE_PITCH * (toes_up - flat))


@kernel
def to_step_time(t: float, worker: Worker) -> float:
    """Convert t to the time of the steps, which runs backwards while steps are retraced [s]."""
    undo = worker.undo_at
    return t if undo <= 0.0 or t < undo else 2.0 * undo - t


@kernel
def place_foot(t: float, side: int, footprints: Floats, stance: Floats, worker: Worker) -> None:
    """Compute the six ankle columns of one foot in the control vector at time t.

    Args:
        t: time of the steps, from `to_step_time` [s].
        side: 0 left, 1 right.
        footprints: footprints (N, 5) of the steps.
        stance: footprints (2, 5) at the beginning.
        worker: record with the plan of the steps; its `q` is written.
    """
    q = worker.q
    x, y, yaw, ground = stance[side, 0], stance[side, 1], stance[side, 2], stance[side, 4]
    heel_up, toes_up, rise, flown = 0.0, 0.0, 0.0, 0.0
    count = worker.step_count
    if count > 0:
        start, period, swing = worker.step_start, worker.step_period, worker.step_swing
        first = (side + worker.step_first) % 2
        k = math.floor((t - start) / period)  # the foot's latest step that has left the floor
        k = min(k - (k - first) % 2, count - 1 - (count - 1 - first) % 2)
        coming = max(k + 2, first)
        if coming < count:
            lift, stride = start + coming * period, footprints[coming, 3]
            land = lift + swing + worker.flight_s * stride
            heel_up, toes_up = _pitch_foot(t, lift, land, period, stride)
        if k >= first:
            lift = start + k * period
            aloft = swing + worker.flight_s * footprints[k, 3]
            u = (t - lift) / aloft
            if k >= 2 + first:
                x, y, yaw = footprints[k - 2, 0], footprints[k - 2, 1], footprints[k - 2, 2]
                ground = footprints[k - 2, 4]
            gathers = RUN_RAMP_SHARE if worker.flight_s > 0.0 else RAMP_SHARE
            share, stride = cruise(u, gathers), footprints[k, 3]
            x, y = x + share * (footprints[k, 0] - x), y + share * (footprints[k, 1] - y)
            yaw += min_jerk(u) * (footprints[k, 2] - yaw)
            heel, toes = _pitch_foot(t, lift, lift + aloft, period, stride)
            heel_up, toes_up = heel_up + heel, toes_up + toes
            step_up = footprints[k, 4] - ground
            if step_up != 0.0:  # rise early, before the foot is above the tread; descend late
                ground += step_up * min_jerk((u if step_up > 0.0 else u - 0.4) / 0.6)
            rise = (LIFT_BASE_M + LIFT_STRIDE_M * stride) * hump(u)
            flown = min_jerk(2.0 * u) if u < 1.0 else 0.0
            if worker.flight_s > 0.0 and u < 1.0:
                rise += KICK_M * stride * hump(u * (1.7 - 0.7 * u))
    if worker.flight_s > 0.0:
        heel_up *= KICK_PITCH
    at = c.ANKLE + 6 * side
    ahead, above = pivot_foot(heel_up, worker.lengths[BALL_X], worker.lengths[BALL_Z])
    behind, below = pivot_foot(toes_up, worker.lengths[HEEL_X], -worker.lengths[ANKLE_Z])
    q[at], q[at + 1] = move_point(x, y, yaw, ahead + behind, 0.0)
    q[at + 2] = worker.lengths[ANKLE_Z] + above + below + rise + ground
    q[at + 3], q[at + 4], q[at + 5] = yaw, heel_up + toes_up, heel_up * flown + toes_up


@kernel
def place_feet(t: float, worker: Worker) -> None:
    """Compute the ankle columns of both feet in the control vector at time t."""
    for side in range(2):
        place_foot(t, side, worker.footprints, worker.stance, worker)


@kernel
def raise_heel(side: int, pitch: float, worker: Worker) -> None:
    """Pitch a standing foot about its ball, or about its heel if the pitch is negative.

    Args:
        side: 0 left, 1 right.
        pitch: additional pitch, positive with the heel up [rad].
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    at = c.ANKLE + 6 * side
    ahead, above = pivot_foot(pitch, worker.lengths[BALL_X], worker.lengths[BALL_Z])
    if pitch < 0.0:
        ahead, above = pivot_foot(pitch, worker.lengths[HEEL_X], -worker.lengths[ANKLE_Z])
    shift(q, at, q[at + 3], ahead, 0.0)
    q[at + 2] += above
    q[at + 4] += pitch
