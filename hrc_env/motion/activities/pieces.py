"""Pieces of clips that begin and end with both feet on the floor and have room in the scene.

After a job, a worker plays a piece on the spot or goes to a location with room for it
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
"""Maximum duration of a piece [s]; longer clips are cut."""
SHORTEST_S = 0.5
"""Minimum duration of a piece [s]."""
EDGE_SHARE = 0.15
"""Fraction of a piece by which each end may be trimmed for flatter feet, up to `SHORTEST_S`."""
LOW_M = 0.05
"""Maximum height of the higher foot at the beginning and end of a piece [m].

The limit admits walks, in which one foot pushes off while the other lands.
"""
UNLOADED_RAD = 0.5
"""Penalty, in tilt of the feet, for beginning or ending a piece without both feet loaded [rad]."""
TURNS_RAD = (0.0, 0.6, -0.6, 1.2, -1.2)
"""Headings of a clip relative to the worker's, tried in turn [rad]; two steps limit the turn."""
SPARE_M = 0.05
"""Additional slack around a piece, for deviations of workers from their workplaces [m]."""
ENOUGH = 0.1
"""Fraction of the starting poses at which a piece should have room, if possible."""
ROBOT_RADII = np.linspace(0.0, 1.0, 3)
"""Distances of starting poses at the robot, as fractions of the range of the distance."""
ROBOT_AZIMUTHS = np.linspace(-1.0, 1.0, 7)
"""Azimuths of starting poses at the robot, as multiples of the maximum azimuth."""


