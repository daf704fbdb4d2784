"""The state of the workers' motion, and the compiled code that moves it on."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Workplace
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.climb import climb
from hrc_env.motion.activities.going import push
from hrc_env.motion.activities.loads import pick_up
from hrc_env.motion.activities.look_round import look_round
from hrc_env.motion.activities.recorded import play
from hrc_env.motion.activities.work import work
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.config import MotionConfig, Numbers
from hrc_env.motion.curves import decay, wrap
from hrc_env.motion.errands import Errands
from hrc_env.motion.feet import feet, step_time
from hrc_env.motion.floorplan import Floorplan
from hrc_env.motion.hands import lift, reach
from hrc_env.motion.holding import drop_load, hold_load
from hrc_env.motion.playing import Clips
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.walk import footprint, walk

BLEND_S = 0.45
"""Time in which the difference between two activities decays [s]; about a settling step."""
RATE_H_S = 1e-4
"""Step of the difference quotient of the closed form that gives velocities [s]: at 60 m/s^2
its error is 3 mm/s."""


SPOT_X, SPOT_Y, SPOT_YAW, SPOT_HEIGHT, SPOT_UNTIL, SPOT_SINCE = range(6)
"""Where the worker works or goes to, which way they look there, how high the work is, until which
clock they stay [s], since when they want to go (0: they do not)."""
N_SPOT = 6
TASK, GOING, AT = range(3)
"""Index of the task; whether they do it, are on the way to it, or want to go; kind of the place
(index into `WORKPLACE_KINDS`; NOWHERE: they have done there what they came for)."""
N_ERRAND, NOWHERE = 3, -1
THERE, UNDER_WAY, WAITING = range(3)
"""Values of `GOING`."""
ACTS_AT, DOING, UNTIL_AT, CALM_AT, DELAY_S, KIND, LASTS_S = range(7)
"""Clock at which the worker will react to what they noticed (infinite: noticed nothing); what
they do about it now and until which clock; from which clock on they may be startled again; drawn
when an activity begins: how long they take to react, how they would, for how long."""
N_ALERT = 7
NO_REACTION, PAUSE, BACK_AWAY = range(3)
"""Values of `DOING` and `KIND`."""


@dataclass(frozen=True, slots=True, eq=False)
class Mind:
    """What decisions are made from; constants."""

    config: MotionConfig
    numbers: Numbers
    plan: Floorplan
    errands: Errands
    places: dict[str, tuple[Workplace, ...]]
    """By kind."""
    clips: Clips
    """What there is to play."""
    fewest: int
    """Workers who are in an episode at least."""


@dataclass(frozen=True, slots=True)
class MotionState:
    """All that changes is in these arrays: copying them copies the state."""

    clock_s: Floats
    """(B, W) time since the episode began."""
    time_s: Floats
    """(B, W) time since the activity began."""
    duration_s: Floats
    """(B, W) how long the activity lasts."""
    activity: Ints
    """(B, W) index into `ACTIVITY_NAMES`."""
    plan: Floats
    """(B, W, N_PLAN) the activity's numbers, see `plans`."""
    prints: Floats
    """(B, W, MAX_STEPS, 5) footprints x, y, heading, share of a full stride, height."""
    stance: Floats
    """(B, W, 2, 5) footprints that the activity begins on: left, right; columns as `prints`."""
    offset: Floats
    """(B, W, N_BLENDED, 2) what the activity before left over: value and rate at time 0."""
    traits: Floats
    """(B, W, N_TRAITS) what the worker keeps for an episode."""
    pace: Floats
    """(B, W, 2) how fast the activity's time goes, and what that is going to: 1 as planned, 0
    halted, negative: taken back."""
    spots: Floats
    """(B, W, N_SPOT) the worker's place, see below."""
    errand: Ints
    """(B, W, N_ERRAND) what they are about, see below."""
    alert: Floats
    """(B, W, N_ALERT) what they noticed of the robot, see below."""
    robot: Floats
    """(B, 2, 3) elbow and tool of the arm when the workers last looked [m]; infinite: not yet."""
    present: Floats
    """(B, W) 1 of a worker who is there, 0 of one who is not in this episode."""
    body: Ints
    """(B, W) row of `anatomy`: which body each worker has in this episode."""
    anatomy: Anatomy
    """(N, ...) constants of the bodies that there are."""
    mind: Mind
    """Constants of the behaviour."""


