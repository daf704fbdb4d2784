"""Everything that workers can do, in scenes of one or a few activities: for reports, pictures."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.climb import start_climb
from hrc_env.motion.activities.crouching import plan_kneel, plan_squat
from hrc_env.motion.activities.drill import plan_drill
from hrc_env.motion.activities.going import (
    CART,
    WHEELBARROW,
    start_push,
    start_step_back,
    start_stumble,
    start_turn,
    start_walk,
)
from hrc_env.motion.activities.hammer import plan_hammer
from hrc_env.motion.activities.loads import (
    BOARD,
    BOX,
    finish_lift,
    plan_hand_over,
    plan_pick_up,
    plan_receive,
    plan_set_down,
)
from hrc_env.motion.activities.look_round import start_look_round
from hrc_env.motion.activities.lunge import plan_lunge
from hrc_env.motion.activities.measure import plan_measure
from hrc_env.motion.activities.planning import finish
from hrc_env.motion.activities.point import plan_point
from hrc_env.motion.activities.saw import plan_saw
from hrc_env.motion.activities.worker import N_START, Place, Worker
from hrc_env.motion.solo import Film, play, rest

Start = Callable[[Floats, Place, Worker], float]
"""Begins an activity, see `activities`; how long it lasts [s]."""
Act = tuple[int, Start, float]
"""An activity, what begins it, the height of its place [m]."""
NO_CORNERS = np.zeros((0, 3))
AWAY_M, FAR_M = 3.0, 8.0
"""How far those who go somewhere go, and how long the walks are that are measured [m]."""
LIGHT_DRAW = 2
"""Which draw of `plan_hammer` decides between taps and blows."""


def perform(acts: Sequence[Act], me: Worker, rng: np.random.Generator, dt_s: float) -> list[Film]:
    """Films of acts in their order, at intervals of dt_s; the worker stands where they end."""
    films, clock_s = [], 10.0 * float(rng.random())
    for activity, start, height_m in acts:
        plan = me.plan
        place = (float(plan[pl.START_X]), float(plan[pl.START_Y]), float(plan[pl.START_YAW]))
        lasts_s = start(rng.random(N_START), (*place, height_m), me)
        films.append(play(me, activity, np.arange(0.0, lasts_s, dt_s), clock_s))
        rest(me, activity)
        clock_s += lasts_s
    return films


def _ahead(place: Place, way_m: float = AWAY_M) -> Place:
    """A place some way ahead."""
    x, y, yaw, height = place
    return x + way_m * math.cos(yaw), y + way_m * math.sin(yaw), yaw, height


def _walk(speed_m_s: float, way_m: float = AWAY_M) -> Start:
    return lambda draws, place, me: start_walk(_ahead(place, way_m), NO_CORNERS, speed_m_s, me)


def _hammer(lightly: bool) -> Start:
    def start(draws: Floats, place: Place, me: Worker) -> float:
        chosen = draws.copy()
        chosen[LIGHT_DRAW] = 0.0 if lightly else 1.0
        return finish(plan_hammer(chosen, place, me), me)

    return start


def _turn(draws: Floats, place: Place, me: Worker) -> float:
    turn = (1.0 if draws[0] < 0.5 else -1.0) * (0.8 + 2.0 * draws[1])
    return start_turn((place[0], place[1], place[2] + turn, 0.0), me)


def _stumble(draws: Floats, place: Place, me: Worker) -> float:
    return start_stumble(draws, _ahead(place), NO_CORNERS, 1.2, me)


def _push(prop: int) -> Start:
    return lambda draws, place, me: start_push(_ahead(place), NO_CORNERS, 1.1, prop, me)


def _work(plan: Start) -> Start:
    """Work in place that is planned so."""
    return lambda draws, place, me: finish(plan(draws, place, me), me)


def _load(plan: Start) -> Start:
    """The way of a load that is planned so."""
    return lambda draws, place, me: finish_lift(plan(draws, place, me), me)


def _take(prop: int, on_shoulder: bool) -> Start:
    return _load(lambda draws, place, me: plan_pick_up(draws, place, prop, on_shoulder, me))


def _stand(draws: Floats, place: Place, me: Worker) -> float:
    return 4.0


FLOOR_M, TABLE_M = 0.2, 0.85
_SET_DOWN: Start = _load(plan_set_down)
_CARRY: Act = (pl.CARRY, _walk(1.1), 0.0)
REPERTOIRE: dict[str, tuple[Act, ...]] = {
    "stand": ((pl.STAND, _stand, 0.0),),
    "look round": ((pl.LOOK_ROUND, start_look_round, 0.0),),
    "point": ((pl.POINT, _work(plan_point), 0.0),),
    "walk 0.8 m/s": ((pl.WALK, _walk(0.8, FAR_M), 0.0),),
    "walk 1.1 m/s": ((pl.WALK, _walk(1.1, FAR_M), 0.0),),
    "walk 1.3 m/s": ((pl.WALK, _walk(1.3, FAR_M), 0.0),),
    "walk 1.4 m/s": ((pl.WALK, _walk(1.4, FAR_M), 0.0),),
    "walk 1.8 m/s": ((pl.WALK, _walk(1.8, FAR_M), 0.0),),
    "turn": ((pl.TURN, _turn, 0.0),),
    "step back": ((pl.STEP_BACK, start_step_back, 0.0),),
    "stumble": ((pl.STUMBLE, _stumble, 0.0),),
    "lunge": ((pl.LUNGE, _work(plan_lunge), 1.1),),
    "box from the floor to a table": (
        (pl.PICK_UP, _take(BOX, False), FLOOR_M), _CARRY, (pl.SET_DOWN, _SET_DOWN, TABLE_M)
    ),
    "board in both hands": (
        (pl.PICK_UP, _take(BOARD, False), TABLE_M), _CARRY, (pl.SET_DOWN, _SET_DOWN, FLOOR_M)
    ),
    "board on the shoulder": (
        (pl.PICK_UP, _take(BOARD, True), FLOOR_M), _CARRY, (pl.SET_DOWN, _SET_DOWN, FLOOR_M)
    ),
    "receive and hand over": (
        (pl.RECEIVE, _load(plan_receive), 0.0), (pl.HAND_OVER, _load(plan_hand_over), 0.0)
    ),
    "cart": ((pl.PUSH, _push(CART), 0.0),),
    "wheelbarrow": ((pl.PUSH, _push(WHEELBARROW), 0.0),),
    "squat": ((pl.SQUATTING, _work(plan_squat), FLOOR_M),),
    "kneel": ((pl.KNEELING, _work(plan_kneel), FLOOR_M),),
    "hammer lightly": ((pl.HAMMER, _hammer(True), TABLE_M),),
    "hammer on a table": ((pl.HAMMER, _hammer(False), TABLE_M),),
    "hammer at a wall": ((pl.HAMMER, _hammer(False), 1.4),),
    "hammer on the floor": ((pl.HAMMER, _hammer(False), FLOOR_M),),
    "drill": ((pl.DRILL, _work(plan_drill), 1.25),),
    "drill overhead": ((pl.OVERHEAD, _work(plan_drill), 2.0),),
    "saw": ((pl.SAW, _work(plan_saw), TABLE_M),),
    "measure": ((pl.MEASURE, _work(plan_measure), TABLE_M),),
    "climb": ((pl.CLIMB, start_climb, 0.22),),
}  # fmt: skip
"""Scenes by name."""
