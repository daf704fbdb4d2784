"""Setting out: to a place by a way that meets nobody, a few steps back, into a clip."""

import math

import numpy as np

from hrc_env.core.records import WORKPLACE_KINDS
from hrc_env.core.typing import Floats
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import N_START, Place
from hrc_env.motion.errands import HERE
from hrc_env.motion.floorplan import slack_at
from hrc_env.motion.places import in_the_way, wished
from hrc_env.motion.playing import TURNS_RAD, following, roots, start_clip
from hrc_env.motion.routes import route
from hrc_env.motion.starting import start_going, start_here
from hrc_env.motion.state import (
    AT,
    SPOT_HEIGHT,
    SPOT_UNTIL,
    SPOT_X,
    SPOT_Y,
    SPOT_YAW,
    THERE,
    UNDER_WAY,
)
from hrc_env.motion.traffic import APART_M, meets
from hrc_env.motion.who import (
    BOW,
    DWELL,
    EVENT,
    Who,
)
from hrc_env.worker.props import prop_index

WISHED_CLIP, WHICH_CLIP = N_START - 2, N_START - 1
"""Of an activity's own draws: whether to play a clip instead of it, and which."""
ARRIVED_M = 0.12
"""So near to a place a worker is there [m]."""
HURRY = (1.0, 0.75)
"""Shares of their pace at which walkers try to get past each other."""
STUMBLE_TO = ("robot", "open", "floor")
"""Kinds of places with room ahead for the arms of somebody who stumbles."""


def go(who: Who) -> tuple[int, float] | None:
    """Begin to walk to a place of the task, if there is a free one and a free way to it."""
    state, task = who.state, who.task
    for x, y, yaw, height in wished(who):
        who.me.plan[pl.END_X], who.me.plan[pl.END_Y] = x, y
        obstacles = in_the_way(who)
        for share in HURRY:
            begun = _set_out(who, (x, y, yaw, height), obstacles, share)
            if begun is None:
                break
            when, at_x, at_y = meets_somebody(who, *begun)
            if when < 0.0:
                who.spot[: SPOT_HEIGHT + 1] = x, y, yaw, height
                kind = task.at if task.at != HERE else "open"
                state.errand[who.b, who.w, AT] = WORKPLACE_KINDS.index(kind)
                dwell = who.draw(DWELL, state.mind.config.dwell_s) * state.mind.config.people.tempo
                who.spot[SPOT_UNTIL] = who.now + begun[1] + dwell
                who.going = UNDER_WAY
                return begun
            obstacles = np.vstack([obstacles, (at_x, at_y, APART_M + 0.1)])
            stay(who)
    stay(who)
    return None


def _set_out(who: Who, place: Place, obstacles: Floats, share: float) -> tuple[int, float] | None:
    """Plan to go to a place round obstacles (n, 3) at a share of one's pace, if there is a way."""
    mind, me, plan = who.state.mind, who.me, who.me.plan
    start = (plan.item(pl.START_X), plan.item(pl.START_Y))
    via = np.empty((pl.MAX_VIA, 3))
    n = route(
        start, (place[0], place[1]), 2.0 * who.draws.item(BOW) - 1.0, obstacles,
        mind.plan.slack, mind.plan.origin, plan, via,
    )  # fmt: skip
    if n < 0:
        return None
    activity, prop = pl.WALK, 0
    if who.loaded:
        activity = pl.CARRY
    elif who.task.by == "push":
        activity, prop = pl.PUSH, prop_index(who.task.prop)
    elif (
        who.task.at in STUMBLE_TO
        and who.draws[EVENT] > 1.0 - mind.config.people.stumble_probability
    ):
        activity = pl.STUMBLE
    pace = share * me.traits.item(pl.SPEED_TRAIT)
    return activity, start_going(activity, who.draws, place, via[:n], pace, prop, me)


def step_back(who: Who) -> tuple[int, float] | None:
    """Begin to step back, if there is room behind."""
    if who.loaded:
        return None
    mind, plan = who.state.mind, who.me.plan
    lasts = start_here(
        pl.STEP_BACK, who.draws, (0.0, 0.0, 0.0, 0.0), False, np.zeros((0, 2)), 0, mind.numbers,
        who.me,
    )  # fmt: skip
    room = slack_at(plan[pl.END_X], plan[pl.END_Y], mind.plan.slack, mind.plan.origin)
    if room < 0.0 or meets_somebody(who, pl.STEP_BACK, lasts)[0] >= 0.0:
        stay(who)
        return None
    if who.going == THERE and who.kind_here:
        who.going = UNDER_WAY
    return pl.STEP_BACK, lasts


def stay(who: Who) -> None:
    """Forget what was planned: end where the worker stands, with what they hold."""
    plan = who.me.plan
    plan[pl.END_X], plan[pl.END_Y] = plan[pl.START_X], plan[pl.START_Y]
    plan[pl.END_YAW], plan[pl.STEP_COUNT], plan[pl.UNDO_AT] = plan[pl.START_YAW], 0.0, 0.0
    plan[pl.LOAD_PROP] = who.load


def arrived(who: Who) -> bool:
    """Whether the worker stands at their place."""
    plan, spot = who.me.plan, who.spot
    off = math.hypot(plan[pl.START_X] - spot[SPOT_X], plan[pl.START_Y] - spot[SPOT_Y])
    turned = math.cos(plan[pl.START_YAW] - spot[SPOT_YAW])
    return off < ARRIVED_M and turned > 0.9


def meets_somebody(who: Who, activity: int, lasts: float) -> tuple[float, float, float]:
    """When and where an activity that the worker begins now comes too near to another's."""
    state, b, w = who.state, who.b, who.w
    if state.present.shape[1] == 1:
        return -1.0, 0.0, 0.0
    doing, time_s, duration_s = state.activity[b], state.time_s[b], state.duration_s[b]
    doing[w], time_s[w], duration_s[w] = activity, 0.0, lasts
    return meets(w, doing, time_s, duration_s, state.plan[b], state.present[b])


def play(who: Who) -> tuple[int, float] | None:
    """Begin to play a clip where the worker is, if it is wished and there is room for it.

    Who has just played one goes on with the next, wherever they are.
    """
    state, mind, n_clips = who.state, who.state.mind, len(who.state.mind.clips.count)
    was = int(state.activity[who.b, who.w])
    idle = who.going == THERE or was == pl.CLIP
    if n_clips == 0 or who.loaded or not idle:
        return None
    wished, which = who.draws[WISHED_CLIP], who.draws.item(WHICH_CLIP)
    if wished >= mind.config.motions_probability:
        return None
    first = int(which * n_clips)
    if was == pl.CLIP:
        first = following(mind.clips, who.me.plan)
    for turn_rad in TURNS_RAD:
        lasts = start_clip(first, turn_rad, mind.clips, who.body, who.me)
        room = min(slack_at(x, y, mind.plan.slack, mind.plan.origin) for x, y in roots(who.me.plan))
        if room >= 0.0 and meets_somebody(who, pl.CLIP, lasts)[0] < 0.0:
            who.going = UNDER_WAY  # that is, back to the place afterwards
            return pl.CLIP, lasts
    stay(who)
    return None
