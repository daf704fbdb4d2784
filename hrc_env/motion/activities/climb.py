"""Climbing a step or low ladder and descending backwards, and looking round on the spot."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.planning import clear_plan, scale_draw
from hrc_env.motion.curves import cruise, min_jerk, shift
from hrc_env.motion.feet import to_step_time
from hrc_env.motion.posture import RELAXED_ELBOW, RELAXED_PITCH, hang
from hrc_env.motion.state import Worker

HIGHEST_RISER_M = 0.32
"""Maximum rise of one step [m]; the rungs of ladders are 0.25 to 0.30 m apart (EN 131-1)."""
FIRST_M = 0.40
"""Distance from the initial stance to the first tread [m]."""
TREAD_M = 0.24
"""Horizontal distance from tread to tread [m]."""
STEP_AT_S = 0.12
"""Time at which a climber's first foot lifts off [s]. The value is an estimate."""
PERIOD_S = 0.72
"""Period of a climber's steps [s]. The value is an estimate."""
SWING_S = 0.56
"""Swing time of a climber's foot [s]. The value is an estimate."""
TURN_S = 0.75
"""Time to turn the head from one side to the other [s]. The value is an estimate."""


@kernel
def climb(t: float, worker: Worker) -> None:
    """Add a climb to the pose of a standing worker: climb up, stay, and descend in reverse.

    Args:
        t: time since the activity began [s].
        worker: record with the plan; its `q`, a relaxed stance, is changed.
    """
    q = worker.q
    up_s, treads = worker.up_s, worker.treads
    when = to_step_time(t, worker)
    along = cruise((when - 0.25) / (up_s - 0.25), 0.4)
    risen = cruise((when - 0.50) / (up_s - 0.55), 0.4)
    shift(q, c.ROOT_X, worker.start_yaw, (FIRST_M + TREAD_M * (treads - 1.0)) * along, 0.0)
    q[c.PELVIS_Z] += treads * worker.riser_m * risen
    going = min_jerk(when / 0.5) - min_jerk((when - up_s + 0.3) / 0.6)
    q[c.SPINE_FLEX] += 0.14 * going
    q[c.PELVIS_PITCH] += 0.10 * going
    q[c.HEAD_PITCH] += 0.20 * going
    for side in range(2):
        hang(side, RELAXED_PITCH - 0.05 * going, RELAXED_ELBOW + 0.25 * going, worker)


@kernel
def start_climb(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to climb to a height and descend again.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height to climb to [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    clear_plan(worker)
    prints = worker.footprints
    high = height if height > 0.0 else scale_draw(draws[0], 0.18, 0.30)
    treads = max(1, math.ceil(high / HIGHEST_RISER_M))
    worker.treads, worker.riser_m = treads, high / treads
    first = 1 if draws[1] < 0.5 else 0
    worker.step_start, worker.step_period, worker.step_swing = STEP_AT_S, PERIOD_S, SWING_S
    worker.step_first, worker.step_count = first, treads + 1
    for k in range(treads + 1):
        side, tread = (k + first) % 2, min(k + 1, treads)
        for i in range(3):
            prints[k, i] = worker.stance[side, i]
        shift(prints[k], 0, worker.start_yaw, FIRST_M + TREAD_M * (tread - 1.0), 0.0)
        prints[k, 3], prints[k, 4] = 0.25, tread * worker.riser_m
    worker.up_s = STEP_AT_S + treads * PERIOD_S + SWING_S + 0.1
    worker.undo_at = worker.up_s + 0.5 * scale_draw(draws[2], 0.5, 4.0)
    return 2.0 * worker.undo_at


@kernel
def look_round(t: float, worker: Worker) -> None:
    """Add looking to both sides to the pose of a standing worker."""
    q = worker.q
    there, across = min_jerk(t / TURN_S), min_jerk((t - worker.left_s) / TURN_S)
    back = min_jerk((t - worker.right_s) / TURN_S)
    gaze = worker.left_rad * (there - across) + worker.right_rad * (across - back)
    q[c.HEAD_YAW] += 0.62 * gaze
    q[c.SPINE_TWIST] += 0.26 * gaze
    q[c.PELVIS_YAW] += 0.12 * gaze


@kernel
def start_look_round(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to look to both sides.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: unused; part of the interface of start functions.
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    clear_plan(worker)
    first = 1.0 if draws[0] < 0.5 else -1.0
    worker.left_rad = first * scale_draw(draws[1], 0.6, 1.5)
    worker.right_rad = -first * scale_draw(draws[2], 0.6, 1.5)
    worker.left_s = TURN_S + scale_draw(draws[3], 0.3, 1.2)
    worker.right_s = worker.left_s + TURN_S + scale_draw(draws[4], 0.3, 1.2)
    return worker.right_s + TURN_S + 0.05
