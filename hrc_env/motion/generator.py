"""The procedural worker: behaviour, activities and kinematics as one moving batch.

Every activity is a closed form in the time since it began, so that a moment can be evaluated
anywhere, nothing is precomputed, and velocities come from the closed form itself.
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.body import N_SEGMENTS, Body
from hrc_env.errors import ConfigError
from hrc_env.motion import behaviour as bh
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import anatomy
from hrc_env.motion.compiled import compiled
from hrc_env.motion.config import MotionConfig, numbers
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS, pose, quaternion, spin
from hrc_env.motion.state import RATE_H_S, MotionState, begin, evaluate, follow_up
from hrc_env.records import WorkerMotion
from hrc_env.typing import Bools, Floats, Ints

__all__ = [
    "MotionConfig",
    "MotionState",
    "activity",
    "activity_names",
    "advance",
    "current",
    "make_state",
    "reset",
]

activity_names: tuple[str, ...] = pl.ACTIVITY_NAMES
"""Names of the values of `activity`."""


def make_state(batch: int, n_workers: int, body: Body, config: MotionConfig) -> MotionState:
    """Arrays for `batch` environments of `n_workers` each; call `reset` before use.

    Raises:
        ConfigError: negative sizes.
    """
    if batch < 1 or n_workers < 0:
        raise ConfigError(f"Need batch >= 1 and n_workers >= 0, got {batch} and {n_workers}.")

    def array(*shape: int) -> Floats:
        return np.zeros((batch, n_workers, *shape))

    state = MotionState(
        clock_s=array(), time_s=array(), duration_s=array(),
        activity=np.zeros((batch, n_workers), np.int64),
        plan=array(pl.N_PLAN), prints=array(pl.MAX_STEPS, 4), stance=array(2, 3),
        offset=array(c.N_BLENDED, 2), traits=array(pl.N_TRAITS), spots=array(bh.N_SPOT),
        draws=array(2 * bh.N_DRAWS), anatomy=anatomy(body), numbers=numbers(config),
    )  # fmt: skip
    state.stance[..., 0, 1], state.stance[..., 1, 1] = 0.1, -0.1
    return state


def reset(state: MotionState, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
    """Start environments `ids` anew; rngs holds one generator for each of the B environments."""
    arrays, constants = _arrays(state), _constants(state)
    for b in np.asarray(ids).tolist():
        state.spots[b, :, : bh.SPOT_YAW] = np.inf
        state.draws[b] = rngs[b].random(state.draws.shape[1:])
        for w in range(state.activity.shape[1]):
            begin(b, w, *arrays, *constants)


def advance(
    state: MotionState, rngs: Sequence[np.random.Generator], dt_s: float, n_steps: int
) -> WorkerMotion:
    """Move on by n_steps of dt_s; the bodies after each of them.

    Args:
        state: changed in place.
        rngs: one generator an environment, drawn from only when an activity ends.
        dt_s: seconds between poses, positive.
        n_steps: T >= 1.

    Returns:
        Arrays (B, T, W, 22, ...): the poses at dt_s, 2 dt_s, ... after the last call.
    """
    batch, n_workers = state.activity.shape
    motion = _blank((batch, n_steps, n_workers))
    done, ticked = np.zeros(batch, np.int64), np.zeros(batch, np.bool_)
    arrays, constants = _arrays(state), _constants(state)
    body, out = constants[1:], _outputs(motion)
    while _run(float(dt_s), n_steps, done, ticked, *arrays[:9], *body, *out):
        for b in np.flatnonzero(ticked).tolist():
            for w in np.flatnonzero(state.time_s[b] >= state.duration_s[b]).tolist():
                state.draws[b, w, : bh.N_DRAWS] = rngs[b].random(bh.N_DRAWS)
                follow_up(b, w, *arrays, *constants)
    return motion


def current(state: MotionState, ids: Ints | None = None) -> WorkerMotion:
    """The bodies now: arrays (B, W, 22, ...), or of environments `ids` only (len(ids), W, ...)."""
    batch, n_workers = state.activity.shape
    rows = np.arange(batch) if ids is None else np.asarray(ids, np.int64)
    motion = _blank((len(rows), 1, n_workers))
    _draw(rows, *_arrays(state)[:9], *_constants(state)[1:], *_outputs(motion))
    return WorkerMotion(*(array[:, 0] for array in _outputs(motion)))


def activity(state: MotionState) -> Ints:
    """(B, W) what each worker does, an index into `activity_names`."""
    return state.activity.copy()


def _blank(lead: tuple[int, ...]) -> WorkerMotion:
    return WorkerMotion(*(np.empty((*lead, N_SEGMENTS, n)) for n in (3, 4, 3, 3)))


def _outputs(motion: WorkerMotion) -> tuple[Floats, ...]:
    return (
        motion.position_world,
        motion.quaternion_wxyz,
        motion.velocity_world,
        motion.angular_velocity_world,
    )


def _arrays(state: MotionState) -> tuple:
    """What changes, in the order that the compiled functions take it."""
    return (
        state.clock_s, state.time_s, state.duration_s, state.activity, state.plan, state.prints,
        state.stance, state.offset, state.traits, state.spots, state.draws,
    )  # fmt: skip


def _constants(state: MotionState) -> tuple:
    return (state.numbers, state.anatomy.offset, state.anatomy.frame, state.anatomy.size)


@compiled
def _body(
    b: int, w: int, clock_s: Floats, time_s: Floats, activity: Ints, plan: Floats,
    prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats,
    q: Floats, p: Floats, r: Floats,
) -> None:  # fmt: skip
    """Pose and velocities of worker (b, w) now, into (22, ...) arrays."""
    doing, t, clock = activity[b, w], time_s[b, w], clock_s[b, w]
    row, steps, feet = plan[b, w], prints[b, w], stance[b, w]
    left_over, own = offset[b, w], traits[b, w]
    before, after, first, second = p[0], p[1], r[0], r[1]
    evaluate(doing, t, clock, row, steps, feet, left_over, own, size, q)
    pose(q, bones, frame, size, before, first)
    t, clock = t + RATE_H_S, clock + RATE_H_S
    evaluate(doing, t, clock, row, steps, feet, left_over, own, size, q)
    pose(q, bones, frame, size, after, second)
    rate = 1.0 / RATE_H_S
    for s in range(bones.shape[0]):
        for i in range(3):
            position[s, i] = before[s, i]
            velocity[s, i] = (after[s, i] - before[s, i]) * rate
        quaternion(first, s, quaternion_)
        spin(first, second, s, RATE_H_S, turning)


@compiled
def _run(
    dt_s: float, n_steps: int, done: Ints, ticked: Bools,
    clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats,
) -> bool:  # fmt: skip
    """Move every environment on until done or someone must decide; whether anyone must."""
    q, p = np.empty(c.N_CONTROLS), np.zeros((2, N_POINTS, 3))
    r = np.zeros((2, N_FRAMES, 3, 3))
    waiting = False
    for b in range(done.shape[0]):
        while done[b] < n_steps:
            t, due = done[b], False
            for w in range(time_s.shape[1]):
                if not ticked[b]:
                    time_s[b, w] += dt_s
                    clock_s[b, w] += dt_s
                due = due or time_s[b, w] >= duration_s[b, w]
            ticked[b] = due
            if due:
                waiting = True
                break
            for w in range(time_s.shape[1]):
                _body(
                    b, w, clock_s, time_s, activity, plan, prints, stance, offset, traits,
                    bones, frame, size, position[b, t, w], quaternion_[b, t, w],
                    velocity[b, t, w], turning[b, t, w], q, p, r,
                )  # fmt: skip
            done[b] += 1
    return waiting


@compiled
def _draw(
    rows: Ints, clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints, plan: Floats,
    prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats,
) -> None:  # fmt: skip
    """Bodies of some environments as they are, into arrays (rows, 1, W, ...)."""
    q, p = np.empty(c.N_CONTROLS), np.zeros((2, N_POINTS, 3))
    r = np.zeros((2, N_FRAMES, 3, 3))
    for i, b in enumerate(rows):
        for w in range(time_s.shape[1]):
            _body(
                b, w, clock_s, time_s, activity, plan, prints, stance, offset, traits,
                bones, frame, size, position[i, 0, w], quaternion_[i, 0, w],
                velocity[i, 0, w], turning[i, 0, w], q, p, r,
            )  # fmt: skip