@kernel
def evaluate(
    activity: int, t: float, clock_s: float, plan: Floats, prints: Floats, stance: Floats,
    offset: Floats, traits: Floats, size: Floats, frames: Floats, q: Floats,
) -> None:  # fmt: skip
    """The control vector q at time t of an activity: its closed form."""
    feet_s = step_time(t, plan) - (plan[pl.TAKEN_S] if activity == pl.PUSH else 0.0)
    feet(feet_s, plan, prints, stance, size, q)
    if activity in pl.GOING:
        walk(t, plan, clock_s, traits, size, q)
    elif activity == pl.REACH:
        reach(t, plan, clock_s, traits, size, q)
    elif activity == pl.LIFT:
        lift(t, plan, clock_s, traits, size, q)
    elif activity == pl.PUSH:
        push(t, plan, clock_s, traits, size, q)
    elif activity in pl.TAKING:
        pick_up(t, plan, clock_s, traits, size, q)
    elif activity in pl.GIVING:
        pick_up(plan[pl.LASTS] - t, plan, clock_s, traits, size, q)
    elif pl.SQUATTING <= activity <= pl.LUNGE:
        work(t, plan, clock_s, traits, size, q)
    elif activity == pl.CLIMB:
        climb(t, plan, clock_s, traits, size, q)
    elif activity == pl.CLIP:
        play(t, plan, prints, stance, clock_s, traits, size, frames, q)
    else:
        _stay(activity, t, plan, clock_s, traits, size, q)
    if t < BLEND_S:
        for i in range(c.N_BLENDED):
            q[i] += decay(t / BLEND_S, BLEND_S, offset[i, 0], offset[i, 1])


@kernel
def _stay(
    activity: int, t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats
) -> None:
    """The control vector of someone who stands, perhaps looking round or with a load."""
    x, y, yaw = plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW]
    if activity == pl.LOOK_ROUND:
        look_round(t, plan, clock_s, traits, size, q)
    else:
        stand(x, y, yaw, clock_s, traits, size, q)
    if plan[pl.LOAD_PROP] > 0.0:
        hold_load(x, y, yaw, 0.0, plan, q)


@kernel
def stop(plan: Floats, prints: Floats, stance: Floats) -> float:
    """Begin where the last activity ended; returns by how much its heading was unwound."""
    count = int(plan[pl.STEP_COUNT]) if plan[pl.UNDO_AT] == 0.0 else 0
    for k in range(max(count - 2, 0), count):
        side = (k + int(plan[pl.STEP_FIRST])) % 2
        for i in range(5):
            stance[side, i] = prints[k, i]
    yaw = wrap(plan[pl.END_YAW])
    unwound = yaw - plan[pl.END_YAW]
    stance[0, 2] += unwound
    stance[1, 2] += unwound
    plan[pl.START_X] = plan[pl.END_X]
    plan[pl.START_Y] = plan[pl.END_Y]
    plan[pl.START_YAW] = plan[pl.END_YAW] = yaw
    plan[pl.STEP_COUNT], plan[pl.STEP_FIRST], plan[pl.UNDO_AT] = 0.0, 0.0, 0.0
    plan[pl.STEP_START], plan[pl.STEP_PERIOD], plan[pl.STEP_SWING] = 0.0, 1.0, 0.5
    return unwound


@kernel
def leave(
    t: float, pace: float, clock_s: float, activity: int, plan: Floats, prints: Floats,
    stance: Floats, offset: Floats, traits: Floats, size: Floats, frames: Floats, q: Floats,
) -> None:  # fmt: skip
    """End an activity at its time t: fill q (2, N_CONTROLS) then and a little later, and stop.

    Args:
        t: [s].
        pace: how fast the activity's time goes; negative where it was taken back.
        clock_s: the clock at t.
        activity, plan, prints, stance, offset, traits: the worker's rows; plan and stance are
            made to begin where it ended, and what was set down is gone.
        size: of the body.
        frames: of the clips.
        q: written.
    """
    for i in range(2):
        later = i * RATE_H_S
        evaluate(
            activity, t + pace * later, clock_s + later, plan, prints, stance, offset, traits,
            size, frames, q[i],
        )  # fmt: skip
    unwound = stop(plan, prints, stance)
    if activity in pl.GIVING or activity == pl.PUSH:
        drop_load(plan)
    q[0, c.HEADING] += unwound
    q[1, c.HEADING] += unwound


@kernel(makes_arrays=True)
def join(
    clock_s: float, activity: int, plan: Floats, prints: Floats, stance: Floats, offset: Floats,
    traits: Floats, size: Floats, frames: Floats, q: Floats,
) -> None:  # fmt: skip
    """Let an activity that begins now take over smoothly from q (2, N_CONTROLS) of `leave`."""
    mine = np.empty((2, c.N_CONTROLS))
    offset[:] = 0.0
    for i in range(2):
        later = i * RATE_H_S
        evaluate(
            activity, later, clock_s + later, plan, prints, stance, offset, traits, size, frames,
            mine[i],
        )  # fmt: skip
    for i in range(c.N_BLENDED):
        gap, then = q[0, i] - mine[0, i], q[1, i] - mine[1, i]
        offset[i, 0], offset[i, 1] = gap, (then - gap) / RATE_H_S


@kernel
def settle(
    x: float, y: float, yaw: float, plan: Floats, prints: Floats, stance: Floats, size: Floats
) -> None:
    """Stand somewhere, feet side by side, with nothing done yet."""
    for i in range(plan.shape[0]):
        plan[i] = 0.0
    plan[pl.END_X], plan[pl.END_Y], plan[pl.END_YAW] = x, y, wrap(yaw)
    stop(plan, prints, stance)
    for side in range(2):
        footprint(side, x, y, plan[pl.START_YAW], STANCE_HALF_WIDTH_M, size, stance[side])
