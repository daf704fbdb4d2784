"""Sequences of one or a few activities that cover all activities, for reports and pictures."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Floats
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.activities.going import CART, WHEELBARROW, start_turn
from hrc_env.motion.activities.loads import BOARD, BOX, finish_lift, plan_pick_up
from hrc_env.motion.activities.running import plan_run
from hrc_env.motion.anatomy import measure_body
from hrc_env.motion.blending import place_standing, stop
from hrc_env.motion.curves import move_point
from hrc_env.motion.feet import place_feet
from hrc_env.motion.floorplan import FloorGrid
from hrc_env.motion.generator import evaluate_motion
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point
from hrc_env.motion.starting import STARTS, Start, start_going
from hrc_env.motion.state import N_START, WORKER, Worker
from hrc_env.worker.body import Body

AWAY_M = 3.0
"""Default length of a straight path [m]."""
FAR_M = 8.0
"""Length of the walks and runs that are evaluated [m]."""
OPEN = FloorGrid(np.full((401, 401), 9.0), np.full(2, -10.0))
"""Empty floor of 20 m x 20 m around the origin."""


class Act(NamedTuple):
    """An activity to be performed."""

    activity: int
    """Index into `ACTIVITY_NAMES`."""
    start: Start
    """Function that plans the activity."""
    height_m: float
    """Height of the work [m]."""


@dataclass(frozen=True, slots=True)
class Film:
    """Sampled motion of one activity."""

    activity: int
    """Index into `ACTIVITY_NAMES`."""
    time_s: Floats
    """Times (T,) since the activity began [s]."""
    controls: Floats
    """Control vectors (T, N_CONTROLS)."""
    motion: WorkerMotion
    """Motion of the body, arrays (T, 1, ...)."""
    worker: Worker
    """Record of the worker, which contains the plan of the activity."""


def make_worker(
    body: Body, xy_m: tuple[float, float] = (0.0, 0.0), yaw_rad: float = 0.0, right: bool = True
) -> Worker:
    """Return a worker without a task, standing at a point with the feet side by side.

    Args:
        body: body of the worker.
        xy_m: position of the root on the floor, in the world [m].
        yaw_rad: heading [rad].
        right: whether the worker is right-handed.
    """
    bones, worker = measure_body(body), np.zeros(1, WORKER)[0]
    worker.is_present, worker.pace = True, 1.0
    worker.bones, worker.frame, worker.lengths = bones.offset, bones.frame, bones.lengths
    worker.trunk_ends = bones.trunk_ends
    worker.speed_m_s, worker.squat_share, worker.right_handed = 1.2, 0.7, 0.9 if right else 0.1
    place_standing(*xy_m, yaw_rad, worker)
    place_feet(0.0, worker)
    return worker


def perform(
    acts: Sequence[Act], worker: Worker, rng: np.random.Generator, dt_s: float
) -> list[Film]:
    """Perform activities in sequence and return the sampled motion of each.

    Args:
        acts: activities, in the order in which they are performed.
        worker: record of the worker, which is changed; it ends in the last pose.
        rng: random number generator of the plans.
        dt_s: sampling interval of the motion [s].
    """
    films, clock_s = [], 10.0 * float(rng.random())
    for activity, start, height_m in acts:
        worker.activity = activity
        lasts_s = start(rng.random(N_START), height_m, worker)
        films.append(_record(worker, np.arange(0.0, lasts_s, dt_s), clock_s))
        stop(worker)
        place_feet(0.0, worker)
        clock_s += lasts_s
    return films


def _record(worker: Worker, time_s: Floats, clock_s: float) -> Film:
    """Return the sampled motion of an activity, with angular velocities of zero.

    Args:
        worker: record of the worker, which contains the plan.
        time_s: times (T,) since the activity began [s].
        clock_s: episode time at which the activity began [s].
    """
    moments = np.full((len(time_s), 1), worker, WORKER)
    moments["time_s"][:, 0], moments["clock_s"][:, 0] = time_s, clock_s + time_s
    motion = evaluate_motion(moments, np.zeros((1, 1)))
    motion = replace(motion, angular_velocity_world=np.zeros_like(motion.velocity_world), body=None)
    return Film(int(worker.activity), time_s, moments["q"][:, 0].copy(), motion, copy(worker))


def _going(activity: int, speed_m_s: float = 1.1, prop: int = 0, way_m: float = AWAY_M) -> Act:
    """Return an activity that moves straight ahead.

    Args:
        activity: index into `ACTIVITY_NAMES`.
        speed_m_s: speed [m/s].
        prop: cart that is pushed, an index into `PROPS`.
        way_m: length of the path [m].
    """

    def start(draws: Floats, height_m: float, worker: Worker) -> float:
        """Plan the path, and the motion along it."""
        x, y, yaw = float(worker.start_x), float(worker.start_y), float(worker.start_yaw)
        lay_path(Point(x, y), np.zeros((0, 3)), move_point(x, y, yaw, way_m, 0.0), worker)
        if activity == st.RUN:
            return plan_run(yaw, speed_m_s, worker)
        if activity == st.FALL:
            lie_s = 2.0 + 2.0 * float(draws[4])
            return plan_fall(draws, yaw, speed_m_s, lie_s, OPEN, worker)
        return start_going(activity, draws, yaw, speed_m_s, prop, worker)

    return Act(activity, start, 0.0)


def _hammer(lightly: bool, height_m: float) -> tuple[Act, ...]:
    """Return a scene of hammering with light taps or with blows."""

    def start(draws: Floats, height_m: float, worker: Worker) -> float:
        """Plan to hammer with light taps or with blows."""
        chosen = draws.copy()
        chosen[2] = 0.0 if lightly else 1.0  # this draw decides between taps and blows
        return STARTS[st.HAMMER](chosen, height_m, worker)

    return (Act(st.HAMMER, start, height_m),)


def _turn(draws: Floats, height_m: float, worker: Worker) -> float:
    """Plan to turn on the spot by a random angle."""
    turn = (1.0 if draws[0] < 0.5 else -1.0) * (0.8 + 2.0 * draws[1])
    return start_turn(float(worker.start_yaw) + turn, worker)


def _take(prop: int, on_shoulder: bool, height_m: float) -> Act:
    """Return an activity of picking up a load.

    Args:
        prop: load, an index into `PROPS`.
        on_shoulder: whether the load is carried on the shoulder.
        height_m: height of the grips [m].
    """

    def start(draws: Floats, height_m: float, worker: Worker) -> float:
        """Plan to pick up the load."""
        return finish_lift(plan_pick_up(draws, height_m, prop, on_shoulder, worker), worker)

    return Act(st.PICK_UP, start, height_m)


def _here(activity: int, height_m: float = 0.0) -> tuple[Act, ...]:
    """Return a scene of one activity on the spot."""
    return (Act(activity, STARTS[activity], height_m),)


def _stand(draws: Floats, height_m: float, worker: Worker) -> float:
    """Plan to stand for four seconds."""
    return 4.0


FLOOR_M, TABLE_M = 0.2, 0.85
_CARRY = _going(st.CARRY)
REPERTOIRE: dict[str, tuple[Act, ...]] = {
    "stand": (Act(st.STAND, _stand, 0.0),),
    "look round": _here(st.LOOK_ROUND),
    "point": _here(st.POINT),
    **{f"walk {v} m/s": (_going(st.WALK, v, way_m=FAR_M),) for v in (0.8, 1.1, 1.3, 1.4, 1.8)},
    "turn": (Act(st.TURN, _turn, 0.0),),
    "step back": _here(st.STEP_BACK),
    "stumble": (_going(st.STUMBLE, 1.2),),
    "lunge": _here(st.LUNGE, 1.1),
    "box from the floor to a table": (
        _take(BOX, False, FLOOR_M),
        _CARRY,
        *_here(st.SET_DOWN, TABLE_M),
    ),
    "board in both hands": (_take(BOARD, False, TABLE_M), _CARRY, *_here(st.SET_DOWN, FLOOR_M)),
    "board on the shoulder": (_take(BOARD, True, FLOOR_M), _CARRY, *_here(st.SET_DOWN, FLOOR_M)),
    "receive and hand over": (*_here(st.RECEIVE), *_here(st.HAND_OVER)),
    "cart": (_going(st.PUSH, prop=CART),),
    "wheelbarrow": (_going(st.PUSH, prop=WHEELBARROW),),
    "squat": _here(st.SQUATTING, FLOOR_M),
    "kneel": _here(st.KNEELING, FLOOR_M),
    "hammer lightly": _hammer(True, TABLE_M),
    "hammer on a table": _hammer(False, TABLE_M),
    "hammer at a wall": _hammer(False, 1.4),
    "hammer on the floor": _hammer(False, FLOOR_M),
    "drill": _here(st.DRILL, 1.25),
    "drill overhead": _here(st.OVERHEAD, 2.0),
    "saw": _here(st.SAW, TABLE_M),
    "measure": _here(st.MEASURE, TABLE_M),
    "climb": _here(st.CLIMB, 0.22),
}
"""Scenes by name."""
HASTY: dict[str, tuple[Act, ...]] = {
    **{f"run {v} m/s": (_going(st.RUN, v, way_m=FAR_M),) for v in (2.5, 3.0, 3.5)},
    "fall": (_going(st.FALL, 1.2),),
}
"""Scenes of running and falling by name; no emulator is fitted to them."""
FOR_TASKS: dict[str, tuple[Act, ...]] = {
    "screw below each other": _here(st.SCREW, 1.5),
    "take what is brought": _here(st.TAKE, 1.15),
}
"""Scenes of activities that occur only in tasks, by name."""
SCENES = {**REPERTOIRE, **HASTY, **FOR_TASKS}
"""All scenes, by name."""
