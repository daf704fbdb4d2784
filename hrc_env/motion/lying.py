"""Loads at rest in the scene, initially in piles and later where workers have laid them down.

The number of loads is constant. A worker picks up the uppermost load at a workplace; a load that is
laid down remains there, on top of the loads below it, until a reset restores the piles.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, dtype_of
from hrc_env.core.errors import make_unknown_name_error
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities.going import CART, WHEELBARROW
from hrc_env.motion.activities.loads import BOARD
from hrc_env.motion.curves import move_point
from hrc_env.motion.holding import N_HELD, write_prop_pose
from hrc_env.motion.points import Place
from hrc_env.motion.rows import with_fields
from hrc_env.motion.schedule import Job
from hrc_env.motion.state import NOWHERE, Worker
from hrc_env.worker.props import BOUNDS_M, PROP_NAMES
from hrc_env.world import AWAY_M, WORKPLACE_KINDS, Workplace


class Load:
    """A load at rest; a row of kind 0 is unused."""

    shown: Annotated[Floats, (N_HELD,)]
    """Kind, position [m] and quaternion of the load, in the format of `holding.write_prop_pose`."""
    pose: Annotated[Floats, (6,)]
    """Pose in the world: x, y, z [m], yaw, pitch, roll [rad]."""
    stand: Annotated[Floats, (4,)]
    """Pose of a worker that picks up the load: x, y [m], heading [rad], height of the work [m]."""
    at: int
    """Kind of the workplace at `stand`, an index into `WORKPLACE_KINDS`, or `NOWHERE`."""


@with_fields(Load)
class LoadRow(np.void):
    """A row of `LOAD` in Python; the fields of `Load` are its attributes."""


LOAD = np.dtype((LoadRow, dtype_of(Load)))
"""NumPy data type of a `Load`; the fields of its rows are attributes in Python, too."""
MOVED_M = 0.015
"""Maximum random displacement of a load in a pile along x and y [m]."""
TURNED_RAD = 0.03
"""Maximum random rotation of a load in a pile [rad]."""
HIGH = ("pile", "bench", "task")
"""Kinds of workplaces with a surface for loads at the workplace's height.

At other workplaces, loads rest on the floor or hang on the wall.
"""
HUNG_M = 1.2
"""Maximum height of boards that hang on a wall [m]. The value is an estimate."""
AT_HAND_M = 0.13
"""Distance from `Load.stand` within which a worker can pick up the load [m]."""
EXACT_M = 0.01
"""Distance from the `Load.stand` of a cart within which a worker can grasp it [m]."""
EXACT_COS = 0.9999
"""Minimum cosine of the heading error with which a worker can grasp a cart."""
WHEELED = (CART, WHEELBARROW)
"""Wheeled props, which are pushed by their handles."""
ROOM_M = 0.40
"""Minimum distance of paths from a load's centre, in addition to half its shorter side [m]."""
TOUCH_M = 0.01
"""Maximum overlap of two loads that are considered to lie beside each other [m]."""


class Extent(NamedTuple):
    """Vertical extent of a load relative to its origin."""

    low: float
    """Lower end [m]."""
    high: float
    """Upper end [m]."""


class Footprints(NamedTuple):
    """Rectangles on the floor that are covered by loads."""

    middle: Floats
    """Centres (n, 2) in the world [m]."""
    half: Floats
    """Half sizes (n, 2) along and across the loads [m]."""


def make_loads(places: Sequence[Workplace], jobs: Sequence[Job]) -> Records1[Load]:
    """Return the loads (L,) at the workplaces when an episode begins.

    If a job needs a load at a kind of workplace and the scene has none there, the load is added to
    the first workplace of that kind.
    """
    wanted = {(job.prop, job.at) for job in jobs if job.activity == "pick up"}
    wanted -= {(prop, place.kind) for place in places for prop in place.loads}
    loads = np.zeros(0, LOAD)
    for place in places:
        more = sorted(prop for prop, kind in wanted if kind == place.kind)
        wanted -= {(prop, place.kind) for prop in more}
        stand = get_place(place)
        for prop in (*place.loads, *more):
            if prop not in PROP_NAMES[1:]:
                raise make_unknown_name_error(f"load at {place.name!r}", prop, PROP_NAMES[1:])
            kind = PROP_NAMES.index(prop)
            row = np.zeros(1, LOAD)
            row["shown"][0, 0] = kind
            row["pose"] = find_rest_pose(kind, place.kind, stand, place.ahead_m, loads)
            row["stand"], row["at"] = stand, WORKPLACE_KINDS.index(place.kind)
            loads = np.concatenate([loads, row])
    return loads


