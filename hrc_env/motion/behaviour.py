"""What a worker does next: decided when an activity has ended, from uniform draws in [0, 1).

A worker goes about errands (`errands`): a task at a place, then what follows it, there or
elsewhere. Who wants to go somewhere looks for a way that meets nobody (`routes`, `traffic`),
takes another place of the kind if there is none, or waits.
"""

import math

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.errands import HERE, picked
from hrc_env.motion.places import others_of, take_first_place
from hrc_env.motion.setting_out import (
    arrived,
    go,
    meets_somebody,
    play,
    stay,
    step_back,
)
from hrc_env.motion.starting import start_here
from hrc_env.motion.state import (
    ACTS_AT,
    AT,
    BACK_AWAY,
    DELAY_S,
    DOING,
    KIND,
    LASTS_S,
    NO_REACTION,
    NOWHERE,
    PAUSE,
    SPOT_HEIGHT,
    SPOT_SINCE,
    SPOT_UNTIL,
    SPOT_X,
    SPOT_Y,
    SPOT_YAW,
    TASK,
    THERE,
    UNDER_WAY,
    UNTIL_AT,
    WAITING,
    MotionState,
    join,
    leave,
    settle,
)
from hrc_env.motion.who import (
    DELAY,
    EVENT,
    LASTS,
    NEXT,
    PLACES,
    REACTION,
    REACTION_S,
    Who,
    who_is,
)
from hrc_env.worker.props import prop_index

WAIT_S = (0.5, 1.1)
"""Who finds no way looks again after so long [s]; judgement."""
CHANGE_S, GIVE_UP_S = 1.5, 4.5
"""After so long they think of something else to do, and at last give up [s]; judgement."""
PARKED_M = 60.0
"""Who is not in an episode stands this far away along x and y [m], and deep below."""
WITH_LOAD = (pl.STAND, pl.LOOK_ROUND, pl.SET_DOWN, pl.HAND_OVER)
"""What one does with something in one's hands; before anything else it is set down."""
ABOVE_M = 0.17
"""Hands work so far above a bench [m]: a hand and a workpiece are as thick; judgement."""
CHEST_M = 1.2
"""Loads are set down or leant against something no higher than this [m]."""


def follow_up(state: MotionState, b: int, w: int, draws: Floats) -> None:
    """The activity of worker (b, w) is over: begin the next, smoothly."""
    pace = state.pace.item(b, w, 0)
    end = 0.0 if pace < 0.0 else state.duration_s.item(b, w)
    over = (state.time_s.item(b, w) - end) / pace if pace != 0.0 else 0.0
    who = who_is(state, b, w, draws, state.clock_s.item(b, w) - over)
    me, q = who.me, np.empty((2, c.N_CONTROLS))
    rows = (
        me.plan, me.prints, me.stance, state.offset[b, w], me.traits, me.size,
        state.mind.clips.frames, q,
    )  # fmt: skip
    leave(end, pace, who.now, int(state.activity[b, w]), *rows)
    who.load = me.plan.item(pl.LOAD_PROP)
    state.pace[b, w] = 1.0
    _begin(who, *next_activity(who))
    join(who.now, int(state.activity[b, w]), *rows)
    state.time_s[b, w] = over


def begin_episode(state: MotionState, b: int, n_present: int, draws: Floats) -> None:
    """Put the workers of environment b at places of theirs, in the middle of something.

    Args:
        state: changed in place.
        b: which environment.
        n_present: how many of its workers are there; the others are parked.
        draws: (W, 2, N_DRAWS): of each worker's beginning, and of their first activity.
    """
    people = state.mind.config.people
    state.spots[b], state.errand[b], state.alert[b] = 0.0, 0, 0.0
    state.alert[b, :, ACTS_AT] = state.robot[b] = np.inf
    state.spots[b, :, :SPOT_YAW] = state.duration_s[b] = np.inf
    state.clock_s[b] = state.time_s[b] = state.offset[b] = 0.0
    state.activity[b], state.pace[b] = pl.STAND, 1.0
    state.present[b] = np.arange(state.present.shape[1]) < n_present
    everyone = [who_is(state, b, w, draws[w, 0], 0.0) for w in range(state.present.shape[1])]
    for who in everyone:
        d, spot = who.draws, who.spot
        who.me.traits[pl.SPEED_TRAIT] = who.draw(0, people.speed_m_s)
        who.me.traits[pl.SQUAT_TRAIT] = 0.4 + 0.6 * d[1]
        who.me.traits[pl.RIGHT_HANDED] = 0.9 if d[2] < 0.9 else 0.1
        who.me.traits[pl.PHASE :] = d[3 : 3 + pl.N_TRAITS - pl.PHASE]
        if state.present[b, who.w]:
            take_first_place(who)
        else:
            spot[[SPOT_X, SPOT_Y]] = PARKED_M + 3.0 * who.w, PARKED_M
        x, y, yaw = spot[:SPOT_HEIGHT].tolist()
        settle(x, y, yaw, who.me.plan, who.me.prints, who.me.stance, who.me.size)
    for who in everyone[:n_present]:
        share = who.draws.item(PLACES - 1)
        who.draws = draws[who.w, 1]
        _begin(who, *_do_task(who))
        lasts = state.duration_s.item(b, who.w)
        state.time_s[b, who.w] = math.floor(1e6 * share * lasts) * 1e-6


