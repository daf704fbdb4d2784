"""Loads that lie about: in piles at first, then where workers have laid them down.

None appears or vanishes: a worker takes up what lies on top at a place, and what is laid down lies
there from then on, on what lies there already. Nobody makes piles grow; a reset does.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hrc_env.core.errors import unknown
from hrc_env.core.typing import Bools, Floats, Records
from hrc_env.motion import controls as c
from hrc_env.motion.activities.going import CART, WHEELBARROW
from hrc_env.motion.activities.loads import BOARD
from hrc_env.motion.curves import placed
from hrc_env.motion.holding import N_HELD, prop_pose
from hrc_env.motion.schedule import Job
from hrc_env.motion.state import NOWHERE, Place, Worker
from hrc_env.worker.props import BOUNDS_M, PROP_NAMES
from hrc_env.world import AWAY_M, WORKPLACE_KINDS, Workplace

LOAD = np.dtype(
    [
        ("shown", "f8", (N_HELD,)),  # as `holding.prop_pose` writes it; of kind 0 there is none
        ("pose", "f8", (6,)),  # x, y, z, yaw, pitch, roll
        ("stand", "f8", (4,)),  # from where it is taken up: a `Place`
        ("at", "i8"),  # kind of that place, index into `WORKPLACE_KINDS`, or NOWHERE
    ],
    align=True,
)
"""A load that lies somewhere; a row without one is room for another."""
MOVED_M, TURNED_RAD = 0.015, 0.03
"""In piles loads lie off their place by up to so much, each by its own."""
HIGH = ("pile", "bench", "task")
"""Kinds of places whose height is that of a surface on which loads lie; elsewhere that is the
floor, or the wall."""
HUNG_M = 1.2
"""Boards are put to a wall no higher than this [m]; judgement."""
AT_HAND_M, EXACT_M, EXACT_COS = 0.13, 0.01, 0.9999
"""Who is so near to where a load is taken up can take it; a cart, only who is exactly there."""
WHEELED = (CART, WHEELBARROW)
"""Props that are taken by their handles."""
ROOM_M, TOUCH_M = 0.40, 0.01
"""Paths keep so far from what lies about, and half its shorter side, from its middle; what overlaps
by less than that lies beside each other [m]."""


def at_first(places: Sequence[Workplace], jobs: Sequence[Job]) -> Records:
    """(L,) of `LOAD`: what lies at places at first. Where a job takes up what no place of its kind
    has, the first one has one."""
    wanted = {(job.prop, job.at) for job in jobs if job.activity == "pick up"}
    wanted -= {(prop, place.kind) for place in places for prop in place.loads}
    loads = np.zeros(0, LOAD)
    for place in places:
        more = sorted(prop for prop, kind in wanted if kind == place.kind)
        wanted -= {(prop, place.kind) for prop in more}
        spot = spot_of(place)
        for prop in (*place.loads, *more):
            if prop not in PROP_NAMES[1:]:
                raise unknown(f"load at {place.name!r}", prop, PROP_NAMES[1:])
            kind = PROP_NAMES.index(prop)
            row = np.zeros(1, LOAD)
            row["shown"][0, 0] = kind
            row["pose"] = resting(kind, place.kind, spot, place.ahead_m, loads)
            row["stand"], row["at"] = spot, WORKPLACE_KINDS.index(place.kind)
            loads = np.concatenate([loads, row])
    return loads


def spot_of(place: Workplace) -> Place:
    """Where one stands at a place."""
    return *place.xy_m, place.yaw_rad, place.height_m


def lay_out(loads: Records, first: Records, rng: np.random.Generator) -> None:
    """Fill the rows of an environment with what lies there `at_first`, a little off its place."""
    loads[...] = np.zeros((), LOAD)
    loads[: len(first)] = first
    off = 2.0 * rng.random((len(first), 3)) - 1.0
    for row, (x, y, turn) in zip(loads, off.tolist(), strict=False):
        if row["shown"][0] not in WHEELED:
            row["pose"][:2] += MOVED_M * x, MOVED_M * y
            row["pose"][3] += TURNED_RAD * turn
        half = 0.5 * row["pose"][3]
        row["shown"][1:] = *row["pose"][:3], math.cos(half), 0.0, 0.0, math.sin(half)


def resting(kind: int, at: str, spot: Place, ahead_m: float, loads: Records) -> Floats:
    """(6,) where a load of a kind rests that is laid down `ahead_m` ahead of a spot, at a place of
    a kind ("": none): a board flat to a wall, below what is there, all else on top of it."""
    hung = at == "wall" and kind == BOARD
    low, high = _level(kind, hung)
    if hung:
        ahead_m += BOUNDS_M[kind, 0, 2]
    x, y = placed(spot[0], spot[1], spot[2], ahead_m, 0.0)
    pose = np.array([x, y, 0.0, spot[2], 0.5 * math.pi if hung else 0.0, 0.0])
    pose[2] = min(spot[3], HUNG_M) if hung else (spot[3] if at in HIGH else 0.0) - low
    for other in loads[_under(kind, pose, loads)]:
        z, span = other["pose"][2], _level(int(other["shown"][0]), other["pose"][4] > 1.0)
        pose[2] = min(pose[2], z + span[0] - high) if hung else max(pose[2], z + span[1] - low)
    return pose


def on_top(loads: Records) -> Bools:
    """(L,) which loads there are and bear nothing."""
    free = loads["shown"][:, 0] > 0
    for row in np.flatnonzero(free):
        over = _under(int(loads["shown"][row, 0]), loads["pose"][row], loads)
        free[row] = not (over & (loads["pose"][:, 2] > loads["pose"][row, 2])).any()
    return free


def stands(loads: Records, kind: int, at: str) -> Iterator[Place]:
    """From where loads of a kind can be taken up that lie at places of a kind."""
    here = on_top(loads) & (loads["shown"][:, 0] == kind)
    here &= loads["at"] == WORKPLACE_KINDS.index(at)
    for row in loads["stand"][here]:
        yield tuple(row.tolist())  # type: ignore[misc]


def at_hand(loads: Records, kind: int, me: Worker) -> int:
    """The row of a load of a kind that a worker can take up from where they stand; -1: none."""
    x, y, yaw = loads["stand"][:, :3].T
    away = np.hypot(x - me["start_x"], y - me["start_y"])
    near = on_top(loads) & (loads["shown"][:, 0] == kind) & (away < AT_HAND_M)
    if kind in WHEELED:
        near &= (away < EXACT_M) & (np.cos(yaw - me["start_yaw"]) > EXACT_COS)
    return int(np.argmin(np.where(near, away, np.inf))) if near.any() else -1


def is_left(loads: Records, spot: Place) -> bool:
    """Whether something lies there that is taken up from a spot."""
    away = np.hypot(*(loads["stand"][:, :2] - spot[:2]).T)
    return bool(((loads["shown"][:, 0] > 0) & (away < AT_HAND_M)).any())


def is_any(loads: Records, kind: int) -> bool:
    """Whether a load of a kind lies anywhere."""
    return bool((loads["shown"][:, 0] == kind).any())


def take(loads: Records, row: int) -> None:
    """It is in somebody's hands."""
    loads[row] = np.zeros((), LOAD)


