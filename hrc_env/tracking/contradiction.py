"""Detection of poses that no track explains, which reveal wrong calibrations.

A camera contradicts a track if most of its confident detections are farther from the track's joints
than the detector's errors can explain. A single camera may do so briefly after it has swapped left
and right labels, or while a track restarts. If several cameras do so persistently, their
poses differ from the calibration: they were moved, interchanged or mirrored.

A track with a body that is far too small or too large explains no detection. If the calibration
used wrong units or a board of the wrong size, all cameras agree on such a body.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.geometry.triangulation import pixel_of
from hrc_env.tracking.measurements import KeypointArrays, get_keypoint_arrays
from hrc_env.tracking.tracks import EstimateArrays, get_estimate_arrays

SEEN_WELL = 0.5
"""Minimum confidence of a detected joint that a track must explain."""
LEAST_JOINTS = 4
"""Minimum number of confident joints in a pose that a track must explain."""
EXPLAINED_M = 0.15
"""Maximum distance of a track's joint from the line of sight of a detection that fits it [m]."""
SIGMAS = 4.0
"""Maximum distance of a track's joint from a detection that fits it, in standard deviations of the
detection."""
SMALLEST_M = 0.95
"""Total length of trunk, thigh and shank of the smallest plausible person [m]. The length is 1.15
to 1.55 m for adults."""
LARGEST_M = 1.8
"""Total length of trunk, thigh and shank of the largest plausible person [m]."""
CHAIN = tuple(JOINT[f"left_{name}"] for name in ("shoulder", "hip", "knee", "ankle"))
"""Indices of the left shoulder, hip, knee and ankle; the index of the right one is one higher."""


class DetectedPoses(NamedTuple):
    """Masks of the cameras that detect poses, and of those that detect unexplained poses."""

    poses: Bools
    """(B, C) mask of the cameras that detect a pose."""
    unexplained: Bools
    """(B, C) mask of the cameras that detect a pose that no track explains."""


def find_unexplained(
    keypoints: Keypoints, age_s: Floats, estimate: PoseEstimate, P: Floats, focal_px: Floats
) -> DetectedPoses:
    """Find the cameras that detect poses, and those that detect poses that no track explains.

    Args:
        keypoints: (B, C, W, J) pinhole pixels, assigned to workers.
        age_s: (B, C) age of each camera's image [s]; NaN if it has none.
        estimate: (B, W, J) estimate of the tracker.
        P: (C, 3, 4) projections of the calibrated cameras.
        focal_px: (C,) focal lengths [px].
    """
    shape = keypoints.confidence.shape[:2]
    detected = DetectedPoses(np.zeros(shape, np.bool_), np.zeros(shape, np.bool_))
    arrays = get_keypoint_arrays(keypoints), age_s, get_estimate_arrays(estimate)
    _find_unexplained(*arrays, P, focal_px, detected)
    return detected


@kernel
def _find_unexplained(
    detections: KeypointArrays,
    age_s: Floats,
    estimate: EstimateArrays,
    P: Floats,
    focal_px: Floats,
    detected: DetectedPoses,
) -> None:
    """Fill in `detected`; the other arguments are those of `find_unexplained`."""
    px, confidence, tracked = detections.px, detections.confidence, estimate.tracked
    mean, velocity = estimate.mean_world, estimate.velocity_world
    for b in range(len(px)):
        for c in range(len(P)):
            ago = age_s[b, c] if math.isfinite(age_s[b, c]) else 0.0
            for w in range(tracked.shape[1]):
                n, off = 0, 0
                fits = tracked[b, w] and SMALLEST_M < _measure_side(mean[b, w]) < LARGEST_M
                for j in range(confidence.shape[3]):
                    if confidence[b, c, w, j] >= SEEN_WELL:
                        (x, y, z), (vx, vy, vz) = mean[b, w, j], velocity[b, w, j]
                        u, v, depth = pixel_of(P[c], x - ago * vx, y - ago * vy, z - ago * vz)
                        away_px = math.hypot(u - px[b, c, w, j, 0], v - px[b, c, w, j, 1])
                        near_px = EXPLAINED_M * focal_px[c] / max(depth, 1e-9)
                        near_px = max(near_px, SIGMAS * detections.sigma_px[b, c, w, j])
                        off += depth <= 0.0 or away_px > near_px
                        n += 1
                if n >= LEAST_JOINTS:
                    detected.poses[b, c] = True
                    detected.unexplained[b, c] |= not fits or 2 * off > n


@kernel
def _measure_side(body: Points3) -> float:
    """Return the length of trunk, thigh and shank of a body (J, 3), mean of left and right [m]."""
    total = 0.0
    for side in range(2):
        for k in range(3):
            a, b = body[CHAIN[k] + side], body[CHAIN[k + 1] + side]
            x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
            total += 0.5 * math.sqrt(x * x + y * y + z * z)
    return total
