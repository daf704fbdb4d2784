"""What workers notice of the robot: they pause, or take their hands away and step back.

Hands pause or are taken away by their activity's time halting or going backwards; walkers brake.
What they would do, and how late, is drawn when an activity begins.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import state as st
from hrc_env.motion.anatomy import CHEST, HAND, HEAD, LEFT, SIDE_STRIDE
from hrc_env.motion.state import WORKER, Worker, Workers
from hrc_env.motion.traffic import goes, meets
from hrc_env.motion.walk import brake

BODY_POINTS = (CHEST, HEAD, LEFT + HAND, LEFT + SIDE_STRIDE + HAND)
"""Segments that people guard."""
MEETS_M, MEETS_M_S = 0.20, 0.30
"""Who takes something brings the hand so far to it, so fast [m, m/s]; judgement."""
WAITS_SHARE = 0.4
"""Who is further on the way down to a load does not wait for the robot; judgement."""
WITHDRAW = -1.6
"""Pace at which hands come back."""
MACHINE_S, MACHINE_CALM_S = 2.0, 0.4
"""So far ahead walkers look at a machine that drives, and so soon again after a reaction [s];
judgement."""
People = tuple[float, float, float, float]
"""`PeopleConfig.notice_m`, `.fast_m_s`, `.calm_s`, and how far a robot that drives reaches round
the points that people watch; 0: it is an arm [m]."""


@kernel
def notice(
    dt_s: float, people: People, robot_world: Floats, position_world: Floats,
    velocity_world: Floats, workers: Workers,
) -> None:  # fmt: skip
    """Let all look at the robot (B, 2, 3), dt_s after the last look, and react when it is time."""
    for b, w in np.ndindex(workers.shape):
        me = workers[b, w]
        if me.present:
            if me.doing == st.PAUSE and me.clock_s >= me.doing_until:
                me.doing, me.pace_wished = st.NO_REACTION, 1.0
            if me.clock_s >= me.acts_at:
                me.acts_at = math.inf
                _react(w, workers[b])
                calm_s = people[2] if people[3] == 0.0 else MACHINE_CALM_S
                me.calm_until = me.clock_s + me.reaction_s + calm_s
            elif me.acts_at == math.inf and me.clock_s > me.calm_until:
                if people[3] > 0.0:
                    chest = position_world[b, w, CHEST], velocity_world[b, w, CHEST]
                    startled = _machine_near(dt_s, people, robot_world[b], chest, me)
                else:
                    startled = me.reaction != st.NO_REACTION and _startling(
                        dt_s, people, robot_world[b], position_world[b, w], me
                    )
                if startled:
                    me.acts_at = me.clock_s + me.delay_s
            if me.activity == st.PICK_UP and me.doing == st.NO_REACTION:
                me.pace_wished = 0.0 if _in_use(people, robot_world[b], me) else 1.0
        for k, i in np.ndindex(me.robot_world.shape):
            me.robot_world[k, i] = robot_world[b, k, i]


@kernel
def attend(cue: Ints, offered: Floats, dt_s: float, workers: Workers) -> None:
    """Tell everybody how far what they wait for has come, (B,): 0 not yet, 1 there, 2 theirs. Who
    works at it halts until it is there, who takes it until it is theirs, while the hand goes to
    where it is offered (B, 3)."""
    for b, w in np.ndindex(workers.shape):
        me = workers[b, w]
        me.cued = cue[b]
        if me.activity == st.SCREW:
            ready = me.out_at + me.take_s
            works = ready < me.time_s < ready + me.out_s + me.hold_s
            me.pace_wished = 0.0 if works and me.cued < 1 else 1.0
        elif me.activity == st.TAKE:
            waits = me.time_s > me.out_at + me.out_s and me.cued < 2
            me.pace_wished = 0.0 if waits else 1.0
            if waits:
                _meet(offered[b], dt_s, me)


@kernel
def _meet(offered: Floats, dt_s: float, me: Worker) -> None:
    """Bring the hand that takes nearer to what is offered, if that is near where it was put out."""
    goal, squared = me.target[3 * me.side : 3 * me.side + 3], 0.0
    for i in range(3):
        squared += (offered[i] - me.tool_pose[i]) ** 2
    if not squared < MEETS_M**2:
        return
    squared = 0.0
    for i in range(3):
        squared += (offered[i] - goal[i]) ** 2
    share = min(1.0, MEETS_M_S * dt_s / max(math.sqrt(squared), 1e-9))
    for i in range(3):
        goal[i] += share * (offered[i] - goal[i])


@kernel
def _in_use(people: People, robot: Floats, me: Worker) -> bool:
    """Whether hands that set out for a load have to wait, as a point of the robot is near it."""
    if me.time_s > me.out_at + WAITS_SHARE * me.out_s:
        return False
    for k in range(robot.shape[0]):
        squared = 0.0
        for i in range(3):
            squared += (robot[k, i] - me.tool_pose[i]) ** 2
        if squared < people[0] ** 2:
            return True
    return False


@kernel
def _startling(dt_s: float, people: People, robot: Floats, body: Floats, me: Worker) -> bool:
    """Whether a point of the arm is near, or comes fast from not far."""
    for segment in BODY_POINTS:
        for k in range(robot.shape[0]):
            now, then = 0.0, 0.0
            for i in range(3):
                now += (robot[k, i] - body[segment, i]) ** 2
                then += (me.robot_world[k, i] - body[segment, i]) ** 2
            now, then = math.sqrt(now), math.sqrt(then)
            if now < people[0]:
                return True
            if now < 2.0 * people[0] and then - now > people[1] * dt_s:
                return True
    return False


@kernel
def _machine_near(
    dt_s: float, people: People, robot: Floats, chest: tuple[Floats, Floats], me: Worker
) -> bool:
    """Whether a machine that drives is too near, seen from above; or soon will be, to walkers, none
    of whom overlooks it who takes notice of robots at all."""
    place, speed = chest
    walks = goes(me.activity)
    if people[0] == 0.0 or not (walks or me.reaction != st.NO_REACTION):
        return False
    for k in range(robot.shape[0]):
        x, y = robot[k, 0] - place[0], robot[k, 1] - place[1]
        vx, vy, later_s = 0.0, 0.0, 0.0
        if walks and me.robot_world[k, 0] < math.inf:
            vx = (robot[k, 0] - me.robot_world[k, 0]) / dt_s - speed[0]
            vy = (robot[k, 1] - me.robot_world[k, 1]) / dt_s - speed[1]
            nearest_s = -(x * vx + y * vy) / max(vx * vx + vy * vy, 1e-6)
            later_s = min(nearest_s, MACHINE_S)
        if later_s >= 0.0 and (
            math.hypot(x + later_s * vx, y + later_s * vy) - people[3] < people[0]
        ):
            return True
    return False


@kernel
def _react(w: int, workers: Workers) -> None:
    """Do what worker w does about the robot, if what they are at allows it."""
    me = workers[w]
    kind = me.activity
    upright = kind == st.REACH or kind in st.IDLE or st.HAMMER <= kind <= st.POINT
    if goes(kind):
        if kind in (st.WALK, st.CARRY, st.RUN) and _brake(w, workers):
            me.doing = st.PAUSE
            me.doing_until = me.clock_s + me.duration_s - me.time_s + me.reaction_s
    elif me.reaction == st.BACK_AWAY and upright:
        me.doing = st.BACK_AWAY
        if kind in st.IDLE:
            me.duration_s = me.time_s
        else:
            me.pace_wished = WITHDRAW
    elif kind != st.FALL:
        me.doing, me.doing_until, me.pace_wished = st.PAUSE, me.clock_s + me.reaction_s, 0.0


@kernel(makes_arrays=True)
def _brake(w: int, workers: Workers) -> bool:
    """Brake a walker, unless somebody would walk into them; whether they do."""
    before = np.empty(1, WORKER)
    before[0] = workers[w]
    lasts = brake(workers[w].time_s, workers[w])
    if lasts < 0.0:
        return False
    workers[w].duration_s = lasts
    found, _, _ = meets(w, workers)
    if found >= 0.0:
        workers[w] = before[0]
    return found < 0.0
