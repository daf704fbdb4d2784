"""Decoding of BlazePose's output tensors to people, regions of interest and landmarks.

The constants are those of the graphs of MediaPipe 0.10.21. The method is described by Bazarevsky et
al., BlazePose: On-device Real-time Body Pose tracking (2020), arXiv:2006.10204.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Roi
from hrc_env.core.skeleton import BLAZEPOSE_INDEX
from hrc_env.core.typing import Floats, Image, Points2, Tensor
from hrc_env.perception.network import DETECTOR_SIDE, LANDMARK_SIDE, load_landmarker

MIN_SCORE = 0.5
"""Minimum detector score and minimum presence score of a person, as in MediaPipe."""
MAX_OVERLAP = 0.3
"""Overlap (intersection over union) above which two boxes belong to the same person."""
ROI_MARGIN = 1.25
"""Ratio of the side of the region of interest to the diameter of the circle around the person."""
_REACH = 4  # a 9 x 9 neighbourhood in the 64 x 64 heatmap
_HEAT_SIDE = 64
_N_USED = 35  # 33 body landmarks, then the two that give the next region of interest


@dataclass(frozen=True, slots=True)
class Person:
    """A person found by the detector stage, in units of the square image's side."""

    score: float
    """Confidence in [0, 1]."""
    box: Floats
    """(4,) left, top, right and bottom edges of the face's bounding box."""
    hip: Points2
    """(2,) midpoint of the hips."""
    rim: Points2
    """(2,) point on the circle around the whole body, in the direction from the hips to the head of
    an upright body."""


class DetectorInput(NamedTuple):
    """An input of the detector stage."""

    image: Tensor
    """(224, 224, 3) image in [-1, 1], with a black border if the original is not square."""
    window: Roi
    """Window of the original image that is shown in `image` [px]."""


def _anchors() -> Floats:
    """Return the centres (2254, 2) of the detector's cells, with strides 8, 16 and 32.

    The number of cells per grid point is 2, 2 and 6 for these strides.
    """
    parts = []
    for stride, per_cell in ((8, 2), (16, 2), (32, 6)):
        n = DETECTOR_SIDE // stride
        centre = (np.arange(n) + 0.5) / n
        x, y = np.meshgrid(centre, centre)
        parts.append(np.repeat(np.stack([x.ravel(), y.ravel()], 1), per_cell, axis=0))
    return np.concatenate(parts)


ANCHORS: Floats = _anchors()
"""(2254, 2) centres of the detector's cells, in units of the image's side."""


def wrap_angle(angle_rad: float) -> float:
    """Return the equivalent angle in [-pi, pi) [rad]."""
    return angle_rad - 2 * math.pi * math.floor((angle_rad + math.pi) / (2 * math.pi))


def window_from_points(centre_px: Points2, rim_px: Points2) -> Roi:
    """Return the region of interest around mid-hip (2,), with its top towards the rim (2,) [px]."""
    dx, dy = rim_px[0] - centre_px[0], rim_px[1] - centre_px[1]
    side_px = 2 * math.hypot(dx, dy) * ROI_MARGIN
    rotation = wrap_angle(math.pi / 2 - math.atan2(-dy, dx))
    return Roi((float(centre_px[0]), float(centre_px[1])), side_px, rotation)


