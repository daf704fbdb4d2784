"""Search for people in whole images without a prediction, and their association across cameras.

The detector stage finds people that fill at least a third of the height of its window. If the floor
is known, the windows are sized for people on it; otherwise they are as large as the image. Cameras
are associated by lines of sight to hips: those to the same person meet, and those to different
people or to false detections rarely do.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.core.typing import Floats, Image, Points2, Points3
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    inside_image,
    pinhole_magnification,
    project,
    rays,
)
from hrc_env.perception import blazepose
from hrc_env.perception.exposure import develop, has_edges
from hrc_env.perception.network import LANDMARK_SIDE, PersonDetector

SEARCH_RAD = math.radians(75.0)
"""Maximum angle of view of a search window [rad]. In wider windows, people are too small for the
detector stage."""
STATURE_M = 1.75
"""Assumed stature of people for the layout of search windows [m]."""
STATURE_OF_SIDE = 0.75
"""Stature of an upright worker, as a fraction of the side of BlazePose's window around the
worker."""
ROOM = 2.1
"""Side of a search window, relative to the height of a person in the image."""
FITTING = (1.25, 2.8)
"""Minimum and maximum side of windows in which the detector stage finds most people, relative to
the height of a person in the image."""
MEETING_M = 0.3
"""Maximum distance between a point and a line of sight to hips at which the hips are assumed to be
at the point [m]."""
SIDE_M = (1.1, 3.6)
"""Minimum and maximum plausible side of the detector stage's window at a person's distance, for a
crouching person and for a tall person with raised arms, respectively [m]."""
SAME = 0.2
"""Distance between the centres of two windows in one camera, as a fraction of the side, below which
both are assumed to show the same person."""
MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines at which their closest points are well defined."""
Candidates: TypeAlias = Sequence[Sequence[Roi]]
"""(C,) windows of the people found in each camera's image."""
Views: TypeAlias = list[Roi | None]
"""(C,) window of a person in each camera's image; None for cameras without a window."""


class ImageSource(Protocol):
    """A source of the present images of all cameras, such as a renderer, cameras or videos."""

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return an upright window (256, 256, 3) of a camera's present image, RGB of uint8."""
        ...


class Sighting(NamedTuple):
    """A person found by a search of whole images."""

    hips_world: Points3
    """(3,) midpoint of the hips [m]; if only one camera detects the person, it is estimated from
    the size of an upright person."""
    windows: Views
    """(C,) window of the person in each camera; None in cameras that do not detect the person."""
    n_cameras: int
    """Number of cameras that detect the person."""


class Found(NamedTuple):
    """A person found in a search window."""

    camera: int
    """Index of the camera."""
    score: float
    """Confidence in [0, 1]."""
    window: Roi
    """Region of interest around the person [px]."""


class SearchResult(NamedTuple):
    """The result of one search window."""

    camera: int
    """Index of the camera."""
    is_usable: bool
    """Whether people can be found in the image, that is, it has edges and is neither blank nor
    mostly noise."""
    found: list[Found]
    """People that the detector stage has found."""


class _People(NamedTuple):
    """Hypothetical people on the floor, projected into an image."""

    middle_px: Points2
    """(N, 2) centres of the bodies [px]."""
    height_px: Floats
    """(N,) heights of the bodies [px]."""


class _Support(NamedTuple):
    """The windows that support the hypothesis of a person with hips at a point."""

    windows: Views
    """(C,) window with the nearest line of sight in each camera; None for cameras without
    support."""
    n_cameras: int
    """Number of cameras with a supporting window."""
    error_m: float
    """Sum of the distances between the lines of sight of the windows and the point [m]."""


SearchJob: TypeAlias = Callable[[PersonDetector], SearchResult]
"""Function that searches one window with a detector stage."""


def search_jobs(
    source: ImageSource, windows: Sequence[Sequence[Roi]], which: Sequence[int]
) -> Iterator[SearchJob]:
    """Render the search windows one by one, and yield a search job for each.

    Args:
        source: the present images.
        windows: (C, ...) search windows of each camera.
        which: indices of the cameras to search.
    """
    for c in which:
        for window in windows[c]:
            crop = np.array(crop_image(source, c, window))
            yield functools.partial(_search_window, c=c, crop=crop, window=window)


def _search_window(detect: PersonDetector, c: int, crop: Image, window: Roi) -> SearchResult:
    """Find the people in the crop (256, 256, 3) of a window of camera c."""
    developed = develop(crop)
    is_usable = developed.is_usable and has_edges(crop)
    people = find_people(detect, developed.picture)
    found = [Found(c, each.score, blazepose.person_window(each, window)) for each in people]
    return SearchResult(c, is_usable, found)


