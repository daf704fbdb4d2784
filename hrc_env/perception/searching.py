"""Detects people without a prior: searches of whole images, and who is the same in several.

It sees pictures only. The detector stage needs a person to be a third of its window high. Where the
floor is known, windows are as large as people on it need; else as large as the image. The lines of
sight to one person's hips meet; those to two people, or to a mistake, rarely do.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol

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
"""In a wider search window people are too small for the detector stage."""
STATURE_M = 1.75
"""Of the people for whom a search is laid out [m]."""
STATURE_OF_SIDE = 0.75
"""Stature of an upright worker as a share of the side of BlazePose's window round them."""
ROOM, FITTING = 2.1, (1.25, 2.8)
"""Sides of search windows in heights of a person, and where the detector stage still finds most."""
MEETING_M = 0.3
"""Lines of sight that pass a point within this distance [m] see the same hips there."""
SIDE_M = (1.1, 3.6)
"""Sides of the detector stage's window at a person's distance [m]: folded up, tall and reaching."""
SAME = 0.2
"""Windows whose middles are nearer than this share of a side show the same person."""
MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines that fixes a point."""
Candidates = Sequence[Sequence[Roi]]
"""(C,) the people found by each camera."""
Views = list[Roi | None]
"""One person's window a camera (C,), None where there is none."""
Found = tuple[int, float, Roi]
"""Which camera, how sure, where."""


class ImageSource(Protocol):
    """A source of the present images of all cameras: a renderer, a camera, a recorded film."""

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Return a window of a camera's present image, upright, (256, 256, 3) RGB of uint8."""
        ...


class Sighting(NamedTuple):
    """A person in whole images."""

    hips_world: Points3  # (3,) [m]; of a camera alone, by the size of an upright person
    windows: Views  # (C,) the window of each camera that detects them
    cameras: int  # the number of these


class Searched(NamedTuple):
    """The result of one search window."""

    camera: int
    shows: bool  # whether people would be found in it (`exposure.Developed`)
    found: list[Found]


def search_jobs(
    source: ImageSource, windows: Sequence[Sequence[Roi]], which: Sequence[int]
) -> Iterator[Callable[[PersonDetector], Searched]]:
    """Draw one window (C, ...) after the other; each comes with the work that is to be done."""
    for c in which:
        for window in windows[c]:
            crop = np.array(image_crop(source, c, window))
            yield lambda detect, c=c, k=crop, w=window: _searched(detect, c, k, w)


def _searched(detect: PersonDetector, c: int, crop: Image, window: Roi) -> Searched:
    picture, _, shows = develop(crop)
    shows = shows and has_edges(crop)
    found = people(detect, picture)
    windows = [blazepose.person_window(person, window) for person in found]
    scores = [person.score for person in found]
    return Searched(c, shows, [(c, *one) for one in zip(scores, windows, strict=True)])


def image_crop(source: ImageSource, c: int, window: Roi) -> Image:
    """Return a crop of an image source's camera c; `ConfigError` unless it is 8-bit RGB."""
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
            f"columns, RGB; camera {c} gave {crop.shape}. Repeat the one channel of grey images "
            "three times: numpy.repeat(image[..., None], 3, axis=-1)."
        )
    return crop


def people(detect: PersonDetector, crop: Image) -> list[blazepose.Person]:
    """Whom the detector stage finds in a crop."""
    image, _ = blazepose.detector_input(crop)
    return blazepose.decode_people(*detect(image))


def search_windows(camera: PinholeCamera, floor_world: Points3 | None = None) -> list[Roi]:
    """Upright squares: as few as show whoever stands at points (N, 3) [m] large enough. Where these
    are not known, as in films, as large as image and lens (`SEARCH_RAD`) allow, overlapping."""
    if floor_world is not None:
        return _covering(*_standing(camera, floor_world))
    side = float(min(camera.width_px, camera.height_px))
    if camera.lens is not None:
        side = min(side, SEARCH_RAD * float(camera.K[0, 0]))
    columns = _middles(camera.width_px, side)
    return [Roi((x, y), side, 0.0) for y in _middles(camera.height_px, side) for x in columns]


def _standing(camera: PinholeCamera, floor_world: Points3) -> tuple[Points2, Floats]:
    """Middles (N, 2) and heights (N,) [px of the image] of people on the floor who are in it."""
    heights_m = np.array([[0.0], [0.5], [1.0]]) * (0.0, 0.0, STATURE_M)
    px, depth_m = project(camera.P[None], (floor_world + heights_m[:, None])[None])
    feet, middle, head = image_from_pinhole(camera, px[0, 0])
    seen = (depth_m[0, 0] > 0).all(0) & inside_image(camera, middle)
    return middle[seen], np.linalg.norm(head - feet, axis=-1)[seen]


