"""The closed form of every activity, and how one hands over to the next without a jerk."""

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
from hrc_env.motion.feet import feet, step_time
from hrc_env.motion.hands import lift, reach
from hrc_env.motion.holding import hold_load
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.state import Worker
from hrc_env.motion.walk import footprint, walk

BLEND_S = 0.45
"""Time in which the difference between two activities decays [s]; about a settling step."""
RATE_H_S = 1e-4
"""Step of the difference quotient that gives velocities [s]: 3 mm/s of error at 60 m/s^2."""


@kernel
def evaluate(t: float, clock_s: float, frames: Floats, me: Worker) -> None:
    """The control vector at time t of the activity: its closed form; `frames` are of the clips."""
    activity = me.activity
    me.fallen = me.rolled = 0.0
    feet(step_time(t, me) - (me.taken_s if activity == st.PUSH else 0.0), me)
    if activity in st.GOING:
        walk(t, clock_s, me)
    elif activity == st.PUSH:
        push(t, clock_s, me)
    elif activity == st.CLIP:
        play(t, clock_s, frames, me)
    elif activity == st.RUN:
        run(t, clock_s, me)
    elif activity == st.FALL:
        fall(t, clock_s, me)
    else:
        stand(me.start_x, me.start_y, me.start_yaw, clock_s, me)
    if activity in (st.REACH, st.TAKE):
        reach(t, me)
    elif activity == st.LIFT:
        lift(t, me)
    elif activity in st.TAKING:
        pick_up(t, me)
    elif activity in st.GIVING:
        pick_up(me.lasts - t, me)
    elif st.SQUATTING <= activity <= st.LUNGE or activity == st.SCREW:
        work(t, me)
    elif activity == st.CLIMB:
        climb(t, me)
    elif activity == st.LOOK_ROUND:
        look_round(t, me)
    if me.load_prop > 0 and activity in st.IDLE:
        hold_load(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    if t < BLEND_S:
        for i in range(c.N_BLENDED):
            me.q[i] += decay(t / BLEND_S, BLEND_S, me.blend[i, 0], me.blend[i, 1])


@kernel
def stop(me: Worker) -> float:
    """Begin where the last activity ended, let go of what is; by how much its heading unwinds."""
    if me.activity in st.GIVING or me.activity == st.PUSH:
        me.load_prop = 0
    count = me.step_count if me.undo_at == 0.0 else 0
    if me.activity == st.FALL:  # the feet on which they got up
        count += 2
    for k in range(max(count - 2, 0), count):
        side = (k + me.step_first) % 2
        for i in range(5):
            me.stance[side, i] = me.prints[k, i]
    yaw = wrap(me.end_yaw)
    unwound = yaw - me.end_yaw
    me.stance[0, 2] += unwound
    me.stance[1, 2] += unwound
    me.start_x, me.start_y = me.end_x, me.end_y
    me.start_yaw = me.end_yaw = yaw
    me.step_count = me.step_first = me.undo_at = me.flight_s = 0
    me.step_start, me.step_period, me.step_swing = 0.0, 1.0, 0.5
    return unwound


@kernel
def leave(t: float, clock_s: float, frames: Floats, me: Worker) -> None:
    """End an activity at its time t: note q then and a little later, and stop."""
    for i in range(2):
        later = i * RATE_H_S
        evaluate(t + me.pace * later, clock_s + later, frames, me)
        for k in range(c.N_BLENDED):
            me.handover[i, k] = me.q[k]
    unwound = stop(me)
    me.handover[0, c.HEADING] += unwound
    me.handover[1, c.HEADING] += unwound


@kernel
def join(clock_s: float, frames: Floats, me: Worker) -> None:
    """Let an activity that begins now take over smoothly from what `leave` noted."""
    me.blend[:] = 0.0
    for i in range(2):
        evaluate(i * RATE_H_S, clock_s + i * RATE_H_S, frames, me)
        for k in range(c.N_BLENDED):
            me.handover[i, k] -= me.q[k]
    for k in range(c.N_BLENDED):
        gap, then = me.handover[0, k], me.handover[1, k]
        me.blend[k, 0], me.blend[k, 1] = gap, (then - gap) / RATE_H_S


@kernel
def settle(x: float, y: float, yaw: float, me: Worker) -> None:
    """Stand somewhere, feet side by side; nothing has been done yet."""
    me.end_x, me.end_y, me.end_yaw = x, y, wrap(yaw)
    stop(me)
    for side in range(2):
        footprint(side, x, y, me.start_yaw, STANCE_HALF_WIDTH_M, me.stance[side], me)
