"""Which of the people found in several images are the same one.

A search gives each camera a list of people, some of them twice, some of them mistakes. The
lines of sight to one person's hips meet; those to two people, or to a mistake, rarely do. Where
they meet it shows how large each of them is: an arm of a robot that looks like a person is not as
large as one.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hrc_env.core.records import Roi
from hrc_env.core.typing import Points3
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    pinhole_magnification,
    project,
    rays,
)

MEETING_M = 0.3
"""Lines of sight that pass a point within this distance [m] see the same hips there."""

SIDE_M = (1.1, 3.6)
"""The detector stage's window round a person has sides of this length at their distance [m]: from
somebody folded up to somebody tall who reaches up."""

MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines that fixes a point."""

Candidates = Sequence[Sequence[Roi]]


def agreed_windows(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> list[Roi | None]:
    """One person's window a camera: those whose hips' lines of sight meet best.

    Args:
        candidates: (C,) windows of the people found by each camera, best first.
        cameras: (C,) the rig.

    Returns:
        (C,) None where a camera has not found that person. A camera that is alone in the rig is
        believed; of several, two must have found the same person, and not too small or large a
        one: else nobody. One view of several never begins a track.
    """
    if len(cameras) == 1:
        return [found[0] if found else None for found in candidates]
    best: list[Roi | None] = [None] * len(cameras)
    best_rank = (1, 0.0)
    for point in _crossings(candidates, cameras):
        windows, rank = _support(point, candidates, cameras)
        if rank > best_rank:
            best, best_rank = windows, rank
    return best


def apart_from(candidates: Candidates, others: Sequence[Sequence[Roi | None]]) -> Candidates:
    """Candidates (C,) without those who are in a window (C,) of somebody else already."""
    known = [[windows[c] for windows in others] for c in range(len(candidates))]
    return [
        [window for window in found if not any(same_person(window, other) for other in taken)]
        for found, taken in zip(candidates, known, strict=True)
    ]


def same_person(window: Roi, other: Roi | None) -> bool:
    """Whether two windows of one camera have their middle, the hips, in nearly one place."""
    if other is None:
        return False
    return math.dist(window.centre_px, other.centre_px) < 0.2 * other.side_px


def _crossings(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Iterator[Points3]:
    """Points (3,) where lines of sight of two cameras pass each other."""
    lines = [
        (c, camera.eye_world, rays(camera, np.array(window.centre_px)))
        for c, (camera, found) in enumerate(zip(cameras, candidates, strict=True))
        for window in found
    ]
    for k, (first, eye_1, along_1) in enumerate(lines):
        for second, eye_2, along_2 in lines[k + 1 :]:
            cosine = float(along_1 @ along_2)
            crossing = 1 - cosine**2
            if first == second or not crossing >= MIN_CROSSING**2:
                continue
            between = eye_2 - eye_1
            a, b = float(between @ along_1), float(between @ along_2)
            far_1, far_2 = (a - b * cosine) / crossing, (a * cosine - b) / crossing
            if far_1 > 0 and far_2 > 0:
                yield (eye_1 + far_1 * along_1 + eye_2 + far_2 * along_2) / 2


def _support(
    point_world: Points3, candidates: Candidates, cameras: Sequence[PinholeCamera]
) -> tuple[list[Roi | None], tuple[int, float]]:
    """Windows that see their hips at a point, with their number and how well they meet."""
    windows: list[Roi | None] = [None] * len(cameras)
    error_m = 0.0
    for c, (camera, found) in enumerate(zip(cameras, candidates, strict=True)):
        px, depth_m = project(camera.P[None], point_world[None])
        if not found or depth_m[0, 0] <= 0:
            continue
        m_per_px = (
            float(depth_m[0, 0]) / camera.K[0, 0] * float(pinhole_magnification(camera, px[0, 0]))
        )
        hips_px = image_from_pinhole(camera, px[0, 0])
        off_m = [
            math.dist(window.centre_px, hips_px) * m_per_px
            if SIDE_M[0] <= window.side_px * m_per_px <= SIDE_M[1]
            else math.inf
            for window in found
        ]
        nearest = int(np.argmin(off_m))
        if off_m[nearest] < MEETING_M:
            windows[c] = found[nearest]
            error_m += off_m[nearest]
    return windows, (sum(window is not None for window in windows), -error_m)