def next_activity(who: Who) -> tuple[int, float]:
    """Decide and plan what comes next: the activity and how long it takes [s]."""
    alert = who.alert
    doing, alert[DOING] = alert[DOING], NO_REACTION
    if doing == BACK_AWAY:
        return step_back(who) or _stand(who, alert.item(LASTS_S))
    if doing == PAUSE and who.going == UNDER_WAY and alert[UNTIL_AT] > who.now:
        return _stand(who, alert.item(UNTIL_AT) - who.now)
    played = play(who)
    if played:
        return played
    if who.going == UNDER_WAY and arrived(who):
        who.going = THERE
        return _do_task(who)
    if who.going == THERE:
        if who.draws[EVENT] < who.state.mind.config.people.careless_probability:
            stepped = step_back(who)
            if stepped:
                return stepped
        _choose_task(who)
        if who.task.at in (HERE, who.kind_here):
            return _do_task(who)
        who.going = WAITING
        who.spot[SPOT_SINCE] = who.now
    return go(who) or _wait(who)


def _begin(who: Who, activity: int, lasts: float) -> None:
    """Note what has been planned, and how the worker would react to the robot meanwhile."""
    state, people, alert = who.state, who.state.mind.config.people, who.alert
    state.activity[who.b, who.w], state.duration_s[who.b, who.w] = activity, lasts
    if alert[ACTS_AT] < np.inf:
        return
    draw = who.draws.item(REACTION)
    pauses = draw < people.pause_probability
    backs = draw < people.pause_probability + people.step_back_probability
    alert[KIND] = PAUSE if pauses else BACK_AWAY if backs else NO_REACTION
    if activity == pl.CLIP and alert[KIND] == BACK_AWAY:
        alert[KIND] = PAUSE  # what was recorded may go anywhere, but not backwards
    alert[DELAY_S] = who.draw(DELAY, people.delay_s)
    alert[LASTS_S] = who.draw(REACTION_S, people.pause_s)


def _choose_task(who: Who) -> None:
    """What follows the task that is done, or another errand."""
    errand, errands = who.state.errand[who.b, who.w], who.state.mind.errands
    then = errands.then[errand[TASK]]
    stays = all(errands.tasks[k].at in (HERE, who.kind_here) for k, _ in then)
    if then and not (stays and who.now >= who.spot[SPOT_UNTIL] and not who.loaded):
        errand[TASK] = picked(then, who.draws.item(NEXT))
        return
    _new_errand(who)


def _new_errand(who: Who) -> None:
    """Choose what to go about next: at the robot, or elsewhere."""
    mind, draw = who.state.mind, who.draws.item(NEXT)
    errand, near = who.state.errand[who.b, who.w], mind.config.near_probability
    if draw < near or not mind.errands.begins:
        errand[TASK] = mind.errands.robot
    else:
        errand[TASK] = picked(mind.errands.begins, (draw - near) / (1.0 - near))
    errand[AT] = NOWHERE


def _do_task(who: Who) -> tuple[int, float]:
    """Begin the task where the worker is; set down first what is in the way of it."""
    activity = pl.ACTIVITY_NAMES.index(who.task.activity)
    if not who.kind_here:
        activity = pl.LOOK_ROUND
    if who.loaded and activity not in WITH_LOAD:
        who.going = UNDER_WAY
        return _work(who, pl.SET_DOWN)
    if activity in pl.GIVING and not who.loaded:
        activity = pl.LOOK_ROUND
    return _work(who, activity)


def _work(who: Who, activity: int) -> tuple[int, float]:
    """Begin an activity where the worker is, if it is in nobody's way; else stand for a while."""
    state, mind = who.state, who.state.mind
    if activity == pl.STAND:
        return _stand(who, who.draw(LASTS, _pauses(who)) * mind.config.people.tempo)
    x, y, yaw, height = who.spot[: SPOT_HEIGHT + 1].tolist()
    if activity in (pl.SET_DOWN, pl.HAND_OVER):
        height = min(height, CHEST_M)
    if who.kind_here == "bench":
        height += ABOVE_M
    near, prop = who.kind_here == "robot", prop_index(who.task.prop)
    if near and activity == pl.REACH:
        lunges = who.draws[EVENT] > 1.0 - mind.config.people.lunge_probability
        activity = pl.LUNGE if lunges else pl.REACH
    others = state.spots[who.b, :, :SPOT_YAW][others_of(who)]
    lasts = start_here(
        activity, who.draws, (x, y, yaw, height), near, others, prop, mind.numbers, who.me
    )
    if meets_somebody(who, activity, lasts)[0] >= 0.0:
        stay(who)
        if who.kind_here:
            who.going = UNDER_WAY  # that is, the task comes next
        return _stand(who, who.draw(LASTS, WAIT_S))
    return activity, lasts


def _stand(who: Who, lasts: float) -> tuple[int, float]:
    return pl.STAND, max(lasts, 0.05)


def _wait(who: Who) -> tuple[int, float]:
    """Wait for a way; after a while, with empty hands, think of something else to do.

    Who has waited long sets down what they hold, or looks about.
    """
    if who.going == UNDER_WAY:
        who.going = WAITING
    if who.spot[SPOT_SINCE] == 0.0:
        who.spot[SPOT_SINCE] = max(who.now, 1e-9)
    waited_s = who.now - who.spot[SPOT_SINCE]
    if waited_s > GIVE_UP_S:
        who.going = THERE
        who.state.errand[who.b, who.w, AT] = NOWHERE
        return _work(who, pl.SET_DOWN if who.loaded else pl.LOOK_ROUND)
    if waited_s > CHANGE_S and not who.loaded:
        _new_errand(who)
    return _stand(who, who.draw(LASTS, WAIT_S))


def _pauses(who: Who) -> tuple[float, float]:
    config = who.state.mind.config
    return config.near_pause_s if who.kind_here == "robot" else config.away_pause_s
