"""Choice of a worker's next activity at the end of an activity, from random numbers in [0, 1).

The order of jobs at workplaces is defined in `schedule`. A worker without a free path to a
workplace chooses another one of the same kind, or waits.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import decision as dc
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.blending import join, leave, place_standing
from hrc_env.motion.decision import Decision, MotionState, take_first_place
from hrc_env.motion.reaches import LEAD_S, find_next_reach
from hrc_env.motion.schedule import HERE, pick_job
from hrc_env.motion.setting_out import (
    Action,
    begin_clip,
    cancel_plan,
    check_traffic,
    has_arrived,
    set_out,
    step_back,
)
from hrc_env.motion.starting import start_here, start_scripted_reach
from hrc_env.motion.state import NOWHERE, THERE, UNDER_WAY, WAITING
from hrc_env.worker.props import PROP_NAMES

WAIT_S = (0.5, 1.1)
"""Interval between two searches for a free path [s]. The values are estimates."""
CHANGE_S = 1.5
"""Time without a free path after which another errand is chosen [s]. The value is an estimate."""
GIVE_UP_S = 4.5
"""Time without a free path after which the errand is abandoned [s]. The value is an estimate."""
PARKED_M = 60.0
"""World x and y of the area in which absent workers are placed [m]."""
WITH_LOAD = (*st.IDLE, *st.GIVING)
"""Activities that are possible with a load; before any other activity the load is set down."""
ABOVE_M = 0.21
"""Height of working hands above a bench [m]. The value is an estimate."""
CHEST_M = 1.2
"""Maximum height at which loads are handed over [m]. The value is an estimate."""


def begin_next_activity(state: MotionState, b: int, w: int, draws: Floats) -> None:
    """End the activity of worker (b, w) and begin the next one smoothly.

    Args:
        state: state of all workers, which is changed.
        b: index of the environment.
        w: index of the worker.
        draws: uniform random numbers (N_DRAWS,) in [0, 1).
    """
    workers, frames = state.workers[b], state.mind.clips.frames
    worker = workers[w]
    pace, clock_s, time_s = float(worker.pace), float(worker.clock_s), float(worker.time_s)
    end = 0.0 if pace < 0.0 else float(worker.duration_s)
    over = (time_s - end) / pace if pace != 0.0 else 0.0
    decision = Decision(
        state.mind_of(b), workers, w, draws, clock_s - over, state.loads[b],
        script=state.scripts.get(b, ()),
    )  # fmt: skip
    leave(end, decision.clock_s, frames, worker)
    if worker.activity in (st.SET_DOWN, st.PUSH):
        lying.lay_down_load(decision.loads, state.mind.plan.grounds.places, worker)
    decision.held_prop = int(worker.load_prop)
    worker.pace = worker.wanted_pace = 1.0
    _store_action(decision, choose_activity(decision))
    join(decision.clock_s, frames, worker)
    worker.time_s = over


def begin_episode(
    state: MotionState,
    b: int,
    n_present: int,
    bodies: Ints,
    draws: Floats,
    activities: Sequence[int] = (),
) -> None:
    """Begin an episode of an environment, with each worker in the middle of an activity.

    Args:
        state: state of all workers, which is changed.
        b: index of the environment.
        n_present: number of workers in the episode.
        bodies: row (W,) of each worker's body in the pool.
        draws: uniform random numbers (W, 2, N_DRAWS) in [0, 1) for the workplaces and
            first activities.
        activities: first activities of the first workers, used if workplaces for them are free.
    """
    mind, workers = state.mind_of(b), state.workers[b]
    workers[...] = _make_fresh_workers(mind.anatomy)[bodies]
    workers["is_present"] = np.arange(len(workers)) < n_present
    everyone = [
        Decision(
            mind, workers, w, draws[w, 0], 0.0, state.loads[b], script=state.scripts.get(b, ())
        )
        for w in range(len(workers))
    ]
    for decision, activity in zip(everyone, activities, strict=False):
        decision.first_activity = None if activity == dc.ANY_ACTIVITY else activity
    for decision in everyone:
        d, worker = decision.draws, decision.worker
        worker.speed_m_s = decision.draw(0, mind.config.people.speed_m_s)
        worker.squat_share = 0.4 + 0.6 * d[1]
        worker.right_handed = 0.9 if d[2] < 0.9 else 0.1
        worker.phases = d[3:8]
        if worker.is_present:
            take_first_place(decision)
        else:
            worker.place[:2] = PARKED_M + 3.0 * decision.w, PARKED_M
        x, y, yaw = worker.place[:3].tolist()
        place_standing(x, y, yaw, worker)
    for decision in everyone[:n_present]:
        share = decision.draws.item(dc.PLACES - 1)
        decision.draws = draws[decision.w, 1]
        scripted = None if decision.first_activity is not None else _follow_script(decision)
        _store_action(decision, scripted or _begin_job(decision))
        if scripted:
            continue
        decision.worker.time_s = math.floor(1e6 * share * float(decision.worker.duration_s)) * 1e-6


@lru_cache(maxsize=8)
def _make_fresh_workers(bones: Anatomy) -> Records1[st.Worker]:
    """Return a worker of each body (N,), without an activity."""
    fresh = np.zeros(len(bones.lengths), st.WORKER)
    fresh["body"] = np.arange(len(fresh))
    fresh["lengths"], fresh["trunk_ends"] = bones.lengths, bones.trunk_ends
    fresh["bones"], fresh["frame"] = bones.offset, bones.frame
    fresh["reacts_at_s"] = fresh["robot_world"] = fresh["duration_s"] = np.inf
    fresh["place"][:, :2] = np.inf
    fresh["pace"] = fresh["wanted_pace"] = 1.0
    return fresh


def choose_activity(decision: Decision) -> Action:
    """Choose and plan the next activity of a worker."""
    worker = decision.worker
    reaction, left = worker.current_reaction, float(worker.reaction_until_s) - decision.clock_s
    worker.current_reaction = st.NO_REACTION
    if reaction == st.BACK_AWAY:
        return step_back(decision) or _begin_standing(float(worker.reaction_s))
    if (
        reaction == st.PAUSE
        and worker.travel == UNDER_WAY
        and worker.reaction_until_s > decision.clock_s
    ):
        return _begin_standing(left)
    if action := begin_clip(decision):
        return action
    if worker.travel == THERE and (action := _follow_script(decision)):
        return action
    if worker.travel == UNDER_WAY and has_arrived(decision):
        decision.set_travel(THERE)
        return _begin_job(decision)
    if worker.travel == THERE:
        careless = decision.draws[dc.EVENT] < decision.mind.config.people.careless_probability
        if careless and (action := step_back(decision)):
            return action
        _choose_job(decision)
        if decision.job.at in (HERE, decision.kind_here) and decision.job.by == "walk":
            return _begin_job(decision)
        decision.set_travel(WAITING)
        worker.waiting_since_s = decision.clock_s
    return set_out(decision) or _begin_waiting(decision)


def _follow_script(decision: Decision) -> Action | None:
    """Begin the next reach of the script, or stand until then.

    Returns:
        The reach or the pause; None if no reach is left, or if the worker cannot reach from here.
    """
    reach = find_next_reach(decision.script, decision.clock_s)
    if reach is None or decision.kind_here != "robot" or decision.is_loaded:
        return None
    wait_s = reach.start_s - decision.clock_s
    if wait_s > LEAD_S + 1e-9:
        return Action(st.STAND, wait_s - LEAD_S)
    return Action(st.REACH, start_scripted_reach(decision, reach))


def _store_action(decision: Decision, action: Action) -> None:
    """Store the planned action, and sample the worker's reaction to the robot during the action."""
    people, worker = decision.mind.config.people, decision.worker
    activity = action.activity
    worker.activity, worker.duration_s = activity, action.duration_s
    if worker.reacts_at_s < np.inf:
        return
    if activity in (st.SCREW, st.TAKE):  # beside a robot that holds the workpiece
        worker.planned_reaction = st.NO_REACTION
        return
    draw = decision.draws.item(dc.REACTION)
    pauses = draw < people.pause_probability
    backs = draw < people.pause_probability + people.step_back_probability
    pauses |= activity == st.CLIP and backs  # a pause replaces a step back during a clip
    worker.planned_reaction = st.PAUSE if pauses else st.BACK_AWAY if backs else st.NO_REACTION
    worker.reaction_delay_s = decision.draw(dc.DELAY, people.delay_s)
    worker.reaction_s = decision.draw(dc.REACTION_S, people.pause_s)


