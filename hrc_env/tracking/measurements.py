"""Measurements: one worker's usable pixels of one frame, and which side each camera calls left.

Pixels that are not finite or absurdly far, confidences outside (0, 1] and standard deviations that
are not finite and positive mean that there is no measurement; wrong pixels that look like pixels
are left to the robust likelihoods.

Cameras that exchange left and right are noticed over the whole body by a two-state hidden Markov
model per camera: detections as they are, or mirrored. A camera that comes back after having seen
nothing is believed at first, for the body may have been tracked mirrored in depth meanwhile; so
are several cameras that all seem to be wrong.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.triangulation import FURTHEST_PX, NEAREST_DEPTH_M
from hrc_env.tracking.tree.state import LANES, N_IMAGE, N_VIEW

MIN_SIGMA_PX = 0.25
"""No detector is believed to be better than this [px]."""
_REORDER = {"reassoc", "contract", "nsz"}
_MIRROR = tuple(int(j) for j in MIRROR)
_BLIND_UPDATES, _BELIEVED_UPDATES = 8, 5
_ENOUGH, _AGAINST = 3, 5.0
"""So many cameras hardly exchange sides at once, while the others say no more than this against it
(a log-likelihood ratio)."""
_LEAST_CHANCE, _MOST_EVIDENCE = 1e-3, 50.0


class KeypointArrays(NamedTuple):
    """The arrays of a `Keypoints` that estimators read, as compiled functions take them."""

    px: Floats
    """(B, C, W, J, 2) pixels."""
    confidence: Floats
    """(B, C, W, J) confidence, 0 to 1."""
    sigma_px: Floats
    """(B, C, W, J) standard deviation of a coordinate [px]."""


def arrays_of(keypoints: Keypoints, shape: tuple[int, int, int, int]) -> KeypointArrays:
    """Pixels, confidence and sigma as contiguous float64; `shape` is (B, C, W, J)."""
    check_shape("Keypoints.px", keypoints.px.shape, (*shape, 2), "B, C, W, J, 2")
    check_shape("Keypoints.confidence", keypoints.confidence.shape, shape, "B, C, W, J")
    check_shape("Keypoints.sigma_px", keypoints.sigma_px.shape, shape, "B, C, W, J")
    return KeypointArrays(
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


class Frame(NamedTuple):
    """What C cameras measured of one worker, and what an update makes of it; filled in place."""

    cameras: Any
    """(C,) records of `lines_of_sight.CAMERA`, as the rig has them."""
    P: Floats
    """(C, 3, 4) projections, as the cameras are believed to hang; the third row is the axis."""
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
    """(C, 8) what each camera says of one joint, for `learning`."""


@kernel(makes_arrays=True)
def make_frame(cameras):
    """Return room for the measurements of one worker by `cameras`, (C,) records of `CAMERA`."""
    n = len(cameras)
    return Frame(
        cameras=cameras,
        P=cameras.P.copy(),
        z=np.empty((N_JOINTS, n, 2)),
        sigma=np.empty((N_JOINTS, n)),
        ok=np.empty((N_JOINTS, n), np.bool_),
        belief=np.empty((N_JOINTS, n)),
        views=np.zeros((n, N_VIEW, LANES)),
        images=np.zeros((n, N_IMAGE, LANES)),
        looks=np.empty((n, 8)),
    )


@kernel
def read_worker(measured, b, w, scale, frame):
    """Put what was measured of worker w of environment b into `frame`; whether there is anything.

    `measured` is as `arrays_of` gives it, `scale` a factor on sigma. Missing measurements get
    pixel 0 and sigma 1, so that no NaN enters the arithmetic.
    """
    px, confidence, sigma_px = measured.px, measured.confidence, measured.sigma_px
    z, sigma, ok = frame.z, frame.sigma, frame.ok
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
def project_joint(p, mean, cov):
    """Return (u, v, depth, spread): the pixel of a joint (3+,) and its mean variance [px^2].

    `p` is the (3, 4) camera. A depth of NEAREST_DEPTH_M or less means that there is no pixel.
    """
    x, y, z = mean[0], mean[1], mean[2]
    depth = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3]
    u = (p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3]) / depth
    v = (p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3]) / depth
    return u, v, depth, pixel_spread(p, u, v, depth, cov)


@kernel
def supports(camera, z, sigma, gate_sigma, point, cov):
    """Whether a pixel lies where a joint with this mean and covariance may be seen."""
    u, v, depth, spread = project_joint(camera, point, cov)
    if not depth > NEAREST_DEPTH_M:
        return False
    variance = sigma * sigma + spread
    return (z[0] - u) ** 2 + (z[1] - v) ** 2 < gate_sigma * gate_sigma * variance


@kernel
def read_for_hypothesis(tree, views, learnt, measured, at, s, frame):
    """Read a worker's measurements as one hypothesis takes them; whether it is the mirrored one.

    `learnt` (J, C) and `views` (C,) are its records of `NOISE` and `VIEW`: standard deviations are
    scaled by what it has learnt, and cameras that exchange left and right are corrected.
    """
    read_worker(measured, at[0], at[1], s.sigma_scale, frame)
    scale_sigma(learnt, frame.sigma)
    return undo_swaps(tree, frame, views, s)


@kernel
def scale_sigma(learnt, sigma):
    """Multiply sigma (J, C) by the roots of the learnt factors (J, C), in place."""
    for j in range(len(sigma)):
        for c in range(sigma.shape[1]):
            sigma[j, c] *= math.sqrt(learnt[j, c].factor)


@kernel
def undo_swaps(tree, frame, views, s):
    """Mirror measurements of cameras that are probably swapped, in place.

    Returns whether the body has its sides exchanged instead, as all of several cameras show it.
    """
    n_seeing, n_swapped, against = 0, 0, 0.0
    for c in range(len(views)):
        sees, view = False, views[c]
        for j in range(len(_MIRROR)):
            sees |= frame.ok[j, c]
        if not sees:
            view.unseen_updates += 1
            continue
        back = view.unseen_updates > _BLIND_UPDATES
        view.trusted_updates = _BELIEVED_UPDATES if back else max(view.trusted_updates - 1, 0)
        view.unseen_updates = 0
        n_seeing += 1
        if view.trusted_updates > 0:
            view.swap_chance = _LEAST_CHANCE
            continue
        prior = view.swap_chance * (1.0 - s.swap_ends) + (1.0 - view.swap_chance) * s.swap_begins
        evidence = _swap_evidence(tree, frame, c, s.inlier_odds)
        odds = math.log(prior / (1.0 - prior)) + evidence
        chance = min(max(1.0 / (1.0 + math.exp(-odds)), _LEAST_CHANCE), 1.0 - _LEAST_CHANCE)
        view.swap_chance = chance
        n_swapped += chance > 0.5
        against -= min(evidence, 0.0)
    mirrored = n_swapped >= _ENOUGH and against < _AGAINST
    if n_swapped == n_seeing > 1 or mirrored:
        for c in range(len(views)):
            views[c].swap_chance = _LEAST_CHANCE
    for c in range(len(views)):
        if views[c].swap_chance > 0.5 and views[c].unseen_updates == 0:
            mirror(c, frame.z, frame.sigma, frame.ok)
    return mirrored


@kernel
def _swap_evidence(tree, frame, c, inlier_odds):
    """Log-likelihood ratio of camera c being swapped, bounded."""
    camera, body, cov = frame.P[c], tree.body, tree.cov
    z, sigma, ok = frame.z, frame.sigma, frame.ok
    swapped, right = 1.0, 1.0  # products: no term is more than 1e10
    for j in range(len(_MIRROR)):
        m = _MIRROR[j]
        if m == j or not (ok[j, c] or ok[m, c]):
            continue
        u, v, depth, spread = project_joint(camera, body[j], cov[j])
        if not depth > NEAREST_DEPTH_M:
            continue
        if ok[m, c]:
            swapped *= _mixture(z[m, c, 0] - u, z[m, c, 1] - v, sigma[m, c], spread, inlier_odds)
        if ok[j, c]:
            right *= _mixture(z[j, c, 0] - u, z[j, c, 1] - v, sigma[j, c], spread, inlier_odds)
    return min(max(math.log(swapped / right), -_MOST_EVIDENCE), _MOST_EVIDENCE)


@kernel(fastmath=_REORDER)
def _mixture(du, dv, sigma, spread, inlier_odds):
    """Density of a detection over that of an outlier, but for a factor that pairs share."""
    near = 1.0 / (sigma * sigma + spread)
    return 1.0 + inlier_odds * near * math.exp(-0.5 * (du * du + dv * dv) * near)


@kernel
def mirror(c, z, sigma, ok):
    """Exchange left and right of camera c, in place."""
    for j in range(len(_MIRROR)):
        m = _MIRROR[j]
        if m > j:
            for i in range(2):
                z[j, c, i], z[m, c, i] = z[m, c, i], z[j, c, i]
            sigma[j, c], sigma[m, c] = sigma[m, c], sigma[j, c]
            ok[j, c], ok[m, c] = ok[m, c], ok[j, c]
