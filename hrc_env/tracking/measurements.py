"""Keypoints as the kernels take them: one worker's usable measurements, and their noise.

Pixels that are not finite or absurdly far, confidences outside (0, 1] and standard deviations that
are not finite and positive mean that there is no measurement; wrong pixels that look like pixels
are left to the robust likelihoods.
"""

from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.triangulation import FURTHEST_PX, NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.tree.state import LANES, N_IMAGE, N_VIEW

MIN_SIGMA_PX = 0.25
"""No detector is believed to be better than this [px]."""
_REORDER = {"reassoc", "contract", "nsz"}


def arrays_of(
    keypoints: Keypoints, shape: tuple[int, int, int, int]
) -> tuple[Floats, Floats, Floats]:
    """Pixels, confidence and sigma as contiguous float64; `shape` is (B, C, W, J)."""
    check_shape("Keypoints.px", keypoints.px.shape, (*shape, 2), "B, C, W, J, 2")
    check_shape("Keypoints.confidence", keypoints.confidence.shape, shape, "B, C, W, J")
    check_shape("Keypoints.sigma_px", keypoints.sigma_px.shape, shape, "B, C, W, J")
    return (
        np.ascontiguousarray(keypoints.px, np.float64),
        np.ascontiguousarray(keypoints.confidence, np.float64),
        np.ascontiguousarray(keypoints.sigma_px, np.float64),
    )


@kernel
def is_measurement(u, v, belief, sigma):
    """Whether a pixel, its confidence and its standard deviation are a measurement."""
    return (
        abs(u) < FURTHEST_PX
        and abs(v) < FURTHEST_PX
        and 0.0 < belief <= 1.0 + 1e-6
        and 0.0 < sigma < FURTHEST_PX
    )


class Seen(NamedTuple):
    """What C cameras measured of one worker, and what an update makes of it; filled in place."""

    P: Floats
    """(C, 3, 4)."""
    z: Floats
    """(J, C, 2) pixels; 0 where there is no measurement."""
    sigma: Floats
    """(J, C) [px]; 1 where there is none."""
    ok: Bools
    """(J, C) whether there is one."""
    belief: Floats
    """(J, C) how far it is believed to be no outlier."""
    views: Floats
    """(C, N_VIEW, LANES) the measurements as `tree.search` takes them."""
    images: Floats
    """(C, N_IMAGE, LANES) the joints in each camera where `tree.search` linearised last."""
    looks: Floats
    """(C, 8) what each camera says of one joint, for `models.noise`."""


@kernel(makes_arrays=True)
def make_seen(P):
    """Room for the measurements of one worker."""
    n = len(P)
    return Seen(
        P=P,
        z=np.empty((N_JOINTS, n, 2)),
        sigma=np.empty((N_JOINTS, n)),
        ok=np.empty((N_JOINTS, n), np.bool_),
        belief=np.empty((N_JOINTS, n)),
        views=np.zeros((n, N_VIEW, LANES)),
        images=np.zeros((n, N_IMAGE, LANES)),
        looks=np.empty((n, 8)),
    )


@kernel
def read_worker(measured, b, w, scale, seen):
    """Put what was measured of worker w of environment b into `seen`; whether there is anything.

    `measured` is as `arrays_of` gives it, `scale` a factor on sigma. Missing measurements get
    pixel 0 and sigma 1, so that no NaN enters the arithmetic.
    """
    px, confidence, sigma_px = measured
    z, sigma, ok = seen.z, seen.sigma, seen.ok
    any_ok = False
    for c in range(px.shape[1]):
        for j in range(px.shape[3]):
            u, v = px[b, c, w, j, 0], px[b, c, w, j, 1]
            s, belief = sigma_px[b, c, w, j], confidence[b, c, w, j]
            good = is_measurement(u, v, belief, s)
            ok[j, c] = good
            any_ok |= good
            z[j, c, 0] = u if good else 0.0
            z[j, c, 1] = v if good else 0.0
            sigma[j, c] = max(s * scale, MIN_SIGMA_PX) if good else 1.0
    return any_ok


@kernel(fastmath=_REORDER)
def pixel_spread(p, u, v, depth, cov):
    """Mean variance of a coordinate of the pixel [px^2] of a point with covariance `cov` (3+, 3+).

    `p` is the (3, 4) camera, (u, v, depth) where it sees the point.
    """
    near = 1.0 / depth
    a0, b0 = (p[0, 0] - u * p[2, 0]) * near, (p[1, 0] - v * p[2, 0]) * near
    a1, b1 = (p[0, 1] - u * p[2, 1]) * near, (p[1, 1] - v * p[2, 1]) * near
    a2, b2 = (p[0, 2] - u * p[2, 2]) * near, (p[1, 2] - v * p[2, 2]) * near
    own = cov[0, 0] * (a0 * a0 + b0 * b0)
    own += cov[1, 1] * (a1 * a1 + b1 * b1)
    own += cov[2, 2] * (a2 * a2 + b2 * b2)
    cross = cov[0, 1] * (a0 * a1 + b0 * b1)
    cross += cov[0, 2] * (a0 * a2 + b0 * b2)
    cross += cov[1, 2] * (a1 * a2 + b1 * b2)
    return 0.5 * own + cross


@kernel
def supports(camera, z, sigma, gate_sigma, point, cov):
    """Whether a pixel lies where a joint with this mean and covariance may be seen."""
    u, v, depth = pixel_of(camera, point[0], point[1], point[2])
    if not depth > NEAREST_DEPTH_M:
        return False
    variance = sigma * sigma + pixel_spread(camera, u, v, depth, cov)
    return (z[0] - u) ** 2 + (z[1] - v) ** 2 < gate_sigma * gate_sigma * variance
