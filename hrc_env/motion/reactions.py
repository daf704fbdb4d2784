"""Reactions of workers to the robot by pausing, or by withdrawing the hands and stepping back.

Hands pause or withdraw because the clock of their activity halts or runs backwards. Walkers brake.
The kind and delay of a reaction are sampled when an activity begins.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records2
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import state as st
from hrc_env.motion.anatomy import CHEST, HAND, HEAD, LEFT, SIDE_STRIDE
from hrc_env.motion.state import WORKER, Worker
from hrc_env.motion.traffic import find_meeting, is_on_path
from hrc_env.motion.walk import brake

BODY_POINTS = (CHEST, HEAD, LEFT + HAND, LEFT + SIDE_STRIDE + HAND)
"""Segments of a worker near which the robot is noticed."""
MEETS_M = 0.20
"""Maximum distance by which a hand adapts to the position of an offered tool [m].

The value is an estimate.
"""
MEETS_M_S = 0.30
"""Speed at which a hand adapts to the position of an offered tool [m/s].

The value is an estimate.
"""
WAITS_SHARE = 0.4
"""Completed fraction of bending down beyond which a worker no longer waits for the robot.

The value is an estimate.
"""
WITHDRAW = -1.6
"""Rate of the activity's clock while the hands are withdrawn; negative for reversed motion."""
MACHINE_S = 2.0
"""Time horizon over which walkers predict the motion of a mobile robot [s].

The value is an estimate.
"""
MACHINE_CALM_S = 0.4
"""Time after a reaction to a mobile robot before the next reaction is possible [s].

The value is an estimate.
"""


class NoticeParams(NamedTuple):
    """Conditions under which workers notice the robot."""

    notice_m: float
    """Distance within which a part of the robot is noticed [m]."""
    fast_m_s: float
    """Approach speed above which the arm is noticed within twice `notice_m` [m/s]."""
    calm_s: float
    """Time after a reaction during which a worker does not react again [s]."""
    base_radius_m: float
    """Radius of a mobile robot around its two points that workers watch [m]; 0 for an arm."""


@kernel
def notice_robot(
    dt_s: float,
    params: NoticeParams,
    robot_world: Floats,
    position_world: Floats,
    velocity_world: Floats,
    workers: Records2[Worker],
) -> None:
    """Determine which workers notice the robot, and begin the reactions with an elapsed delay.

    Args:
        dt_s: time since the last call [s].
        params: conditions under which workers notice the robot.
        robot_world: two points (B, 2, 3) of the robot [m].
        position_world: origins (B, W, 22, 3) of the workers' segments [m].
        velocity_world: velocities (B, W, 22, 3) of the segments' origins [m/s].
        workers: records (B, W), which are changed.
    """
    for b, w in np.ndindex(workers.shape):
        worker = workers[b, w]
        if worker.is_present:
            if worker.current_reaction == st.PAUSE and worker.clock_s >= worker.reaction_until_s:
                worker.current_reaction, worker.wanted_pace = st.NO_REACTION, 1.0
            if worker.clock_s >= worker.reacts_at_s:
                worker.reacts_at_s = math.inf
                _react(w, workers[b])
                calm_s = params.calm_s if params.base_radius_m == 0.0 else MACHINE_CALM_S
                worker.calm_until_s = worker.clock_s + worker.reaction_s + calm_s
            elif worker.reacts_at_s == math.inf and worker.clock_s > worker.calm_until_s:
                if params.base_radius_m > 0.0:
                    chest, chest_velocity = position_world[b, w, CHEST], velocity_world[b, w, CHEST]
                    startled = _is_machine_startling(
                        dt_s, params, robot_world[b], chest, chest_velocity, worker
                    )
                else:
                    startled = worker.planned_reaction != st.NO_REACTION and _is_arm_startling(
                        dt_s, params, robot_world[b], position_world[b, w], worker
                    )
                if startled:
                    worker.reacts_at_s = worker.clock_s + worker.reaction_delay_s
            if worker.activity == st.PICK_UP and worker.current_reaction == st.NO_REACTION:
                worker.wanted_pace = 0.0 if _is_load_in_use(params, robot_world[b], worker) else 1.0
        for k, i in np.ndindex(worker.robot_world.shape):
            worker.robot_world[k, i] = robot_world[b, k, i]


@kernel
def follow_signal(stage: Ints, offered: Floats, dt_s: float, workers: Records2[Worker]) -> None:
    """Update the activities of workers that follow the signal of the task.

    The stages are 0 (not ready), 1 (the robot is in position) and 2 (the tool is released). Work on
    the robot's workpiece halts until stage 1. A hand that takes a tool waits for stage 2, and moves
    to the offered tool.

    Args:
        stage: stage (B,) of the signal.
        offered: point (B, 3) at which the tool is offered [m].
        dt_s: time since the last call [s].
        workers: records (B, W), which are changed.
    """
    for b, w in np.ndindex(workers.shape):
        worker = workers[b, w]
        worker.signal = int(stage[b])
        if worker.activity == st.SCREW:
            ready = worker.out_at + worker.take_s
            works = ready < worker.time_s < ready + worker.out_s + worker.hold_s
            worker.wanted_pace = 0.0 if works and worker.signal < 1 else 1.0
        elif worker.activity == st.TAKE:
            waits = worker.time_s > worker.out_at + worker.out_s and worker.signal < 2
            worker.wanted_pace = 0.0 if waits else 1.0
            if waits:
                _move_hand(offered[b], dt_s, worker)


