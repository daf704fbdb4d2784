"""How well a 2D pose fits a body whose joints are predicted, in one camera.

A joint counts with its log likelihood ratio, near where the body is expected or anywhere in the
image; one gross error costs no more than the gate. Errors of a body's joints go together, so a pose
counts with the mean over its joints. Left and right may be exchanged: the better reading counts.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread

LEAST_JOINTS = 3
"""A pose of fewer joints is nobody's."""
FULL_JOINTS = 6
"""Poses of fewer joints than this count for less."""
_ISOTROPIC = np.eye(3)
POSE = np.dtype(
    [
        # pixels, standard deviations [px], and which of them are measurements
        ("px", "f8", (N_JOINTS, 2)), ("sigma_px", "f8", (N_JOINTS,)), ("ok", "i1", (N_JOINTS,)),
        # unit directions to the joints, from the camera; whether the pose is nobody's yet
        ("sight", "f8", (N_JOINTS, 3)), ("free", "?"),
    ],
    align=True,
)  # fmt: skip
"""A 2D pose that a camera has found."""


@kernel(makes_arrays=True)
def expect(camera, mean, cov, known, slack_m, image):
    """Where a camera (3, 4) should see a body's joints: image (J, 3) of u, v and variance [px^2].

    The variance is -1 where nothing is expected: what is not `known` (J,), or not before the lens.
    `slack_m` is a standard deviation of what the body may have done besides [m].
    """
    for j in range(len(mean)):
        image[j, 2] = -1.0
        if not known[j]:
            continue
        u, v, depth = pixel_of(camera, mean[j, 0], mean[j, 1], mean[j, 2])
        if depth > NEAREST_DEPTH_M:
            spread = pixel_spread(camera, u, v, depth, cov[j])
            spread += slack_m**2 * pixel_spread(camera, u, v, depth, _ISOTROPIC)
            if math.isfinite(u + v + spread) and spread >= 0.0:
                image[j, 0], image[j, 1], image[j, 2] = u, v, spread


@kernel(makes_arrays=True)
def affinity(image, pose, s):
    """Mean log likelihood ratio of a `POSE`; 0 where it does not fit. `s` as in `association`."""
    return max(_one_reading(image, pose, False, s), _one_reading(image, pose, True, s))


@kernel(makes_arrays=True)
def _one_reading(image, pose, swapped, s):
    z, sigma, ok, gate_sigma = pose.px, pose.sigma_px, pose.ok, s.gate_sigma
    n, n_near, total, product, gate = 0, 0, 0.0, 1.0, gate_sigma * gate_sigma
    for j in range(len(image)):
        k = MIRROR[j] if swapped else j
        if not ok[k] or image[j, 2] < 0.0:
            continue
        variance = sigma[k] * sigma[k] + image[j, 2]
        misfit = ((z[k, 0] - image[j, 0]) ** 2 + (z[k, 1] - image[j, 1]) ** 2) / variance
        product *= variance  # one logarithm for all; absurd variances overflow to "no fit"
        total -= 0.5 * min(misfit, gate)
        n += 1
        n_near += misfit < gate
    if n < LEAST_JOINTS or 2 * n_near < n:
        return 0.0
    total += n * math.log(s.image_area_px / (2.0 * math.pi)) - math.log(product)
    return max(total / max(n, FULL_JOINTS), 0.0)
