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
from hrc_env.motion.holding import N_HELD, prop_pose
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS, pose, quaternion, spin
from hrc_env.motion.state import RATE_H_S, MotionState, begin, evaluate, follow_up
from hrc_env.records import Held, WorkerMotion, WorkerPath
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
        plan=array(pl.N_PLAN), prints=array(pl.MAX_STEPS, 5), stance=array(2, 5),
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
) -> tuple[WorkerPath, WorkerMotion]:
    """Move on by n_steps of dt_s.

    Args:
        state: changed in place.
        rngs: one generator an environment, drawn from only when an activity ends.
        dt_s: seconds between poses, positive.
        n_steps: T >= 1.

    Returns:
        The bodies' path, arrays (B, T, W, 22, ...) at dt_s, 2 dt_s, ... after the last call,
        and their motion at its end, (B, W, 22, ...).
    """
    batch, n_workers = state.activity.shape
    done, ticked = np.zeros(batch, np.int64), np.zeros(batch, np.bool_)
    arrays, constants = _arrays(state), _constants(state)
    out = _blank((batch, n_steps, n_workers), 3, 4) + _blank((batch, n_workers), 3, 3)
    held = np.empty((batch, n_workers, N_HELD))
    written = (*out, held)
    position, quaternion_, velocity, turning = out
    while _run(float(dt_s), n_steps, done, ticked, *arrays[:9], *constants[1:], *written):
        for b in np.flatnonzero(ticked).tolist():
            for w in np.flatnonzero(state.time_s[b] >= state.duration_s[b]).tolist():
                state.draws[b, w, : bh.N_DRAWS] = rngs[b].random(bh.N_DRAWS)
                follow_up(b, w, *arrays, *constants)
    last = WorkerMotion(position[:, -1], quaternion_[:, -1], velocity, turning, _held(held))
    return WorkerPath(position, quaternion_), last


def current(state: MotionState, ids: Ints | None = None) -> WorkerMotion:
    """The bodies now: arrays (B, W, 22, ...), or of environments `ids` only (len(ids), W, ...)."""
    batch, n_workers = state.activity.shape
    rows = np.arange(batch) if ids is None else np.asarray(ids, np.int64)
    out = _blank((len(rows), n_workers), 3, 4, 3, 3)
    held = np.empty((len(rows), n_workers, N_HELD))
    written = (*out, held)
    _draw(rows, *_arrays(state)[:9], *_constants(state)[1:], *written)
    return WorkerMotion(out[0], out[1], out[2], out[3], _held(held))


def activity(state: MotionState) -> Ints:
    """(B, W) what each worker does, an index into `activity_names`."""
    return state.activity.copy()


def _held(rows: Floats) -> Held:
    """What `prop_pose` wrote into rows (B, W, N_HELD)."""
    return Held(rows[..., 0].astype(np.int64), rows[..., 1:4].copy(), rows[..., 4:].copy())


def _blank(lead: tuple[int, ...], *widths: int) -> tuple[Floats, ...]:
    """An array (*lead, 22, n) for each width n."""
    return tuple(np.empty((*lead, N_SEGMENTS, n)) for n in widths)


def _arrays(state: MotionState) -> tuple:
    """What changes, in the order that the compiled functions take it."""
    return (
        state.clock_s, state.time_s, state.duration_s, state.activity, state.plan, state.prints,
        state.stance, state.offset, state.traits, state.spots, state.draws,
    )  # fmt: skip


def _constants(state: MotionState) -> tuple:
    return (state.numbers, state.anatomy.offset, state.anatomy.frame, state.anatomy.size)


@compiled
def _pose(
    b: int, w: int, later_s: float, clock_s: Floats, time_s: Floats, activity: Ints,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats, q: Floats, p: Floats, r: Floats,
) -> None:  # fmt: skip
    """Worker (b, w) a little later than now: points p and frames r of `kinematics.pose`."""
    t, clock = time_s[b, w] + later_s, clock_s[b, w] + later_s
    evaluate(
        activity[b, w], t, clock, plan[b, w], prints[b, w], stance[b, w], offset[b, w],
        traits[b, w], size, q,
    )  # fmt: skip
    pose(q, bones, frame, size, p, r)


@compiled
def _place(p: Floats, r: Floats, position: Floats, quaternion_: Floats) -> None:
    """Write a pose into (22, ...) arrays."""
    for s in range(position.shape[0]):
        for i in range(3):
            position[s, i] = p[s, i]
        quaternion(r, s, quaternion_)


@compiled
def _rates(p: Floats, r: Floats, velocity: Floats, turning: Floats) -> None:
    """Velocities (22, 3) from the poses now, p[0] and r[0], and RATE_H_S later, p[1] and r[1]."""
    rate = 1.0 / RATE_H_S
    for s in range(velocity.shape[0]):
        for i in range(3):
            velocity[s, i] = (p[1, s, i] - p[0, s, i]) * rate
        spin(r[0], r[1], s, RATE_H_S, turning)


@compiled
def _run(
    dt_s: float, n_steps: int, done: Ints, ticked: Bools,
    clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats, held: Floats,
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
                for i in range(1 if t == n_steps - 1 else 0, -1, -1):
                    _pose(
                        b, w, i * RATE_H_S, clock_s, time_s, activity, plan, prints, stance,
                        offset, traits, bones, frame, size, q, p[i], r[i],
                    )  # fmt: skip
                _place(p[0], r[0], position[b, t, w], quaternion_[b, t, w])
                if t == n_steps - 1:
                    _rates(p, r, velocity[b, w], turning[b, w])
                    prop_pose(q, held[b, w])
            done[b] += 1
    return waiting


@compiled
def _draw(
    rows: Ints, clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints, plan: Floats,
    prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    bones: Floats, frame: Floats, size: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats, held: Floats,
) -> None:  # fmt: skip
    """Bodies of some environments as they are, into arrays (rows, W, ...)."""
    q, p = np.empty(c.N_CONTROLS), np.zeros((2, N_POINTS, 3))
    r = np.zeros((2, N_FRAMES, 3, 3))
    for row, b in enumerate(rows):
        for w in range(time_s.shape[1]):
            for i in range(1, -1, -1):
                _pose(
                    b, w, i * RATE_H_S, clock_s, time_s, activity, plan, prints, stance,
                    offset, traits, bones, frame, size, q, p[i], r[i],
                )  # fmt: skip
            _place(p[0], r[0], position[row, w], quaternion_[row, w])
            _rates(p, r, velocity[row, w], turning[row, w])
            prop_pose(q, held[row, w])
