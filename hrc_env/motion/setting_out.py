"""Setting out: to a place by a way that meets nobody, a few steps back, into a clip."""

import math
from collections.abc import Iterable

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.activities.pieces import TURNS_RAD, following, piece_of
from hrc_env.motion.activities.playing import start_clip
from hrc_env.motion.activities.running import fastest, plan_run
from hrc_env.motion.decision import BOW, DWELL, EVENT, Decision, free_stages, in_the_way, wished
from hrc_env.motion.floorplan import slack_at
from hrc_env.motion.routes import route
from hrc_env.motion.schedule import HERE
from hrc_env.motion.starting import start_going, start_here
from hrc_env.motion.state import N_START, NOWHERE, ON_STAGE, THERE, UNDER_WAY, WAITING, Place
from hrc_env.motion.traffic import APART_M, meets
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import WORKPLACE_KINDS

WISHED_CLIP, WHICH_CLIP = N_START - 2, N_START - 1
"""Of an activity's own draws: whether to play a clip instead of it, and which."""
FALLS, RUNS, HOW_FAST, HOW_LONG, STAYS_DOWN = range(8, 13)
"""Of a walk's own draws: whether they fall or run on it, how fast, how long they lie."""
ARRIVED_M, HURRY = 0.12, (1.0, 0.75)
"""So near to a place a worker is there [m]; shares of their pace at which walkers set out."""
STAY_DOWN_S = (15.0, 40.0)
"""How long those lie who do not get up soon [s]; judgement."""
STUMBLE_TO = ("robot", "open", "floor")
"""Kinds of places with room ahead for the arms of who stumbles."""
Begun = tuple[int, float] | None
"""The activity that was begun and how long it takes [s]; None: it cannot be."""


def go(who: Decision) -> Begun:
    """Begin to walk to a place of the job, if there is a free one and a free way to it."""
    job, me = who.job, who.me
    if me["going"] == UNDER_WAY and me["at"] == ON_STAGE:
        spot: Place = tuple(me["spot"].tolist())  # type: ignore[assignment]
        if begun := _go_to(who, [spot], ON_STAGE):
            return begun
        me["at"] = NOWHERE
        who.go(WAITING)
    return _go_to(who, wished(who), WORKPLACE_KINDS.index(job.at if job.at != HERE else "open"))


def _go_to(who: Decision, places: Iterable[Place], at: int) -> Begun:
    """Begin to walk to one of some places, `at` which is that."""
    mind, me = who.mind, who.me
    for place in places:
        obstacles = in_the_way(who)
        for share in HURRY:
            begun = _set_out(who, place, obstacles, share, at != ON_STAGE)
            if begun is None:
                break
            when, at_x, at_y = meets_somebody(who, *begun)
            if when < 0.0:
                me["spot"] = place
                me["at"] = at
                dwell = who.draw(DWELL, mind.config.dwell_s) * mind.config.people.tempo
                me["until_s"] = who.now + begun[1] + dwell
                who.go(UNDER_WAY)
                if begun[0] == st.PUSH:
                    _take_wheels(who)
                return begun
            obstacles = np.vstack([obstacles, (at_x, at_y, APART_M + 0.1)])
            stay(who)
    stay(who)
    return None


def _set_out(who: Decision, place: Place, obstacles: Floats, share: float, to_work: bool) -> Begun:
    """Plan to go to a place round obstacles (n, 3) at a share of one's pace, if there is a way."""
    mind, job, me = who.mind, who.job, who.me
    start, end = (float(me["start_x"]), float(me["start_y"])), (place[0], place[1])
    bow = 2.0 * who.draws.item(BOW) - 1.0
    if not route(start, end, bow, obstacles, mind.plan.slack, mind.plan.origin, me):
        return None
    pace = share * float(me["speed_m_s"])
    free = not who.loaded and job.by == "walk"
    if free and (hastened := _fall_or_run(who, place[2], pace)):
        return hastened
    activity, prop = st.WALK, 0
    stumbles = who.draws[EVENT] > 1.0 - mind.config.people.stumble_probability
    if who.loaded:
        activity = st.CARRY
    elif to_work and job.by == "push" and _has_wheels(who):
        activity, prop = st.PUSH, PROP_NAMES.index(job.prop)
    elif job.at in STUMBLE_TO and stumbles:
        activity = st.STUMBLE
    return activity, start_going(activity, who.draws, place[2], pace, prop, me)


def _has_wheels(who: Decision) -> bool:
    """Whether what is to be pushed is where the worker stands, or is none of what lies about."""
    kind = PROP_NAMES.index(who.job.prop)
    return lying.at_hand(who.loads, kind, who.me) >= 0 or not lying.is_any(who.loads, kind)


