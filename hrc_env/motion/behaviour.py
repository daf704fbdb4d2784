"""What a worker does next: decided when an activity has ended, from uniform draws in [0, 1).

Jobs at places follow each other (`schedule`). Who finds no way to a place that meets nobody takes
another one of its kind, or waits.
"""

import math
from collections.abc import Sequence

import numpy as np

from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import decision as dc
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.blending import join, leave, settle
from hrc_env.motion.decision import Decision, MotionState, take_first_place
from hrc_env.motion.schedule import HERE, picked
from hrc_env.motion.setting_out import arrived, go, meets_somebody, play, stay, step_back
from hrc_env.motion.starting import start_here
from hrc_env.motion.state import NOWHERE, THERE, UNDER_WAY, WAITING
from hrc_env.worker.props import PROP_NAMES

WAIT_S, CHANGE_S, GIVE_UP_S = (0.5, 1.1), 1.5, 4.5
"""After so long who finds no way looks again; does something else; gives up [s]; judgement."""
PARKED_M = 60.0
"""Who is not in an episode stands this far away along x and y [m]."""
WITH_LOAD = (*st.IDLE, *st.GIVING)
"""What one does with something in one's hands; before anything else it is set down."""
ABOVE_M, CHEST_M = 0.21, 1.2
"""Hands work so far above a bench; loads are handed over no higher than this [m]; judgement."""


def follow_up(state: MotionState, b: int, w: int, draws: Floats) -> None:
    """The activity of worker (b, w) is over: begin the next, smoothly."""
    workers, frames = state.workers[b], state.mind.clips.frames
    me = workers[w]
    pace, clock_s, time_s = float(me["pace"]), float(me["clock_s"]), float(me["time_s"])
    end = 0.0 if pace < 0.0 else float(me["duration_s"])
    over = (time_s - end) / pace if pace != 0.0 else 0.0
    who = Decision(state.mind_of(b), workers, w, draws, clock_s - over, state.loads[b])
    leave(end, who.now, frames, me)
    if me["activity"] in (st.SET_DOWN, st.PUSH):
        lying.lay_down(who.loads, state.mind.plan.grounds.places, me)
    who.load = int(me["load_prop"])
    me["pace"] = me["pace_wished"] = 1.0
    _begin(who, *next_activity(who))
    join(who.now, frames, me)
    me["time_s"] = over


def begin_episode(
    state: MotionState, b: int, n_present: int, bodies: Ints, draws: Floats,
    activities: Sequence[int] = (),
) -> None:  # fmt: skip
    """Put n_present workers of environment b at places of theirs, in the middle of something.

    They have `bodies` (W,); draws (W, 2, N_DRAWS) are for places and first activities, which are
    `activities` of the first workers, where there is a place for them.
    """
    mind, workers = state.mind_of(b), state.workers[b]
    workers[...] = np.zeros((), st.WORKER)
    workers["present"] = np.arange(len(workers)) < n_present
    bones, workers["body"] = mind.anatomy, bodies
    workers["size"], workers["round"] = bones.size[bodies], bones.round[bodies]
    workers["bones"], workers["frame"] = bones.offset[bodies], bones.frame[bodies]
    workers["acts_at"] = workers["robot_world"] = workers["duration_s"] = np.inf
    workers["spot"][:, :2] = np.inf
    workers["pace"] = workers["pace_wished"] = 1.0
    everyone = [
        Decision(mind, workers, w, draws[w, 0], 0.0, state.loads[b]) for w in range(len(workers))
    ]
    for who, activity in zip(everyone, activities, strict=False):
        who.wanted = None if activity == dc.ANY_ACTIVITY else activity
    for who in everyone:
        d, me = who.draws, who.me
        me["speed_m_s"] = who.draw(0, mind.config.people.speed_m_s)
        me["squat_share"] = 0.4 + 0.6 * d[1]
        me["right_handed"] = 0.9 if d[2] < 0.9 else 0.1
        me["phases"] = d[3:8]
        if me["present"]:
            take_first_place(who)
        else:
            me["spot"][:2] = PARKED_M + 3.0 * who.w, PARKED_M
        x, y, yaw = me["spot"][:3].tolist()
        settle(x, y, yaw, me)
    for who in everyone[:n_present]:
        share = who.draws.item(dc.PLACES - 1)
        who.draws = draws[who.w, 1]
        _begin(who, *_do_job(who))
        who.me["time_s"] = math.floor(1e6 * share * float(who.me["duration_s"])) * 1e-6


def next_activity(who: Decision) -> tuple[int, float]:
    """Decide and plan what comes next: the activity and how long it takes [s]."""
    me = who.me
    doing, left = me["doing"], float(me["doing_until"]) - who.now
    me["doing"] = st.NO_REACTION
    if doing == st.BACK_AWAY:
        return step_back(who) or _stand(float(me["reaction_s"]))
    if doing == st.PAUSE and me["going"] == UNDER_WAY and me["doing_until"] > who.now:
        return _stand(left)
    if played := play(who):
        return played
    if me["going"] == UNDER_WAY and arrived(who):
        who.go(THERE)
        return _do_job(who)
    if me["going"] == THERE:
        careless = who.draws[dc.EVENT] < who.mind.config.people.careless_probability
        if careless and (stepped := step_back(who)):
            return stepped
        _choose_job(who)
        if who.job.at in (HERE, who.kind_here) and who.job.by == "walk":
            return _do_job(who)
        who.go(WAITING)
        me["since_s"] = who.now
    return go(who) or _wait(who)


