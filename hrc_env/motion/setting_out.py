"""Start of walks, steps back and clips, if they do not lead too close to other workers."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.activities.pieces import TURNS_RAD, find_next_piece, find_piece
from hrc_env.motion.activities.playing import start_clip
from hrc_env.motion.activities.running import limit_run_speed, plan_run
from hrc_env.motion.decision import (
    BOW,
    DWELL,
    EVENT,
    Decision,
    list_obstacles,
    list_places,
    list_stages,
)
from hrc_env.motion.floorplan import read_slack
from hrc_env.motion.points import Place, Point
from hrc_env.motion.routes import find_route
from hrc_env.motion.schedule import HERE
from hrc_env.motion.starting import start_going, start_here
from hrc_env.motion.state import N_START, NOWHERE, ON_STAGE, THERE, UNDER_WAY, WAITING
from hrc_env.motion.traffic import APART_M, Meeting, find_meeting
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import WORKPLACE_KINDS

WANTS_CLIP, WHICH_CLIP = N_START - 2, N_START - 1
"""Indices of the random numbers that select whether a clip is played, and which clip."""
FALLS, RUNS, HOW_FAST, HOW_LONG, STAYS_DOWN = range(8, 13)
"""Indices of a walk's random numbers.

They select whether the worker falls, whether it runs, the speed of the run, the time on the floor
after a fall, and whether the worker stays down for a longer time.
"""
ARRIVED_M = 0.12
"""Distance to the destination within which a worker has arrived [m]."""
PACE_FACTORS = (1.0, 0.75)
"""Factors of the walking speed that are tried in turn."""
DETOUR_RESERVE_M = 0.1
"""Distance added to `APART_M` for the radius of a detour around another worker [m]."""
STAY_DOWN_S = (15.0, 40.0)
"""Time for which a worker that stays down lies on the floor [s]. The values are estimates."""
STUMBLE_TO = ("robot", "open", "floor")
"""Kinds of workplaces with room ahead for the arms of a stumbling worker."""


class Action(NamedTuple):
    """A planned activity and its duration."""

    activity: int
    """Index into `ACTIVITY_NAMES`."""
    duration_s: float
    """Duration [s]."""


def set_out(decision: Decision) -> Action | None:
    """Begin to walk to a workplace of the job, if a workplace and a path to it are free.

    Returns:
        The walk, or None if no workplace can be reached.
    """
    job, worker = decision.job, decision.worker
    if worker.travel == UNDER_WAY and worker.place_kind == ON_STAGE:
        place = Place(*worker.place.tolist())
        if action := _set_out_to(decision, [place], ON_STAGE):
            return action
        worker.place_kind = NOWHERE
        decision.set_travel(WAITING)
    kind = WORKPLACE_KINDS.index(job.at if job.at != HERE else "open")
    return _set_out_to(decision, list_places(decision), kind)


def _set_out_to(decision: Decision, places: Iterable[Place], kind: int) -> Action | None:
    """Begin to walk to the first destination that can be reached without meeting another worker.

    For each destination, paths at the speeds of `PACE_FACTORS` are tried in turn. The position at
    which a path meets another worker becomes an obstacle for the next path to this destination.

    Args:
        decision: inputs of the decision; if a destination is reachable, the worker's `place`,
            `place_kind`, `stay_until_s` and `travel` are set.
        places: destinations in the order in which they are tried.
        kind: kind of the destinations, an index into `WORKPLACE_KINDS`, or `ON_STAGE`.

    Returns:
        The activity that begins, or None if no destination can be reached. In the latter case the
        worker's plan is cancelled.
    """
    config, worker = decision.mind.config, decision.worker
    for place in places:
        obstacles = list_obstacles(decision)
        for pace_factor in PACE_FACTORS:
            # A plan is written to the worker's record, from which meetings are predicted.
            action = _plan_way(decision, place, obstacles, pace_factor, to_work=kind != ON_STAGE)
            if action is None:
                break  # There is no path at any pace.
            meeting = check_traffic(decision, action)
            if meeting.time_s < 0.0:  # The path meets no other worker.
                worker.place[:] = place
                worker.place_kind = kind
                dwell_s = decision.draw(DWELL, config.dwell_s) * config.people.tempo
                worker.stay_until_s = decision.clock_s + action.duration_s + dwell_s
                decision.set_travel(UNDER_WAY)
                if action.activity == st.PUSH:
                    _take_cart(decision)
                return action
            detour = (meeting.x, meeting.y, APART_M + DETOUR_RESERVE_M)
            obstacles = np.vstack([obstacles, detour])
            cancel_plan(decision)
    cancel_plan(decision)
    return None


def _plan_way(
    decision: Decision, place: Place, obstacles: Floats, pace_factor: float, to_work: bool
) -> Action | None:
    """Plan to go to a destination.

    Args:
        decision: inputs of the decision.
        place: destination of the path.
        obstacles: discs (n, 3) that the path must avoid: x, y, radius [m].
        pace_factor: factor of the worker's walking speed.
        to_work: whether the worker has a job to do at the destination.

    Returns:
        The activity and its duration, or None if there is no path.
    """
    mind, job, worker = decision.mind, decision.job, decision.worker
    start = Point(float(worker.start_x), float(worker.start_y))
    end = Point(place.x, place.y)
    bow = 2.0 * decision.draws.item(BOW) - 1.0
    if not find_route(start, end, bow, obstacles, mind.plan.grid, worker):
        return None
    pace = pace_factor * float(worker.speed_m_s)
    free = not decision.is_loaded and job.by == "walk"
    if free and (action := _plan_fall_or_run(decision, place.yaw, pace)):
        return action
    activity, prop = st.WALK, 0
    stumbles = decision.draws[EVENT] > 1.0 - mind.config.people.stumble_probability
    if decision.is_loaded:
        activity = st.CARRY
    elif to_work and job.by == "push" and _has_cart(decision):
        activity, prop = st.PUSH, PROP_NAMES.index(job.prop)
    elif job.at in STUMBLE_TO and stumbles:
        activity = st.STUMBLE
    duration_s = start_going(activity, decision.draws, place.yaw, pace, prop, worker)
    return Action(activity, duration_s)


def _has_cart(decision: Decision) -> bool:
    """Return whether the required cart is within reach, or missing from the scene."""
    kind = PROP_NAMES.index(decision.job.prop)
    row = lying.find_load_at_hand(decision.loads, kind, decision.worker)
    return row >= 0 or not lying.has_load(decision.loads, kind)


def _take_cart(decision: Decision) -> None:
    """Remove the cart that the worker will push from the loads at rest."""
    kind = PROP_NAMES.index(decision.job.prop)
    row = lying.find_load_at_hand(decision.loads, kind, decision.worker)
    if row >= 0:
        lying.remove_load(decision.loads, row)


def _plan_fall_or_run(decision: Decision, yaw_rad: float, pace_m_s: float) -> Action | None:
    """Plan to fall on the way or to run, if a random number selects this and there is room."""
    people, grid = decision.mind.config.people, decision.mind.plan.grid
    worker, draws = decision.worker, decision.draws
    if draws[FALLS] < people.fall_probability:
        stays = draws[STAYS_DOWN] < people.stay_down_probability
        lie_s = decision.draw(HOW_LONG, STAY_DOWN_S if stays else people.lie_s)
        duration_s = plan_fall(draws, yaw_rad, pace_m_s, lie_s, grid, worker)
        if duration_s > 0.0:
            return Action(st.FALL, duration_s)
    if draws[RUNS] < people.run_probability:
        speed_m_s = limit_run_speed(decision.draw(HOW_FAST, people.run_m_s), worker)
        if speed_m_s >= people.run_m_s[0]:
            return Action(st.RUN, plan_run(yaw_rad, speed_m_s, worker))
    return None


def step_back(decision: Decision) -> Action | None:
    """Begin to step back, or return None if there is no room behind the worker."""
    if decision.is_loaded:
        return None
    plan, worker = decision.mind.plan, decision.worker
    action = Action(st.STEP_BACK, start_here(decision, st.STEP_BACK, 0.0))
    room = read_slack(float(worker.end_x), float(worker.end_y), plan.grid)
    if room < 0.0 or check_traffic(decision, action).time_s >= 0.0:
        cancel_plan(decision)
        return None
    if worker.travel == THERE and decision.kind_here:
        decision.set_travel(UNDER_WAY)
    return action


def cancel_plan(decision: Decision) -> None:
    """Cancel the plan, with the worker at its current pose and any load still in its hands."""
    worker = decision.worker
    worker.end_x, worker.end_y, worker.end_yaw = worker.start_x, worker.start_y, worker.start_yaw
    worker.step_count, worker.load_prop = 0, decision.held_prop
    worker.undo_at = worker.flight_s = 0.0


def has_arrived(decision: Decision) -> bool:
    """Return whether the worker stands at the destination of its errand."""
    worker, (x, y, yaw, _) = decision.worker, decision.worker.place.tolist()
    off, turned = math.hypot(worker.start_x - x, worker.start_y - y), worker.start_yaw - yaw
    if PROP_NAMES.index(decision.job.prop) in lying.WHEELED and decision.job.by == "walk":
        return off < lying.EXACT_M and math.cos(turned) > lying.EXACT_COS
    return off < ARRIVED_M and math.cos(turned) > 0.9


def check_traffic(decision: Decision, action: Action) -> Meeting:
    """Predict when and where a worker, if it begins an action now, is too close to another one."""
    if len(decision.workers) == 1:
        return Meeting(-1.0, 0.0, 0.0)
    worker = decision.worker
    worker.activity, worker.time_s, worker.duration_s = action.activity, 0.0, action.duration_s
    return find_meeting(decision.w, decision.workers)


def begin_clip(decision: Decision) -> Action | None:
    """Begin to play a randomly selected clip, or to go to a location with room for it.

    After a piece of a clip, the next piece follows if there is room. None is returned if no clip is
    selected or there is no room.
    """
    mind, worker, n_clips = decision.mind, decision.worker, len(decision.mind.clips.count)
    was_clip = worker.activity == st.CLIP
    on_stage = worker.place_kind == ON_STAGE and has_arrived(decision)
    if n_clips == 0 or decision.is_loaded or not (was_clip or on_stage or worker.travel == THERE):
        return None
    if not on_stage and decision.draws[WANTS_CLIP] >= mind.config.motions_probability:
        return None
    piece = int(decision.draws.item(WHICH_CLIP) * n_clips)
    if was_clip:
        piece = find_next_piece(mind.clips, worker)
    elif on_stage:
        piece, worker.place_kind = find_piece(mind.clips, worker), NOWHERE
    if action := _begin_clip_here(decision, piece):
        return action
    if was_clip or on_stage:
        return None
    worker.clip_row = mind.clips.row[piece]
    return _set_out_to(decision, list_stages(decision, mind.clips.starts[piece]), ON_STAGE)


def _begin_clip_here(decision: Decision, piece: int) -> Action | None:
    """Begin to play a piece of a clip on the spot, or return None if there is no room."""
    mind, worker = decision.mind, decision.worker
    for turn_rad in TURNS_RAD:
        action = Action(st.CLIP, start_clip(piece, turn_rad, mind.clips, worker))
        roots = worker.roots.tolist()
        room = min(read_slack(x, y, mind.plan.grid) for x, y in roots)
        if room >= 0.0 and check_traffic(decision, action).time_s < 0.0:
            if decision.kind_here:
                decision.set_travel(UNDER_WAY)  # so that the worker returns to the place afterwards
            else:
                decision.set_travel(THERE)
                worker.place[:] = worker.end_x, worker.end_y, worker.end_yaw, 0.0
            return action
    cancel_plan(decision)
    return None
