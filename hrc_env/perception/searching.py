"""Looking for people nobody has told of: where to look in whole images.

The detector stage needs a person to be a quarter of its window high. Where it is known what a
camera shows when nobody is there, windows are laid round what differs from that, so that
people across a building site are found as well as those in a small room; else
squares as large as the image are.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import cv2
import numpy as np

from hrc_env.core.records import Roi
from hrc_env.core.typing import Image
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception import blazepose
from hrc_env.perception.acquisition import same_person
from hrc_env.perception.network import PersonDetector

SEARCH_RAD = math.radians(75.0)
"""In a wider search window people are too small for the detector stage."""
DIFFERENCE = 20
"""Grey levels by which a pixel must differ from the empty place, in one colour at least."""
MEND_PX, MEDIAN_PX = 7, 3
"""Parts of one thing are less than the first apart, in pixels of a crop; single pixels, as noise
changes them, go by a median over the second."""
LEAST_PX, MOST_SHARE, MOST_PLACES = 40, 0.7, 5
"""What is smaller than the first [px of a crop's area] is not looked at; what is larger than this
share of a crop is looked at as a whole; no more than so many places in a window."""
ROOM = 1.6
"""Windows round what has changed are so many times as large."""

Found = tuple[int, float, Roi]
"""Which camera, how sure, where."""


class ImageSource(Protocol):
    """What gives pictures: a renderer, a camera, a recorded film."""

    def crop(self, camera_index: int, window: Roi) -> Image:
        """The window of a camera's present image, upright, (256, 256, 3) RGB."""
        ...

    def empty(self, camera_index: int, window: Roi) -> Image | None:
        """The same if nobody were there, robot and all; None where that is not known."""
        ...


def search_jobs(
    source: ImageSource, cameras: Sequence[PinholeCamera], which: Sequence[int], step: float
) -> Iterator[Callable[[PersonDetector], list[Found]]]:
    """Draw one place after the other; each comes with the work that is to be done on it."""
    for c in which:
        for window in search_windows(cameras[c], step):
            crop = np.array(source.crop(c, window))
            empty = source.empty(c, window)
            places = [window] if empty is None else changed(crop, empty, window)
            for place in places:
                picture = crop if place == window else np.array(source.crop(c, place))
                yield lambda detect, c=c, k=picture, w=place: [
                    (c, person.score, blazepose.person_window(person, w))
                    for person in people(detect, k)
                ]


def changed(crop: Image, empty: Image, window: Roi) -> list[Roi]:
    """Upright windows round what is not as it is in the empty place, the largest first.

    Args:
        crop: a window of an image now.
        empty: the same of the empty place.
        window: which.
    """
    differs = cv2.absdiff(crop, empty).max(-1)
    mask = (cv2.medianBlur(differs, MEDIAN_PX) > DIFFERENCE).astype(np.uint8)
    mask = cv2.dilate(mask, np.ones((MEND_PX, MEND_PX), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask)
    blobs = sorted(stats[1:].tolist(), key=lambda blob: -blob[cv2.CC_STAT_AREA])
    size, places = len(crop), []
    for left, top, width, height, area in blobs[:MOST_PLACES]:
        if area < LEAST_PX:
            break
        side = ROOM * max(width, height) / size
        if side > MOST_SHARE:
            places.append(window)
            continue
        middle = np.array([[left + width / 2, top + height / 2]]) / size
        x, y = blazepose.to_image(middle, window)[0].tolist()
        places.append(Roi((x, y), side * window.side_px, window.rotation_rad))
    return list(dict.fromkeys(places))


def people(detect: PersonDetector, crop: Image) -> list[blazepose.Person]:
    """Whom the detector stage finds in a crop."""
    image, _ = blazepose.detector_input(crop)
    return blazepose.decode_people(*detect(image))


def search_windows(camera: PinholeCamera, step: float = 0.5) -> list[Roi]:
    """Upright squares that overlap and together cover a camera's image.

    As large as fit; behind a lens that sees more than `SEARCH_RAD`, no larger than that.
    """
    side = float(min(camera.width_px, camera.height_px))
    if camera.lens is not None:
        side = min(side, SEARCH_RAD * float(camera.K[0, 0]))
    columns = _middles(camera.width_px, side, step)
    return [Roi((x, y), side, 0.0) for y in _middles(camera.height_px, side, step) for x in columns]


def distinct(found: Sequence[Found], n_cameras: int) -> list[list[Roi]]:
    """Each camera's people, best first, one window each: search windows overlap."""
    kept: list[list[Roi]] = [[] for _ in range(n_cameras)]
    for c, _, window in sorted(found, key=lambda item: -item[1]):
        if not any(same_person(window, other) for other in kept[c]):
            kept[c].append(window)
    return kept


def _middles(length_px: int, side_px: float, step: float) -> list[float]:
    """Middles of spans of a side that together cover a length, at most `step` sides apart."""
    n = 1 + math.ceil((length_px / side_px - 1) / step)
    return np.linspace(side_px / 2, length_px - side_px / 2, n).tolist()
