"""Whether what a search has found is somebody: a network takes robots for people now and then.

Several cameras must show a body: bones about as long as people's. What one camera shows alone must
stand upright on the floor, where its line of sight meets it: then its size says who is too large.
"""

from collections.abc import Sequence

import numpy as np

from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT
from hrc_env.core.typing import Floats, Points2, Points3
from hrc_env.geometry.cameras import PinholeCamera, projections, rays
from hrc_env.geometry.triangulation import triangulate
from hrc_env.perception.lensed import pinhole_keypoints

VISIBLE = 0.6
"""Mean confidence of the joints of who is seen by one camera only."""
NEAR_M = 0.5
"""Who stands is so near to a place where people may [m]."""
GATE_SIGMA = 4.0
"""Cameras agree on a joint within so many standard deviations."""
OFF, LEAST_SHARE = 1.42, 0.65
"""Bones by which factor from an adult's mean still count, and the share of all that must."""
LEVELS = tuple(
    [JOINT[f"{side}_{name}"] for side in ("left", "right")]
    for name in ("ankle", "knee", "hip", "shoulder")
)
"""Joints by which it is seen whether somebody stands,"""
ANKLE_M, LEVELS_M = 0.1, np.array([(0.2, 0.9), (0.6, 1.4), (1.0, 2.0), (1.2, 2.3)])
"""the height of the first above the floor, and bounds of the others' and of the nose's [m]."""


def is_somebody(
    px: Points2,
    confidence: Floats,
    sigma_px: Floats,
    cameras: Sequence[PinholeCamera],
    floor_world: Points3 | None,
) -> bool:
    """Whether what a search has found is a person: joints and floor as below; of a floor that is
    not known, a camera that is the only one is believed."""
    shown = np.flatnonzero(confidence.any(1)).tolist()
    if len(shown) > 1:
        return is_body(px, confidence, sigma_px, cameras)
    if not shown or floor_world is None:
        return shown == [0] and len(cameras) == 1
    (c,) = shown
    return stands(px[c], confidence[c], cameras[c], floor_world)


def is_body(
    px: Points2, confidence: Floats, sigma_px: Floats, cameras: Sequence[PinholeCamera]
) -> bool:
    """Whether cameras C, two at least, show a person's bones: joints (C, J, 2) and what is known of
    them (C, J), in pixels of the images."""
    found = Keypoints(*(each[None, :, None] for each in (px, confidence, sigma_px)))
    seen = pinhole_keypoints(found, cameras)
    joints = triangulate(projections(tuple(cameras)), seen.px, seen.sigma_px, GATE_SIGMA)
    start, end = np.moveaxis(joints.points_world[0, 0, BONES], 1, 0)
    ratio = np.linalg.norm(end - start, axis=-1) / BONE_LENGTH_M
    return bool(np.mean((ratio < OFF) & (ratio > 1 / OFF)) >= LEAST_SHARE)


def stands(
    joints_px: Points2, confidence: Floats, camera: PinholeCamera, floor_world: Points3
) -> bool:
    """Whether somebody with joints (J, 2) [image px] and confidence (J,) is mostly visible and
    stands upright near one of the points (N, 3) of the floor [m]."""
    levels_px = [joints_px[pair].mean(0) for pair in LEVELS]
    ray = rays(camera, np.stack([*levels_px, joints_px[JOINT["nose"]]]))
    eye, level = camera.eye_world, np.linalg.norm(ray[:, :2], axis=-1)
    away_m = (ANKLE_M - eye[2]) / ray[0, 2] * level[0]  # along the floor
    height_m = eye[2] + away_m * ray[1:, 2] / level[1:]
    upright = away_m > 0 and ((height_m > LEVELS_M[:, 0]) & (height_m < LEVELS_M[:, 1])).all()
    if not upright or confidence.mean() < VISIBLE:
        return False
    place = eye[:2] + away_m * ray[0, :2] / level[0]
    return bool(np.linalg.norm(floor_world[:, :2] - place, axis=-1).min() < NEAR_M)
