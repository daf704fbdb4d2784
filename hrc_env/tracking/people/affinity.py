"""Affinity between a 2D pose in one camera and a body with predicted joints.

Each joint contributes the log-likelihood ratio of a detection near its predicted pixel against one
anywhere in the image; the gate limits the penalty of a gross error. The errors of a body's joints
are correlated; therefore the affinity is the mean over joints, not the sum. A detector may swap
left and right; therefore the affinity is the larger of those with and without a swap.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.declared import dtype_of
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Points2, Points3
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import compute_pixel_variance

LEAST_JOINTS = 3
"""Minimum number of joints in a pose that can be assigned to a worker."""
FULL_JOINTS = 6
"""Number of joints below which the affinity of a pose is reduced in proportion."""
_ISOTROPIC = np.eye(3)


class Pose:
    """A 2D pose detected in one camera."""

    px: Annotated[Points2, (N_JOINTS, 2)]
    """Pixel of each joint."""
    sigma_px: Annotated[Floats, (N_JOINTS,)]
    """Standard deviation of each joint's pixel [px]."""
    ok: Annotated[NDArray[np.int8], (N_JOINTS,)]
    """1 for each joint with a valid measurement, 0 for each missing joint."""
    sight: Annotated[Floats, (N_JOINTS, 3)]
    """Unit direction from the camera to each joint in the world frame."""
    free: bool
    """Whether the pose can still be assigned."""


POSE = dtype_of(Pose)


class AssociationSettings(NamedTuple):
    """The fields of `AssociationConfig` as a named tuple, for compiled functions."""

    gate_sigma: float
    """Gate around the predicted pixel of a joint, in standard deviations."""
    prediction_std_m: float
    """Standard deviation of errors that predictions do not account for [m]."""
    min_joints: int
    """Number of joints on which two cameras must agree to detect a new person."""
    merge_distance_m: float
    """Distance between two bodies below which they are considered one person [m]."""
    rejoin_distance_m: float
    """Distance within which a new body is assigned to a tracked worker that no camera sees [m]."""
    image_area_px: float
    """Area of an image [px^2]."""


@kernel(makes_arrays=True)
def project_body(
    camera: Floats,
    mean: Points3,
    cov: Covariances3,
    known: Bools,
    prediction_std_m: float,
    image: Floats,
) -> None:
    """Predict the pixels of a body's joints in one camera.

    Args:
        camera: (3, 4) projection.
        mean: (J, 3) positions [m].
        cov: (J, 3, 3) covariances of the positions [m^2].
        known: (J,) mask of the joints of known position.
        prediction_std_m: standard deviation of errors that `cov` does not include [m].
        image: (J, 3) u, v [px] and their mean variance [px^2], filled in. The variance is -1 for
            joints that are unknown or not in front of the camera.
    """
    for j in range(len(mean)):
        image[j, 2] = -1.0
        if not known[j]:
            continue
        u, v, depth = pixel_of(camera, mean[j, 0], mean[j, 1], mean[j, 2])
        if depth > NEAREST_DEPTH_M:
            spread = compute_pixel_variance(camera, u, v, depth, cov[j])
            spread += prediction_std_m**2 * compute_pixel_variance(camera, u, v, depth, _ISOTROPIC)
            if math.isfinite(u + v + spread) and spread >= 0.0:
                image[j, 0], image[j, 1], image[j, 2] = u, v, spread


@kernel(makes_arrays=True)
def compute_affinity(image: Floats, pose: Pose, settings: AssociationSettings) -> float:
    """Return the mean log-likelihood ratio of a pose, or 0 if the pose does not fit.

    Args:
        image: (J, 3) predicted pixels and variances, from `project_body`.
        pose: the detected pose.
        settings: settings that contain the gate and the area of the image.
    """
    as_detected = _score_reading(image, pose, False, settings)
    return max(as_detected, _score_reading(image, pose, True, settings))


@kernel(makes_arrays=True)
def _score_reading(
    image: Floats, pose: Pose, swapped: bool, settings: AssociationSettings
) -> float:
    """Return the affinity of a pose with or without a swap of sides, or 0 if it does not fit.

    Args:
        image: (J, 3) predicted pixels and variances, from `project_body`.
        pose: the detected pose.
        swapped: whether to swap left and right of the pose.
        settings: settings that contain the gate and the area of the image.
    """
    z, sigma, ok, gate_sigma = pose.px, pose.sigma_px, pose.ok, settings.gate_sigma
    n, n_near, total, product, gate = 0, 0, 0.0, 1.0, gate_sigma * gate_sigma
    for j in range(len(image)):
        k: int = MIRROR[j] if swapped else j
        if not ok[k] or image[j, 2] < 0.0:
            continue
        variance = sigma[k] * sigma[k] + image[j, 2]
        misfit = ((z[k, 0] - image[j, 0]) ** 2 + (z[k, 1] - image[j, 1]) ** 2) / variance
        product *= variance  # one logarithm for all; huge variances overflow and do not fit
        total -= 0.5 * min(misfit, gate)
        n += 1
        n_near += misfit < gate
    if n < LEAST_JOINTS or 2 * n_near < n:
        return 0.0
    total += n * math.log(settings.image_area_px / (2.0 * math.pi)) - math.log(product)
    return max(total / max(n, FULL_JOINTS), 0.0)
