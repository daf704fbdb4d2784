"""What a worker does next: decided when an activity has ended, from uniform draws in [0, 1).

A worker goes about errands (`errands`): a task at a place, then what follows it, there or
elsewhere. Who wants to go somewhere looks for a way that meets nobody (`routes`, `traffic`),
takes another place of the kind if there is none, or waits.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import N_START, Place, Worker
from hrc_env.motion.errands import HERE, Task, picked
from hrc_env.motion.floorplan import CELL_M, slack_at
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS
from hrc_env.motion.playing import TURNS_RAD, following, roots, start_clip
from hrc_env.motion.routes import route
from hrc_env.motion.starting import start_going, start_here
from hrc_env.motion.state import (
    ACTS_AT,
    AT,
    BACK_AWAY,
    DELAY_S,
    DOING,
    GOING,
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
from hrc_env.motion.traffic import AHEAD_M, APART_M, HANDS_M, meets
from hrc_env.props import prop_index
from hrc_env.records import WORKPLACE_KINDS
from hrc_env.typing import Floats

NEXT, BOW, LASTS, DELAY, REACTION, REACTION_S, EVENT, DWELL = range(N_START, N_START + 8)
"""Which draw decides what; the first N_START are the activity's own."""
PLACES, N_TRIED = N_START + 8, 5
"""First of the draws for places, three a place, and how many are tried."""
N_DRAWS = PLACES + 3 * N_TRIED
"""Uniform numbers of one decision."""
WISHED_CLIP, WHICH_CLIP = N_START - 2, N_START - 1
"""Of an activity's own draws: whether to play a clip instead of it, and which."""
WAIT_S = (0.5, 1.1)
"""Who finds no way looks again after so long [s]; judgement."""
CHANGE_S, GIVE_UP_S = 1.5, 4.5
"""After so long they think of something else to do, and at last give up [s]; judgement."""
ARRIVED_M = 0.12
"""So near to a place a worker is there [m]."""
HURRY = (1.0, 0.75)
"""Shares of their pace at which walkers try to get past each other."""
PARKED_M = 60.0
"""Who is not in an episode stands this far away along x and y [m], and deep below."""
WITH_LOAD = (pl.STAND, pl.LOOK_ROUND, pl.SET_DOWN, pl.HAND_OVER)
"""What one does with something in one's hands; before anything else it is set down."""
ROBOT_WORK_M = 1.1
"""Height of the work at the robot [m]."""
ABOVE_M = 0.17
"""Hands work so far above a bench [m]: a hand and a workpiece are as thick; judgement."""
STUMBLE_TO = ("robot", "open", "floor")
"""Kinds of places with room ahead for the arms of somebody who stumbles."""
CHEST_M = 1.2
"""Loads are set down or leant against something no higher than this [m]."""


@dataclass(slots=True)
class Who:
    """A worker who decides."""

    state: MotionState
    b: int
    w: int
    me: Worker
    draws: Floats
    """(N_DRAWS,)."""
    now: float
    """Clock [s]."""
    load: float
    """What they hold when they decide (`plans.LOAD_PROP`)."""

    @property
    def spot(self) -> Floats:
        """(N_SPOT,) row of `MotionState.spots`."""
        return self.state.spots[self.b, self.w]

    @property
    def alert(self) -> Floats:
        """(N_ALERT,) row of `MotionState.alert`."""
        return self.state.alert[self.b, self.w]

    @property
    def going(self) -> int:
        """`THERE`, `UNDER_WAY` or `WAITING`."""
        return int(self.state.errand[self.b, self.w, GOING])

    @going.setter
    def going(self, value: int) -> None:
        self.state.errand[self.b, self.w, GOING] = value
        if value != WAITING:
            self.spot[SPOT_SINCE] = 0.0

    @property
    def kind_here(self) -> str:
        """Kind of the place where they are and have something to do; else nothing."""
        at = self.state.errand.item(self.b, self.w, AT)
        return "" if at == NOWHERE else WORKPLACE_KINDS[at]

    @property
    def task(self) -> Task:
        """What they do or want to do."""
        return self.state.mind.errands.tasks[self.state.errand[self.b, self.w, TASK]]

    @property
    def loaded(self) -> bool:
        """Whether they hold something."""
        return bool(self.me.plan[pl.LOAD_PROP] > 0.0)

    def draw(self, index: int, limits: tuple[float, float]) -> float:
        """A draw stretched to (low, high)."""
        return limits[0] + self.draws.item(index) * (limits[1] - limits[0])