def crop_image(source: ImageSource, c: int, window: Roi) -> Image:
    """Return a window (256, 256, 3) of camera c; raise `ConfigError` unless it is 8-bit RGB."""
    crop = source.crop(c, window)
    if not isinstance(crop, np.ndarray) or crop.dtype != np.uint8:
        got = f"{crop.dtype} array" if isinstance(crop, np.ndarray) else type(crop).__name__
        raise ConfigError(
            f"Image sources must give crops as numpy arrays of uint8, RGB from 0 to 255; camera "
            f"{c} gave a {got}. Scale floating-point images by 255 and convert them: "
            "(255 * image).round().astype(numpy.uint8)."
        )
    if crop.shape != (LANDMARK_SIDE, LANDMARK_SIDE, 3):
        raise ConfigError(
            f"Image sources must give crops of shape {(LANDMARK_SIDE, LANDMARK_SIDE, 3)}: rows, "
            f"columns, RGB; camera {c} gave {crop.shape}. Repeat the single channel of grey images "
            "three times: numpy.repeat(image[..., None], 3, axis=-1)."
        )
    return crop


def find_people(detect: PersonDetector, crop: Image) -> list[blazepose.Person]:
    """Find the people in a crop with the detector stage, best first."""
    return blazepose.decode_people(*detect(blazepose.detector_input(crop).image))


def search_windows(camera: PinholeCamera, floor_world: Points3 | None = None) -> list[Roi]:
    """Return the search windows of a camera, which are upright squares in pixels of the image.

    Args:
        camera: the camera.
        floor_world: (N, 3) points where people may stand [m]. They are covered by a small number of
            windows in which people at these points have a sufficient size. If None, the windows
            overlap and are as large as the image and `SEARCH_RAD` permit.
    """
    if floor_world is not None:
        return _cover_people(_project_people(camera, floor_world))
    side = float(min(camera.width_px, camera.height_px))
    if camera.lens is not None:
        side = min(side, SEARCH_RAD * float(camera.K[0, 0]))
    columns = _middles(camera.width_px, side)
    return [Roi((x, y), side, 0.0) for y in _middles(camera.height_px, side) for x in columns]


def _project_people(camera: PinholeCamera, floor_world: Points3) -> _People:
    """Project people at points (N, 3) of the floor [m], and return those inside the image."""
    heights_m = np.array([[0.0], [0.5], [1.0]]) * (0.0, 0.0, STATURE_M)
    px, depth_m = project(camera.P[None], (floor_world + heights_m[:, None])[None])
    feet, middle, head = image_from_pinhole(camera, px[0, 0])
    seen = (depth_m[0, 0] > 0).all(0) & inside_image(camera, middle)
    return _People(middle[seen], np.linalg.norm(head - feet, axis=-1)[seen])


def _cover_people(people: _People) -> list[Roi]:
    """Return a small set of windows of suitable size that fully contain each of the people.

    The candidates are windows around each person; the one that covers the most people is selected
    repeatedly.
    """
    middle_px, height_px = people.middle_px, people.height_px
    side_px = ROOM * height_px
    fits = side_px[:, None] / height_px
    off_px = np.abs(middle_px[:, None] - middle_px).max(-1)
    covers = (off_px <= (side_px[:, None] - height_px) / 2) & (fits >= FITTING[0])
    covers &= fits <= FITTING[1]
    windows: list[Roi] = []
    while covers.any():
        best = int(np.argmax(covers.sum(1)))
        (x, y), side = middle_px[best].tolist(), float(side_px[best])
        windows.append(Roi((x, y), side, 0.0))
        covers[:, covers[best]] = False
    return windows


def drop_duplicates(found: Sequence[Found], n_cameras: int) -> list[list[Roi]]:
    """Remove duplicates from overlapping windows, and return the people by camera, best first."""
    kept: list[list[Roi]] = [[] for _ in range(n_cameras)]
    for each in sorted(found, key=lambda one: -one.score):
        if not any(is_same_person(each.window, other) for other in kept[each.camera]):
            kept[each.camera].append(each.window)
    return kept


def _middles(length_px: int, side_px: float) -> list[float]:
    """Return the centres of intervals that cover a length, at most half an interval apart [px]."""
    n = 1 + math.ceil(2 * (length_px / side_px - 1))
    return np.linspace(side_px / 2, length_px - side_px / 2, n).tolist()


