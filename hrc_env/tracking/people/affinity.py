"""How well a 2D pose fits a body whose joints are predicted, in one camera.

A joint counts with the logarithm of its likelihood ratio: near where the body is expected, or
anywhere in the image. One gross error costs no more than the gate. Errors of a body's joints
go together, so that a pose counts with the mean over its joints, not with the sum. Left and
right may be exchanged: the better reading counts.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.measurements import pixel_spread

LEAST_JOINTS = 3
"""A pose of fewer joints is nobody's."""
FULL_JOINTS = 6
"""Poses of fewer joints than this count for less."""
_ISOTROPIC = np.eye(3)


@kernel(makes_arrays=True)
def expect(camera, mean, cov, known, slack_m, image):
    """Where a camera should see a body's joints: image (J, 3) of u, v and variance [px^2].

    Args:
        camera: (3, 4).
        mean, cov: (J, 3) [m] and (J, 3, 3) [m^2].
        known: (J,) which joints there is an expectation of.
        slack_m: what a body may have done besides, a standard deviation [m].
        image: filled; the variance is -1 where nothing is expected.
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
def affinity(image, z, sigma, ok, mirror, gate_sigma, area_px):
    """Mean log likelihood ratio of a pose z (J, 2), sigma, ok (J,); 0 where it does not fit."""
    plain = _one_reading(image, z, sigma, ok, mirror, False, gate_sigma, area_px)
    swapped = _one_reading(image, z, sigma, ok, mirror, True, gate_sigma, area_px)
    return max(plain, swapped)


@kernel(makes_arrays=True)
def _one_reading(image, z, sigma, ok, mirror, swapped, gate_sigma, area_px):
    n, n_near, total, product, gate = 0, 0, 0.0, 1.0, gate_sigma * gate_sigma
    for j in range(len(image)):
        k = mirror[j] if swapped else j
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
    total += n * math.log(area_px / (2.0 * math.pi)) - math.log(product)
    return max(total / max(n, FULL_JOINTS), 0.0)
