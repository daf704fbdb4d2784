"""Where workers may go: places of a kind that nobody else has, and what is in the way."""

import math
from collections.abc import Iterator

import numpy as np

from hrc_env.core.records import WORKPLACE_KINDS
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import Place
from hrc_env.motion.errands import HERE
from hrc_env.motion.floorplan import CELL_M, slack_at
from hrc_env.motion.state import AT, NOWHERE, SPOT_HEIGHT, SPOT_UNTIL, SPOT_YAW, TASK, UNDER_WAY
from hrc_env.motion.traffic import AHEAD_M, APART_M, HANDS_M
from hrc_env.motion.who import (
    BOW,
    DWELL,
    LASTS,
    NEXT,
    PLACES,
    Who,
)

ROBOT_WORK_M = 1.1
"""Height of the work at the robot [m]."""


def others_of(who: Who) -> np.ndarray:
    """(W,) which other workers are there."""
    there = who.state.present[who.b] > 0.0
    there[who.w] = False
    return there


def in_the_way(who: Who) -> Floats:
    """(n, 3) x, y, radius of where other workers will stand and work, and of the robot's arm."""
    state, people = who.state, who.state.mind.config.people
    rows = []
    for k in np.flatnonzero(others_of(who)).tolist():
        plan = state.plan[who.b, k]
        x, y, yaw = plan[pl.END_X : pl.END_YAW + 1].tolist()
        rows.append((x, y, APART_M))
        rows.append((x + AHEAD_M * math.cos(yaw), y + AHEAD_M * math.sin(yaw), HANDS_M))
    if people.detour_m > 0.0 and np.isfinite(state.robot[who.b, 0, 0]):
        rows += [(x, y, people.detour_m) for x, y, _ in state.robot[who.b].tolist()]
    return np.array(rows).reshape(-1, 3)


def wished(who: Who) -> Iterator[Place]:
    """Places for the task that nobody else has, the one last chosen first."""
    if who.going == UNDER_WAY:
        yield tuple(who.spot[: SPOT_HEIGHT + 1].tolist())  # type: ignore[misc]
    for place in _candidates(who, who.task.at):
        if _is_free(who, place):
            yield place


def _candidates(who: Who, kind: str) -> Iterator[Place]:
    """Places of a kind: drawn round the robot, the scene's elsewhere, or where the worker is."""
    mind, draws = who.state.mind, who.draws[PLACES:].tolist()
    if kind == HERE:
        yield tuple(who.spot[: SPOT_HEIGHT + 1].tolist())  # type: ignore[misc]
    elif kind == "robot":
        config, ground = mind.config, mind.plan
        for radius, azimuth, turn in zip(draws[::3], draws[1::3], draws[2::3], strict=True):
            low, high = config.near_radius_m
            r = low + radius * (high - low)
            angle = ground.robot_front_rad + config.near_azimuth_rad * (2.0 * azimuth - 1.0)
            x = ground.robot_xy_m[0] + r * math.cos(angle)
            y = ground.robot_xy_m[1] + r * math.sin(angle)
            if slack_at(x, y, ground.slack, ground.origin) >= 0.0:
                yield x, y, angle + math.pi + 0.15 * (2.0 * turn - 1.0), ROBOT_WORK_M
    else:
        places = mind.places[kind]
        first = int(draws[0] * len(places))
        for place in (*places[first:], *places[:first]):
            yield *place.xy_m, place.yaw_rad, place.height_m


def _is_free(who: Who, place: Place) -> bool:
    """Whether no other worker has a place near this one."""
    apart_m, spots = who.state.mind.config.spacing_m, who.state.spots[who.b, :, :SPOT_YAW]
    there = zip(others_of(who).tolist(), spots.tolist(), strict=True)
    return all(math.dist(spot, place[:2]) >= apart_m for other, spot in there if other)


def take_first_place(who: Who) -> None:
    """A place to begin at, and the task there; where all are taken, the loneliest that is free."""
    mind, errand, draw = who.state.mind, who.state.errand[who.b, who.w], who.draws.item(NEXT)
    begins = [k for k, _ in mind.errands.begins]
    near = draw < mind.config.near_probability or not begins
    wished = mind.errands.robot if near else begins[int(who.draws[BOW] * len(begins))]
    for task in (wished, mind.errands.robot, *begins):
        kind = mind.errands.tasks[task].at
        for place in _candidates(who, kind):
            if _is_free(who, place):
                errand[TASK], errand[AT] = task, WORKPLACE_KINDS.index(kind)
                who.spot[: SPOT_HEIGHT + 1] = place
                dwell = who.draw(DWELL, mind.config.dwell_s) * mind.config.people.tempo
                who.spot[SPOT_UNTIL] = max(0.05, dwell * who.draws.item(LASTS))
                return
    errand[TASK], errand[AT] = mind.errands.robot, NOWHERE
    who.spot[: SPOT_HEIGHT + 1] = _loneliest(who)


def _loneliest(who: Who) -> Place:
    """Where there is room to walk, farthest from the other workers."""
    ground = who.state.mind.plan
    x, y = (np.argwhere(ground.slack >= 0.0) * CELL_M + ground.origin).T
    others = who.state.spots[who.b, :, :SPOT_YAW][others_of(who)]
    away = np.min([np.hypot(x - ox, y - oy) for ox, oy in others], axis=0)
    k = int(np.argmax(away))
    return float(x[k]), float(y[k]), 2.0 * math.pi * who.draws.item(BOW), 0.0