def _choose_job(decision: Decision) -> None:
    """Choose a job that follows the completed one, or another errand if there is none."""
    worker, schedule = decision.worker, decision.mind.schedule
    then = schedule.then[worker.job]
    stays = all(schedule.jobs[k].at in (HERE, decision.kind_here) for k, _ in then)
    if then and not (stays and decision.clock_s >= worker.stay_until_s and not decision.is_loaded):
        chosen = pick_job(then, decision.draws.item(dc.NEXT))
        if worker.signal > 0 or not schedule.jobs[chosen].waits:
            worker.job = chosen
    else:
        _choose_errand(decision)


def _choose_errand(decision: Decision) -> None:
    """Choose the next errand, at the robot or elsewhere."""
    mind, worker, draw = decision.mind, decision.worker, decision.draws.item(dc.NEXT)
    near = mind.config.near_probability
    if draw < near or not mind.schedule.begins:
        worker.job = mind.schedule.robot
    else:
        worker.job = pick_job(mind.schedule.begins, (draw - near) / (1.0 - near))
    worker.place_kind = NOWHERE


def _choose_other_place(decision: Decision) -> None:
    """Choose another job for the load that the worker holds."""
    schedule, prop = decision.mind.schedule, PROP_NAMES[decision.worker.load_prop]
    for job, then in zip(schedule.jobs, schedule.then, strict=True):
        if job.activity == "pick up" and job.prop == prop and then:
            decision.worker.job = pick_job(then, decision.draws.item(dc.NEXT))