def place_here(places: Sequence[Workplace], me: Worker) -> Workplace | None:
    """The place at which a worker stands, if it is one."""
    for place in places:
        x, y = place.xy_m
        if math.hypot(me["start_x"] - x, me["start_y"] - y) < AT_HAND_M:
            return place
    return None


def rest_here(loads: Records, places: Sequence[Workplace], me: Worker) -> Floats:
    """(6,) where what a worker holds rests when it is laid down where they stand."""
    kind, place = int(me["load_prop"]), place_here(places, me)
    if place is None:
        spot = float(me["start_x"]), float(me["start_y"]), float(me["start_yaw"]), 0.0
        return resting(kind, "", spot, AWAY_M, loads)
    return resting(kind, place.kind, spot_of(place), place.ahead_m, loads)


def lay_down(loads: Records, places: Sequence[Workplace], me: Worker) -> None:
    """What is in the hands of a worker who ends an activity lies there from now on."""
    free = np.flatnonzero(loads["shown"][:, 0] == 0)
    if not len(free):
        return
    row = loads[int(free[0])]
    prop_pose(row["shown"], me)
    row["pose"] = me["q"][c.PROP_POSE : c.PROP_POSE + 6]
    here = float(me["end_x"]), float(me["end_y"]), float(me["end_yaw"]), 0.0
    place = place_here(places, me)
    row["stand"] = here if place is None else spot_of(place)
    row["at"] = NOWHERE if place is None else WORKPLACE_KINDS.index(place.kind)


def in_the_way(loads: Records) -> Floats:
    """(n, 3) x, y, radius of what paths go round."""
    there = loads[loads["shown"][:, 0] > 0]
    middle, half = _seen_from_above(there["shown"][:, 0], there["pose"])
    return np.concatenate([middle, ROOM_M + half.min(1, keepdims=True)], axis=1)


def _level(kind: int, hung: bool) -> tuple[float, float]:
    """How far a load reaches below and above its origin [m]."""
    axis = 0 if hung else 2
    return float(BOUNDS_M[kind, 0, axis]), float(BOUNDS_M[kind, 1, axis])


def _under(kind: int, pose: Floats, loads: Records) -> Bools:
    """(L,) which loads are below or above one that lies at a pose."""
    middle, half = _seen_from_above(np.array([kind]), pose[None])
    middles, halves = _seen_from_above(loads["shown"][:, 0], loads["pose"])
    off, yaws = middles - middle, loads["pose"][:, 3]
    meets = loads["shown"][:, 0] > 0
    for axis in (pose[3], pose[3] + 0.5 * math.pi, yaws, yaws + 0.5 * math.pi):
        apart = np.abs(off[:, 0] * np.cos(axis) + off[:, 1] * np.sin(axis))
        reach = _reach(half, pose[3] - axis) + _reach(halves, yaws - axis)
        meets &= apart < reach - TOUCH_M
    return meets


def _seen_from_above(kind: Floats, poses: Floats) -> tuple[Floats, Floats]:
    """(n, 2) middles of loads at poses (n, 6) in the world, and half edges [m]."""
    box = BOUNDS_M[kind.astype(int), :, :2]
    (ahead, left), half = box.mean(1).T, 0.5 * (box[:, 1] - box[:, 0])
    cos, sin = np.cos(poses[:, 3]), np.sin(poses[:, 3])
    middle = np.stack([cos * ahead - sin * left, sin * ahead + cos * left], axis=1)
    return poses[:, :2] + middle, half


def _reach(half: Floats, turn_rad: Floats) -> Floats:
    """(n,) how far rectangles with half edges (n, 2) reach along axes so far turned from them."""
    return half[:, 0] * np.abs(np.cos(turn_rad)) + half[:, 1] * np.abs(np.sin(turn_rad))
