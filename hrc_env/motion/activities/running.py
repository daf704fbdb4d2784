"""Running, with flights between short contacts, bent arms, and a lean due to acceleration.

Steps are planned by `walk.plan_steps`, with a longer swing. At 2.5 to 3.5 m/s, the cadence is about
165 to 175 steps/min and the contact time 0.25 s (Cavanagh & Kram 1989,
doi:10.1249/00005768-198908000-00020).
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import LEG
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.posture import hang, stand
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import LEG_M, SWING_SHARE, locate_root, measure_speed, plan_steps, plan_way

STEP_S = 0.355
"""Period of a step at `USUAL_M_S` [s]."""
STEP_FASTER_S = 0.03
"""Decrease of the period for each m/s above `USUAL_M_S` [s]."""
USUAL_M_S = 3.0
"""Speed for which `STEP_S` and `ALOFT_SHARE` hold [m/s]."""
ALOFT_SHARE = 1.46
"""Swing time at `USUAL_M_S`, in periods of a step.

It exceeds the time between two contacts by about 0.06 s because a foot lifts off slowly.
"""
ALOFT_FAST = 0.08
"""Increase of `ALOFT_SHARE` for each m/s above `USUAL_M_S`."""
RUN_M_S2 = 3.0
"""Mean acceleration at the beginning and mean deceleration at the end [m/s^2].

The value is an estimate.
"""
CORNER_M_S2 = 2.5
"""Maximum lateral acceleration in corners [m/s^2]. The value is an estimate."""
BRAKED_M = 0.3
"""Length of a path in excess of that for acceleration and deceleration [m].

The value is an estimate.
"""
BOB_M = 0.036
"""Amplitude of the pelvis's vertical motion [m]; measured values are 7 to 9 cm peak to peak."""
LOWER_M = 0.085
"""Lowering of the pelvis from its standing height [m]."""
LEAN_RAD = 0.12
"""Lean of the trunk at constant speed [rad]."""
LEAN_G = 0.75
"""Additional lean of the trunk at an acceleration of 9.81 m/s^2 [rad]."""
ARM_RAD = 0.52
"""Amplitude of the upper arm's swing [rad]."""
ELBOW_RAD = 1.45
"""Bend of the elbow [rad]."""
ELBOW_SWING = 0.35
"""Additional bend of the elbow, as a fraction of the arm swing."""
NECK = 0.7
"""Fraction of the trunk's lean that the neck compensates."""


@kernel
def limit_run_speed(wanted_m_s: float, worker: Worker) -> float:
    """Return the desired speed [m/s], limited by the length and curvature of the worker's path."""
    straight = math.sqrt(RUN_M_S2 * max(worker.length - BRAKED_M, 0.0))
    return min(wanted_m_s, straight, math.sqrt(CORNER_M_S2 / max(worker.sharpest, 1e-6)))


@kernel
def plan_run(end_yaw: float, speed_m_s: float, worker: Worker) -> float:
    """Plan to run along the worker's path.

    Args:
        end_yaw: heading at the end [rad].
        speed_m_s: top speed [m/s].
        worker: record with the path; the plan is written into it.

    Returns:
        The duration [s].
    """
    worker.follow = 1.0
    plan_way(speed_m_s, speed_m_s / RUN_M_S2, end_yaw, worker)
    scale = math.sqrt(worker.lengths[LEG] / LEG_M)
    faster = worker.top_m_s / scale - USUAL_M_S
    worker.step_period = scale * (STEP_S - STEP_FASTER_S * faster)
    worker.step_swing = SWING_SHARE * worker.step_period
    worker.flight_s = (ALOFT_SHARE + ALOFT_FAST * faster - SWING_SHARE) * worker.step_period
    return plan_steps(0, worker)


@kernel
def run(t: float, clock_s: float, worker: Worker) -> None:
    """Compute the control vector of a runner, except for the feet.

    Args:
        t: time since the run began [s].
        clock_s: time since the episode began [s].
        worker: record with the plan; its `q` is written.
    """
    q = worker.q
    x, y, yaw = locate_root(t, worker)
    stand(x, y, yaw, clock_s, worker)
    pace = measure_speed(t, worker)
    share = min(pace / worker.top_m_s, 1.0)
    period, last = worker.step_period, worker.step_count - 1.0
    phase = (t - worker.step_start) / period
    lead = 1.0 - 2.0 * worker.step_first
    aloft = (worker.step_swing + worker.flight_s * share) / period
    going = min_jerk((phase + 0.4) / 0.8) - min_jerk((phase - last) / 0.9)
    left_ahead = lead * math.cos(math.pi * (phase - aloft)) * share
    over = -lead * math.cos(math.pi * (phase - 0.5 * aloft)) * going
    flying = math.cos(2.0 * math.pi * (phase - 0.5 * (1.0 + aloft)))
    gained = (measure_speed(t + 0.06, worker) - measure_speed(t - 0.06, worker)) / 0.12
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
    ahead = locate_root(t + 0.4, worker).yaw
    q[c.HEAD_YAW] += 0.8 * min(max(ahead - yaw, -0.8), 0.8) - 0.18 * left_ahead
    bent = min_jerk(t / 0.6) * min_jerk((worker.depart + worker.travel_s + 0.3 - t) / 0.8)
    for side in range(2):
        swing = -(1.0 - 2.0 * side) * ARM_RAD * left_ahead
        hang(
            side,
            -0.12 * bent + swing,
            0.38 + (ELBOW_RAD - 0.38) * bent + ELBOW_SWING * swing,
            worker,
        )
