"""The procedural worker: behaviour, activities and kinematics as one moving batch.

Every activity is a closed form in the time since it began, so that a moment can be evaluated
anywhere, nothing is precomputed, and velocities come from the closed form itself.
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Grounds, Held, WorkerMotion, WorkerPath, Workplace
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion import state as st
from hrc_env.motion.anatomy import anatomies
from hrc_env.motion.behaviour import begin_episode, follow_up
from hrc_env.motion.clip import Clip, opened
from hrc_env.motion.config import MotionConfig, numbers
from hrc_env.motion.errands import errands_at
from hrc_env.motion.floorplan import floorplan, room_for
from hrc_env.motion.generator_kernel import bodies_now, move_on
from hrc_env.motion.holding import N_HELD
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS
from hrc_env.motion.people import PEOPLE, PeopleConfig
from hrc_env.motion.playing import Clips, stocked
from hrc_env.motion.reactions import notice
from hrc_env.motion.state import MotionState
from hrc_env.motion.who import N_DRAWS
from hrc_env.worker.body import N_SEGMENTS, Body

__all__ = [
    "ABSENT",
    "PEOPLE",
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

activity_names: tuple[str, ...] = pl.ACTIVITY_NAMES
"""Names of the values of `activity`."""
ABSENT = -1
"""The activity of who is not in an episode."""

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
    robot_xy_m=(-0.75, 0.0),
    robot_front_rad=0.0,
    robot_clearance_m=0.8,
)
"""Where workers are whom no scene holds: the laboratory's walkway without its furniture."""


def make_state(
    batch: int, n_workers: int, body: Body, config: MotionConfig,
    grounds: Grounds = OPEN_FLOOR, fewest: int | None = None,
) -> MotionState:  # fmt: skip
    """Arrays for `batch` environments of `n_workers` each; call `reset` before use.

    Args:
        batch: environments.
        n_workers: workers whom each has room for.
        body: of all of them, or those of which each episode gives each worker one.
        config: settings.
        grounds: where they walk and work.
        fewest: so many workers are in an episode at least, drawn at its beginning; None: all.

    Raises:
        ConfigError: negative sizes, more workers than fit, a place in a wall, a clip that
            cannot be played.
    """
    if batch < 1 or n_workers < 0:
        raise ConfigError(f"Need batch >= 1 and n_workers >= 0, got {batch} and {n_workers}.")
    fewest = n_workers if fewest is None else fewest
    if not 0 <= fewest <= n_workers:
        raise ConfigError(f"The fewest workers must be 0 to {n_workers}, got {fewest}.")

    bones = anatomies(body)
    clips = stocked([opened(motion) for motion in config.motions], bones.size)
    mind = _mind(config, grounds, clips, n_workers, fewest)

    def array(*shape: int) -> Floats:
        return np.zeros((batch, n_workers, *shape))

    return MotionState(
        clock_s=array(), time_s=array(), duration_s=array(),
        activity=np.zeros((batch, n_workers), np.int64),
        plan=array(pl.N_PLAN), prints=array(pl.MAX_STEPS, 5), stance=array(2, 5),
        offset=array(c.N_BLENDED, 2), traits=array(pl.N_TRAITS), pace=array(2),
        spots=array(st.N_SPOT), errand=np.zeros((batch, n_workers, st.N_ERRAND), np.int64),
        alert=array(st.N_ALERT), robot=np.full((batch, 2, 3), np.inf), present=array(),
        body=np.zeros((batch, n_workers), np.int64), anatomy=bones,
        mind=mind,
    )  # fmt: skip


def _mind(
    config: MotionConfig, grounds: Grounds, clips: Clips, n_workers: int, fewest: int
) -> st.Mind:
    """The constants of decisions."""
    plan = floorplan(grounds)
    fit = room_for(plan, config.spacing_m)
    if n_workers > fit:
        raise ConfigError(
            f"n_workers={n_workers}: no more than {fit} fit on these grounds, "
            f"{config.spacing_m} m from each other."
        )
    places: dict[str, tuple[Workplace, ...]] = {}
    for place in plan.places:
        places[place.kind] = (*places.get(place.kind, ()), place)
    errands = errands_at(config.tasks, tuple(places))
    values = numbers(config, grounds.robot_xy_m)
    return st.Mind(config, values, plan, errands, places, clips, fewest)