@kernel
def _move_hand(offered: Floats, dt_s: float, worker: Worker) -> None:
    """Move the target of a hand that takes a tool towards the offered point, if this is close.

    Args:
        offered: point (3,) at which the tool is offered [m].
        dt_s: time since the last call [s].
        worker: record of the worker; its target is changed.
    """
    goal, squared = worker.target[3 * worker.side : 3 * worker.side + 3], 0.0
    for i in range(3):
        squared += (offered[i] - worker.tool_pose[i]) ** 2
    if not squared < MEETS_M**2:
        return
    squared = 0.0
    for i in range(3):
        squared += (offered[i] - goal[i]) ** 2
    share = min(1.0, MEETS_M_S * dt_s / max(math.sqrt(squared), 1e-9))
    for i in range(3):
        goal[i] += share * (offered[i] - goal[i])


@kernel
def _is_load_in_use(params: NoticeParams, robot: Floats, worker: Worker) -> bool:
    """Return whether a worker must wait because the robot is close to the load to be picked up.

    Args:
        params: conditions under which workers notice the robot.
        robot: two points (2, 3) of the robot [m].
        worker: record of the worker.
    """
    if worker.time_s > worker.out_at + WAITS_SHARE * worker.out_s:
        return False
    for k in range(robot.shape[0]):
        squared = 0.0
        for i in range(3):
            squared += (robot[k, i] - worker.tool_pose[i]) ** 2
        if squared < params.notice_m**2:
            return True
    return False


@kernel
def _is_arm_startling(
    dt_s: float, params: NoticeParams, robot: Floats, body: Floats, worker: Worker
) -> bool:
    """Return whether the arm is so close to a worker, or approaches so fast, that it is noticed.

    Args:
        dt_s: time since the last call [s].
        params: conditions under which workers notice the robot.
        robot: two points (2, 3) of the robot [m].
        body: origins (22, 3) of the worker's segments [m].
        worker: record with the robot's position at the last call.
    """
    for segment in BODY_POINTS:
        for k in range(robot.shape[0]):
            distance, last_distance = 0.0, 0.0
            for i in range(3):
                distance += (robot[k, i] - body[segment, i]) ** 2
                last_distance += (worker.robot_world[k, i] - body[segment, i]) ** 2
            distance, last_distance = math.sqrt(distance), math.sqrt(last_distance)
            if distance < params.notice_m:
                return True
            if (
                distance < 2.0 * params.notice_m
                and last_distance - distance > params.fast_m_s * dt_s
            ):
                return True
    return False


@kernel
def _is_machine_startling(
    dt_s: float,
    params: NoticeParams,
    robot: Floats,
    chest_world: Floats,
    chest_velocity: Floats,
    worker: Worker,
) -> bool:
    """Return whether a mobile robot is, or soon will be, too close to a walker.

    Distances are horizontal. A walker that reacts to robots always notices a mobile robot.

    Args:
        dt_s: time since the last call [s].
        params: conditions under which workers notice the robot.
        robot: two points (2, 3) of the robot [m].
        chest_world: position (3,) of the worker's chest [m].
        chest_velocity: velocity (3,) of the chest [m/s].
        worker: record with the robot's position at the last call.
    """
    walks = is_on_path(worker.activity)
    if params.notice_m == 0.0 or not (walks or worker.planned_reaction != st.NO_REACTION):
        return False
    for k in range(robot.shape[0]):
        x, y = robot[k, 0] - chest_world[0], robot[k, 1] - chest_world[1]
        vx, vy, later_s = 0.0, 0.0, 0.0
        if walks and worker.robot_world[k, 0] < math.inf:
            vx = (robot[k, 0] - worker.robot_world[k, 0]) / dt_s - chest_velocity[0]
            vy = (robot[k, 1] - worker.robot_world[k, 1]) / dt_s - chest_velocity[1]
            nearest_s = -(x * vx + y * vy) / max(vx * vx + vy * vy, 1e-6)
            later_s = min(nearest_s, MACHINE_S)
        if later_s >= 0.0 and (
            math.hypot(x + later_s * vx, y + later_s * vy) - params.base_radius_m < params.notice_m
        ):
            return True
    return False


@kernel
def _react(w: int, workers: Records1[Worker]) -> None:
    """Begin the planned reaction of worker w, if the current activity allows it."""
    worker = workers[w]
    kind = worker.activity
    upright = kind == st.REACH or kind in st.IDLE or st.HAMMER <= kind <= st.POINT
    if is_on_path(kind):
        if kind in (st.WALK, st.CARRY, st.RUN) and _brake(w, workers):
            worker.current_reaction = st.PAUSE
            worker.reaction_until_s = (
                worker.clock_s + worker.duration_s - worker.time_s + worker.reaction_s
            )
    elif worker.planned_reaction == st.BACK_AWAY and upright:
        worker.current_reaction = st.BACK_AWAY
        if kind in st.IDLE:
            worker.duration_s = worker.time_s
        else:
            worker.wanted_pace = WITHDRAW
    elif kind != st.FALL:
        worker.current_reaction, worker.reaction_until_s, worker.wanted_pace = (
            st.PAUSE,
            worker.clock_s + worker.reaction_s,
            0.0,
        )


@kernel(makes_arrays=True)
def _brake(w: int, workers: Records1[Worker]) -> bool:
    """Brake a walker unless another worker would come too close; return whether it brakes."""
    before = np.empty(1, WORKER)
    before[0] = workers[w]
    duration_s = brake(workers[w].time_s, workers[w])
    if duration_s < 0.0:
        return False
    workers[w].duration_s = duration_s
    meeting_s = find_meeting(w, workers).time_s
    if meeting_s >= 0.0:
        workers[w] = before[0]
    return meeting_s < 0.0
