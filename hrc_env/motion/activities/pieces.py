"""Pieces of clips: from one moment on both feet to another, as long as there is room for.

Who finishes a job plays a piece from there, or goes to a place from which there is room
(`setting_out.play`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import ANKLE_Z
from hrc_env.motion.clip import RECORDED, Clip, fitted_to, footprints, placed_at_origin
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.floorplan import Floorplan, beside_robot, slack_at
from hrc_env.motion.state import Worker

LONGEST_S, SHORTEST_S = 20.0, 0.5
"""Longer clips are played in pieces; no piece is shorter [s]."""
EDGE_SHARE = 0.15
"""At its ends a piece may lose so much of it, each, and SHORTEST_S at most, for feet that are flat
there."""
LOW_M, UNLOADED_RAD = 0.05, 0.5
"""Pieces begin and end while no foot is higher [m]: in a walk the one behind rolls off as the other
comes down. Both feet standing is worth that they are less flat by so much."""
TURNS_RAD = (0.0, 0.6, -0.6, 1.2, -1.2)
"""Headings, from the worker's own, that are tried for a clip: two steps turn no further."""
SPARE_M, ENOUGH = 0.05, 0.1
"""Room that a piece has to spare [m], as workers stand a little beside their places; it is so long
that it has room from this share of the places, if there is one."""
AT_ROBOT = (np.linspace(0.0, 1.0, 3), np.linspace(-1.0, 1.0, 7))
"""Places at the robot that are tried: shares of the ranges of radius and azimuth."""