def _begin(who: Decision, activity: int, lasts: float) -> None:
    """Note what has been planned, and how the worker would react to the robot meanwhile."""
    people, me = who.mind.config.people, who.me
    me["activity"], me["duration_s"] = activity, lasts
    if me["acts_at"] < np.inf:
        return
    if activity in (st.SCREW, st.TAKE):  # beside a robot that holds what they work at
        me["reaction"] = st.NO_REACTION
        return
    draw = who.draws.item(dc.REACTION)
    pauses = draw < people.pause_probability
    backs = draw < people.pause_probability + people.step_back_probability
    pauses |= activity == st.CLIP and backs  # a recording may go anywhere, but not backwards
    me["reaction"] = st.PAUSE if pauses else st.BACK_AWAY if backs else st.NO_REACTION
    me["delay_s"] = who.draw(dc.DELAY, people.delay_s)
    me["reaction_s"] = who.draw(dc.REACTION_S, people.pause_s)


def _choose_job(who: Decision) -> None:
    """What follows the job that is done, or another errand."""
    me, schedule = who.me, who.mind.schedule
    then = schedule.then[me["job"]]
    stays = all(schedule.jobs[k].at in (HERE, who.kind_here) for k, _ in then)
    if then and not (stays and who.now >= me["until_s"] and not who.loaded):
        chosen = picked(then, who.draws.item(dc.NEXT))
        if me["cued"] > 0 or not schedule.jobs[chosen].waits:
            me["job"] = chosen
    else:
        _new_errand(who)


def _new_errand(who: Decision) -> None:
    """Choose what to go about next: at the robot, or elsewhere."""
    mind, me, draw = who.mind, who.me, who.draws.item(dc.NEXT)
    near = mind.config.near_probability
    if draw < near or not mind.schedule.begins:
        me["job"] = mind.schedule.robot
    else:
        me["job"] = picked(mind.schedule.begins, (draw - near) / (1.0 - near))
    me["at"] = NOWHERE


def _elsewhere(who: Decision) -> None:
    """Choose anew what to do with what is held."""
    schedule, prop = who.mind.schedule, PROP_NAMES[who.me["load_prop"]]
    for job, then in zip(schedule.jobs, schedule.then, strict=True):
        if job.activity == "pick up" and job.prop == prop and then:
            who.me["job"] = picked(then, who.draws.item(dc.NEXT))


def _do_job(who: Decision) -> tuple[int, float]:
    """Begin the job where the worker is; set down first what is in the way of it."""
    activity = st.ACTIVITY_NAMES.index(who.job.activity)
    if not who.kind_here:
        activity = st.LOOK_ROUND
    if who.loaded and activity not in WITH_LOAD:
        who.go(UNDER_WAY)
        return _work(who, st.SET_DOWN)
    if activity in st.GIVING and not who.loaded:
        activity = st.LOOK_ROUND
    return _work(who, activity)


def _work(who: Decision, activity: int) -> tuple[int, float]:
    """Begin an activity where the worker is, if it is in nobody's way; else stand for a while."""
    config, me = who.mind.config, who.me
    near = who.kind_here == "robot"
    if activity == st.STAND:
        pause_s = config.near_pause_s if near else config.away_pause_s
        return _stand(who.draw(dc.LASTS, pause_s) * config.people.tempo)
    height, row, at_rest = who.job.height_m or me["spot"].item(3), -1, None
    if activity == st.PICK_UP:
        row = lying.at_hand(who.loads, PROP_NAMES.index(who.job.prop), me)
        at_rest = who.loads["pose"][row].copy() if row >= 0 else None
        activity = st.PICK_UP if row >= 0 else st.LOOK_ROUND
    elif activity == st.SET_DOWN:
        at_rest = lying.rest_here(who.loads, who.mind.plan.grounds.places, me)
    elif activity == st.HAND_OVER:
        height = min(height, CHEST_M)
    if who.kind_here == "bench":
        height += ABOVE_M
    lunges = who.draws[dc.EVENT] > 1.0 - config.people.lunge_probability
    if near and activity == st.REACH and lunges:
        activity = st.LUNGE
    lasts = start_here(who, activity, height, at_rest)
    if meets_somebody(who, activity, lasts)[0] >= 0.0:
        stay(who)
        if who.kind_here:
            who.go(UNDER_WAY)  # that is, the job comes next
        return _stand(who.draw(dc.LASTS, WAIT_S))
    if row >= 0:
        lying.take(who.loads, row)
    return activity, lasts


def _stand(lasts: float) -> tuple[int, float]:
    return st.STAND, max(lasts, 0.05)


def _wait(who: Decision) -> tuple[int, float]:
    """Wait for a way; after a while think of something else, at last set down what is held."""
    me = who.me
    if me["going"] == UNDER_WAY:
        who.go(WAITING)
    if me["since_s"] == 0.0:
        me["since_s"] = max(who.now, 1e-9)
    waited_s = who.now - me["since_s"]
    if waited_s > GIVE_UP_S:
        who.go(THERE)
        me["at"] = NOWHERE
        return _work(who, st.SET_DOWN if who.loaded else st.LOOK_ROUND)
    if waited_s > CHANGE_S:
        _elsewhere(who) if who.loaded else _new_errand(who)
    return _stand(who.draw(dc.LASTS, WAIT_S))
