"""Where to look: the crop round a worker whose joints are predicted.

As BlazePose's detector stage has it: round mid-hip, the torso upright, as large as the body. The
landmark stage forgives a shift of 0.2 of the side, a scale of 0.8 to 1.25, a turn of 20 degrees.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Roi
from hrc_env.core.skeleton import JOINT, TORSO
from hrc_env.core.typing import Floats, Points2
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    inside_image,
    pinhole_magnification,
)
from hrc_env.perception.blazepose import ROI_MARGIN, wrap_angle

MIN_DEPTH_M = 0.5
"""A worker whose torso is nearer to the camera's plane is not looked at."""
MIN_JOINTS_INSIDE = 6
"""Fewer joints in the image, of 15, are not worth a look."""
MIN_REACH_M = 0.85
"""A window is never tighter than round somebody upright: whoever is folded up may rise."""
MIN_TORSO_M = 0.15
"""A torso that looks shorter is seen end on and gives no direction; then up is the image's."""
CROWN = 0.8
"""The hat reaches so much further beyond the nose as the nose is from the shoulders."""
HAND = 0.6
"""Hands reach so much further beyond the wrists as the wrists are from the elbows."""
STEADY_SHIFT, STEADY_SCALE, STEADY_TURN_RAD = 0.10, 0.15, 0.2
"""A window stays while the wanted one is off by less than this share of its side, this
logarithm of its size and this turn: half of what the landmark stage forgives."""


def window_from_joints(joints_px: Points2, depth_m: Floats, camera: PinholeCamera) -> Roi | None:
    """The region of interest of a camera's image [px of the image] round joints (J, 2) [pinhole
    px] with depths (J,) [m]; None if the worker is behind, very close or outside."""
    if depth_m[TORSO].min() < MIN_DEPTH_M:
        return None
    magnification = pinhole_magnification(camera, joints_px[TORSO].mean(0))
    joints_px = image_from_pinhole(camera, joints_px)
    inside = (depth_m > MIN_DEPTH_M) & inside_image(camera, joints_px)
    if np.count_nonzero(inside) < MIN_JOINTS_INSIDE:
        return None
    px_per_m = camera.K[0, 0] / (depth_m[TORSO].mean() * magnification)
    side_px, turn_rad = window_round(
        np.ascontiguousarray(joints_px), np.ascontiguousarray(depth_m), px_per_m, MIN_DEPTH_M
    )
    u, v = joints_px[[JOINT["left_hip"], JOINT["right_hip"]]].mean(0).tolist()
    return Roi((u, v), side_px, turn_rad)


@kernel
def window_round(uv, depth, px_per_m, nearest_m):
    """Side [px] and turn [rad] of the window round joints (J, 2); those nearer than `nearest_m` do
    not count, and `px_per_m` is at the worker's distance."""
    hip_x, hip_y = 0.5 * (uv[7, 0] + uv[8, 0]), 0.5 * (uv[7, 1] + uv[8, 1])
    neck_x, neck_y = 0.5 * (uv[1, 0] + uv[2, 0]), 0.5 * (uv[1, 1] + uv[2, 1])
    x, y = neck_x - hip_x, neck_y - hip_y
    y -= max(0.0, MIN_TORSO_M * px_per_m - math.sqrt(x * x + y * y))
    reach = MIN_REACH_M * px_per_m
    reach *= reach
    for j in range(len(depth)):
        if depth[j] > nearest_m:
            reach = max(reach, _squared(uv[j, 0] - hip_x, uv[j, 1] - hip_y))
    for j in range(5, 7):
        hand_x = uv[j, 0] + HAND * (uv[j, 0] - uv[j - 2, 0]) - hip_x
        hand_y = uv[j, 1] + HAND * (uv[j, 1] - uv[j - 2, 1]) - hip_y
        if depth[j] > nearest_m and depth[j - 2] > nearest_m:
            reach = max(reach, _squared(hand_x, hand_y))
    if depth[0] > nearest_m:
        crown_x = uv[0, 0] + CROWN * (uv[0, 0] - neck_x) - hip_x
        crown_y = uv[0, 1] + CROWN * (uv[0, 1] - neck_y) - hip_y
        reach = max(reach, _squared(crown_x, crown_y))
    return 2.0 * ROI_MARGIN * math.sqrt(reach), math.atan2(x, -y)


@kernel
def _squared(x, y):
    return x * x + y * y


def steady_window(kept: Roi | None, wanted: Roi | None) -> Roi | None:
    """The window of the last look while it is still good for the wanted one, else the latter:
    steady crops make steady landmarks, and need not be drawn again."""
    if kept is None or wanted is None:
        return wanted
    steady = (
        math.dist(kept.centre_px, wanted.centre_px) < STEADY_SHIFT * kept.side_px
        and abs(math.log(wanted.side_px / kept.side_px)) < STEADY_SCALE
        and abs(wrap_angle(wanted.rotation_rad - kept.rotation_rad)) < STEADY_TURN_RAD
    )
    return kept if steady else wanted
