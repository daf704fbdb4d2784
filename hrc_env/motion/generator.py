"""Batched simulation of the workers: behaviour, activities and kinematics.

The pose in each activity is a closed-form function of the time since its beginning. Velocities are
computed by finite differences.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records2
from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Held, WorkerMotion, WorkerPath
from hrc_env.core.typing import Bools, Floats, Ints, Points3, QuaternionsWxyz, Velocities3
from hrc_env.geometry.rotations import matrix
from hrc_env.motion import state as st
from hrc_env.motion.activities.pieces import cut_clips, make_stage
from hrc_env.motion.activities.strokes import count_screws
from hrc_env.motion.anatomy import GRIP_M, HAND, LEFT, SIDE_STRIDE, measure_bodies
from hrc_env.motion.behaviour import begin_episode, begin_next_activity
from hrc_env.motion.blending import RATE_H_S, evaluate
from hrc_env.motion.clip import Clip, load_clip
from hrc_env.motion.config import PEOPLE, MotionConfig, PeopleConfig, make_hand_params
from hrc_env.motion.decision import (
    ANY_ACTIVITY,
    N_DRAWS,
    BehaviourParams,
    Cast,
    MotionState,
)
from hrc_env.motion.floorplan import count_room, make_floorplan
from hrc_env.motion.holding import N_HELD, write_prop_pose
from hrc_env.motion.kinematics import pose, write_angular_velocity, write_quaternion
from hrc_env.motion.lying import LOAD, Load, make_loads, reset_loads
from hrc_env.motion.points import Point
from hrc_env.motion.reactions import NoticeParams, follow_signal, notice_robot
from hrc_env.motion.schedule import make_schedule
from hrc_env.motion.scripted import draw_reaches, make_reaches
from hrc_env.motion.state import Worker
from hrc_env.worker.body import N_SEGMENTS, Body
from hrc_env.world import FOOT_M, Grounds, WorkerProgress, WorkerSignal, Workplace

__all__ = [
    "ABSENT",
    "PEOPLE",
    "Cast",
    "Clip",
    "MotionConfig",
    "MotionState",
    "PeopleConfig",
    "activity",
    "activity_names",
    "advance",
    "current",
    "make_state",
    "reset",
    "watch",
]

activity_names: tuple[str, ...] = st.ACTIVITY_NAMES
"""Name of each activity, by the index that `activity` returns."""
ABSENT = -1
"""Value of `activity` for an absent worker."""
PARKED_Z_M = -100.0
"""Height of absent workers, out of sight of all cameras [m]."""
HALT_S = 0.3
"""Time in which moving hands come to a halt [s]."""

CAST_TRIES = 40
"""Number of attempts to sample an episode that begins with the prescribed activities."""
NOBODY_CAST: Mapping[int, Cast] = MappingProxyType({})
"""Empty mapping of casts, with which all episodes are random."""

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
"""Floor for workers without a scene: the walkway of the laboratory, without furniture."""


class BodyPath(NamedTuple):
    """Positions and orientations of bodies in the world frame."""

    position: Points3
    """Origins (..., 22, 3) of the segments [m]."""
    quaternion: QuaternionsWxyz
    """Orientations (..., 22, 4) of the segments, scalar first."""


class BodyRates(NamedTuple):
    """Velocities of bodies in the world frame, and the props held by them."""

    velocity: Velocities3
    """Velocities (..., 22, 3) of the origins of the segments [m/s]."""
    angular_velocity: Floats
    """Angular velocities (..., 22, 3) of the segments [rad/s]."""
    held: Floats
    """Held props (..., N_HELD); `holding.N_HELD` describes the columns."""


class Advance(NamedTuple):
    """Motion of workers over several steps."""

    path: WorkerPath
    """Paths of the bodies, arrays (B, T, W, 22, ...)."""
    motion: WorkerMotion
    """Motion of the bodies after the last step, arrays (B, W, 22, ...)."""


class Grip(NamedTuple):
    """Grip of the hand that each worker uses."""

    position: Points3
    """Position (B, W, 3) of the grip in the world [m]."""
    velocity: Velocities3
    """Velocity (B, W, 3) of the grip [m/s]."""


class MindGroup(NamedTuple):
    """Environments with the same constants of behaviour."""

    mind: BehaviourParams
    """Constants of the behaviour."""
    parts: tuple[slice, ...]
    """Slices of the batch that contain the environments."""


def make_state(
    batch: int,
    n_workers: int,
    body: Body,
    config: MotionConfig,
    grounds: Grounds = OPEN_FLOOR,
    fewest: int | None = None,
    robot_girth_m: float = 0.0,
) -> MotionState:
    """Allocate the state of the workers of a batch of environments; call `reset` before use.

    Args:
        batch: number of environments.
        n_workers: maximum number of workers in each environment.
        body: body of all workers, or a pool from which the bodies are sampled in each episode.
        config: settings of the motion.
        grounds: floor of the scene.
        fewest: minimum number of workers in an episode, if their number is random; None if it is
            always `n_workers`.
        robot_girth_m: radius of a mobile robot around its two points that workers watch [m];
            0 for an arm.

    Raises:
        ConfigError: the floor has no room for this number of workers, or for a clip, or a script
            of reaches is invalid.
    """
    fewest = n_workers if fewest is None else fewest
    reaches = make_reaches(config, n_workers, robot_girth_m > 0.0)
    bones, plan = measure_bodies(body), make_floorplan(grounds)
    fit = count_room(plan, config.spacing_m)
    if n_workers > fit:
        raise ConfigError(
            f"n_workers={n_workers}: at most {fit} fit into this scene, {config.spacing_m} m from "
            "each other."
        )
    clips = [m if isinstance(m, Clip) else load_clip(Path(m)) for m in config.motions]
    schedule = make_schedule(config.jobs, {place.kind for place in grounds.places})
    hand_params = make_hand_params(config, Point(*grounds.robot_xy_m))
    pieces = cut_clips(clips, bones.lengths, make_stage(plan, config))
    loads = make_loads(grounds.places, schedule.jobs)[: None if n_workers else 0]
    mind = BehaviourParams(
        config, hand_params, plan, schedule, pieces, bones, loads, fewest, robot_girth_m, reaches
    )
    # One more row per worker, because each may bring or receive a load.
    rows = np.zeros((batch, len(loads) + n_workers), LOAD)
    return MotionState(np.zeros((batch, n_workers), st.WORKER), rows, mind)


def reset(
    state: MotionState,
    ids: Ints,
    rngs: Sequence[np.random.Generator],
    casts: Mapping[int, Cast] = NOBODY_CAST,
) -> None:
    """Begin new episodes of some environments.

    Args:
        state: state of all workers, which is changed.
        ids: environments (N,).
        rngs: random number generators, one for each of the B environments.
        casts: prescribed parts of episodes, by environment; the random numbers are the same with
            and without a cast.

    Raises:
        ConfigError: there is no workplace for a prescribed first activity.
    """
    n_workers, fewest = state.workers.shape[1], state.mind.fewest
    for b in np.asarray(ids).tolist():
        bodies = draw_bodies(rngs[b].random(n_workers), len(state.mind.anatomy.lengths))
        n = n_workers if fewest == n_workers else int(rngs[b].integers(fewest, n_workers + 1))
        reset_loads(state.loads[b], state.mind.loads, rngs[b].spawn(1)[0])
        draws = rngs[b].random((n_workers, 2, N_DRAWS))
        state.minds.pop(b, None)
        mind = casts[b].mind if b in casts else None
        _begin_script(state, b, state.mind if mind is None else mind, rngs[b])
        if b in casts:
            _begin_cast_episode(state, b, n, bodies, draws, casts[b], rngs[b])
        else:
            begin_episode(state, b, n, bodies, draws)


def _begin_script(
    state: MotionState, b: int, mind: BehaviourParams, rng: np.random.Generator
) -> None:
    """Store the script of an episode of environment b, if its worker has one."""
    state.scripts.pop(b, None)
    if script := draw_reaches(mind.reaches, mind.config, rng):
        state.scripts[b] = script


def _begin_cast_episode(
    state: MotionState,
    b: int,
    n_present: int,
    bodies: Ints,
    draws: Floats,
    cast: Cast,
    rng: np.random.Generator,
) -> None:
    """Begin an episode in which workers and first activities are prescribed.

    The episode is sampled again until all workers begin with their prescribed activities.

    Args:
        state: state of all workers, which is changed.
        b: index of the environment.
        n_present: sampled number of workers.
        bodies: sampled row (W,) of each worker's body in the pool.
        draws: uniform random numbers (W, 2, N_DRAWS) in [0, 1).
        cast: prescribed parts of the episode.
        rng: random number generator for further samples.
    """
    n = n_present if cast.n_workers is None else cast.n_workers
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
        f"No start of an episode with {named} was found in {CAST_TRIES} draws: there are fewer "
        "free positions for it than workers. Let fewer workers begin with this activity."
    )


def draw_bodies(draws: Floats, n_bodies: int) -> Ints:
    """Select the body (W,) of each worker by random numbers, without repetition if possible."""
    bodies, left = np.zeros(len(draws), np.int64), list[int]()
    for w, draw in enumerate(draws.tolist()):
        left = left or list(range(n_bodies))
        bodies[w] = left.pop(int(draw * len(left)))
    return bodies


def advance(
    state: MotionState, rngs: Sequence[np.random.Generator], dt_s: float, n_steps: int
) -> Advance:
    """Advance all workers by a number of steps.

    Args:
        state: state of all workers, which is changed.
        rngs: random number generators, one for each environment; they are used only when an
            activity ends.
        dt_s: duration of a step [s].
        n_steps: number of steps T.

    Returns:
        The paths at the times dt_s, 2 dt_s, ..., n_steps dt_s from now, and the bodies at the end.
    """
    workers, frames = state.workers, state.mind.clips.frames
    batch, n_workers = workers.shape
    done, over = np.zeros(batch, np.int64), np.zeros(workers.shape, np.bool_)
    path, rates = _make_path((batch, n_steps, n_workers)), _make_rates(workers.shape)
    while _advance_until_decision(float(dt_s), n_steps, done, over, workers, frames, path, rates):
        for b, w in np.argwhere(over).tolist():
            begin_next_activity(state, b, w, rngs[b].random(N_DRAWS))
    last = BodyPath(path.position[:, -1], path.quaternion[:, -1])
    motion = _make_motion(workers, last, rates, state.loads)
    return Advance(WorkerPath(path.position, path.quaternion), motion)


def watch(
    state: MotionState,
    elbow_and_tool_world: Floats,
    motion: WorkerMotion,
    dt_s: float,
    cue: WorkerSignal | None = None,
) -> None:
    """Update the workers' reactions to the robot and to the task's signal.

    Args:
        state: state of all workers, which is changed.
        elbow_and_tool_world: positions (B, 2, 3) of the elbow and tool of each arm, or of the front
            and back of each mobile robot [m].
        motion: motion of the workers' bodies.
        dt_s: time since the last call [s].
        cue: signal of the task to the workers; None if the task has no signal.
    """
    if cue is not None:
        follow_signal(cue.stage, cue.offered_world, dt_s, state.workers)
    for mind, parts in _group_by_mind(state):
        people = mind.config.people
        params = NoticeParams(people.notice_m, people.fast_m_s, people.calm_s, mind.robot_girth_m)
        for part in parts:
            notice_robot(
                dt_s,
                params,
                elbow_and_tool_world[part],
                motion.position_world[part],
                motion.velocity_world[part],
                state.workers[part],
            )


def _group_by_mind(state: MotionState) -> Iterator[MindGroup]:
    """Yield each set of behaviour constants with the environments that use it."""
    if not state.minds:
        yield MindGroup(state.mind, (slice(None),))
        return
    common = [slice(b, b + 1) for b in range(len(state.workers)) if b not in state.minds]
    yield MindGroup(state.mind, tuple(common))
    for b, mind in state.minds.items():
        yield MindGroup(mind, (slice(b, b + 1),))


def progress(state: MotionState, motion: WorkerMotion) -> WorkerProgress:
    """Return the progress of all workers in their current activity.

    Args:
        state: state of all workers.
        motion: motion of the workers' bodies.
    """
    workers = state.workers
    takes = (workers["activity"] == st.TAKE) & (workers["time_s"] > workers["out_at"])
    screws, boring = np.zeros(workers.shape, np.int64), np.zeros(workers.shape, np.bool_)
    _count_work(workers, screws, boring)
    grip = _measure_grip(workers, motion)
    return WorkerProgress(
        workers["is_present"].copy(), screws, boring, takes, grip.position, grip.velocity
    )


def _measure_grip(workers: Records2[Worker], motion: WorkerMotion) -> Grip:
    """Return the position and velocity of the grip of the hand that each worker uses."""
    hands = (LEFT + HAND + SIDE_STRIDE * workers["side"])[..., None, None]

    def of_hand(values: Floats) -> Floats:
        """Return the rows (B, W, ...) of the used hands."""
        return np.take_along_axis(values, hands, axis=2)[:, :, 0]

    bone = np.take_along_axis(workers["frame"][..., 0, :], hands, axis=2)[:, :, 0]
    arm = (matrix(of_hand(motion.quaternion_wxyz)) @ (GRIP_M * bone)[..., None])[..., 0]
    turning = np.cross(of_hand(motion.angular_velocity_world), arm)
    velocity = of_hand(motion.velocity_world) + turning
    return Grip(of_hand(motion.position_world) + arm, velocity)


@kernel
def _count_work(workers: Records2[Worker], n_screws: Ints, boring: Bools) -> None:
    """Count the screws driven by each worker, and determine whether one is being driven.

    The results are written to `n_screws` and `boring`.
    """
    for b, w in np.ndindex(workers.shape):
        if workers[b, w].activity == st.SCREW:
            progress = count_screws(workers[b, w])
            n_screws[b, w], boring[b, w] = progress.n_done, progress.is_driving


def current(state: MotionState, ids: Ints | None = None) -> WorkerMotion:
    """Return the current motion (B, W, 22, ...) of the workers of all environments or of `ids`."""
    rows = slice(None) if ids is None else np.asarray(ids, np.int64)
    return evaluate_motion(state.workers[rows], state.mind.clips.frames, state.loads[rows])


def evaluate_motion(
    workers: Records2[Worker], frames: Floats, loads: Records2[Load] | None = None
) -> WorkerMotion:
    """Return the motion of the workers' bodies at the current times of their activities.

    Args:
        workers: records (B, W).
        frames: frames of all clips.
        loads: loads (B, L) at rest in the scene.
    """
    path, rates = _make_path(workers.shape), _make_rates(workers.shape)
    _evaluate_bodies(workers, frames, path, rates)
    return _make_motion(workers, path, rates, loads)


def activity(state: MotionState) -> Ints:
    """Return the activity (B, W) of each worker, an index into `activity_names` or `ABSENT`."""
    return np.where(state.workers["is_present"], state.workers["activity"], ABSENT)


def _make_motion(
    workers: Records2[Worker],
    path: BodyPath,
    rates: BodyRates,
    loads: Records2[Load] | None = None,
) -> WorkerMotion:
    """Return the motion of bodies (B, W, ...), with held props and the loads (B, L) at rest."""
    rows = rates.held
    if loads is not None:
        rows = np.concatenate([rows, loads["shown"]], axis=1)
    held = Held(rows[..., 0].astype(np.int64), rows[..., 1:4].copy(), rows[..., 4:].copy())
    return WorkerMotion(
        path.position,
        path.quaternion,
        rates.velocity,
        rates.angular_velocity,
        held,
        workers["body"].copy(),
    )


def _make_path(lead: tuple[int, ...]) -> BodyPath:
    """Return uninitialized arrays for bodies with given leading axes."""
    return BodyPath(np.empty((*lead, N_SEGMENTS, 3)), np.empty((*lead, N_SEGMENTS, 4)))


def _make_rates(lead: tuple[int, ...]) -> BodyRates:
    """Return uninitialized arrays for bodies with given leading axes."""
    shape = (*lead, N_SEGMENTS, 3)
    return BodyRates(np.empty(shape), np.empty(shape), np.empty((*lead, N_HELD)))


@kernel
def _advance_until_decision(
    dt_s: float,
    n_steps: int,
    done: Ints,
    over: Bools,
    workers: Records2[Worker],
    frames: Floats,
    path: BodyPath,
    rates: BodyRates,
) -> bool:
    """Advance each environment until all steps are completed or a worker has to decide.

    Args:
        dt_s: duration of a step [s].
        n_steps: number of steps.
        done: number (B,) of completed steps, which is increased.
        over: mask (B, W) of the activities that have ended or have been reversed to their
            beginning; these workers must decide before the next call.
        workers: records (B, W), which are changed.
        frames: frames of all clips.
        path: path of the bodies, which is written.
        rates: rates after the last step, which are written.

    Returns:
        Whether any worker has to decide.
    """
    waiting = False
    for b in range(done.shape[0]):
        while done[b] < n_steps:
            t, ticked, due = done[b], over[b].any(), False
            for w in range(workers.shape[1]):
                worker = workers[b, w]
                if not ticked:
                    _tick(dt_s, worker)
                back = worker.pace < 0.0 and worker.time_s <= 0.0
                over[b, w] = back or worker.time_s >= worker.duration_s
                due = due or over[b, w]
            if due:
                waiting = True
                break
            for w in range(workers.shape[1]):
                worker = workers[b, w]
                last = t == n_steps - 1
                if last:
                    _evaluate_rates(
                        frames, rates.velocity[b, w], rates.angular_velocity[b, w], worker
                    )
                    write_prop_pose(rates.held[b, w], worker)
                else:
                    _pose_at(0.0, frames, worker)
                _write_pose(path.position[b, t, w], path.quaternion[b, t, w], worker)
            done[b] += 1
    return waiting


@kernel
def _evaluate_bodies(
    workers: Records2[Worker], frames: Floats, path: BodyPath, rates: BodyRates
) -> None:
    """Compute the current poses and velocities of all bodies.

    Args:
        workers: records (B, W).
        frames: frames of all clips.
        path: poses (B, W, ...), which are written.
        rates: rates (B, W, ...), which are written.
    """
    for b, w in np.ndindex(workers.shape):
        worker = workers[b, w]
        _evaluate_rates(frames, rates.velocity[b, w], rates.angular_velocity[b, w], worker)
        write_prop_pose(rates.held[b, w], worker)
        _write_pose(path.position[b, w], path.quaternion[b, w], worker)


@kernel
def _tick(dt_s: float, worker: Worker) -> None:
    """Advance the clocks of a worker by a time step [s], and adjust the pace towards its target."""
    most = dt_s / HALT_S
    worker.pace += min(max(worker.wanted_pace - worker.pace, -most), most)
    worker.time_s += dt_s * worker.pace
    worker.clock_s += dt_s


@kernel
def _pose_at(later_s: float, frames: Floats, worker: Worker) -> None:
    """Compute the pose (`q`, `p` and `r`) of a worker at a later time.

    Args:
        later_s: time from now [s].
        frames: frames of all clips.
        worker: record of the worker.
    """
    evaluate(worker.time_s + worker.pace * later_s, worker.clock_s + later_s, frames, worker)
    pose(worker)


@kernel
def _evaluate_rates(frames: Floats, velocity: Floats, turning: Floats, worker: Worker) -> None:
    """Compute the current pose of a worker, and velocities from the pose `RATE_H_S` later.

    Args:
        frames: frames of all clips.
        velocity: velocities (22, 3), which are written [m/s].
        turning: angular velocities (22, 3), which are written [rad/s].
        worker: record of the worker.
    """
    _pose_at(RATE_H_S, frames, worker)
    worker.later_p = worker.p
    worker.later_r = worker.r
    _pose_at(0.0, frames, worker)
    rate = 1.0 / RATE_H_S
    for segment in range(velocity.shape[0]):
        for i in range(3):
            velocity[segment, i] = (worker.later_p[segment, i] - worker.p[segment, i]) * rate
        write_angular_velocity(worker.r, worker.later_r, segment, RATE_H_S, turning)


@kernel
def _write_pose(position: Floats, quaternion: Floats, worker: Worker) -> None:
    """Copy the pose of a worker to arrays; an absent worker is placed far below the floor.

    Args:
        position: origins (22, 3), which are written [m].
        quaternion: orientations (22, 4), which are written.
        worker: record of the worker.
    """
    down = 0.0 if worker.is_present else PARKED_Z_M
    for segment in range(position.shape[0]):
        for i in range(3):
            position[segment, i] = worker.p[segment, i]
        position[segment, 2] += down
        write_quaternion(worker.r, segment, quaternion)
