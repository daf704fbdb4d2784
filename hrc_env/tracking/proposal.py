"""Where a joint probably is: the mode of its posterior, by a robust Gauss-Newton search.

The prior is Gaussian; the likelihood of a pixel is a Gaussian about the joint's image or, with
the outlier weight, anything in the image. The search begins with the likelihood widened by
the prior's own uncertainty, so that good measurements of a badly predicted joint are not
taken for outliers (graduated non-convexity), and ends with the likelihood as it is.
"""

import math

import numba
import numpy as np

from hrc_env.geometry.triangulation import (
    NEAREST_DEPTH_M,
    add_outer,
    inverse3,
    pixel_jacobian,
    pixel_of,
)
from hrc_env.tracking.measurements import variance_in_image

_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}


@numba.njit(**_JIT)
def odds_of_inlier(variance, s):
    """Density of a perfect inlier over that of an outlier."""
    inlier = (1.0 - s.outlier_weight) / (2.0 * math.pi * variance)
    return inlier * s.image_area_px / s.outlier_weight


@numba.njit(**_JIT)
def find_mode(P, z, sigma, ok, mean, cov, precision, s, mode, spread, belief):
    """Robust Gauss-Newton from the prior (mean, cov, precision) to the posterior's mode.

    Fills mode (3,), spread (3, 3) (the inverse Hessian there) and belief (C,).
    """
    information, gradient = np.empty((3, 3)), np.empty(3)
    for i in range(3):
        mode[i] = mean[i]
    n_steps = s.gauss_newton_steps
    for step in range(n_steps + 1):
        widen = 0.5**step if step < n_steps - 1 else 0.0
        for i in range(3):
            gradient[i] = 0.0
            for k in range(3):
                information[i, k] = precision[i, k]
                gradient[i] += precision[i, k] * (mean[k] - mode[k])
        add_cameras(P, z, sigma, ok, mode, cov, widen, s, information, gradient, belief)
        inverse3(information, spread)
        if step == n_steps:
            return
        for i in range(3):
            for k in range(3):
                mode[i] += spread[i, k] * gradient[k]


@numba.njit(**_JIT)
def add_cameras(P, z, sigma, ok, point, cov, widen, s, information, gradient, belief):
    """Information (3, 3) and gradient (3,) of the robust likelihood at a point, added up.

    `widen` times the prior's variance in the image is added to the detector's in the decision
    how far each measurement is believed; `belief` (C,) is that decision, in [0, 1].
    """
    jacobian = np.empty((2, 3))
    for c in range(len(P)):
        belief[c] = 0.0
        if not ok[c]:
            continue
        u, v, depth = pixel_of(P[c], point[0], point[1], point[2])
        if not depth > NEAREST_DEPTH_M:
            continue
        pixel_jacobian(P[c], u, v, depth, jacobian)
        variance = sigma[c] * sigma[c]
        wide = variance + widen * variance_in_image(jacobian, cov)
        du, dv = z[c, 0] - u, z[c, 1] - v
        near = math.exp(-0.5 * (du * du + dv * dv) / wide) * odds_of_inlier(wide, s)
        belief[c] = near / (near + 1.0)
        weight = belief[c] / variance
        for axis in range(2):
            a, b, d = jacobian[axis, 0], jacobian[axis, 1], jacobian[axis, 2]
            residual = weight * (du if axis == 0 else dv)
            add_outer(information, a, b, d, weight)
            gradient[0] += a * residual
            gradient[1] += b * residual
            gradient[2] += d * residual
