"""The procedural workers: behaviour, activities and kinematics as one moving batch.

Every activity is a closed form in the time since it began; velocities are its difference quotients.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Held, WorkerMotion, WorkerPath
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Records, Velocities3
from hrc_env.geometry.rotations import matrix
from hrc_env.motion import state as st
from hrc_env.motion.activities.pieces import stage, stocked
from hrc_env.motion.activities.strokes import screws as driven
from hrc_env.motion.anatomy import GRIP_M, HAND, LEFT, SIDE_STRIDE, anatomies
from hrc_env.motion.behaviour import begin_episode, follow_up
from hrc_env.motion.blending import RATE_H_S, evaluate
from hrc_env.motion.clip import Clip, load_clip
from hrc_env.motion.config import PEOPLE, MotionConfig, PeopleConfig, numbers
from hrc_env.motion.decision import (
    ANY_ACTIVITY,
    N_DRAWS,
    BehaviourParams,
    Cast,
    MotionState,
)
from hrc_env.motion.floorplan import floorplan, room_for
from hrc_env.motion.holding import N_HELD, prop_pose
from hrc_env.motion.kinematics import pose, quaternion, spin
from hrc_env.motion.lying import LOAD, at_first, lay_out
from hrc_env.motion.reactions import attend, notice
from hrc_env.motion.schedule import schedule_at
from hrc_env.motion.state import Worker, Workers
from hrc_env.worker.body import N_SEGMENTS, Body
from hrc_env.world import FOOT_M, Grounds, WorkerProgress, WorkerSignal, Workplace

__all__ = [
    "ABSENT", "PEOPLE", "Cast", "Clip", "MotionConfig", "MotionState", "PeopleConfig", "activity",
    "activity_names", "advance", "current", "make_state", "reset", "watch",
]  # fmt: skip

activity_names: tuple[str, ...] = st.ACTIVITY_NAMES
"""Names of the values of `activity`."""
ABSENT = -1
"""The activity of who is not in an episode."""
PARKED_Z_M, HALT_S = -100.0, 0.3
"""Height of who is not in an episode, where no camera looks [m]; hands halt within so long [s]."""

CAST_TRIES = 40
"""So often the beginning of an episode is drawn in which workers are to do certain things."""
NOBODY_CAST: Mapping[int, Cast] = MappingProxyType({})

OPEN_FLOOR = Grounds(
    walkable_x_m=(-0.1, 2.4),
    walkable_y_m=(-2.0, 2.0),
    blocked=np.zeros((0, 5)),
    places=(
        Workplace("left", "floor", (1.4, 0.9), 0.6, 0.0),
        Workplace("right", "floor", (1.6, -0.9), -0.5, 0.0),
        Workplace("aside", "open", (1.0, -1.5), -1.2, 0.0),
        Workplace("behind", "open", (1.9, 0.0), 0.0, 0.0),
    ),
    robot_xy_m=FOOT_M[:2],
    robot_clearance_m=0.8,
)
"""Where workers are whom no scene holds: the laboratory's walkway without its furniture."""


def make_state(
    batch: int, n_workers: int, body: Body, config: MotionConfig,
    grounds: Grounds = OPEN_FLOOR, fewest: int | None = None, robot_girth_m: float = 0.0,
) -> MotionState:  # fmt: skip
    """Workers of `batch` environments, `n_workers` each; call `reset` before use.

    They have the `body`, or each episode gives each one of several, and walk on the `grounds`. At
    least `fewest` of them are in an episode, drawn at its beginning; None: all. A robot that drives
    reaches `robot_girth_m` round what they watch of it; 0: it is an arm.
    """
    fewest = n_workers if fewest is None else fewest
    bones, plan = anatomies(body), floorplan(grounds)
    fit = room_for(plan, config.spacing_m)
    if n_workers > fit:
        raise ConfigError(
            f"n_workers={n_workers}: no more than {fit} fit on these grounds, "
            f"{config.spacing_m} m from each other."
        )
    clips = [m if isinstance(m, Clip) else load_clip(Path(m)) for m in config.motions]
    schedule = schedule_at(config.jobs, {place.kind for place in grounds.places})
    values = numbers(config, grounds.robot_xy_m)
    pieces = stocked(clips, bones.size, stage(plan, config))
    loads = at_first(grounds.places, schedule.jobs)[: None if n_workers else 0]
    mind = BehaviourParams(
        config, values, plan, schedule, pieces, bones, loads, fewest, robot_girth_m
    )
    # What they bring themselves, or receive, needs room, too.
    there = np.zeros((batch, len(loads) + n_workers), LOAD)
    return MotionState(np.zeros((batch, n_workers), st.WORKER), there, mind)


