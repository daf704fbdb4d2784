"""Where to look: the crop round a worker whose joints are predicted.

BlazePose's detector stage gives the landmark stage a square round mid-hip, turned so that
the torso is upright, as large as the body. The tracker's prediction gives the same square
at no cost, also where the detector stage is blind: bodies smaller than a quarter of the
image. The landmark stage forgives a shift of 0.2 of the side, a scale of 0.8 to 1.25 and a
turn of 20 degrees.
"""

import math

import numpy as np

from hrc_env.core.records import Roi
from hrc_env.core.skeleton import JOINT, TORSO
from hrc_env.core.typing import Floats, Points2
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    inside_image,
    pinhole_magnification,
)
from hrc_env.perception.blazepose import window_from_points, wrap_angle

MIN_DEPTH_M = 0.5
"""A worker whose torso is nearer to the camera's plane is not looked at."""

MIN_JOINTS_INSIDE = 6
"""Fewer joints in the image, of 15, are not worth a look."""

MIN_REACH_M = 0.85
"""A window is never tighter than round somebody upright: whoever is folded up may rise, and a tight
window round a wrong estimate shows too little to put it right."""

MIN_TORSO_M = 0.15
"""A torso that looks shorter is seen end on and gives no direction; then up is the image's."""

CROWN = 0.8
"""The hat reaches so much further beyond the nose as the nose is from the shoulders."""

HAND = 0.6
"""Hands reach so much further beyond the wrists as the wrists are from the elbows."""

STEADY_SHIFT, STEADY_SCALE, STEADY_TURN_RAD = 0.10, 0.15, 0.2
"""A window stays while the wanted one is off by less than this share of its side, this
logarithm of its size and this turn: half of what the landmark stage forgives."""

_LEFT_RIGHT = ("left", "right")
_HIPS = [JOINT[f"{side}_hip"] for side in _LEFT_RIGHT]
_SHOULDERS = [JOINT[f"{side}_shoulder"] for side in _LEFT_RIGHT]
_ELBOWS = [JOINT[f"{side}_elbow"] for side in _LEFT_RIGHT]
_WRISTS = [JOINT[f"{side}_wrist"] for side in _LEFT_RIGHT]


def window_from_joints(joints_px: Points2, depth_m: Floats, camera: PinholeCamera) -> Roi | None:
    """The region of interest round projected joints, or None where there is nothing to see.

    Args:
        joints_px: (J, 2) projected joints, pinhole pixels.
        depth_m: (J,) their depth along the optical axis [m].
        camera: whose image it is.

    Returns:
        In pixels of the image. None if the worker is behind or very close to the camera, or
        outside its image.
    """
    if depth_m[TORSO].min() < MIN_DEPTH_M:
        return None
    ahead = depth_m > MIN_DEPTH_M
    magnification = pinhole_magnification(camera, joints_px[TORSO].mean(0))
    joints_px = image_from_pinhole(camera, joints_px)
    if np.count_nonzero(ahead & inside_image(camera, joints_px)) < MIN_JOINTS_INSIDE:
        return None
    px_per_m = camera.K[0, 0] / (depth_m[TORSO].mean() * magnification)
    hip = joints_px[_HIPS].mean(0)
    torso = joints_px[_SHOULDERS].mean(0) - hip
    missing = max(0.0, MIN_TORSO_M * px_per_m - float(np.hypot(*torso)))
    upright = torso - np.array([0.0, missing])
    away = _outline(joints_px, ahead) - hip
    reach_px = max(float(np.hypot(away[:, 0], away[:, 1]).max()), MIN_REACH_M * px_per_m)
    length = float(np.hypot(*upright))
    up = upright / length if length > 1e-9 else np.array([0.0, -1.0])
    return window_from_points(hip, hip + reach_px * up)


def steady_window(kept: Roi | None, wanted: Roi | None) -> Roi | None:
    """The window of the last look while it is still good for the wanted one, else the latter.

    Steady crops make steady landmarks, and what stands still in them need not be drawn again.
    """
    if kept is None or wanted is None:
        return wanted
    shift_px = math.dist(kept.centre_px, wanted.centre_px)
    turn_rad = wrap_angle(wanted.rotation_rad - kept.rotation_rad)
    steady = (
        shift_px < STEADY_SHIFT * kept.side_px
        and abs(math.log(wanted.side_px / kept.side_px)) < STEADY_SCALE
        and abs(turn_rad) < STEADY_TURN_RAD
    )
    return kept if steady else wanted


def _outline(joints_px: Points2, ahead: np.ndarray) -> Points2:
    """Joints, and what sticks out beyond them: crown and hands."""
    nose = joints_px[JOINT["nose"]]
    crown = nose + CROWN * (nose - joints_px[_SHOULDERS].mean(0))
    hands = joints_px[_WRISTS] + HAND * (joints_px[_WRISTS] - joints_px[_ELBOWS])
    arms_ahead = ahead[_WRISTS] & ahead[_ELBOWS]
    parts = [joints_px[ahead], hands[arms_ahead]]
    if ahead[JOINT["nose"]]:
        parts.append(crown[None])
    return np.concatenate(parts)