def _begin_job(decision: Decision) -> Action:
    """Begin the job at the worker's location, or first set down a load that prevents the job."""
    activity = st.ACTIVITY_NAMES.index(decision.job.activity)
    if not decision.kind_here:
        activity = st.LOOK_ROUND
    if decision.is_loaded and activity not in WITH_LOAD:
        decision.set_travel(UNDER_WAY)
        return _begin_activity(decision, st.SET_DOWN)
    if activity in st.GIVING and not decision.is_loaded:
        activity = st.LOOK_ROUND
    return _begin_activity(decision, activity)


def _begin_activity(decision: Decision, activity: int) -> Action:
    """Begin an activity on the spot, or stand for a while if another worker is in the way."""
    config, worker = decision.mind.config, decision.worker
    near = decision.kind_here == "robot"
    if activity == st.STAND:
        pause_s = config.near_pause_s if near else config.away_pause_s
        return _begin_standing(decision.draw(dc.LASTS, pause_s) * config.people.tempo)
    height, row, at_rest = decision.job.height_m or worker.place.item(3), -1, None
    if activity == st.PICK_UP:
        row = lying.find_load_at_hand(decision.loads, PROP_NAMES.index(decision.job.prop), worker)
        at_rest = decision.loads["pose"][row].copy() if row >= 0 else None
        activity = st.PICK_UP if row >= 0 else st.LOOK_ROUND
    elif activity == st.SET_DOWN:
        at_rest = lying.find_rest_pose_here(
            decision.loads, decision.mind.plan.grounds.places, worker
        )
    elif activity == st.HAND_OVER:
        height = min(height, CHEST_M)
    if decision.kind_here == "bench":
        height += ABOVE_M
    lunges = decision.draws[dc.EVENT] > 1.0 - config.people.lunge_probability
    if near and activity == st.REACH and lunges:
        activity = st.LUNGE
    action = Action(activity, start_here(decision, activity, height, at_rest))
    if check_traffic(decision, action).time_s >= 0.0:
        cancel_plan(decision)
        if decision.kind_here:
            decision.set_travel(UNDER_WAY)  # so that the job comes next
        return _begin_standing(decision.draw(dc.LASTS, WAIT_S))
    if row >= 0:
        lying.remove_load(decision.loads, row)
    return action


def _begin_standing(duration_s: float) -> Action:
    """Return an action in which the worker stands for a duration [s]."""
    return Action(st.STAND, max(duration_s, 0.05))


def _begin_waiting(decision: Decision) -> Action:
    """Wait for a free path; after a while choose another errand, and finally set down the load."""
    worker = decision.worker
    if worker.travel == UNDER_WAY:
        decision.set_travel(WAITING)
    if worker.waiting_since_s == 0.0:
        worker.waiting_since_s = max(decision.clock_s, 1e-9)
    waited_s = decision.clock_s - worker.waiting_since_s
    if waited_s > GIVE_UP_S:
        decision.set_travel(THERE)
        worker.place_kind = NOWHERE
        return _begin_activity(decision, st.SET_DOWN if decision.is_loaded else st.LOOK_ROUND)
    if waited_s > CHANGE_S:
        _choose_other_place(decision) if decision.is_loaded else _choose_errand(decision)
    return _begin_standing(decision.draw(dc.LASTS, WAIT_S))