def reset(
    state: MotionState, ids: Ints, rngs: Sequence[np.random.Generator],
    casts: Mapping[int, Cast] = NOBODY_CAST,
) -> None:  # fmt: skip
    """Start environments `ids` anew; rngs holds one generator for each of the B environments.

    `casts` says by environment what is not drawn; the same numbers are drawn with and without one.
    `ConfigError` where workers find no place for an activity with which they are to begin.
    """
    n_workers, fewest = state.workers.shape[1], state.mind.fewest
    for b in np.asarray(ids).tolist():
        bodies = drawn_bodies(rngs[b].random(n_workers), len(state.mind.anatomy.size))
        n = n_workers if fewest == n_workers else int(rngs[b].integers(fewest, n_workers + 1))
        lay_out(state.loads[b], state.mind.loads, rngs[b].spawn(1)[0])
        draws = rngs[b].random((n_workers, 2, N_DRAWS))
        state.minds.pop(b, None)
        if b in casts:
            _begin_as_cast(state, b, (n, bodies), draws, casts[b], rngs[b])
        else:
            begin_episode(state, b, n, bodies, draws)


def _begin_as_cast(
    state: MotionState, b: int, drawn: tuple[int, Ints], draws: Floats, cast: Cast,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Begin the episode of environment b with a cast; draw again until all do as they are to."""
    n, bodies = drawn
    n = n if cast.n_workers is None else cast.n_workers
    if cast.bodies is not None:
        bodies[: len(cast.bodies)] = cast.bodies
    if cast.mind is not None:
        state.minds[b] = cast.mind
    activities, loads = np.array(cast.activities or (), np.int64)[:n], state.loads[b].copy()
    wrong: Ints = np.zeros(0, np.int64)
    for _ in range(CAST_TRIES):
        state.loads[b] = loads
        begin_episode(state, b, n, bodies, draws, activities.tolist())
        begun = state.workers[b]["activity"][: len(activities)]
        wrong = np.flatnonzero((activities != ANY_ACTIVITY) & (begun != activities))
        if not len(wrong):
            return
        draws = rng.random(draws.shape)
    named = ", ".join(f"{activity_names[activities[w]]!r} of worker_{w}" for w in wrong)
    raise ConfigError(
        f"No beginning of an episode with {named} was found in {CAST_TRIES} draws: there are fewer "
        "free places for that than workers. Let fewer workers begin so."
    )


def drawn_bodies(draws: Floats, n_bodies: int) -> Ints:
    """(W,) a body for each worker by draws in [0, 1), no two the same while there are others."""
    bodies, left = np.zeros(len(draws), np.int64), list[int]()
    for w, draw in enumerate(draws.tolist()):
        left = left or list(range(n_bodies))
        bodies[w] = left.pop(int(draw * len(left)))
    return bodies


def advance(
    state: MotionState, rngs: Sequence[np.random.Generator], dt_s: float, n_steps: int
) -> tuple[WorkerPath, WorkerMotion]:
    """Move on by n_steps of dt_s; generators are drawn from only when an activity ends.

    Returns the path, arrays (B, T, W, 22, ...) at dt_s, 2 dt_s, ... after the last call, and the
    motion at its end, (B, W, 22, ...).
    """
    workers, frames = state.workers, state.mind.clips.frames
    batch, n_workers = workers.shape
    done, over = np.zeros(batch, np.int64), np.zeros(workers.shape, np.bool_)
    path, now = _blank((batch, n_steps, n_workers), 3, 4), _blank_now(workers)
    while _move_on(float(dt_s), n_steps, done, over, workers, frames, path, now):
        for b, w in np.argwhere(over).tolist():
            follow_up(state, b, w, rngs[b].random(N_DRAWS))
    last = path[0][:, -1], path[1][:, -1]
    return WorkerPath(*path), _motion(workers, last, now, state.loads)


def watch(
    state: MotionState, elbow_and_tool_world: Floats, motion: WorkerMotion, dt_s: float,
    cue: WorkerSignal | None = None,
) -> None:  # fmt: skip
    """Let the workers see where elbow and tool, or front and back (B, 2, 3), of the robot are, dt_s
    after the last look, and how far what they wait for has come."""
    if cue is not None:
        attend(cue.stage, cue.offered_world, dt_s, state.workers)
    bodies = motion.position_world, motion.velocity_world
    seen = elbow_and_tool_world, *bodies, state.workers
    for mind, rows in _by_mind(state):
        people = mind.config.people
        settings = (people.notice_m, people.fast_m_s, people.calm_s, mind.robot_girth_m)
        for part in (slice(None),) if rows is None else rows:
            notice(dt_s, settings, *(each[part] for each in seen))


def _by_mind(state: MotionState) -> Iterator[tuple[BehaviourParams, list[slice] | None]]:
    """Each set of constants with the environments that it is of; None: all."""
    if not state.minds:
        yield state.mind, None
        return
    of_all = [slice(b, b + 1) for b in range(len(state.workers)) if b not in state.minds]
    yield state.mind, of_all
    for b, mind in state.minds.items():
        yield mind, [slice(b, b + 1)]


def progress(state: MotionState, motion: WorkerMotion) -> WorkerProgress:
    """What workers, whose bodies are in `motion`, have done in the activity that they are in."""
    workers = state.workers
    takes = (workers["activity"] == st.TAKE) & (workers["time_s"] > workers["out_at"])
    screws, boring = np.zeros(workers.shape, np.int64), np.zeros(workers.shape, np.bool_)
    _deeds(workers, screws, boring)
    return WorkerProgress(
        workers["present"].copy(), screws, boring, takes, *_gripping(workers, motion)
    )


def _gripping(workers: Workers, motion: WorkerMotion) -> tuple[Points3, Velocities3]:
    """(B, W, 3) where the hand that each uses grips, and how fast it is."""
    hands = (LEFT + HAND + SIDE_STRIDE * workers["side"])[..., None, None]

    def of_hand(values: Floats) -> Floats:
        return np.take_along_axis(values, hands, axis=2)[:, :, 0]

    bone = np.take_along_axis(workers["frame"][..., 0, :], hands, axis=2)[:, :, 0]
    arm = (matrix(of_hand(motion.quaternion_wxyz)) @ (GRIP_M * bone)[..., None])[..., 0]
    turning = np.cross(of_hand(motion.angular_velocity_world), arm)
    return of_hand(motion.position_world) + arm, of_hand(motion.velocity_world) + turning


@kernel
def _deeds(workers: Workers, n_screws: Ints, boring: Bools) -> None:
    for b, w in np.ndindex(workers.shape):
        if workers[b, w].activity == st.SCREW:
            n_screws[b, w], boring[b, w] = driven(workers[b, w])


def current(state: MotionState, ids: Ints | None = None) -> WorkerMotion:
    """The bodies now: arrays (B, W, 22, ...), or of environments `ids` only (len(ids), W, ...)."""
    rows = slice(None) if ids is None else np.asarray(ids, np.int64)
    return bodies_of(state.workers[rows], state.mind.clips.frames, state.loads[rows])


def bodies_of(workers: Workers, frames: Floats, loads: Records | None = None) -> WorkerMotion:
    """The bodies of workers (B, W) at their times; `frames` are of the clips, loads (B, L) lie
    about."""
    place, now = _blank(workers.shape, 3, 4), _blank_now(workers)
    _bodies_now(workers, frames, place, now)
    return _motion(workers, place, now, loads)


def activity(state: MotionState) -> Ints:
    """(B, W) what each worker does: an index into `activity_names`, or `ABSENT`."""
    return np.where(state.workers["present"], state.workers["activity"], ABSENT)


Places = tuple[Floats, ...]
"""Positions and quaternions (..., 22, 3 or 4)."""
Now = tuple[Floats, ...]
"""Velocities, angular velocities (..., 22, 3), what is held (..., N_HELD)."""


def _motion(
    workers: Workers, place: Places, now: Now, loads: Records | None = None
) -> WorkerMotion:
    (position, turn), (velocity, turning, rows) = place, now
    if loads is not None:
        rows = np.concatenate([rows, loads["shown"]], axis=1)
    held = Held(rows[..., 0].astype(np.int64), rows[..., 1:4].copy(), rows[..., 4:].copy())
    return WorkerMotion(position, turn, velocity, turning, held, workers["body"].copy())


def _blank(lead: tuple[int, ...], *widths: int) -> Places:
    """An array (*lead, 22, n) for each width n."""
    return tuple(np.empty((*lead, N_SEGMENTS, n)) for n in widths)


def _blank_now(workers: Workers) -> Now:
    return *_blank(workers.shape, 3, 3), np.empty((*workers.shape, N_HELD))


@kernel
def _move_on(
    dt_s: float, n_steps: int, done: Ints, over: Bools, workers: Workers, frames: Floats,
    path: Places, now: Now,
) -> bool:  # fmt: skip
    """Move every environment on until done or someone must decide; whether anyone must.

    Whose activities are `over` (B, W), done or taken back to their beginning, have decided.
    """
    waiting = False
    for b in range(done.shape[0]):
        while done[b] < n_steps:
            t, ticked, due = done[b], over[b].any(), False
            for w in range(workers.shape[1]):
                me = workers[b, w]
                if not ticked:
                    _tick(dt_s, me)
                back = me.pace < 0.0 and me.time_s <= 0.0
                over[b, w] = back or me.time_s >= me.duration_s
                due = due or over[b, w]
            if due:
                waiting = True
                break
            for w in range(workers.shape[1]):
                me = workers[b, w]
                last = t == n_steps - 1
                if last:
                    _rates_of(frames, now[0][b, w], now[1][b, w], me)
                    prop_pose(now[2][b, w], me)
                else:
                    _pose(0.0, frames, me)
                _place(path[0][b, t, w], path[1][b, t, w], me)
            done[b] += 1
    return waiting


@kernel
def _bodies_now(workers: Workers, frames: Floats, path: Places, now: Now) -> None:
    """Bodies as they are, into arrays (B, W, ...)."""
    for b, w in np.ndindex(workers.shape):
        me = workers[b, w]
        _rates_of(frames, now[0][b, w], now[1][b, w], me)
        prop_pose(now[2][b, w], me)
        _place(path[0][b, w], path[1][b, w], me)


@kernel
def _tick(dt_s: float, me: Worker) -> None:
    """Let time go on at the worker's pace, which comes nearer to the wished one."""
    most = dt_s / HALT_S
    me.pace += min(max(me.pace_wished - me.pace, -most), most)
    me.time_s += dt_s * me.pace
    me.clock_s += dt_s


@kernel
def _pose(later_s: float, frames: Floats, me: Worker) -> None:
    """A worker a little later than now: q, p and r."""
    evaluate(me.time_s + me.pace * later_s, me.clock_s + later_s, frames, me)
    pose(me)


@kernel
def _rates_of(frames: Floats, velocity: Floats, turning: Floats, me: Worker) -> None:
    """The pose now, and velocities (22, 3) from that RATE_H_S later."""
    _pose(RATE_H_S, frames, me)
    me.later_p = me.p
    me.later_r = me.r
    _pose(0.0, frames, me)
    rate = 1.0 / RATE_H_S
    for s in range(velocity.shape[0]):
        for i in range(3):
            velocity[s, i] = (me.later_p[s, i] - me.p[s, i]) * rate
        spin(me.r, me.later_r, s, RATE_H_S, turning)


@kernel
def _place(position: Floats, quaternion_: Floats, me: Worker) -> None:
    """Write a pose into (22, ...) arrays; far below the floor of who is not there."""
    down = 0.0 if me.present else PARKED_Z_M
    for s in range(position.shape[0]):
        for i in range(3):
            position[s, i] = me.p[s, i]
        position[s, 2] += down
        quaternion(me.r, s, quaternion_)
