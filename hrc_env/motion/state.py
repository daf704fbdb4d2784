"""The state of the workers' motion, and the compiled code that moves it on."""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.motion import behaviour as bh
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.climb import climb
from hrc_env.motion.activities.going import push
from hrc_env.motion.activities.loads import pick_up
from hrc_env.motion.activities.look_round import look_round
from hrc_env.motion.activities.work import work
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.compiled import compiled
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.curves import decay, wrap
from hrc_env.motion.feet import foot, step_time
from hrc_env.motion.hands import lift, reach
from hrc_env.motion.holding import drop_load, hold_load
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M, stand
from hrc_env.motion.walk import footprint, walk
from hrc_env.typing import Floats, Ints

BLEND_S = 0.45
"""Time in which the difference between two activities decays [s]; about a settling step."""
RATE_H_S = 1e-4
"""Step of the difference quotient of the closed form that gives velocities [s]: at 60 m/s^2
its error is 3 mm/s."""


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
    spots: Floats
    """(B, W, N_SPOT) the worker's place."""
    draws: Floats
    """(B, W, N_DRAWS) uniform numbers of the decision now due; scratch."""
    anatomy: Anatomy
    """Constants of the body."""
    numbers: tuple
    """Constants of the behaviour (`config.numbers`)."""


@compiled
def evaluate(
    activity: int, t: float, clock_s: float, plan: Floats, prints: Floats, stance: Floats,
    offset: Floats, traits: Floats, size: Floats, q: Floats,
) -> None:  # fmt: skip
    """The control vector q at time t of an activity: its closed form."""
    feet_s = step_time(t, plan) - (plan[pl.TAKEN_S] if activity == pl.PUSH else 0.0)
    for side in range(2):
        foot(feet_s, side, plan, prints, stance, size, q)
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
    else:
        _stay(activity, t, plan, clock_s, traits, size, q)
    if t < BLEND_S:
        for i in range(c.N_BLENDED):
            q[i] += decay(t / BLEND_S, BLEND_S, offset[i, 0], offset[i, 1])


@compiled
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


@compiled
def _stop(plan: Floats, prints: Floats, stance: Floats) -> float:
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


@compiled
def plan_next(
    w: int, clock_s: float, draws: Floats, config: MotionConfig, spots: Floats, traits: Floats,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, frame: Floats, size: Floats,
    q: Floats, p: Floats, r: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Decide and plan what comes next; START, END and stance are set. (activity, duration)."""
    for side in range(2):
        foot(0.0, side, plan, prints, stance, size, q)
    near = spots[w, bh.SPOT_NEAR] > 0.0
    if clock_s >= spots[w, bh.SPOT_UNTIL]:
        lasts = bh.walk_on(draws, config, spots, w, clock_s, traits, plan, prints, stance, size)
        spots[w, bh.SPOT_UNTIL] += lasts
        return pl.WALK, lasts
    kind = bh.next_work(draws, config, near)
    if kind == pl.REACH:
        return kind, bh.start_reach(draws, config, near, traits, plan, offset, frame, size, q, p, r)
    if kind == pl.LIFT:
        return kind, bh.start_lift(draws, config, traits, plan, offset, frame, size, q, p, r)
    return kind, bh.between(draws[1], config.near_pause_s if near else config.away_pause_s)


@compiled
def follow_up(
    b: int, w: int, clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats, spots: Floats,
    draws: Floats, config: MotionConfig, bones: Floats, frame: Floats, size: Floats,
) -> None:  # fmt: skip
    """The activity of worker (b, w) is over: begin the next, smoothly."""
    q, h, end = np.empty((4, c.N_CONTROLS)), RATE_H_S, duration_s[b, w]
    p, r = np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3))
    now = clock_s[b, w] - (time_s[b, w] - end)
    for i in range(2):
        evaluate(
            activity[b, w], end + i * h, now + i * h, plan[b, w], prints[b, w], stance[b, w],
            offset[b, w], traits[b, w], size, q[i],
        )  # fmt: skip
    unwound = _stop(plan[b, w], prints[b, w], stance[b, w])
    if activity[b, w] in pl.GIVING or activity[b, w] == pl.PUSH:
        drop_load(plan[b, w])
    q[0, c.HEADING] += unwound
    q[1, c.HEADING] += unwound
    activity[b, w], duration_s[b, w] = plan_next(
        w, now, draws[b, w], config, spots[b], traits[b, w], plan[b, w], prints[b, w],
        stance[b, w], bones, frame, size, q[2], p, r,
    )  # fmt: skip
    time_s[b, w] -= end
    offset[b, w] = 0.0
    for i in range(2):
        evaluate(
            activity[b, w], i * h, now + i * h, plan[b, w], prints[b, w], stance[b, w],
            offset[b, w], traits[b, w], size, q[2 + i],
        )  # fmt: skip
    for i in range(c.N_BLENDED):
        gap, later = q[0, i] - q[2, i], q[1, i] - q[3, i]
        offset[b, w, i, 0], offset[b, w, i, 1] = gap, (later - gap) / h


@compiled
def begin(
    b: int, w: int, clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats, spots: Floats,
    draws: Floats, config: MotionConfig, bones: Floats, frame: Floats, size: Floats,
) -> None:  # fmt: skip
    """Put worker (b, w) at a place of theirs, in the middle of something, feet settled."""
    d, row = draws[b, w, bh.N_DRAWS :], plan[b, w]
    traits[b, w, pl.SPEED_TRAIT] = bh.between(d[0], config.speed_m_s)
    traits[b, w, pl.SQUAT_TRAIT] = 0.4 + 0.6 * d[1]
    traits[b, w, pl.RIGHT_HANDED] = 0.9 if d[2] < 0.9 else 0.1
    traits[b, w, pl.PHASE :] = d[3 : 3 + pl.N_TRAITS - pl.PHASE]
    clock_s[b, w], offset[b, w] = 0.0, 0.0
    bh.choose_place(d, config, spots[b], w, 0.0)
    spots[b, w, bh.SPOT_UNTIL] = max(0.05, spots[b, w, bh.SPOT_UNTIL] * d[9])
    row[:] = 0.0
    row[pl.END_X], row[pl.END_Y] = spots[b, w, bh.SPOT_X], spots[b, w, bh.SPOT_Y]
    row[pl.END_YAW] = wrap(spots[b, w, bh.SPOT_YAW])
    _stop(row, prints[b, w], stance[b, w])
    for side in range(2):
        footprint(
            side, row[pl.START_X], row[pl.START_Y], row[pl.START_YAW], STANCE_HALF_WIDTH_M,
            size, stance[b, w, side],
        )  # fmt: skip
    q = np.empty(c.N_CONTROLS)
    p, r = np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3))
    activity[b, w], duration_s[b, w] = plan_next(
        w, 0.0, draws[b, w], config, spots[b], traits[b, w], row, prints[b, w], stance[b, w],
        bones, frame, size, q, p, r,
    )  # fmt: skip
    time_s[b, w] = math.floor(1e6 * d[10] * duration_s[b, w]) * 1e-6