def get_place(place: Workplace) -> Place:
    """Return the pose of a worker at a workplace, with the height of the work."""
    return Place(*place.xy_m, place.yaw_rad, place.height_m)


def reset_loads(loads: Records1[Load], first: Records1[Load], rng: np.random.Generator) -> None:
    """Reset the loads of an environment to the initial ones, with small random displacements.

    Args:
        loads: rows of the environment, which are written.
        first: initial loads, from `make_loads`.
        rng: random number generator of the displacements.
    """
    loads[...] = np.zeros((), LOAD)
    loads[: len(first)] = first
    _displace_loads(loads, 2.0 * rng.random((len(first), 3)) - 1.0)


@kernel
def _displace_loads(loads: Records1[Load], off: Floats) -> None:
    """Displace the first loads by random numbers (L, 3) in [-1, 1), and set what is shown."""
    for k in range(len(off)):
        load = loads[k]
        kind, pose, shown = load.shown[0], load.pose, load.shown
        if kind != CART and kind != WHEELBARROW:
            pose[0] += MOVED_M * off[k, 0]
            pose[1] += MOVED_M * off[k, 1]
            pose[3] += TURNED_RAD * off[k, 2]
        half = 0.5 * pose[3]
        for i in range(3):
            shown[1 + i] = pose[i]
        shown[4], shown[5], shown[6], shown[7] = math.cos(half), 0.0, 0.0, math.sin(half)


def find_rest_pose(
    kind: int, at: str, stand: Place, ahead_m: float, loads: Records1[Load]
) -> Floats:
    """Return the rest pose (6,) of a load that is laid down at a workplace.

    A board at a wall hangs flat on it, below other boards there; any other load rests on top of the
    loads below it.

    Args:
        kind: kind of the load, an index into `PROPS`.
        at: kind of the workplace; "" for none.
        stand: pose at which the worker stands.
        ahead_m: distance of the load ahead of the worker [m].
        loads: loads at rest in the scene.
    """
    is_hung = at == "wall" and kind == BOARD
    low, high = _measure_extent(kind, is_hung)
    if is_hung:
        ahead_m += BOUNDS_M[kind, 0, 2]
    x, y = move_point(stand.x, stand.y, stand.yaw, ahead_m, 0.0)
    pose = np.array([x, y, 0.0, stand.yaw, 0.5 * math.pi if is_hung else 0.0, 0.0])
    pose[2] = min(stand.height, HUNG_M) if is_hung else (stand.height if at in HIGH else 0.0) - low
    for other in loads[_find_overlapping(kind, pose, loads)]:
        z, extent = other.pose[2], _measure_extent(int(other.shown[0]), other.pose[4] > 1.0)
        pose[2] = (
            min(pose[2], z + extent.low - high) if is_hung else max(pose[2], z + extent.high - low)
        )
    return pose


def find_uncovered(loads: Records1[Load]) -> Bools:
    """Return a mask (L,) of the loads without another load on top."""
    free = loads["shown"][:, 0] > 0
    for row in np.flatnonzero(free):
        over = _find_overlapping(int(loads["shown"][row, 0]), loads["pose"][row], loads)
        free[row] = not (over & (loads["pose"][:, 2] > loads["pose"][row, 2])).any()
    return free


def list_stands(loads: Records1[Load], kind: int, at: str) -> Iterator[Place]:
    """Yield the poses of a worker that picks up a load of one kind, at workplaces of one kind.

    Args:
        loads: loads at rest in the scene.
        kind: kind of the loads, an index into `PROPS`.
        at: kind of the workplaces.
    """
    here = find_uncovered(loads) & (loads["shown"][:, 0] == kind)
    here &= loads["at"] == WORKPLACE_KINDS.index(at)
    for row in loads["stand"][here]:
        yield Place(*row.tolist())


def find_load_at_hand(loads: Records1[Load], kind: int, worker: Worker) -> int:
    """Return the row of a load of a kind within a worker's reach on the spot; -1 for none."""
    x, y, yaw = loads["stand"][:, :3].T
    away = np.hypot(x - worker.start_x, y - worker.start_y)
    near = find_uncovered(loads) & (loads["shown"][:, 0] == kind) & (away < AT_HAND_M)
    if kind in WHEELED:
        near &= (away < EXACT_M) & (np.cos(yaw - worker.start_yaw) > EXACT_COS)
    return int(np.argmin(np.where(near, away, np.inf))) if near.any() else -1


