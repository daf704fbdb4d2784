"""Detected people that no track explains: wrong calibrations, exchanged cameras, mirrored images.

A track of a body that is far too small or too large for a person explains no pose: with a
calibration in other units, or by a board of another size, all cameras agree on such a body.

A camera contradicts a track if most of its confident detections are farther from the track's joints
than the detector's errors. One camera does for a moment after a swap of left and right or while a
track restarts; several cameras that go on are not placed as the calibration has it.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.triangulation import pixel_of

SEEN_WELL = 0.5
LEAST_JOINTS = 4
"""Least confidence of a joint, and number of such joints, of a pose that has to be explained."""
EXPLAINED_M = 0.15
SIGMAS = 4.0
"""A detection belongs to a track's joint within this distance across the line of sight [m], or
within this number of its standard deviations."""

SMALLEST_M, LARGEST_M = 0.95, 1.8
"""Length of trunk, thigh and shank of the smallest and of the largest person [m]; of adults of
1.5 to 2 m it is 1.15 to 1.55."""
CHAIN = tuple(JOINT[f"left_{name}"] for name in ("shoulder", "hip", "knee", "ankle"))
"""Joints of the left side; those of the right are the next."""


class Shown(NamedTuple):
    """The poses that cameras detect."""

    poses: Bools
    """(B, C) whether a camera detects a pose."""
    unexplained: Bools
    """(B, C) whether it detects a pose that no track explains."""


def find_unexplained(
    keypoints: Keypoints, age_s: Floats, estimate: PoseEstimate, P: Floats, focal_px: Floats
) -> Shown:
    """Find the cameras that detect poses, and poses that no track explains.

    Args:
        keypoints: (B, C, W, ...) pinhole pixels, worker by worker.
        age_s: (B, C) age of the images [s]; NaN without one.
        estimate: (B, W, ...) of the tracker.
        P: (C, 3, 4) projections.
        focal_px: (C,) focal lengths [px].
    """
    shape = keypoints.confidence.shape[:2]
    shown = Shown(np.zeros(shape, np.bool_), np.zeros(shape, np.bool_))
    seen = keypoints.px, keypoints.confidence, keypoints.sigma_px, np.nan_to_num(age_s)
    believed = estimate.mean_world, estimate.velocity_world, estimate.tracked
    _find(seen, believed, P, focal_px, shown)
    return shown


@kernel
def _find(seen, believed, P, focal_px, shown):
    (px, confidence, sigma_px, age_s), (mean, velocity, tracked) = seen, believed
    for b in range(len(px)):
        for c in range(len(P)):
            for w in range(tracked.shape[1]):
                n, off = 0, 0
                fits = tracked[b, w] and SMALLEST_M < _length_m(mean[b, w]) < LARGEST_M
                for j in range(confidence.shape[3]):
                    if confidence[b, c, w, j] >= SEEN_WELL:
                        (x, y, z), (vx, vy, vz), ago = mean[b, w, j], velocity[b, w, j], age_s[b, c]
                        u, v, depth = pixel_of(P[c], x - ago * vx, y - ago * vy, z - ago * vz)
                        away_px = math.hypot(u - px[b, c, w, j, 0], v - px[b, c, w, j, 1])
                        near_px = EXPLAINED_M * focal_px[c] / max(depth, 1e-9)
                        near_px = max(near_px, SIGMAS * sigma_px[b, c, w, j])
                        off += depth <= 0.0 or away_px > near_px
                        n += 1
                if n >= LEAST_JOINTS:
                    shown.poses[b, c] = True
                    shown.unexplained[b, c] |= not fits or 2 * off > n


@kernel
def _length_m(body):
    """Length of trunk, thigh and shank of a body (J, 3), the mean of both sides [m]."""
    total = 0.0
    for side in range(2):
        for k in range(3):
            a, b = body[CHAIN[k] + side], body[CHAIN[k + 1] + side]
            x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
            total += 0.5 * math.sqrt(x * x + y * y + z * z)
    return total
