"""Agreement of an estimate with the measurements of the last frames, joint by joint.

A covariance is the error that an estimator expects. The number of views that locate a joint and the
distance of their measurements from it reveal where this expectation is too small: a hidden wrist
may be detected with confidence in the wrong place.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import change_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.triangulation import pixel_of
from hrc_env.tracking.measurements import KeypointArrays, get_keypoint_arrays, is_measurement
from hrc_env.tracking.tracks import EstimateArrays, get_estimate_arrays

SUPPORTING_SIGMAS = 3.0
"""Maximum distance of a measurement from the estimate that it supports, in standard deviations."""
SUPPORTING_M = 0.1
"""Maximum standard deviation of a measurement that locates a joint, across the line of sight
[m]."""
MAX_SIGMAS = 4.0
"""Upper bound on the contribution of a measurement to the misfit, in standard deviations. One
measurement that is far off is recognized as an outlier, whatever its distance."""


class Agreement(NamedTuple):
    """Agreement of the joints of an estimate with measurements."""

    n_views: Ints
    """(B, W, J) number of cameras that locate each joint where it is estimated."""
    misfit: Floats
    """(B, W, J) sum over the cameras of the squared distances between measurement and estimate, in
    units of the measurement's standard deviation."""


def add_agreement(
    estimate: PoseEstimate, keypoints: Keypoints, age_s: Floats, P: Floats, focal_px: Floats
) -> PoseEstimate:
    """Return an estimate with its agreement with the last measurements.

    Args:
        estimate: (B, W, J) estimate of the joints that the network detects.
        keypoints: (B, C, W, J) pinhole pixels, assigned to workers.
        age_s: (B, C) age of each camera's image [s]; NaN if it has none.
        P: (C, 3, 4) projections of the calibrated cameras.
        focal_px: (C,) focal lengths [px].
    """
    shape = estimate.age_s.shape
    agreement = Agreement(np.zeros(shape, np.int64), np.zeros(shape))
    arrays = get_keypoint_arrays(keypoints), age_s, get_estimate_arrays(estimate)
    _measure_agreement(*arrays, P, focal_px, agreement)
    return change_fields(estimate, n_views=agreement.n_views, misfit=agreement.misfit)


@kernel
def _measure_agreement(
    detections: KeypointArrays,
    age_s: Floats,
    estimate: EstimateArrays,
    P: Floats,
    focal_px: Floats,
    agreement: Agreement,
) -> None:
    """Fill in `agreement`, which is 0; the other arguments are those of `add_agreement`."""
    px, mean, velocity = detections.px, estimate.mean_world, estimate.velocity_world
    for b, c, w, j in np.ndindex(detections.confidence.shape):
        sigma_px = float(detections.sigma_px[b, c, w, j])
        confidence = float(detections.confidence[b, c, w, j])
        u, v = px[b, c, w, j, 0], px[b, c, w, j, 1]
        if not is_measurement(u, v, confidence, sigma_px):
            continue
        ago = age_s[b, c] if math.isfinite(age_s[b, c]) else 0.0
        (x, y, z), (vx, vy, vz) = mean[b, w, j], velocity[b, w, j]
        at_u, at_v, depth = pixel_of(P[c], x - ago * vx, y - ago * vy, z - ago * vz)
        off = math.hypot(at_u - u, at_v - v) / sigma_px if depth > 0.0 else MAX_SIGMAS
        agreement.misfit[b, w, j] += min(off, MAX_SIGMAS) ** 2
        locates = off <= SUPPORTING_SIGMAS and sigma_px * depth <= SUPPORTING_M * focal_px[c]
        agreement.n_views[b, w, j] += locates