def has_load_at(loads: Records1[Load], stand: Place) -> bool:
    """Return whether a worker at the pose `stand` or near it can pick up any load."""
    away = np.hypot(*(loads["stand"][:, :2] - stand[:2]).T)
    return bool(((loads["shown"][:, 0] > 0) & (away < AT_HAND_M)).any())


def has_load(loads: Records1[Load], kind: int) -> bool:
    """Return whether there is a load of a kind."""
    return bool((loads["shown"][:, 0] == kind).any())


def remove_load(loads: Records1[Load], row: int) -> None:
    """Remove a load that a worker has picked up."""
    loads[row] = np.zeros((), LOAD)


def find_place_here(places: Sequence[Workplace], worker: Worker) -> Workplace | None:
    """Return the workplace at which a worker stands, if there is one."""
    for place in places:
        x, y = place.xy_m
        if math.hypot(worker.start_x - x, worker.start_y - y) < AT_HAND_M:
            return place
    return None


def find_rest_pose_here(
    loads: Records1[Load], places: Sequence[Workplace], worker: Worker
) -> Floats:
    """Return the rest pose (6,) of a worker's load after it is laid down on the spot."""
    kind, place = int(worker.load_prop), find_place_here(places, worker)
    if place is None:
        here = Place(float(worker.start_x), float(worker.start_y), float(worker.start_yaw), 0.0)
        return find_rest_pose(kind, "", here, AWAY_M, loads)
    return find_rest_pose(kind, place.kind, get_place(place), place.ahead_m, loads)


def lay_down_load(loads: Records1[Load], places: Sequence[Workplace], worker: Worker) -> None:
    """Add the load that a worker has just laid down to the loads at rest."""
    free = np.flatnonzero(loads["shown"][:, 0] == 0)
    if not len(free):
        return
    row = loads[int(free[0])]
    write_prop_pose(row.shown, worker)
    row.pose = worker.q[c.PROP_POSE : c.PROP_POSE + 6]
    here = Place(float(worker.end_x), float(worker.end_y), float(worker.end_yaw), 0.0)
    place = find_place_here(places, worker)
    row.stand = np.array(here if place is None else get_place(place))
    row.at = NOWHERE if place is None else WORKPLACE_KINDS.index(place.kind)


def list_load_discs(loads: Records1[Load]) -> Floats:
    """Return the discs (n, 3) around loads that paths must avoid: x, y, radius [m]."""
    lying = loads[loads["shown"][:, 0] > 0]
    middle, half = _project(lying["shown"][:, 0], lying["pose"])
    return np.concatenate([middle, ROOM_M + half.min(1, keepdims=True)], axis=1)


def _measure_extent(kind: int, is_hung: bool) -> Extent:
    """Return the vertical extent of a load that hangs on a wall or lies.

    Args:
        kind: kind of the load, an index into `PROPS`.
        is_hung: whether the load hangs on a wall.
    """
    axis = 0 if is_hung else 2
    return Extent(float(BOUNDS_M[kind, 0, axis]), float(BOUNDS_M[kind, 1, axis]))


def _find_overlapping(kind: int, pose: Floats, loads: Records1[Load]) -> Bools:
    """Return a mask (L,) of the loads that overlap, on the floor, a load at a pose (6,)."""
    middle, half = _project(np.array([kind]), pose[None])
    middles, halves = _project(loads["shown"][:, 0], loads["pose"])
    off, yaws = middles - middle, loads["pose"][:, 3]
    meets = loads["shown"][:, 0] > 0
    for axis in (pose[3], pose[3] + 0.5 * math.pi, yaws, yaws + 0.5 * math.pi):
        apart = np.abs(off[:, 0] * np.cos(axis) + off[:, 1] * np.sin(axis))
        reach = _measure_half_width(half, pose[3] - axis) + _measure_half_width(halves, yaws - axis)
        meets &= apart < reach - TOUCH_M
    return meets


def _project(kind: Floats, poses: Floats) -> Footprints:
    """Return the rectangles on the floor covered by loads of kinds (n,) at poses (n, 6)."""
    box = BOUNDS_M[kind.astype(int), :, :2]
    (ahead, left), half = box.mean(1).T, 0.5 * (box[:, 1] - box[:, 0])
    cos, sin = np.cos(poses[:, 3]), np.sin(poses[:, 3])
    middle = np.stack([cos * ahead - sin * left, sin * ahead + cos * left], axis=1)
    return Footprints(poses[:, :2] + middle, half)


def _measure_half_width(half: Floats, turn_rad: Floats) -> Floats:
    """Return half the extents (n,) of rectangles along axes at an angle to them."""
    return half[:, 0] * np.abs(np.cos(turn_rad)) + half[:, 1] * np.abs(np.sin(turn_rad))