def _covering(middle_px: Points2, height_px: Floats) -> list[Roi]:
    """Few windows so that everybody is well inside one that fits: the most useful one each time,
    of those round somebody."""
    side_px = ROOM * height_px
    fits = side_px[:, None] / height_px
    off_px = np.abs(middle_px[:, None] - middle_px).max(-1)
    covers = (off_px <= (side_px[:, None] - height_px) / 2) & (fits >= FITTING[0])
    covers &= fits <= FITTING[1]
    windows = []
    while covers.any():
        best = int(np.argmax(covers.sum(1)))
        (x, y), side = middle_px[best].tolist(), float(side_px[best])
        windows.append(Roi((x, y), side, 0.0))
        covers[:, covers[best]] = False
    return windows


def distinct(found: Sequence[Found], n_cameras: int) -> list[list[Roi]]:
    """Each camera's people, best first, one window each: search windows overlap."""
    kept: list[list[Roi]] = [[] for _ in range(n_cameras)]
    for c, _, window in sorted(found, key=lambda item: -item[1]):
        if not any(same_person(window, other) for other in kept[c]):
            kept[c].append(window)
    return kept


def _middles(length_px: int, side_px: float) -> list[float]:
    """Middles of spans of a side that together cover a length, at most half a side apart."""
    n = 1 + math.ceil(2 * (length_px / side_px - 1))
    return np.linspace(side_px / 2, length_px - side_px / 2, n).tolist()


def agreed_windows(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Views:
    """One person's window a camera (C,), None where it has not found them: those of the candidates
    (C,), best first, whose hips' lines of sight meet best. Of several cameras, two must have found
    the same person, and not too small or large a one: else nobody."""
    if len(cameras) == 1:
        return [found[0] if found else None for found in candidates]
    agreed = _agreed(candidates, cameras)
    return [None] * len(cameras) if agreed is None else agreed.windows


def sightings(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> list[Sighting]:
    """Return the people among candidates (C,): those on whom several cameras agree, best first,
    then those whom one camera alone detects."""
    found = []
    while (agreed := _agreed(candidates, cameras)) is not None:
        found.append(agreed)
        candidates = apart_from(candidates, [agreed.windows])
    for c, (camera, windows) in enumerate(zip(cameras, candidates, strict=True)):
        for window in windows:
            alone: Views = [window if k == c else None for k in range(len(cameras))]
            found.append(Sighting(_by_size(camera, window), alone, 1))
    return found


def _agreed(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Sighting | None:
    """Return the person on whom most cameras agree best; None unless two do."""
    best, best_rank = None, (1, 0.0)
    for point in _crossings(candidates, cameras):
        windows, rank = _support(point, candidates, cameras)
        if rank > best_rank:
            best, best_rank = Sighting(point, windows, rank[0]), rank
    return best


def _by_size(camera: PinholeCamera, window: Roi) -> Points3:
    """Return the place (3,) at which an upright person has a window of this size [m]."""
    (x, y), half_px = window.centre_px, window.side_px / 2
    along, edge = rays(camera, np.array([[x, y], [x, y + half_px]]))
    half_m = STATURE_M / STATURE_OF_SIDE / 2
    away_m = half_m / math.tan(math.acos(min(float(along @ edge), 1.0 - 1e-9)))
    return np.asarray(camera.eye_world + away_m * along)


def proposals(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Iterator[Views]:
    """Who it may be, best first, a window a camera (C,): whom several cameras agree on, then whom
    only one has found."""
    left = candidates
    while any(agreed := agreed_windows(left, cameras)):
        yield agreed
        left = apart_from(left, [agreed])
    for c, found in enumerate(left):
        for window in found:
            yield [window if k == c else None for k in range(len(cameras))]


def apart_from(candidates: Candidates, others: Sequence[Sequence[Roi | None]]) -> Candidates:
    """Candidates (C,) without those who are in a window (C,) of somebody else already."""
    return [
        [window for window in found if not any(same_person(window, w[c]) for w in others)]
        for c, found in enumerate(candidates)
    ]


def same_person(window: Roi, other: Roi | None, share: float = SAME) -> bool:
    """Return whether two windows of one camera have their middle, the hips, in nearly one place:
    within this share of a side."""
    if other is None:
        return False
    return math.dist(window.centre_px, other.centre_px) < share * other.side_px


def _crossings(candidates: Candidates, cameras: Sequence[PinholeCamera]) -> Iterator[Points3]:
    """Points (3,) where lines of sight of two cameras pass each other."""
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


def _support(
    point_world: Points3, candidates: Candidates, cameras: Sequence[PinholeCamera]
) -> tuple[Views, tuple[int, float]]:
    """Windows that see their hips at a point, with their number and how well they meet."""
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
    return windows, (sum(window is not None for window in windows), -error_m)