def follow_up(state: MotionState, b: int, w: int, draws: Floats) -> None:
    """The activity of worker (b, w) is over: begin the next, smoothly."""
    pace = state.pace.item(b, w, 0)
    end = 0.0 if pace < 0.0 else state.duration_s.item(b, w)
    over = (state.time_s.item(b, w) - end) / pace if pace != 0.0 else 0.0
    who = _who(state, b, w, draws, state.clock_s.item(b, w) - over)
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
    everyone = [_who(state, b, w, draws[w, 0], 0.0) for w in range(state.present.shape[1])]
    for who in everyone:
        d, spot = who.draws, who.spot
        who.me.traits[pl.SPEED_TRAIT] = who.draw(0, people.speed_m_s)
        who.me.traits[pl.SQUAT_TRAIT] = 0.4 + 0.6 * d[1]
        who.me.traits[pl.RIGHT_HANDED] = 0.9 if d[2] < 0.9 else 0.1
        who.me.traits[pl.PHASE :] = d[3 : 3 + pl.N_TRAITS - pl.PHASE]
        if state.present[b, who.w]:
            _take_first_place(who)
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
        return _step_back(who) or _stand(who, alert.item(LASTS_S))
    if doing == PAUSE and who.going == UNDER_WAY and alert[UNTIL_AT] > who.now:
        return _stand(who, alert.item(UNTIL_AT) - who.now)
    played = _play(who)
    if played:
        return played
    if who.going == UNDER_WAY and _arrived(who):
        who.going = THERE
        return _do_task(who)
    if who.going == THERE:
        if who.draws[EVENT] < who.state.mind.config.people.careless_probability:
            stepped = _step_back(who)
            if stepped:
                return stepped
        _choose_task(who)
        if who.task.at in (HERE, who.kind_here):
            return _do_task(who)
        who.going = WAITING
        who.spot[SPOT_SINCE] = who.now
    return _go(who) or _wait(who)


def _who(state: MotionState, b: int, w: int, draws: Floats, now: float) -> Who:
    body = state.anatomy
    me = Worker(
        state.traits[b, w], state.plan[b, w], state.prints[b, w], state.stance[b, w],
        body.offset, body.frame, body.size,
        np.empty(c.N_CONTROLS), np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3)),
    )  # fmt: skip
    return Who(state, b, w, me, draws, now, me.plan.item(pl.LOAD_PROP))


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
    others = state.spots[who.b, :, :SPOT_YAW][_others(who)]
    lasts = start_here(
        activity, who.draws, (x, y, yaw, height), near, others, prop, mind.numbers, who.me
    )
    if _meets(who, activity, lasts)[0] >= 0.0:
        _stay(who)
        if who.kind_here:
            who.going = UNDER_WAY  # that is, the task comes next
        return _stand(who, who.draw(LASTS, WAIT_S))
    return activity, lasts


def _go(who: Who) -> tuple[int, float] | None:
    """Begin to walk to a place of the task, if there is a free one and a free way to it."""
    state, task = who.state, who.task
    for x, y, yaw, height in _wished(who):
        who.me.plan[pl.END_X], who.me.plan[pl.END_Y] = x, y
        obstacles = _in_the_way(who)
        for share in HURRY:
            begun = _set_out(who, (x, y, yaw, height), obstacles, share)
            if begun is None:
                break
            when, at_x, at_y = _meets(who, *begun)
            if when < 0.0:
                who.spot[: SPOT_HEIGHT + 1] = x, y, yaw, height
                kind = task.at if task.at != HERE else "open"
                state.errand[who.b, who.w, AT] = WORKPLACE_KINDS.index(kind)
                dwell = who.draw(DWELL, state.mind.config.dwell_s) * state.mind.config.people.tempo
                who.spot[SPOT_UNTIL] = who.now + begun[1] + dwell
                who.going = UNDER_WAY
                return begun
            obstacles = np.vstack([obstacles, (at_x, at_y, APART_M + 0.1)])
            _stay(who)
    _stay(who)
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


