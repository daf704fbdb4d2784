"""Running: short contacts and flights between them, bent arms, a lean with every change of speed.

Steps are those of `walk.plan_steps` with a longer time in the air. Cadence and contact at 2.5 to
3.5 m/s: about 165 to 175 steps a minute and 0.25 s (Cavanagh & Kram 1989,
doi:10.1249/00005768-198908000-00020).
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import LEG
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.posture import hang, stand
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import LEG_M, SWING_SHARE, plan_steps, plan_way, root, speed

STEP_S, STEP_FASTER_S, USUAL_M_S = 0.355, 0.03, 3.0
"""Time of a step at USUAL_M_S, and so much shorter for each m/s more [s]."""
ALOFT_SHARE, ALOFT_FAST = 1.46, 0.08
"""Time in the air in times of a step at USUAL_M_S, and for each m/s more; a foot goes off slowly,
so that this is about 0.06 s more than between two contacts."""
RUN_M_S2, CORNER_M_S2, BRAKED_M = 3.0, 2.5, 0.3
"""Mean rate of gathering speed and losing it, most sideways in corners [m/s^2]; a way is so much
longer than both take [m]; judgement."""
BOB_M, LOWER_M = 0.036, 0.085
"""Half the pelvis's rise and fall, how much lower than standing it is [m]; 7 to 9 cm of rise."""
LEAN_RAD, LEAN_G = 0.12, 0.75
"""Lean at a steady run [rad], and more with the acceleration as a share of gravity's."""
ARM_RAD, ELBOW_RAD, ELBOW_SWING = 0.52, 1.45, 0.35
"""Swing of the upper arm to each side, bent elbow [rad], and the elbow's share of the swing."""
NECK = 0.7
"""Share of the lean that the neck takes back."""


@kernel
def fastest(wished_m_s: float, me: Worker) -> float:
    """How fast one can run along the path that is laid [m/s]: it may be too short or too bent."""
    straight = math.sqrt(RUN_M_S2 * max(me.length - BRAKED_M, 0.0))
    return min(wished_m_s, straight, math.sqrt(CORNER_M_S2 / max(me.sharpest, 1e-6)))


@kernel
def plan_run(end_yaw: float, speed_m_s: float, me: Worker) -> float:
    """Plan to run along the path that is laid; returns how long it takes [s]."""
    me.follow = 1.0
    plan_way(speed_m_s, speed_m_s / RUN_M_S2, end_yaw, me)
    scale = math.sqrt(me.size[LEG] / LEG_M)
    faster = me.top_m_s / scale - USUAL_M_S
    me.step_period = scale * (STEP_S - STEP_FASTER_S * faster)
    me.step_swing = SWING_SHARE * me.step_period
    me.flight_s = (ALOFT_SHARE + ALOFT_FAST * faster - SWING_SHARE) * me.step_period
    return plan_steps(0, me)


@kernel
def run(t: float, clock_s: float, me: Worker) -> None:
    """The control vector of a runner but for the feet."""
    q = me.q
    x, y, yaw = root(t, me)
    stand(x, y, yaw, clock_s, me)
    pace = speed(t, me)
    share = min(pace / me.top_m_s, 1.0)
    period, last = me.step_period, me.step_count - 1.0
    phase = (t - me.step_start) / period
    lead = 1.0 - 2.0 * me.step_first
    aloft = (me.step_swing + me.flight_s * share) / period
    going = min_jerk((phase + 0.4) / 0.8) - min_jerk((phase - last) / 0.9)
    left_ahead = lead * math.cos(math.pi * (phase - aloft)) * share
    over = -lead * math.cos(math.pi * (phase - 0.5 * aloft)) * going
    flying = math.cos(2.0 * math.pi * (phase - 0.5 * (1.0 + aloft)))
    gained = (speed(t + 0.06, me) - speed(t - 0.06, me)) / 0.12
    lean = LEAN_RAD * share + LEAN_G * gained / 9.81
    shift(q, c.ROOT_X, yaw, 0.0, 0.012 * over)
    q[c.PELVIS_Z] += BOB_M * share * flying - LOWER_M * share - 0.02 * going * (1.0 - share)
    q[c.PELVIS_PITCH] += 0.5 * lean
    q[c.SPINE_FLEX] += 0.5 * lean
    q[c.HEAD_PITCH] -= NECK * lean
    q[c.PELVIS_ROLL] += 0.04 * over
    q[c.SPINE_SIDE] -= 0.05 * over
    q[c.PELVIS_YAW] -= 0.10 * left_ahead
    q[c.SPINE_TWIST] += 0.28 * left_ahead
    _, _, ahead = root(t + 0.4, me)
    q[c.HEAD_YAW] += 0.8 * min(max(ahead - yaw, -0.8), 0.8) - 0.18 * left_ahead
    bent = min_jerk(t / 0.6) * min_jerk((me.depart + me.travel_s + 0.3 - t) / 0.8)
    for side in range(2):
        swing = -(1.0 - 2.0 * side) * ARM_RAD * left_ahead
        hang(side, -0.12 * bent + swing, 0.38 + (ELBOW_RAD - 0.38) * bent + ELBOW_SWING * swing, me)
