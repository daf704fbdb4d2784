"""Pieces of clips: from one moment on both feet to another, as long as there is room for.

After a job a worker plays a piece on the spot, or goes to a place from which there is room
(`setting_out.begin_clip`).
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
from hrc_env.motion.clip import RECORDED, Clip, find_footprints, move_to_origin, scale_clip
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.floorplan import FloorGrid, Floorplan, locate_beside_robot, read_slack
from hrc_env.motion.state import Worker

LONGEST_S = 20.0
"""Duration of the longest piece; longer clips are cut [s]."""
SHORTEST_S = 0.5
"""Duration of the shortest piece [s]."""
EDGE_SHARE = 0.15
"""Share of a piece that each of its ends may lose, `SHORTEST_S` at most, to end on flat feet."""
LOW_M = 0.05
"""Height of the higher foot up to which a piece may begin or end [m].

In a walk one foot rolls off behind while the other lands.
"""
UNLOADED_RAD = 0.5
"""Tilt of the feet that standing on both of them outweighs [rad]."""
TURNS_RAD = (0.0, 0.6, -0.6, 1.2, -1.2)
"""Headings from the worker's own that are tried for a clip; two steps turn no further [rad]."""
SPARE_M = 0.05
"""Reserve of the room for a piece, as workers stand a little beside their places [m]."""
ENOUGH = 0.1
"""Share of the places from which a piece has room, if there is such a piece."""
ROBOT_RADII = np.linspace(0.0, 1.0, 3)
"""Places at the robot that are tried: shares of the range of the radius."""
ROBOT_AZIMUTHS = np.linspace(-1.0, 1.0, 7)
"""Places at the robot that are tried: shares of the range of the azimuth."""