def crop_window(image: Image, window: Roi, side: int = LANDMARK_SIDE) -> Image:
    """Resample a window of an image to an upright crop, as MediaPipe does.

    Args:
        image: (H, W, 3) RGB of uint8; outside the image, its border pixels are repeated.
        window: a rotated square in the image [px].
        side: side of the crop [px].

    Returns:
        (side, side, 3) crop of uint8, interpolated bilinearly; its corners are those of the window.

    Raises:
        ConfigError: the image is not of type uint8.
    """
    if image.dtype != np.uint8:
        raise ConfigError(
            f"An image must be of uint8, 0 to 255, got {image.dtype}. Convert an image with values "
            "from 0 to 1 by (255 * image).round().astype(numpy.uint8)."
        )
    matrix = image_from_crop(window, side)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    crop = cv2.warpAffine(image, matrix, (side, side), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return crop.astype(np.uint8, copy=False)


def to_image(points: Points2, window: Roi) -> Points2:
    """Convert points (..., 2), in units of a window's side from its corner, to image pixels."""
    matrix = image_from_crop(window, 1)
    return points @ matrix[:, :2].T + matrix[:, 2]


def image_from_crop(window: Roi, side: int) -> Floats:
    """Return the affine map (2, 3) from the pixels of a crop to those of the image."""
    scale = window.side_px / side
    c, s = math.cos(window.rotation_rad) * scale, math.sin(window.rotation_rad) * scale
    turn = np.array([[c, -s], [s, c]])
    return np.column_stack([turn, np.array(window.centre_px) - turn @ [side / 2, side / 2]])


def detector_input(image: Image) -> DetectorInput:
    """Convert an image of any shape to an input of the detector stage."""
    height, width = image.shape[:2]
    window = Roi((width / 2, height / 2), float(max(height, width)), 0.0)
    size = (DETECTOR_SIDE, DETECTOR_SIDE)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    small = cv2.warpAffine(image, image_from_crop(window, DETECTOR_SIDE), size, flags=flags)
    return DetectorInput(small.astype(np.float32) * np.float32(2 / 255) - np.float32(1), window)


def landmark_input(crop: Image) -> Tensor:
    """Convert a crop (256, 256, 3) to an input of the landmark stage, in [0, 1]."""
    return np.multiply(crop, np.float32(1 / 255), dtype=np.float32)


def decode_people(boxes: Tensor, logits: Tensor, min_score: float = MIN_SCORE) -> list[Person]:
    """Decode the outputs of the detector stage to people, in descending order of score.

    Args:
        boxes: (2254, 12) box and keypoints of each cell.
        logits: (2254,) logits of the scores.
        min_score: minimum score of a person.
    """
    score = 1 / (1 + np.exp(-np.clip(logits.astype(float), -80, 80)))
    kept = np.flatnonzero(score >= min_score)
    raw, score, anchor = boxes[kept].astype(float) / DETECTOR_SIDE, score[kept], ANCHORS[kept]
    centre, half = raw[:, 0:2] + anchor, raw[:, 2:4] / 2
    corners = np.concatenate([centre - half, centre + half], axis=1)
    keypoints = raw[:, 4:8].reshape(-1, 2, 2) + anchor[:, None]
    return merge_people(score, corners, keypoints)


def merge_people(score: Floats, box: Floats, keypoints: Floats) -> list[Person]:
    """Merge overlapping boxes to people, by weighted non-maximum suppression.

    Args:
        score: (n,) scores, which are the weights.
        box: (n, 4) boxes.
        keypoints: (n, 2, 2) mid-hips and rims.
    """
    people: list[Person] = []
    order = np.argsort(-score, kind="stable")
    while len(order):
        same = _overlap(box[order[0]], box[order]) > MAX_OVERLAP
        same[0] = True  # a box without area does not overlap even itself
        group = order[same]
        weight = score[group] / score[group].sum()
        hip, rim = np.einsum("n,nkd->kd", weight, keypoints[group])
        people.append(Person(float(score[order[0]]), weight @ box[group], hip, rim))
        order = order[~same]
    return people


def person_window(person: Person, window: Roi) -> Roi:
    """Return the region of interest around a person found in a square window [px]."""
    hip, rim = to_image(np.array([person.hip, person.rim]), window)
    return window_from_points(hip, rim)


def decode_landmarks(points: Tensor, heat: Tensor) -> Floats:
    """Decode BlazePose's landmarks: 33 points of the body, mid-hip and rim.

    Args:
        points: (39, 5) x, y, z in crop pixels, and logits of visibility and presence.
        heat: (64, 64, 39) logits of the heatmaps. If a probability near a point reaches
            `MIN_SCORE`, the point is refined to the mean of its neighbourhood, weighted with the
            probabilities.

    Returns:
        (35, 3) x, y in units of the crop's side, and visibility in [0, 1].
    """
    out = np.empty((_N_USED, 3))
    _refine(np.ascontiguousarray(points), np.ascontiguousarray(heat), out)
    return out


def load_blazepose(network: str = "full") -> Callable[[Image], Floats | None]:
    """Load BlazePose's landmark network as a function, for use in custom detectors.

    Custom detectors are registered with `register_detector`.

    Args:
        network: "lite", "full" or "heavy".

    Returns:
        A function from a crop (256, 256, 3), RGB of uint8, to (15, 3): x, y [px] from the crop's
        corner and confidence in [0, 1] of each of `JOINTS`. It returns None if there is no person.

    Raises:
        WeightsError: the network's weights are missing.
    """
    run = load_landmarker(network)

    def find_joints(crop: Image) -> Floats | None:
        points, presence, heat = run(landmark_input(crop))
        if presence < MIN_SCORE:
            return None
        joints = decode_landmarks(points, heat)[BLAZEPOSE_INDEX]
        return joints * (LANDMARK_SIDE, LANDMARK_SIDE, 1.0)

    return find_joints


@kernel
def _refine(points: Tensor, heat: Tensor, out: Floats) -> None:
    """Compute the result `out` (35, 3) of `decode_landmarks`, with Python's lock released."""
    for k in range(out.shape[0]):
        x, y = points[k, 0] / np.float64(LANDMARK_SIDE), points[k, 1] / np.float64(LANDMARK_SIDE)
        out[k, 0], out[k, 1] = x, y
        out[k, 2] = _probability(np.float64(points[k, 3]))
        column, row = int(x * _HEAT_SIDE), int(y * _HEAT_SIDE)
        if not (0 <= column < _HEAT_SIDE and 0 <= row < _HEAT_SIDE):
            continue
        total, at_column, at_row, surest = 0.0, 0.0, 0.0, 0.0
        for r in range(max(row - _REACH, 0), min(row + _REACH + 1, _HEAT_SIDE)):
            for c in range(max(column - _REACH, 0), min(column + _REACH + 1, _HEAT_SIDE)):
                weight = _probability(np.float64(heat[r, c, k]))
                surest = max(surest, weight)
                total += weight
                at_column += weight * c
                at_row += weight * r
        if surest >= MIN_SCORE:
            out[k, 0] = at_column / total / _HEAT_SIDE
            out[k, 1] = at_row / total / _HEAT_SIDE


@kernel
def _probability(logit: float) -> float:
    """Convert a logit to a probability."""
    return 1.0 / (1.0 + math.exp(-min(max(logit, -80.0), 80.0)))


def _overlap(box: Floats, boxes: Floats) -> Floats:
    """Return the intersection over union (n,) of a box (4,) with each of n boxes (n, 4)."""
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    shared = np.clip(high - low, 0, None).prod(1)
    area = (boxes[:, 2:] - boxes[:, :2]).prod(1)
    union = (box[2:] - box[:2]).prod() + area - shared
    return shared / np.maximum(union, 1e-12)
