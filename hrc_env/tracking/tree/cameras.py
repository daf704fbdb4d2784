"""All joints of a body in one camera at once: a row for each quantity, a column for each joint.

The likelihood of a pixel is a Gaussian about the joint's image or, with the outlier weight,
anything in the image. The columns are filled up to a whole number of processor vectors, so that
loops over them are compiled to vector instructions.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M
from hrc_env.tracking.tree.state import LANES

BELIEF, LOG_ODDS, FACTOR, A0, A1, A2, B0, B1, B2, DU, DV = range(11)
_REORDER = {"reassoc", "contract", "nsz"}  # NaN and infinity keep their meaning


@kernel
def set_views(seen):
    """Put pixels and precisions into seen.views (C, N_VIEW, LANES)."""
    z, sigma, ok, views = seen.z, seen.sigma, seen.ok, seen.views
    for c in range(len(views)):
        for j in range(len(ok)):
            good = ok[j, c]
            views[c, 0, j] = z[j, c, 0] if good else 0.0
            views[c, 1, j] = z[j, c, 1] if good else 0.0
            views[c, 2, j] = 1.0 / (sigma[j, c] * sigma[j, c]) if good else 0.0


@kernel
def set_covariances(cov, points):
    """Put position covariances (J, 3+, 3+) into their rows."""
    for j in range(len(cov)):
        points[3, j], points[4, j], points[5, j] = cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2]
        points[6, j], points[7, j], points[8, j] = cov[j, 0, 1], cov[j, 0, 2], cov[j, 1, 2]


@kernel(fastmath=_REORDER)
def add_view(p, points, view, widen, inlier_odds, image, sums):
    """Add one camera's information and gradient, of all joints, to `sums` (N_SUM, LANES).

    `p` is (3, 4), `points` (N_POINT, LANES), `view` (N_VIEW, LANES); `widen` times the prior's
    variance in the image is added to the detector's in the decision how far each measurement is
    believed, which is left in `image` (N_IMAGE, LANES).
    """
    _project(p, points, view, widen, inlier_odds, image)
    for j in range(LANES):
        odds = math.exp(image[LOG_ODDS, j]) * image[FACTOR, j]
        image[BELIEF, j] = odds / (odds + 1.0)
    for j in range(LANES):
        a0, a1, a2 = image[A0, j], image[A1, j], image[A2, j]
        b0, b1, b2 = image[B0, j], image[B1, j], image[B2, j]
        weight = image[BELIEF, j] * view[2, j]
        sums[0, j] += weight * (a0 * a0 + b0 * b0)
        sums[1, j] += weight * (a1 * a1 + b1 * b1)
        sums[2, j] += weight * (a2 * a2 + b2 * b2)
        sums[3, j] += weight * (a0 * a1 + b0 * b1)
        sums[4, j] += weight * (a0 * a2 + b0 * b2)
        sums[5, j] += weight * (a1 * a2 + b1 * b2)
        du, dv = weight * image[DU, j], weight * image[DV, j]
        sums[6, j] += a0 * du + b0 * dv
        sums[7, j] += a1 * du + b1 * dv
        sums[8, j] += a2 * du + b2 * dv


@kernel(fastmath=_REORDER)
def _project(p, points, view, widen, inlier_odds, image):
    """Where the camera sees the joints, and how odd that the pixels lie where they do."""
    p00, p01, p02, p03 = p[0, 0], p[0, 1], p[0, 2], p[0, 3]
    p10, p11, p12, p13 = p[1, 0], p[1, 1], p[1, 2], p[1, 3]
    p20, p21, p22, p23 = p[2, 0], p[2, 1], p[2, 2], p[2, 3]
    for j in range(LANES):
        x, y, z = points[0, j], points[1, j], points[2, j]
        depth = p20 * x + p21 * y + p22 * z + p23
        near = 1.0 / depth if depth > NEAREST_DEPTH_M else 0.0
        u = (p00 * x + p01 * y + p02 * z + p03) * near
        v = (p10 * x + p11 * y + p12 * z + p13) * near
        a0, b0 = (p00 - u * p20) * near, (p10 - v * p20) * near
        a1, b1 = (p01 - u * p21) * near, (p11 - v * p21) * near
        a2, b2 = (p02 - u * p22) * near, (p12 - v * p22) * near
        own = points[3, j] * (a0 * a0 + b0 * b0) + points[4, j] * (a1 * a1 + b1 * b1)
        own += points[5, j] * (a2 * a2 + b2 * b2)
        cross = points[6, j] * (a0 * a1 + b0 * b1) + points[7, j] * (a0 * a2 + b0 * b2)
        cross += points[8, j] * (a1 * a2 + b1 * b2)
        du, dv, precision = view[0, j] - u, view[1, j] - v, view[2, j]
        usable = near * precision > 0.0
        spread = 1.0 / precision + widen * (0.5 * own + cross)
        narrow = 1.0 / spread if usable else 0.0
        image[LOG_ODDS, j] = -0.5 * (du * du + dv * dv) * narrow
        image[FACTOR, j] = inlier_odds * narrow
        image[A0, j], image[A1, j], image[A2, j] = a0, a1, a2
        image[B0, j], image[B1, j], image[B2, j] = b0, b1, b2
        image[DU, j], image[DV, j] = du, dv