class NoRoomError(ConfigError):
    """Error for a clip without room on the floor."""

    def __init__(self, clip: Clip) -> None:
        """Create an error that names the clip."""
        super().__init__(
            f"{clip.source}: there is no room for {SHORTEST_S} s or more of this clip at any "
            "position where workers finish a job."
        )
        self.clip = clip


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Floor and starting poses for clips."""

    plan: Floorplan
    """Floor of the scene."""
    starts: Floats
    """Poses (S, 3) of workers after a job: x, y [m], heading [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Clips:
    """Concatenated pieces of clips."""

    frames: Floats
    """Frames (n_bodies N, 32) of all pieces, for one body after the other.

    Each piece begins at the origin, facing +x.
    """
    row: Ints
    """Index (n,) of each piece's first row in `frames`, for the first body."""
    count: Ints
    """Number (n,) of rows of each piece."""
    fps: Floats
    """Frame rate (n,) of each piece [Hz]."""
    starts: tuple[Floats, ...]
    """Poses (k, 3) with room for each piece: x, y [m], heading [rad]."""

    @property
    def n_rows(self) -> int:
        """Number of frames N of all pieces for one body."""
        return int(self.count.sum())

    @property
    def duration_s(self) -> float:
        """Duration of all pieces together [s]."""
        return float(((self.count - 1) / self.fps).sum())


class _Piece(NamedTuple):
    """A range of frames of a clip."""

    first: int
    """Index of the first frame."""
    last: int
    """Index of the last frame, which belongs to the piece."""
    starts: Floats
    """Poses (k, 3) with room for the piece: x, y [m], heading [rad]."""


def make_stage(plan: Floorplan, config: MotionConfig) -> Stage:
    """Return the poses at which workers with the given settings begin clips."""
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
    """Cut clips into pieces that begin and end with both feet on the floor.

    All bodies have the same pieces, each of which has room on the floor for every body.

    Args:
        clips: recorded motion.
        lengths: dimensions (n_bodies, N_SIZES) of the bodies [m], as in `Anatomy.lengths`.
        stage: floor and starting poses.

    Returns:
        The n pieces, in the order of the clips, with N frames together. `Clips.frames` holds the
        N frames of all pieces scaled to the first body, then those scaled to the second body, and
        so on: piece i of body b begins at row b N + `Clips.row[i]`.

    Raises:
        NoRoomError: a clip has no piece that fits at any of the starting poses.
        ConfigError: a clip does not have two frames with both feet on the floor at least
            `SHORTEST_S` apart.
    """
    scaled_clips = [[scale_clip(clip, size) for size in lengths] for clip in clips]
    pieces_of_clips = [
        _cut_clip(clip, scaled, stage) for clip, scaled in zip(clips, scaled_clips, strict=True)
    ]
    pieces, fps = list[_Piece](), list[float]()
    for clip, pieces_of_clip in zip(clips, pieces_of_clips, strict=True):
        pieces += pieces_of_clip
        fps += [clip.fps] * len(pieces_of_clip)
    frames = [np.zeros((0, len(RECORDED)))]  # This entry sets the width if there are no clips.
    for body in range(len(lengths)):
        for scaled, pieces_of_clip in zip(scaled_clips, pieces_of_clips, strict=True):
            for piece in pieces_of_clip:
                controls = move_to_origin(scaled[body][piece.first : piece.last + 1])
                frames.append(controls[:, RECORDED])
    count = np.array([piece.last - piece.first + 1 for piece in pieces], np.int64)
    return Clips(
        frames=np.ascontiguousarray(np.concatenate(frames)),
        row=np.cumsum(count) - count,
        count=count,
        fps=np.array(fps),
        starts=tuple(piece.starts for piece in pieces),
    )


def _cut_clip(clip: Clip, bodies: list[Floats], stage: Stage) -> list[_Piece]:
    """Return the pieces of one clip.

    At both ends of a piece, both feet are near the floor. If the clip has such a frame at about the
    desired time, they are also loaded and flat.

    Args:
        clip: recorded motion.
        bodies: control vectors of the clip, scaled to each body.
        stage: floor and starting poses.
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
    """Return the number of frames at each end of a piece that are searched for flat feet."""
    return min(fewest, EDGE_SHARE * n_frames, max(0.0, 0.5 * (n_frames - fewest)))


def _find_stands(clip: Clip) -> Ints:
    """Return the frames with both feet near the floor; raise `ConfigError` if there are too few."""
    feet = [find_footprints(clip.controls[:, c.ANKLE + 6 * side :], clip.size) for side in range(2)]
    low = (np.stack(feet, 1)[..., 2] - clip.size[ANKLE_Z]).max(1) < LOW_M
    stands = np.flatnonzero(low)
    if len(stands) >= 2 and stands[-1] - stands[0] >= SHORTEST_S * clip.fps:
        return stands
    raise ConfigError(
        f"{clip.source}: both feet are within {100 * LOW_M:g} cm of the floor at {len(stands)} "
        f"frames within {SHORTEST_S} s only; a clip is played from one such frame to another. "
        "Record such poses at the beginning and the end."
    )


def _count_room(q: Floats, stage: Stage) -> Ints:
    """Return the number (S,) of leading frames that have room from each starting pose."""
    way = np.ascontiguousarray(move_to_origin(q)[:, [c.ROOT_X, c.ROOT_Y]])
    return _measure_room(way, stage.starts, stage.plan.grid)


def _choose_room(room: Ints, least: int) -> int:
    """Return the number of frames with room at a fraction `ENOUGH` of the starting poses.

    If this number is not above `least`, return that of the best starting pose.
    """
    room = np.sort(room)
    usual = int(room[-max(1, round(ENOUGH * len(room)))])
    return usual if usual > least else int(room[-1])


@kernel(makes_arrays=True)
def _measure_room(way: Floats, starts: Floats, grid: FloorGrid) -> Ints:
    """Count the leading points of a path that have room, for the best of `TURNS_RAD`.

    Args:
        way: points (N, 2) of the path, which begins at the origin [m].
        starts: poses (S, 3) at which the path begins.
        grid: slack on the floor.

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
    """Return the index of the piece that a worker plays or is about to play."""
    return int(np.searchsorted(clips.row, worker.clip_row % clips.n_rows))


def find_next_piece(clips: Clips, worker: Worker) -> int:
    """Return the index of the piece after the worker's piece; the first one follows the last."""
    return (find_piece(clips, worker) + 1) % len(clips.row)