def agreed_windows(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Views:
    """Return the windows of the person on which the cameras agree best.

    These are the windows with lines of sight to the hips that meet most closely. In a rig of
    several cameras, at least two must have found the person at a plausible size; in a rig of one
    camera, the first candidate is used.

    Args:
        candidates: (C,) windows of the people found in each camera, best first.
        cameras: the rig.

    Returns:
        (C,) window in each camera; None in cameras that have not found the person.
    """
    if len(cameras) == 1:
        return [found[0] if found else None for found in candidates]
    agreed = _find_agreed(candidates, cameras)
    return [None] * len(cameras) if agreed is None else agreed.windows


def sightings(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> list[Sighting]:
    """Return the people among candidates (C,).

    People on which several cameras agree come first, in descending order of agreement, followed by
    those found by only one camera.
    """
    found: list[Sighting] = []
    while (agreed := _find_agreed(candidates, cameras)) is not None:
        found.append(agreed)
        candidates = exclude_people(candidates, [agreed.windows])
    for c, (camera, windows) in enumerate(zip(cameras, candidates, strict=True)):
        for window in windows:
            alone: Views = [window if k == c else None for k in range(len(cameras))]
            found.append(Sighting(_locate_by_size(camera, window), alone, 1))
    return found


def _find_agreed(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Sighting | None:
    """Return the person on which most cameras agree, or None if no two cameras agree."""
    best, best_rank = None, (1, 0.0)
    for point in _find_crossings(candidates, cameras):
        support = _find_support(point, candidates, cameras)
        rank = support.n_cameras, -support.error_m
        if rank > best_rank:
            best, best_rank = Sighting(point, support.windows, support.n_cameras), rank
    return best


def _locate_by_size(camera: PinholeCamera, window: Roi) -> Points3:
    """Return the position (3,) [m] at which the window of an upright person has a given size."""
    (x, y), half_px = window.centre_px, window.side_px / 2
    along, edge = rays(camera, np.array([[x, y], [x, y + half_px]]))
    half_m = STATURE_M / STATURE_OF_SIDE / 2
    away_m = half_m / math.tan(math.acos(min(float(along @ edge), 1.0 - 1e-9)))
    return np.asarray(camera.eye_world + away_m * along)


def propose_people(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Iterator[Views]:
    """Yield the windows (C,) of possible people among candidates (C,), best first.

    People on which several cameras agree come first, followed by those found by only one camera.
    """
    left = candidates
    while any(agreed := agreed_windows(left, cameras)):
        yield agreed
        left = exclude_people(left, [agreed])
    for c, found in enumerate(left):
        for window in found:
            yield [window if k == c else None for k in range(len(cameras))]


def exclude_people(candidates: Candidates, others: Sequence[Sequence[Roi | None]]) -> Candidates:
    """Return the candidates (C,) without those that are in the windows (C,) of other people."""
    return [
        [window for window in found if not any(is_same_person(window, w[c]) for w in others)]
        for c, found in enumerate(candidates)
    ]


def is_same_person(window: Roi, other: Roi | None, share: float = SAME) -> bool:
    """Return whether two windows in one camera have nearly the same centre, that is, hips.

    Args:
        window: a window.
        other: another window, or None.
        share: maximum distance between the centres, as a fraction of the side of `other`.
    """
    if other is None:
        return False
    return math.dist(window.centre_px, other.centre_px) < share * other.side_px


def _find_crossings(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Iterator[Points3]:
    """Yield the points (3,) at which lines of sight of two cameras are closest [m]."""
    lines = [
        (c, camera.eye_world, rays(camera, np.array(window.centre_px)))
        for c, (camera, found) in enumerate(zip(cameras, candidates, strict=True))
        for window in found
    ]
    for (first, eye_1, along_1), (second, eye_2, along_2) in itertools.combinations(lines, 2):
        cosine = float(along_1 @ along_2)
        crossing = 1 - cosine**2
        if first == second or not crossing >= MIN_CROSSING**2:
            continue
        between = eye_2 - eye_1
        a, b = float(between @ along_1), float(between @ along_2)
        far_1, far_2 = (a - b * cosine) / crossing, (a * cosine - b) / crossing
        if far_1 > 0 and far_2 > 0:
            yield (eye_1 + far_1 * along_1 + eye_2 + far_2 * along_2) / 2


def _find_support(
    point_world: Points3, candidates: Candidates, cameras: Sequence[PinholeCamera]
) -> _Support:
    """Return the support by candidates (C,) for a person with hips at a point (3,) [m]."""
    windows: Views = [None] * len(cameras)
    error_m = 0.0
    for c, (camera, found) in enumerate(zip(cameras, candidates, strict=True)):
        px, depth_m = project(camera.P[None], point_world[None])
        if not found or depth_m[0, 0] <= 0:
            continue
        magnified = float(pinhole_magnification(camera, px[0, 0]))
        m_per_px = float(depth_m[0, 0]) / camera.K[0, 0] * magnified
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
    return _Support(windows, sum(window is not None for window in windows), error_m)