def reset(state: MotionState, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
    """Start environments `ids` anew; rngs holds one generator for each of the B environments."""
    n_workers, fewest = state.activity.shape[1], state.mind.fewest
    for b in np.asarray(ids).tolist():
        state.body[b] = drawn_bodies(rngs[b].random(n_workers), len(state.anatomy.size))
        n = n_workers if fewest == n_workers else int(rngs[b].integers(fewest, n_workers + 1))
        begin_episode(state, b, n, rngs[b].random((n_workers, 2, N_DRAWS)))


def drawn_bodies(draws: Floats, n_bodies: int) -> Ints:
    """(W,) a body for each worker by draws (W,) in [0, 1), no two the same as long as there are
    others."""
    bodies, left = np.zeros(len(draws), np.int64), list[int]()
    for w, draw in enumerate(draws.tolist()):
        left = left or list(range(n_bodies))
        bodies[w] = left.pop(int(draw * len(left)))
    return bodies


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
    arrays = _arrays(state)
    out = _blank((batch, n_steps, n_workers), 3, 4) + _blank((batch, n_workers), 3, 3)
    position, quaternion_, velocity, turning = out
    held = np.empty((batch, n_workers, N_HELD))
    rest: tuple = (*out, held, *_room())
    while move_on(float(dt_s), n_steps, done, ticked, *arrays, *rest):
        for b in np.flatnonzero(ticked).tolist():
            for w in np.flatnonzero(_over(state, b)).tolist():
                follow_up(state, b, w, rngs[b].random(N_DRAWS))
    last = position[:, -1], quaternion_[:, -1], velocity, turning, _held(held)
    return WorkerPath(position, quaternion_), WorkerMotion(*last, state.body.copy())


def _over(state: MotionState, b: int) -> Bools:
    """(W,) whose activity is over: done, or taken back to its beginning."""
    time_s = state.time_s[b]
    return (time_s >= state.duration_s[b]) | ((time_s <= 0.0) & (state.pace[b, :, 0] < 0.0))


def watch(
    state: MotionState, elbow_and_tool_world: Floats, motion: WorkerMotion, dt_s: float
) -> None:
    """Let the workers see the robot; they react in the steps to come.

    Args:
        state: changed in place.
        elbow_and_tool_world: (B, 2, 3) where these truly are [m].
        motion: the workers now.
        dt_s: since they last looked [s].
    """
    people = state.mind.config.people
    notice(
        dt_s, (people.notice_m, people.fast_m_s, people.calm_s), elbow_and_tool_world,
        state.robot, motion.position_world, state.present, state.alert, state.pace,
        state.clock_s, state.time_s, state.duration_s, state.activity, state.plan, state.prints,
        state.stance, state.body, state.anatomy.size,
    )  # fmt: skip


def current(state: MotionState, ids: Ints | None = None) -> WorkerMotion:
    """The bodies now: arrays (B, W, 22, ...), or of environments `ids` only (len(ids), W, ...)."""
    batch, n_workers = state.activity.shape
    rows = np.arange(batch) if ids is None else np.asarray(ids, np.int64)
    out = _blank((len(rows), n_workers), 3, 4, 3, 3)
    held = np.empty((len(rows), n_workers, N_HELD))
    rest: tuple = (*out, held, *_room())
    bodies_now(rows, *_arrays(state), *rest)
    return WorkerMotion(out[0], out[1], out[2], out[3], _held(held), state.body[rows])


def activity(state: MotionState) -> Ints:
    """(B, W) what each worker does: an index into `activity_names`, or `ABSENT`."""
    return np.where(state.present > 0.0, state.activity, ABSENT)


def _held(rows: Floats) -> Held:
    """What `prop_pose` wrote into rows (B, W, N_HELD)."""
    return Held(rows[..., 0].astype(np.int64), rows[..., 1:4].copy(), rows[..., 4:].copy())


def _blank(lead: tuple[int, ...], *widths: int) -> tuple[Floats, ...]:
    """An array (*lead, 22, n) for each width n."""
    return tuple(np.empty((*lead, N_SEGMENTS, n)) for n in widths)


def _room() -> tuple[Floats, Floats, Floats]:
    """Room to work in: a control vector, points and frames of two moments."""
    return np.empty(c.N_CONTROLS), np.zeros((2, N_POINTS, 3)), np.zeros((2, N_FRAMES, 3, 3))


def _arrays(state: MotionState) -> tuple:
    """What a pose follows from, in the order that the compiled functions take it."""
    return (
        state.clock_s, state.time_s, state.duration_s, state.activity, state.pace, state.plan,
        state.prints, state.stance, state.offset, state.traits, state.present, state.body,
        state.anatomy.offset, state.anatomy.frame, state.anatomy.size, state.mind.clips.frames,
    )  # fmt: skip