class NoRoomError(ConfigError):
    """A clip does not fit on the floor."""

    def __init__(self, clip: Clip) -> None:
        """Name the clip in the message."""
        super().__init__(
            f"{clip.source}: there is no room for {SHORTEST_S} s or more of this clip from any "
            "place where workers finish a job."
        )
        self.clip = clip


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Where clips are played."""

    plan: Floorplan
    """Free floor of the scene."""
    starts: Floats
    """Poses (S, 3) of workers after a job: x, y [m], heading [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Clips:
    """Pieces of clips, one after the other."""

    frames: Floats
    """Frames (n_bodies N, 32) of all pieces for each body, from the origin towards +x."""
    row: Ints
    """First row of each piece (n,), of the first body."""
    count: Ints
    """Number of rows of each piece (n,)."""
    fps: Floats
    """Frame rate of each piece (n,) [Hz]."""
    starts: tuple[Floats, ...]
    """For each piece the poses (k, 3) from which there is room for it: x, y [m], heading [rad]."""

    @property
    def n_rows(self) -> int:
        """Number of frames N of all pieces of one body."""
        return int(self.count.sum())

    @property
    def lasts_s(self) -> float:
        """Duration of all pieces together [s]."""
        return float(((self.count - 1) / self.fps).sum())


class _Piece(NamedTuple):
    """Part of a clip."""

    first: int
    """First frame."""
    last: int
    """Last frame."""
    starts: Floats
    """Poses (k, 3) as in `Clips`."""


def make_stage(plan: Floorplan, config: MotionConfig) -> Stage:
    """Return the places from which workers with these settings play clips."""
    kinds = {job.at for job in config.jobs} - {"robot"}
    places = [(*p.xy_m, p.yaw_rad) for p in plan.grounds.places if p.kind in kinds]
    low, high = config.near_radius_m
    for share in ROBOT_RADII:
        for azimuth in ROBOT_AZIMUTHS:
            angle = config.near_azimuth_rad * azimuth
            x, y = locate_beside_robot(plan.grounds, low + share * (high - low), angle)
            places.append((x, y, angle + math.pi))
    return Stage(plan, np.array(places))


def cut_clips(clips: Sequence[Clip], lengths: Floats, stage: Stage) -> Clips:
    """Cut clips into pieces.

    Args:
        clips: recorded motion.
        lengths: lengths (n_bodies, N_SIZES) of the bodies [m], see `Anatomy.lengths`.
        stage: where they are played.

    Returns:
        The pieces, scaled to each body.

    Raises:
        NoRoomError: no part of a clip fits where it is to be played.
        ConfigError: a clip has no two moments with both feet on the floor.
    """
    bodies = [[scale_clip(clip, row) for row in lengths] for clip in clips]
    cut = [_cut_clip(clip, scaled, stage) for clip, scaled in zip(clips, bodies, strict=True)]
    pieces = [piece for parts in cut for piece in parts]
    frames = [np.zeros((0, len(RECORDED)))]
    for body in range(len(lengths)):
        for scaled, parts in zip(bodies, cut, strict=True):
            for first, last, _ in parts:
                frames.append(move_to_origin(scaled[body][first : last + 1])[:, RECORDED])
    count = np.array([last - first + 1 for first, last, _ in pieces], np.int64)
    rates = [clip.fps for clip, parts in zip(clips, cut, strict=True) for _ in parts]
    return Clips(
        np.ascontiguousarray(np.concatenate(frames)),
        np.cumsum(count) - count,
        count,
        np.array(rates),
        tuple(piece.starts for piece in pieces),
    )


def _cut_clip(clip: Clip, bodies: list[Floats], stage: Stage) -> list[_Piece]:
    """Return the pieces of one clip.

    At both ends of a piece the feet are low; they stand, and are flat, if they do so at about that
    time.

    Args:
        clip: recorded motion.
        bodies: its control vectors scaled to each body.
        stage: where it is played.
    """
    tilt = np.abs(clip.controls[:, [c.ANKLE + 4, c.ANKLE + 10]]).sum(1)
    tilt += UNLOADED_RAD * ~clip.contacts.all(1)
    fewest, most = SHORTEST_S * clip.fps, LONGEST_S * clip.fps
    stands, pieces = _find_stands(clip), list[_Piece]()
    early = stands[stands <= stands[0] + _count_edge_frames(int(stands[-1] - stands[0]), fewest)]
    first = int(early[np.argmin(tilt[early])])
    while stands[-1] - first >= fewest:
        ends = stands[stands >= first + fewest]
        room = np.min([_count_room(q[first:], stage) for q in bodies], axis=0)
        fits = ends[ends < first + _choose_room(room, int(ends[0]) - first)]
        if not len(fits):
            first = int(ends[0])
            continue
        inside = fits[: max(1, np.sum(fits <= first + most))]
        late = inside[inside >= inside[-1] - _count_edge_frames(int(inside[-1]) - first, fewest)]
        last = int(late[np.argmin(tilt[late])])
        pieces.append(_Piece(first, last, stage.starts[room > last - first]))
        first = last
        if inside[-1] == stands[-1]:
            break
    if not pieces:
        raise NoRoomError(clip)
    return pieces


def _count_edge_frames(n_frames: int, fewest: float) -> float:
    """Return the number of frames at an end of a piece among which the flattest feet are chosen."""
    return min(fewest, EDGE_SHARE * n_frames, max(0.0, 0.5 * (n_frames - fewest)))


def _find_stands(clip: Clip) -> Ints:
    """Return the frames in which both feet are low: at least two, far enough apart for a piece."""
    feet = [find_footprints(clip.controls[:, c.ANKLE + 6 * side :], clip.size) for side in range(2)]
    low = (np.stack(feet, 1)[..., 2] - clip.size[ANKLE_Z]).max(1) < LOW_M
    stands = np.flatnonzero(low)
    if len(stands) >= 2 and stands[-1] - stands[0] >= SHORTEST_S * clip.fps:
        return stands
    raise ConfigError(
        f"{clip.source}: both feet are within {100 * LOW_M:g} cm of the floor at {len(stands)} "
        f"frames within {SHORTEST_S} s only; a clip is played from one such moment to another. "
        "Record them, too, at the beginning and the end."
    )


def _count_room(q: Floats, stage: Stage) -> Ints:
    """Return for each start (S,) the number of frames of control vectors that there is room for."""
    way = np.ascontiguousarray(move_to_origin(q)[:, [c.ROOT_X, c.ROOT_Y]])
    return _measure_room(way, stage.starts, stage.plan.grid)


def _choose_room(room: Ints, least: int) -> int:
    """Return the number of frames with room from a share `ENOUGH` of the places.

    If that is not more than `least`, return the number with room from the best place.
    """
    room = np.sort(room)
    usual = int(room[-max(1, round(ENOUGH * len(room)))])
    return usual if usual > least else int(room[-1])


@kernel(makes_arrays=True)
def _measure_room(way: Floats, starts: Floats, grid: FloorGrid) -> Ints:
    """Return the number of points of a way that have room before the first that has none.

    Args:
        way: points (N, 2) from the origin on [m].
        starts: poses (S, 3) from which the way begins, in the best of `TURNS_RAD`.
        grid: free distance on the floor.

    Returns:
        The number of points from each start (S,).
    """
    most = np.zeros(len(starts), np.int64)
    for s in range(len(starts)):
        for turn in TURNS_RAD:
            cos, sin = math.cos(starts[s, 2] + turn), math.sin(starts[s, 2] + turn)
            n = 0
            while n < len(way):
                x = starts[s, 0] + cos * way[n, 0] - sin * way[n, 1]
                y = starts[s, 1] + sin * way[n, 0] + cos * way[n, 1]
                if read_slack(x, y, grid) < SPARE_M:
                    break
                n += 1
            most[s] = max(most[s], n)
    return most


def find_piece(clips: Clips, worker: Worker) -> int:
    """Return the piece that a worker plays or goes to play."""
    return int(np.searchsorted(clips.row, worker.clip_row % clips.n_rows))


def find_next_piece(clips: Clips, worker: Worker) -> int:
    """Return the piece after the one that was played; the first follows the last."""
    return (find_piece(clips, worker) + 1) % len(clips.row)
