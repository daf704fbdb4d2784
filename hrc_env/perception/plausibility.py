"""Plausibility checks of detections, which exclude robots that are mistaken for people.

If several cameras detect a body, its bones must have plausible lengths. If only one camera detects
it, the body must stand upright at the point at which the line of sight to its feet meets the floor,
and the heights of its joints must be plausible for that position.
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT
from hrc_env.core.typing import Floats, Points2, Points3
from hrc_env.geometry.cameras import PinholeCamera, projections, rays
from hrc_env.geometry.triangulation import triangulate
from hrc_env.perception.lenses import pinhole_keypoints

MIN_VISIBILITY = 0.6
"""Minimum mean confidence of the joints of a person detected by only one camera."""
NEAR_FLOOR_M = 0.5
"""Maximum distance of a standing person from the nearest of the floor's points [m]."""
GATE_SIGMA = 4.0
"""Maximum reprojection error of cameras that agree on a joint, in standard deviations."""
BONE_RATIO = 1.42
"""Maximum plausible ratio of a bone's length to the mean of adults, or of the mean to the
length."""
MIN_BONES = 0.65
"""Minimum fraction of the bones that must have plausible lengths."""
LEVELS = tuple(
    [JOINT[f"{side}_{name}"] for side in ("left", "right")]
    for name in ("ankle", "knee", "hip", "shoulder")
)
"""Pairs of joints with mean heights that are used to check whether a person stands."""
ANKLE_M = 0.1
"""Height of the ankles of a standing person above the floor [m]."""
LEVELS_M: Floats = np.array([(0.2, 0.9), (0.6, 1.4), (1.0, 2.0), (1.2, 2.3)])
"""(4, 2) lower and upper bounds of the heights of knees, hips, shoulders and nose [m]."""


def is_person(
    px: Points2,
    confidence: Floats,
    sigma_px: Floats,
    cameras: Sequence[PinholeCamera],
    floor_world: Points3 | None,
) -> bool:
    """Return whether a detection found by a search is a person.

    Args:
        px: (C, J, 2) joints in pixels of the images.
        confidence: (C, J) confidences of the joints; 0 in cameras that do not show them.
        sigma_px: (C, J) standard deviations of the pixels [px].
        cameras: the rig.
        floor_world: (N, 3) points of the floor where people may be [m]. If None, detections by a
            single camera are accepted only if there is no other camera.
    """
    shown = np.flatnonzero(confidence.any(1)).tolist()
    if len(shown) > 1:
        return has_body(px, confidence, sigma_px, cameras)
    if not shown or floor_world is None:
        return shown == [0] and len(cameras) == 1
    (c,) = shown
    return is_standing(px[c], confidence[c], cameras[c], floor_world)


def has_body(
    px: Points2, confidence: Floats, sigma_px: Floats, cameras: Sequence[PinholeCamera]
) -> bool:
    """Return whether the bones between joints have the lengths of those of a person.

    Args:
        px: (C, J, 2) joints in pixels of the images of two or more cameras.
        confidence: (C, J) confidences of the joints.
        sigma_px: (C, J) standard deviations of the pixels [px].
        cameras: the rig.
    """
    found = Keypoints(*(each[None, :, None] for each in (px, confidence, sigma_px)))
    views = pinhole_keypoints(found, cameras)
    joints = triangulate(projections(tuple(cameras)), views.px, views.sigma_px, GATE_SIGMA)
    start, end = np.moveaxis(joints.points_world[0, 0, BONES], 1, 0)
    ratio = np.linalg.norm(end - start, axis=-1) / BONE_LENGTH_M
    return bool(np.mean((ratio < BONE_RATIO) & (ratio > 1 / BONE_RATIO)) >= MIN_BONES)


def is_standing(
    joints_px: Points2, confidence: Floats, camera: PinholeCamera, floor_world: Points3
) -> bool:
    """Return whether a person is mostly visible and stands upright on the floor.

    Args:
        joints_px: (J, 2) joints in pixels of the image.
        confidence: (J,) confidences of the joints.
        camera: the camera.
        floor_world: (N, 3) points of the floor [m].
    """
    levels_px = [joints_px[pair].mean(0) for pair in LEVELS]
    ray = rays(camera, np.stack([*levels_px, joints_px[JOINT["nose"]]]))
    eye, level = camera.eye_world, np.linalg.norm(ray[:, :2], axis=-1)
    away_m = (ANKLE_M - eye[2]) / ray[0, 2] * level[0]  # along the floor
    height_m = eye[2] + away_m * ray[1:, 2] / level[1:]
    upright = away_m > 0 and ((height_m > LEVELS_M[:, 0]) & (height_m < LEVELS_M[:, 1])).all()
    if not upright or confidence.mean() < MIN_VISIBILITY:
        return False
    place = eye[:2] + away_m * ray[0, :2] / level[0]
    return bool(np.linalg.norm(floor_world[:, :2] - place, axis=-1).min() < NEAR_FLOOR_M)
