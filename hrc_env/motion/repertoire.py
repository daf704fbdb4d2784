"""Everything that workers can do, in scenes of one or a few activities: for reports, pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Floats
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.activities.going import CART, WHEELBARROW, start_turn
from hrc_env.motion.activities.loads import BOARD, BOX, finish_lift, plan_pick_up
from hrc_env.motion.activities.running import plan_run
from hrc_env.motion.anatomy import anatomy
from hrc_env.motion.blending import settle, stop
from hrc_env.motion.curves import placed
from hrc_env.motion.feet import feet
from hrc_env.motion.generator import bodies_of
from hrc_env.motion.paths import lay_path
from hrc_env.motion.starting import STARTS, Start, start_going
from hrc_env.motion.state import N_START, WORKER, Worker
from hrc_env.worker.body import Body

Act = tuple[int, Start, float]
"""An activity, what begins it, the height of its place [m]."""
AWAY_M, FAR_M = 3.0, 8.0
"""Length of a way, and of the walks that are measured [m]."""
OPEN = np.full((401, 401), 9.0), np.full(2, -10.0)
"""A floor without anything: 10 m to each side."""


@dataclass(frozen=True, slots=True)
class Film:
    """What a worker did."""

    activity: int
    time_s: Floats
    """(T,) since the activity began."""
    controls: Floats
    """(T, N_CONTROLS)."""
    motion: WorkerMotion
    """Arrays (T, 1, ...)."""
    worker: Worker
    """As the activity planned it."""


def alone(
    body: Body, xy_m: tuple[float, float] = (0.0, 0.0), yaw_rad: float = 0.0, right: bool = True
) -> Worker:
    """A worker at a point, feet side by side, who has nothing to do."""
    bones, me = anatomy(body), np.zeros(1, WORKER)[0]
    me["present"], me["pace"] = True, 1.0
    me["bones"], me["frame"], me["size"] = bones.offset, bones.frame, bones.size
    me["round"] = bones.round
    me["speed_m_s"], me["squat_share"], me["right_handed"] = 1.2, 0.7, 0.9 if right else 0.1
    settle(*xy_m, yaw_rad, me)
    feet(0.0, me)
    return me


def perform(acts: Sequence[Act], me: Worker, rng: np.random.Generator, dt_s: float) -> list[Film]:
    """Films of acts in their order, at intervals of dt_s; the worker stands where they end."""
    films, clock_s = [], 10.0 * float(rng.random())
    for activity, start, height_m in acts:
        me["activity"] = activity
        lasts_s = start(rng.random(N_START), height_m, me)
        films.append(_film(me, np.arange(0.0, lasts_s, dt_s), clock_s))
        stop(me)
        feet(0.0, me)
        clock_s += lasts_s
    return films


def _film(me: Worker, time_s: Floats, clock_s: float) -> Film:
    """The worker at times (T,) of an activity begun at a clock; without angular velocities."""
    moments = np.full((len(time_s), 1), me, WORKER)
    moments["time_s"][:, 0], moments["clock_s"][:, 0] = time_s, clock_s + time_s
    motion = bodies_of(moments, np.zeros((1, 1)))
    motion = replace(motion, angular_velocity_world=np.zeros_like(motion.velocity_world), body=None)
    return Film(int(me["activity"]), time_s, moments["q"][:, 0].copy(), motion, me.copy())


def _going(activity: int, speed_m_s: float = 1.1, prop: int = 0, way_m: float = AWAY_M) -> Act:
    """Go some way ahead."""

    def start(draws: Floats, height_m: float, me: Worker) -> float:
        x, y, yaw = (float(me[name]) for name in ("start_x", "start_y", "start_yaw"))
        lay_path((x, y), np.zeros((0, 3)), placed(x, y, yaw, way_m, 0.0), me)
        if activity == st.RUN:
            return plan_run(yaw, speed_m_s, me)
        if activity == st.FALL:
            lie_s = 2.0 + 2.0 * float(draws[4])
            return plan_fall(draws, yaw, speed_m_s, lie_s, *OPEN, me)
        return start_going(activity, draws, yaw, speed_m_s, prop, me)

    return activity, start, 0.0


def _hammer(lightly: bool, height_m: float) -> tuple[Act]:
    def start(draws: Floats, height_m: float, me: Worker) -> float:
        chosen = draws.copy()
        chosen[2] = 0.0 if lightly else 1.0  # which decides between taps and blows
        return STARTS[st.HAMMER](chosen, height_m, me)

    return ((st.HAMMER, start, height_m),)


def _turn(draws: Floats, height_m: float, me: Worker) -> float:
    turn = (1.0 if draws[0] < 0.5 else -1.0) * (0.8 + 2.0 * draws[1])
    return start_turn(float(me["start_yaw"]) + turn, me)


def _take(prop: int, on_shoulder: bool, height_m: float) -> Act:
    def start(draws: Floats, height_m: float, me: Worker) -> float:
        return finish_lift(plan_pick_up(draws, height_m, prop, on_shoulder, me), me)

    return st.PICK_UP, start, height_m


def _here(activity: int, height_m: float = 0.0) -> tuple[Act]:
    return ((activity, STARTS[activity], height_m),)


def _stand(draws: Floats, height_m: float, me: Worker) -> float:
    return 4.0


FLOOR_M, TABLE_M = 0.2, 0.85
_CARRY = _going(st.CARRY)
REPERTOIRE: dict[str, tuple[Act, ...]] = {
    "stand": ((st.STAND, _stand, 0.0),),
    "look round": _here(st.LOOK_ROUND),
    "point": _here(st.POINT),
    **{f"walk {v} m/s": (_going(st.WALK, v, way_m=FAR_M),) for v in (0.8, 1.1, 1.3, 1.4, 1.8)},
    "turn": ((st.TURN, _turn, 0.0),),
    "step back": _here(st.STEP_BACK),
    "stumble": (_going(st.STUMBLE, 1.2),),
    "lunge": _here(st.LUNGE, 1.1),
    "box from the floor to a table": (
        _take(BOX, False, FLOOR_M), _CARRY, *_here(st.SET_DOWN, TABLE_M)
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
}  # fmt: skip
"""Scenes by name."""
HASTY: dict[str, tuple[Act, ...]] = {
    **{f"run {v} m/s": (_going(st.RUN, v, way_m=FAR_M),) for v in (2.5, 3.0, 3.5)},
    "fall": (_going(st.FALL, 1.2),),
}
"""The same of what only those do who run and fall; no emulator is fitted to them."""
FOR_TASKS: dict[str, tuple[Act, ...]] = {
    "screw below each other": _here(st.SCREW, 1.5),
    "take what is brought": _here(st.TAKE, 1.15),
}
"""And of what workers do for tasks."""
SCENES = {**REPERTOIRE, **HASTY, **FOR_TASKS}
"""All."""
