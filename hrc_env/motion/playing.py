"""The clips that workers can play, fitted to every body that there is, and the beginning of one."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.recorded import (
    BEGIN,
    END,
    LAST,
    PERIOD_S,
    SETTLE_S,
    STEP_AT_S,
    SWING_S,
    clip_lasts,
)
from hrc_env.motion.activities.worker import Worker
from hrc_env.motion.anatomy import ANKLE_Z
from hrc_env.motion.clip import RECORDED, Clip, fitted_to, footprints, placed_at_origin
from hrc_env.motion.curves import ramp
from hrc_env.motion.posture import STANCE_HALF_WIDTH_M
from hrc_env.motion.walk import footprint

LONGEST_S, SHORTEST_S = 20.0, 0.5
"""Longer clips are played in pieces; no piece is shorter [s]."""
TURNS_RAD = (0.0, 0.6, -0.6, 1.2, -1.2)
"""Headings, from the worker's own, that are tried for a clip: two steps turn no further."""
STRIDE_SHARE = 0.25
"""Share of a full stride that the steps into a clip and out of it are."""


@dataclass(frozen=True, slots=True, eq=False)
class Clips:
    """Pieces of clips, each from one moment on both feet to another, one after the other."""

    frames: Floats
    """(bodies x N, 32) of all pieces, body after body; each begins at the origin, towards +x."""
    row: Ints
    """(n,) first row of each piece, of the first body."""
    count: Ints
    """(n,) its rows."""
    fps: Floats
    """(n,) its frames a second."""

    @property
    def n_rows(self) -> int:
        """N: rows of one body."""
        return int(self.count.sum())


def stocked(clips: Sequence[Clip], size: Floats) -> Clips:
    """The pieces of clips, for workers of these measures (`Anatomy.size` of each body).

    Raises:
        ConfigError: a clip that is never on both feet, or only for moments of the same pose.
    """
    cuts = [(clip, cut) for clip in clips for cut in _cuts(clip)]
    count = np.array([last - first + 1 for _, (first, last) in cuts], np.int64)
    row = np.cumsum(count) - count
    frames = [np.zeros((0, len(RECORDED)))]
    for of_body in size:
        fitted = {id(clip): fitted_to(clip, of_body) for clip in clips}
        for clip, (first, last) in cuts:
            piece = fitted[id(clip)][first : last + 1]
            frames.append(placed_at_origin(piece)[:, RECORDED])
    rates = np.array([clip.fps for clip, _ in cuts])
    return Clips(np.ascontiguousarray(np.concatenate(frames)), row, count, rates)


def _cuts(clip: Clip) -> list[tuple[int, int]]:
    """First and last frame of each piece: both feet stand there, flat as far as they do."""
    tilt = np.abs(clip.controls[:, [c.ANKLE + 4, c.ANKLE + 10]]).sum(1)
    stands = np.flatnonzero(clip.contacts.all(1))
    fewest, most = SHORTEST_S * clip.fps, LONGEST_S * clip.fps
    if len(stands) < 2 or stands[-1] - stands[0] < fewest:
        raise ConfigError(
            f"{clip.source}: the person is on both feet at {len(stands)} frames within "
            f"{SHORTEST_S} s only; a clip is played from one such moment to another. Record them, "
            "too, at the beginning and the end."
        )
    cuts = [int(stands[np.argmin(tilt[stands] + (stands > stands[0] + fewest))])]
    while stands[-1] - cuts[-1] >= fewest:
        inside = stands[(stands >= cuts[-1] + fewest) & (stands <= cuts[-1] + most)]
        if not len(inside):
            inside = stands[stands >= cuts[-1] + fewest][:1]
        late = inside[inside >= inside[-1] - fewest]
        cuts.append(int(late[np.argmin(tilt[late])]))
        if stands[-1] - inside[-1] < 1:
            break
    return list(itertools.pairwise(cuts))


def following(clips: Clips, plan: Floats) -> int:
    """The piece after the one that a plan played; after the last comes the first."""
    row = plan[pl.CLIP_ROW] % clips.n_rows
    return (int(np.searchsorted(clips.row, row)) + 1) % len(clips.row)


def start_clip(piece: int, turn_rad: float, clips: Clips, body: int, me: Worker) -> float:
    """Plan to play a piece where the worker stands, turned from their heading; how long [s]."""
    plan, prints = me.plan, me.prints
    row = body * clips.n_rows + int(clips.row[piece])
    n, fps = int(clips.count[piece]), float(clips.fps[piece])
    q = clips.frames[row : row + n]
    yaw = plan.item(pl.START_YAW) + turn_rad
    plan[pl.CLIP_ROW], plan[pl.CLIP_FRAMES], plan[pl.CLIP_FPS] = row, n, fps
    plan[pl.CLIP_YAW], plan[pl.CLIP_S] = yaw, clip_lasts((n - 1) / fps)
    plan[pl.STEP_START], plan[pl.STEP_PERIOD], plan[pl.STEP_SWING] = STEP_AT_S, PERIOD_S, SWING_S
    plan[pl.STEP_FIRST], plan[pl.STEP_COUNT], plan[pl.UNDO_AT] = 0, 2, 0
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn, origin = np.array([[cos, -sin], [sin, cos]]), plan[[pl.START_X, pl.START_Y]].copy()
    way = q[:, [c.ROOT_X, c.ROOT_Y]] @ turn.T + origin
    plan[[pl.END_X, pl.END_Y]], plan[pl.END_YAW] = way[-1], yaw + q[-1, c.HEADING]
    x, y, heading = plan[pl.END_X : pl.END_YAW + 1].tolist()
    prints[: LAST + 2, 3] = STRIDE_SHARE
    for side in range(2):
        footprint(side, x, y, heading, STANCE_HALF_WIDTH_M, me.size, prints[END + side])
        feet = footprints(q[[0, -1], c.N_BLENDED + 6 * side :], me.size)
        for at, foot in zip((BEGIN, LAST), feet, strict=True):
            prints[at + side, :2] = turn @ foot[:2] + origin
            prints[at + side, 2] = foot[3] + yaw
            prints[at + side, 4] = foot[2] - me.size[ANKLE_Z]
    lasts = plan.item(pl.CLIP_S) + 2.0 * SETTLE_S
    _note_roots(plan, way, fps, lasts)
    return lasts


def _note_roots(plan: Floats, way: Floats, fps: float, lasts: float) -> None:
    """Write where the root will be, for those who walk round it."""
    pace_s = lasts - 2.0 * SETTLE_S - (len(way) - 1) / fps
    slow = lasts - 2.0 * SETTLE_S - pace_s
    for k, t in enumerate(np.linspace(0.0, lasts, pl.N_ROOTS) - SETTLE_S):
        gone_s = pace_s * (ramp(t / pace_s) - ramp((t - slow) / pace_s))
        plan[pl.ROOTS + 2 * k : pl.ROOTS + 2 * k + 2] = way[min(round(gone_s * fps), len(way) - 1)]


def roots(plan: Floats) -> Iterator[tuple[float, float]]:
    """Where the root of a planned clip will be (x, y)."""
    for k in range(pl.N_ROOTS):
        yield plan.item(pl.ROOTS + 2 * k), plan.item(pl.ROOTS + 2 * k + 1)