class NoRoomError(ConfigError):
    """A clip has no room on the grounds."""

    def __init__(self, clip: Clip) -> None:
        super().__init__(
            f"{clip.source}: there is no room for {SHORTEST_S} s or more of this clip from any "
            "place where workers finish a job."
        )
        self.clip = clip


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Where clips are played."""

    plan: Floorplan
    starts: Floats
    """(S, 3) x, y, yaw of workers who have finished a job."""


@dataclass(frozen=True, slots=True, eq=False)
class Clips:
    """Pieces of clips, one after the other."""

    frames: Floats
    """(bodies x N, 32) of all pieces, body after body; each begins at the origin, towards +x."""
    row: Ints
    """(n,) first row of each piece, of the first body."""
    count: Ints
    """(n,) its rows."""
    fps: Floats
    """(n,)."""
    starts: tuple[Floats, ...]
    """n times (k, 3) x, y, yaw of who has room for it."""

    @property
    def n_rows(self) -> int:
        """N."""
        return int(self.count.sum())

    @property
    def lasts_s(self) -> float:
        """All pieces together [s]."""
        return float(((self.count - 1) / self.fps).sum())


class _Piece(NamedTuple):
    """Part of a clip."""

    first: int
    last: int
    """Its frames."""
    starts: Floats
    """(k, 3) as in `Clips`."""


def stage(plan: Floorplan, config: MotionConfig) -> Stage:
    """The stage of workers who have these jobs."""
    kinds = {job.at for job in config.jobs} - {"robot"}
    places = [(*p.xy_m, p.yaw_rad) for p in plan.grounds.places if p.kind in kinds]
    low, high = config.near_radius_m
    for share in AT_ROBOT[0]:
        for azimuth in AT_ROBOT[1]:
            angle = config.near_azimuth_rad * azimuth
            x, y = beside_robot(plan.grounds, low + share * (high - low), angle)
            places.append((x, y, angle + math.pi))
    return Stage(plan, np.array(places))


def stocked(clips: Sequence[Clip], size: Floats, where: Stage) -> Clips:
    """The pieces of clips, for workers of these measures (`Anatomy.size` of each body).

    Raises:
        NoRoomError: nothing of a clip has room where it is to be played.
        ConfigError: there are no two moments with both feet on the floor.
    """
    bodies = [[fitted_to(clip, of_body) for of_body in size] for clip in clips]
    cut = [_cut(clip, fitted, where) for clip, fitted in zip(clips, bodies, strict=True)]
    pieces = [piece for of_clip in cut for piece in of_clip]
    frames = [np.zeros((0, len(RECORDED)))]
    for body in range(len(size)):
        for fitted, of_clip in zip(bodies, cut, strict=True):
            for first, last, _ in of_clip:
                frames.append(placed_at_origin(fitted[body][first : last + 1])[:, RECORDED])
    count = np.array([last - first + 1 for first, last, _ in pieces], np.int64)
    rates = [clip.fps for clip, of_clip in zip(clips, cut, strict=True) for _ in of_clip]
    return Clips(
        np.ascontiguousarray(np.concatenate(frames)), np.cumsum(count) - count, count,
        np.array(rates), tuple(piece.starts for piece in pieces),
    )  # fmt: skip


def _cut(clip: Clip, bodies: list[Floats], where: Stage) -> list[_Piece]:
    """The pieces of a clip: both feet are low at their ends, and stand there, and flat, if they do
    about then."""
    tilt = np.abs(clip.controls[:, [c.ANKLE + 4, c.ANKLE + 10]]).sum(1)
    tilt += UNLOADED_RAD * ~clip.contacts.all(1)
    fewest, most = SHORTEST_S * clip.fps, LONGEST_S * clip.fps
    stands, pieces = _stands(clip), list[_Piece]()
    early = stands[stands <= stands[0] + _edge(int(stands[-1] - stands[0]), fewest)]
    first = int(early[np.argmin(tilt[early])])
    while stands[-1] - first >= fewest:
        ends = stands[stands >= first + fewest]
        room = np.min([_room(q[first:], where) for q in bodies], axis=0)
        fits = ends[ends < first + _enough(room, int(ends[0]) - first)]
        if not len(fits):
            first = int(ends[0])
            continue
        inside = fits[: max(1, np.sum(fits <= first + most))]
        late = inside[inside >= inside[-1] - _edge(int(inside[-1]) - first, fewest)]
        last = int(late[np.argmin(tilt[late])])
        pieces.append(_Piece(first, last, where.starts[room > last - first]))
        first = last
        if inside[-1] == stands[-1]:
            break
    if not pieces:
        raise NoRoomError(clip)
    return pieces


def _edge(n_frames: int, fewest: float) -> float:
    """In how many frames at an end of a piece the flattest feet are looked for."""
    return min(fewest, EDGE_SHARE * n_frames, max(0.0, 0.5 * (n_frames - fewest)))


def _stands(clip: Clip) -> Ints:
    """Frames in which both feet are low, at least two and far enough apart for a piece."""
    feet = [footprints(clip.controls[:, c.ANKLE + 6 * side :], clip.size) for side in range(2)]
    low = (np.stack(feet, 1)[..., 2] - clip.size[ANKLE_Z]).max(1) < LOW_M
    stands = np.flatnonzero(low)
    if len(stands) >= 2 and stands[-1] - stands[0] >= SHORTEST_S * clip.fps:
        return stands
    raise ConfigError(
        f"{clip.source}: both feet are within {100 * LOW_M:g} cm of the floor at {len(stands)} "
        f"frames within {SHORTEST_S} s only; a clip is played from one such moment to another. "
        "Record them, too, at the beginning and the end."
    )


def _room(q: Floats, where: Stage) -> Ints:
    """(S,) for how many frames of control vectors there is room, from each start."""
    way = np.ascontiguousarray(placed_at_origin(q)[:, [c.ROOT_X, c.ROOT_Y]])
    return _frames_with_room(way, where.starts, where.plan.slack, where.plan.origin)


def _enough(room: Ints, least: int) -> int:
    """For how many frames there is room from ENOUGH places, if for more than are wanted at least;
    else from any."""
    room = np.sort(room)
    usual = int(room[-max(1, round(ENOUGH * len(room)))])
    return usual if usual > least else int(room[-1])


@kernel(makes_arrays=True)
def _frames_with_room(way: Floats, starts: Floats, slack: Floats, origin: Floats) -> Ints:
    """(S,) how many points of a way (N, 2) have room before the first that has none, from each
    start (S, 3) in the best of the directions."""
    most = np.zeros(len(starts), np.int64)
    for s in range(len(starts)):
        for turn in TURNS_RAD:
            cos, sin = math.cos(starts[s, 2] + turn), math.sin(starts[s, 2] + turn)
            n = 0
            while n < len(way):
                x = starts[s, 0] + cos * way[n, 0] - sin * way[n, 1]
                y = starts[s, 1] + sin * way[n, 0] + cos * way[n, 1]
                if slack_at(x, y, slack, origin) < SPARE_M:
                    break
                n += 1
            most[s] = max(most[s], n)
    return most


def piece_of(clips: Clips, me: Worker) -> int:
    """The piece whose row a worker has."""
    return int(np.searchsorted(clips.row, me["clip_row"] % clips.n_rows))


def following(clips: Clips, me: Worker) -> int:
    """The piece after the one that was played; after the last comes the first."""
    return (piece_of(clips, me) + 1) % len(clips.row)