def _take_wheels(who: Decision) -> None:
    """What is pushed lies about no longer."""
    row = lying.at_hand(who.loads, PROP_NAMES.index(who.job.prop), who.me)
    if row >= 0:
        lying.take(who.loads, row)


def _fall_or_run(who: Decision, yaw_rad: float, pace_m_s: float) -> Begun:
    """Begin to fall on the way or to run it, if it is to be and there is room."""
    people, plan, me, draws = who.mind.config.people, who.mind.plan, who.me, who.draws
    if draws[FALLS] < people.fall_probability:
        stays = draws[STAYS_DOWN] < people.stay_down_probability
        lie_s = who.draw(HOW_LONG, STAY_DOWN_S if stays else people.lie_s)
        lasts = plan_fall(draws, yaw_rad, pace_m_s, lie_s, plan.slack, plan.origin, me)
        if lasts > 0.0:
            return st.FALL, lasts
    if draws[RUNS] < people.run_probability:
        speed_m_s = fastest(who.draw(HOW_FAST, people.run_m_s), me)
        if speed_m_s >= people.run_m_s[0]:
            return st.RUN, plan_run(yaw_rad, speed_m_s, me)
    return None


def step_back(who: Decision) -> Begun:
    """Begin to step back, if there is room behind."""
    if who.loaded:
        return None
    plan, me = who.mind.plan, who.me
    lasts = start_here(who, st.STEP_BACK, 0.0)
    room = slack_at(float(me["end_x"]), float(me["end_y"]), plan.slack, plan.origin)
    if room < 0.0 or meets_somebody(who, st.STEP_BACK, lasts)[0] >= 0.0:
        stay(who)
        return None
    if me["going"] == THERE and who.kind_here:
        who.go(UNDER_WAY)
    return st.STEP_BACK, lasts


def stay(who: Decision) -> None:
    """Forget what was planned: end where the worker stands, with what they hold."""
    me = who.me
    me["end_x"], me["end_y"], me["end_yaw"] = me["start_x"], me["start_y"], me["start_yaw"]
    me["step_count"], me["load_prop"] = 0, who.load
    me["undo_at"] = me["flight_s"] = 0.0


def arrived(who: Decision) -> bool:
    """Whether the worker stands at their place."""
    me, (x, y, yaw, _) = who.me, who.me["spot"].tolist()
    off, turned = math.hypot(me["start_x"] - x, me["start_y"] - y), me["start_yaw"] - yaw
    if PROP_NAMES.index(who.job.prop) in lying.WHEELED and who.job.by == "walk":
        return off < lying.EXACT_M and math.cos(turned) > lying.EXACT_COS
    return off < ARRIVED_M and math.cos(turned) > 0.9


def meets_somebody(who: Decision, activity: int, lasts: float) -> tuple[float, float, float]:
    """When and where an activity that the worker begins now comes too near to another's."""
    if len(who.workers) == 1:
        return -1.0, 0.0, 0.0
    me = who.me
    me["activity"], me["time_s"], me["duration_s"] = activity, 0.0, lasts
    return meets(who.w, who.workers)


def play(who: Decision) -> Begun:
    """Begin to play a clip, if it is wished, or to go where there is room for it; after one follows
    the next, if there is room."""
    mind, me, n_clips = who.mind, who.me, len(who.mind.clips.count)
    was_clip, on_stage = me["activity"] == st.CLIP, me["at"] == ON_STAGE and arrived(who)
    if n_clips == 0 or who.loaded or not (was_clip or on_stage or me["going"] == THERE):
        return None
    if not on_stage and who.draws[WISHED_CLIP] >= mind.config.motions_probability:
        return None
    piece = int(who.draws.item(WHICH_CLIP) * n_clips)
    if was_clip:
        piece = following(mind.clips, me)
    elif on_stage:
        piece, me["at"] = piece_of(mind.clips, me), NOWHERE
    if begun := _play_here(who, piece):
        return begun
    if was_clip or on_stage:
        return None
    me["clip_row"] = mind.clips.row[piece]
    return _go_to(who, free_stages(who, mind.clips.starts[piece]), ON_STAGE)


def _play_here(who: Decision, piece: int) -> Begun:
    """Begin to play a piece of a clip, if there is room."""
    mind, me = who.mind, who.me
    for turn_rad in TURNS_RAD:
        lasts = start_clip(piece, turn_rad, mind.clips, me)
        roots = me["roots"].tolist()
        room = min(slack_at(x, y, mind.plan.slack, mind.plan.origin) for x, y in roots)
        if room >= 0.0 and meets_somebody(who, st.CLIP, lasts)[0] < 0.0:
            if who.kind_here:
                who.go(UNDER_WAY)  # that is, back to the place afterwards
            else:
                who.go(THERE)
                me["spot"] = me["end_x"], me["end_y"], me["end_yaw"], 0.0
            return st.CLIP, lasts
    stay(who)
    return None
