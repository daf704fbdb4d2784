"""Windows around the predicted joints of workers, from which crops are taken.

As in BlazePose's detector stage, a window is centred at mid-hip, as large as the body, and rotated
so that the torso is upright. The landmark stage tolerates a shift of 0.2 of the side, a scale from
0.8 to 1.25, and a rotation of 20 degrees.
"""

import math
from typing import NamedTuple

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
"""Minimum depth of a worker's torso in the camera's frame [m]. Nearer workers have no window."""
MIN_JOINTS_INSIDE = 6
"""Minimum number of joints (of 15) inside the image for a worker to have a window."""
MIN_REACH_M = 0.85
"""Minimum radius of a window [m]. It is that of an upright person, because a bent person may stand
up."""
MIN_TORSO_M = 0.15
"""Length of the projected torso below which the torso is seen end on, with an undefined direction
[m]. In this case, the window is upright in the image."""
CROWN = 0.8
"""Extent of the head and hat beyond the nose, as a fraction of the distance from the shoulders to
the nose."""
HAND = 0.6
"""Extent of the hands beyond the wrists, as a fraction of the distance from elbow to wrist."""
STEADY_SHIFT, STEADY_SCALE, STEADY_TURN_RAD = 0.10, 0.15, 0.2
"""Differences between the predicted and the last window below which the last window is kept: shift
(as a fraction of the side), scale (logarithm) and rotation [rad]. They are half of the landmark
stage's tolerances."""


class Window(NamedTuple):
    """Size and orientation of the window around a worker."""

    side_px: float
    """Length of the window's sides [px]."""
    turn_rad: float
    """Rotation of the window from upright, clockwise in the image [rad]."""


def window_from_joints(joints_px: Points2, depth_m: Floats, camera: PinholeCamera) -> Roi | None:
    """Return the window around the joints of a worker.

    Args:
        joints_px: (J, 2) joints in pinhole pixels.
        depth_m: (J,) depths of the joints along the camera's axis [m].
        camera: the camera.

    Returns:
        The window in pixels of the image, or None if the worker is behind the camera, very close to
        it or outside its image.
    """
    if depth_m[TORSO].min() < MIN_DEPTH_M:
        return None
    magnification = pinhole_magnification(camera, joints_px[TORSO].mean(0))
    joints_px = image_from_pinhole(camera, joints_px)
    inside = (depth_m > MIN_DEPTH_M) & inside_image(camera, joints_px)
    if np.count_nonzero(inside) < MIN_JOINTS_INSIDE:
        return None
    px_per_m = camera.K[0, 0] / (depth_m[TORSO].mean() * magnification)
    window = fit_window(
        np.ascontiguousarray(joints_px), np.ascontiguousarray(depth_m), px_per_m, MIN_DEPTH_M
    )
    u, v = joints_px[[JOINT["left_hip"], JOINT["right_hip"]]].mean(0).tolist()
    return Roi((u, v), window.side_px, window.turn_rad)


@kernel
def fit_window(uv: Points2, depth: Floats, px_per_m: float, nearest_m: float) -> Window:
    """Return the size and orientation of the window around the joints of a worker.

    Args:
        uv: (J, 2) joints in pixels of the image.
        depth: (J,) depths of the joints along the camera's axis [m].
        px_per_m: scale of the image at the worker's distance [px/m].
        nearest_m: minimum depth of joints that are considered [m].
    """
    hip_x, hip_y = 0.5 * (uv[7, 0] + uv[8, 0]), 0.5 * (uv[7, 1] + uv[8, 1])
    neck_x, neck_y = 0.5 * (uv[1, 0] + uv[2, 0]), 0.5 * (uv[1, 1] + uv[2, 1])
    x, y = neck_x - hip_x, neck_y - hip_y
    y -= max(0.0, MIN_TORSO_M * px_per_m - math.sqrt(x * x + y * y))
    reach = MIN_REACH_M * px_per_m
    reach *= reach
    for j in range(len(depth)):
        if depth[j] > nearest_m:
            reach = max(reach, _squared_norm(uv[j, 0] - hip_x, uv[j, 1] - hip_y))
    for j in range(5, 7):
        hand_x = uv[j, 0] + HAND * (uv[j, 0] - uv[j - 2, 0]) - hip_x
        hand_y = uv[j, 1] + HAND * (uv[j, 1] - uv[j - 2, 1]) - hip_y
        if depth[j] > nearest_m and depth[j - 2] > nearest_m:
            reach = max(reach, _squared_norm(hand_x, hand_y))
    if depth[0] > nearest_m:
        crown_x = uv[0, 0] + CROWN * (uv[0, 0] - neck_x) - hip_x
        crown_y = uv[0, 1] + CROWN * (uv[0, 1] - neck_y) - hip_y
        reach = max(reach, _squared_norm(crown_x, crown_y))
    return Window(2.0 * ROI_MARGIN * math.sqrt(reach), math.atan2(x, -y))


@kernel
def _squared_norm(x: float, y: float) -> float:
    """Return the squared length of a vector (x, y)."""
    return x * x + y * y


def steady_window(kept: Roi | None, wanted: Roi | None) -> Roi | None:
    """Return the last window if it is close to the predicted one, otherwise the predicted one.

    Unchanged crops result in steady landmarks and need not be rendered again.
    """
    if kept is None or wanted is None:
        return wanted
    steady = (
        math.dist(kept.centre_px, wanted.centre_px) < STEADY_SHIFT * kept.side_px
        and abs(math.log(wanted.side_px / kept.side_px)) < STEADY_SCALE
        and abs(wrap_angle(wanted.rotation_rad - kept.rotation_rad)) < STEADY_TURN_RAD
    )
    return kept if steady else wanted
