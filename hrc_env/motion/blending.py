"""Evaluation of the closed-form motion of activities, with smooth transitions between them."""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import state as st
from hrc_env.motion.activities.climb import climb, look_round
from hrc_env.motion.activities.falling import fall
from hrc_env.motion.activities.going import push
from hrc_env.motion.activities.loads import pick_up
from hrc_env.motion.activities.playing import play
from hrc_env.motion.activities.running import run
from hrc_env.motion.activities.work import work
from hrc_env.motion.curves import decay, wrap
from hrc_env.motion.feet import place_feet, to_step_time
from hrc_env.motion.hands import lift, reach
from hrc_env.motion.holding import hold_load
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import walk, write_footprint

BLEND_S = 0.45
"""Time in which the difference between two activities decays [s], about one step period."""
RATE_H_S = 1e-4
"""Time step of the finite differences for velocities [s]; the error is 3 mm/s at 60 m/s^2."""


@kernel
def evaluate(t: float, clock_s: float, frames: Floats, worker: Worker) -> None:
    """Compute the control vector at time t of the current activity.

    Args:
        t: time since the activity began [s].
        clock_s: time since the episode began [s].
        frames: frames of all clips.
        worker: record with the plan; its `q` is written.
    """
    activity = worker.activity
    worker.fall_share = worker.trunk_roll = 0.0
    place_feet(to_step_time(t, worker) - (worker.grasp_s if activity == st.PUSH else 0.0), worker)
    if activity in st.GOING:
        walk(t, clock_s, worker)
    elif activity == st.PUSH:
        push(t, clock_s, worker)
    elif activity == st.CLIP:
        play(t, clock_s, frames, worker)
    elif activity == st.RUN:
        run(t, clock_s, worker)
    elif activity == st.FALL:
        fall(t, clock_s, worker)
    else:
        stand(worker.start_x, worker.start_y, worker.start_yaw, clock_s, worker)
    if activity in (st.REACH, st.TAKE):
        reach(t, worker)
    elif activity == st.LIFT:
        lift(t, worker)
    elif activity in st.TAKING:
        pick_up(t, worker)
    elif activity in st.GIVING:
        pick_up(worker.total_s - t, worker)
    elif st.SQUATTING <= activity <= st.LUNGE or activity == st.SCREW:
        work(t, worker)
    elif activity == st.CLIMB:
        climb(t, worker)
    elif activity == st.LOOK_ROUND:
        look_round(t, worker)
    if worker.load_prop > 0 and activity in st.IDLE:
        hold_load(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
    if t < BLEND_S:
        for i in range(c.N_BLENDED):
            worker.q[i] += decay(t / BLEND_S, BLEND_S, worker.blend[i, 0], worker.blend[i, 1])


@kernel
def stop(worker: Worker) -> float:
    """End an activity with the worker standing at the final pose, and release a load put down.

    Returns:
        The angle added to the heading to wrap it, a multiple of a full turn [rad].
    """
    if worker.activity in st.GIVING or worker.activity == st.PUSH:
        worker.load_prop = 0
    count = worker.step_count if worker.undo_at == 0.0 else 0
    if worker.activity == st.FALL:  # the footprints on which the worker got up
        count += 2
    for k in range(max(count - 2, 0), count):
        side = (k + worker.step_first) % 2
        for i in range(5):
            worker.stance[side, i] = worker.footprints[k, i]
    yaw = wrap(worker.end_yaw)
    unwound = yaw - worker.end_yaw
    worker.stance[0, 2] += unwound
    worker.stance[1, 2] += unwound
    worker.start_x, worker.start_y = worker.end_x, worker.end_y
    worker.start_yaw = worker.end_yaw = yaw
    worker.step_count = worker.step_first = worker.undo_at = worker.flight_s = 0
    worker.step_start, worker.step_period, worker.step_swing = 0.0, 1.0, 0.5
    return unwound


@kernel
def leave(t: float, clock_s: float, frames: Floats, worker: Worker) -> None:
    """End an activity at time t, and store the control vectors at t and a short time later.

    Args:
        t: time since the activity began [s].
        clock_s: time since the episode began [s].
        frames: frames of all clips.
        worker: record of the worker.
    """
    for i in range(2):
        later = i * RATE_H_S
        evaluate(t + worker.pace * later, clock_s + later, frames, worker)
        for k in range(c.N_BLENDED):
            worker.handover[i, k] = worker.q[k]
    unwound = stop(worker)
    worker.handover[0, c.HEADING] += unwound
    worker.handover[1, c.HEADING] += unwound


@kernel
def join(clock_s: float, frames: Floats, worker: Worker) -> None:
    """Blend an activity that begins now with the control vectors that `leave` stored."""
    worker.blend[:] = 0.0
    for i in range(2):
        evaluate(i * RATE_H_S, clock_s + i * RATE_H_S, frames, worker)
        for k in range(c.N_BLENDED):
            worker.handover[i, k] -= worker.q[k]
    for k in range(c.N_BLENDED):
        gap, then = worker.handover[0, k], worker.handover[1, k]
        worker.blend[k, 0], worker.blend[k, 1] = gap, (then - gap) / RATE_H_S


@kernel
def place_standing(x: float, y: float, yaw: float, worker: Worker) -> None:
    """Place a standing worker with the feet side by side, before the first activity.

    Args:
        x: world x of the root [m].
        y: world y of the root [m].
        yaw: heading [rad].
        worker: record of the worker.
    """
    worker.end_x, worker.end_y, worker.end_yaw = x, y, wrap(yaw)
    stop(worker)
    for side in range(2):
        write_footprint(
            side, x, y, worker.start_yaw, STANCE_HALF_WIDTH_M, worker.stance[side], worker
        )