def _play(who: Who) -> tuple[int, float] | None:
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
        lasts = start_clip(first, turn_rad, mind.clips, who.me)
        room = min(slack_at(x, y, mind.plan.slack, mind.plan.origin) for x, y in roots(who.me.plan))
        if room >= 0.0 and _meets(who, pl.CLIP, lasts)[0] < 0.0:
            who.going = UNDER_WAY  # that is, back to the place afterwards
            return pl.CLIP, lasts
    _stay(who)
    return None


def _step_back(who: Who) -> tuple[int, float] | None:
    """Begin to step back, if there is room behind."""
    if who.loaded:
        return None
    mind, plan = who.state.mind, who.me.plan
    lasts = start_here(
        pl.STEP_BACK, who.draws, (0.0, 0.0, 0.0, 0.0), False, np.zeros((0, 2)), 0, mind.numbers,
        who.me,
    )  # fmt: skip
    room = slack_at(plan[pl.END_X], plan[pl.END_Y], mind.plan.slack, mind.plan.origin)
    if room < 0.0 or _meets(who, pl.STEP_BACK, lasts)[0] >= 0.0:
        _stay(who)
        return None
    if who.going == THERE and who.kind_here:
        who.going = UNDER_WAY
    return pl.STEP_BACK, lasts


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


def _stay(who: Who) -> None:
    """Forget what was planned: end where the worker stands, with what they hold."""
    plan = who.me.plan
    plan[pl.END_X], plan[pl.END_Y] = plan[pl.START_X], plan[pl.START_Y]
    plan[pl.END_YAW], plan[pl.STEP_COUNT], plan[pl.UNDO_AT] = plan[pl.START_YAW], 0.0, 0.0
    plan[pl.LOAD_PROP] = who.load


def _arrived(who: Who) -> bool:
    """Whether the worker stands at their place."""
    plan, spot = who.me.plan, who.spot
    off = math.hypot(plan[pl.START_X] - spot[SPOT_X], plan[pl.START_Y] - spot[SPOT_Y])
    turned = math.cos(plan[pl.START_YAW] - spot[SPOT_YAW])
    return off < ARRIVED_M and turned > 0.9


def _pauses(who: Who) -> tuple[float, float]:
    config = who.state.mind.config
    return config.near_pause_s if who.kind_here == "robot" else config.away_pause_s


def _others(who: Who) -> np.ndarray:
    """(W,) which other workers are there."""
    there = who.state.present[who.b] > 0.0
    there[who.w] = False
    return there


def _meets(who: Who, activity: int, lasts: float) -> tuple[float, float, float]:
    """When and where an activity that the worker begins now comes too near to another's."""
    state, b, w = who.state, who.b, who.w
    if state.present.shape[1] == 1:
        return -1.0, 0.0, 0.0
    doing, time_s, duration_s = state.activity[b], state.time_s[b], state.duration_s[b]
    doing[w], time_s[w], duration_s[w] = activity, 0.0, lasts
    return meets(w, doing, time_s, duration_s, state.plan[b], state.present[b])


def _in_the_way(who: Who) -> Floats:
    """(n, 3) x, y, radius of where other workers will stand and work, and of the robot's arm."""
    state, people = who.state, who.state.mind.config.people
    rows = []
    for k in np.flatnonzero(_others(who)).tolist():
        plan = state.plan[who.b, k]
        x, y, yaw = plan[pl.END_X : pl.END_YAW + 1].tolist()
        rows.append((x, y, APART_M))
        rows.append((x + AHEAD_M * math.cos(yaw), y + AHEAD_M * math.sin(yaw), HANDS_M))
    if people.detour_m > 0.0 and np.isfinite(state.robot[who.b, 0, 0]):
        rows += [(x, y, people.detour_m) for x, y, _ in state.robot[who.b].tolist()]
    return np.array(rows).reshape(-1, 3)


def _wished(who: Who) -> Iterator[Place]:
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
    spots = who.state.spots[who.b, :, :SPOT_YAW][_others(who)]
    away = np.hypot(spots[:, 0] - place[0], spots[:, 1] - place[1])
    return not len(away) or bool(away.min() >= who.state.mind.config.spacing_m)


def _take_first_place(who: Who) -> None:
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
    others = who.state.spots[who.b, :, :SPOT_YAW][_others(who)]
    away = np.min([np.hypot(x - ox, y - oy) for ox, oy in others], axis=0)
    k = int(np.argmax(away))
    return float(x[k]), float(y[k]), 2.0 * math.pi * who.draws.item(BOW), 0.0
