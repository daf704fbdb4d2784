"""Where a joint probably is: the mode of its posterior, by a robust Gauss-Newton search.

The prior is Gaussian; the likelihood of a pixel is a Gaussian about the joint's image or, with
the outlier weight, anything in the image. The search begins with the likelihood widened by
the prior's own uncertainty, so that good measurements of a badly predicted joint are not
taken for outliers (graduated non-convexity), and ends with the likelihood as it is.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, inverse3, pixel_of

_REORDER = {"reassoc", "contract", "arcp", "nsz"}  # NaN and infinity keep their meaning


@kernel
def contrast_of(outlier_weight, image_area_px):
    """Odds of a perfect inlier against an outlier, times the variance of its pixel [px^2]."""
    return (1.0 - outlier_weight) * image_area_px / (2.0 * math.pi * outlier_weight)


@kernel
def find_mode(seen, mean, cov, precision, contrast, n_steps, mode, spread, belief, work):
    """Robust Gauss-Newton from the prior (mean, cov, precision) to the posterior's mode.

    `seen` is (P, z (C, 2), sigma (C,), ok (C,)). Fills mode (3,), spread (3, 3) (the inverse
    Hessian there) and belief (C,); `work` (4, 3) is scratch.
    """
    P, z, sigma, ok = seen
    information, gradient = work[:3], work[3]
    for i in range(3):
        mode[i] = mean[i]
    widen = 1.0
    for step in range(n_steps + 1):
        for i in range(3):
            gradient[i] = 0.0
            for k in range(3):
                information[i, k] = precision[i, k]
                gradient[i] += precision[i, k] * (mean[k] - mode[k])
        widening = widen if step < n_steps - 1 else 0.0
        add_cameras(P, z, sigma, ok, mode, cov, widening, contrast, information, gradient, belief)
        inverse3(information, spread)
        widen *= 0.5
        if step == n_steps:
            return
        for i in range(3):
            for k in range(3):
                mode[i] += spread[i, k] * gradient[k]


@kernel(fastmath=_REORDER)
def add_cameras(P, z, sigma, ok, point, cov, widen, contrast, information, gradient, belief):
    """Information (3, 3) and gradient (3,) of the robust likelihood at a point, added up.

    `widen` times the prior's variance in the image is added to the detector's in the decision
    how far each measurement is believed; `belief` (C,) is that decision, in [0, 1].
    """
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = 0.0
    for c in range(len(P)):
        belief[c] = 0.0
        if not ok[c]:
            continue
        p = P[c]
        u, v, depth = pixel_of(p, point[0], point[1], point[2])
        if not depth > NEAREST_DEPTH_M:
            continue
        near = 1.0 / depth
        a0, b0 = (p[0, 0] - u * p[2, 0]) * near, (p[1, 0] - v * p[2, 0]) * near
        a1, b1 = (p[0, 1] - u * p[2, 1]) * near, (p[1, 1] - v * p[2, 1]) * near
        a2, b2 = (p[0, 2] - u * p[2, 2]) * near, (p[1, 2] - v * p[2, 2]) * near
        j00, j11, j22 = a0 * a0 + b0 * b0, a1 * a1 + b1 * b1, a2 * a2 + b2 * b2
        j01, j02, j12 = a0 * a1 + b0 * b1, a0 * a2 + b0 * b2, a1 * a2 + b1 * b2
        variance = sigma[c] * sigma[c]
        cross = cov[0, 1] * j01 + cov[0, 2] * j02 + cov[1, 2] * j12
        prior = 0.5 * (cov[0, 0] * j00 + cov[1, 1] * j11 + cov[2, 2] * j22) + cross
        wide = variance + widen * prior
        du, dv = z[c, 0] - u, z[c, 1] - v
        odds = math.exp(-0.5 * (du * du + dv * dv) / wide) * (contrast / wide)
        belief[c] = odds / (odds + 1.0)
        weight = belief[c] / variance
        g0 += weight * (a0 * du + b0 * dv)
        g1 += weight * (a1 * du + b1 * dv)
        g2 += weight * (a2 * du + b2 * dv)
        h00 += weight * j00
        h11 += weight * j11
        h22 += weight * j22
        h01 += weight * j01
        h02 += weight * j02
        h12 += weight * j12
    gradient[0] += g0
    gradient[1] += g1
    gradient[2] += g2
    information[0, 0] += h00
    information[1, 1] += h11
    information[2, 2] += h22
    information[0, 1] += h01
    information[0, 2] += h02
    information[1, 2] += h12
    information[1, 0], information[2, 0] = information[0, 1], information[0, 2]
    information[2, 1] = information[1, 2]
