"""Measurements of one worker in one set of frames, and correction of swapped left and right labels.

A detection is a measurement unless its pixel is not finite or far outside the image, its confidence
is outside (0, 1], or its standard deviation is not finite and positive. Wrong but plausible pixels
are left to the robust likelihoods.

Cameras with swapped left and right labels are detected by a hidden Markov model over all joints of
the body. It has two states per camera: labels as reported, or swapped. A camera that sees the
worker again after an interval is trusted for some updates, because the body may have been tracked
mirrored in depth in the meantime. Likewise, several cameras are trusted if all of them seem to be
swapped.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records2
from hrc_env.core.errors import check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.core.typing import Bools, Floats, Points2
from hrc_env.geometry.lines_of_sight import Camera
from hrc_env.geometry.triangulation import FURTHEST_PX, NEAREST_DEPTH_M
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.state import LANES, N_IMAGE, N_VIEW, Noise, Tree, View

MIN_SIGMA_PX = 0.25
"""Lower bound of the standard deviations of detections [px]."""
_REORDER = {"reassoc", "contract", "nsz"}
_MIRROR = tuple(int(j) for j in MIRROR)
"""Index of each joint's counterpart on the other side of the body."""
_UNSEEN_UPDATES = 8
"""Number of updates without a detection after which a camera that sees the worker again is
trusted."""
_TRUSTED_UPDATES = 5
"""Number of updates for which a camera is trusted after the worker has reappeared."""
_ENOUGH = 3
"""Number of seemingly swapped cameras from which the tracked body itself may be mirrored."""
_AGAINST = 5.0
"""Upper bound of the other cameras' log-likelihood ratio against a mirrored body."""
_LEAST_CHANCE = 1e-3
"""Lower bound of the probability of either state of a camera."""
_MOST_EVIDENCE = 50.0
"""Upper bound of the absolute log-likelihood ratio of one frame."""


class KeypointArrays(NamedTuple):
    """The arrays of `Keypoints` that estimators read, as a tuple for compiled functions."""

    px: Points2
    """(B, C, W, J, 2) pixels of the keypoints."""
    confidence: Floats
    """(B, C, W, J) confidence of each keypoint, 0 to 1."""
    sigma_px: Floats
    """(B, C, W, J) standard deviation of each coordinate [px]."""


def get_keypoint_arrays(
    keypoints: Keypoints, shape: tuple[int, int, int, int] | None = None
) -> KeypointArrays:
    """Return the arrays of keypoints, copied where they are not contiguous.

    Args:
        keypoints: the keypoints.
        shape: the expected shape (B, C, W, J); None if it is not checked.

    Raises:
        ConfigError: the arrays have another shape.
    """
    if shape is not None:
        check_shape("Keypoints.px", keypoints.px.shape, (*shape, 2), "B, C, W, J, 2")
        check_shape("Keypoints.confidence", keypoints.confidence.shape, shape, "B, C, W, J")
        check_shape("Keypoints.sigma_px", keypoints.sigma_px.shape, shape, "B, C, W, J")
    return KeypointArrays(
        np.ascontiguousarray(keypoints.px, np.float64),
        np.ascontiguousarray(keypoints.confidence, np.float64),
        np.ascontiguousarray(keypoints.sigma_px, np.float64),
    )


class Frame(NamedTuple):
    """The measurements of one worker by C cameras, and work arrays for an update.

    All arrays except `cameras` are filled in place.
    """

    cameras: Records1[Camera]
    """(C,) calibrated cameras."""
    P: Floats
    """(C, 3, 4) projections for the assumed poses of the cameras. The third row of each projection
    contains the optical axis."""
    z: Points2
    """(J, C, 2) measured pixels; 0 where there is no measurement."""
    sigma: Floats
    """(J, C) standard deviations of the pixels [px]; 1 where there is no measurement."""
    ok: Bools
    """(J, C) mask of the existing measurements."""
    belief: Floats
    """(J, C) probability that the measurement is an inlier."""
    views: Floats
    """(C, N_VIEW, LANES) measurements in the layout that `tree.search` reads."""
    images: Floats
    """(C, N_IMAGE, LANES) images of the joints at the last linearisation by `tree.search`."""
    joint_views: Floats
    """(C, 8) work array of `tree.learning` for one joint."""


class JointPixel(NamedTuple):
    """The predicted pixel of a joint in one camera."""

    u: float
    """Column of the pixel [px]."""
    v: float
    """Row of the pixel [px]."""
    depth: float
    """Depth along the optical axis [m]. The pixel is valid only if the depth exceeds
    `NEAREST_DEPTH_M`."""
    spread: float
    """Variance of the pixel, averaged over both coordinates [px^2]."""


@kernel
def is_measurement(u: float, v: float, confidence: float, sigma: float) -> bool:
    """Return whether a detection is valid as a measurement.

    Args:
        u: column of the detected pixel [px].
        v: row of the detected pixel [px].
        confidence: confidence of the detection.
        sigma: standard deviation of each coordinate [px].
    """
    return (
        abs(u) < FURTHEST_PX
        and abs(v) < FURTHEST_PX
        and 0.0 < confidence <= 1.0 + 1e-6
        and 0.0 < sigma < FURTHEST_PX
    )


@kernel(makes_arrays=True)
def make_frame(cameras: Records1[Camera]) -> Frame:
    """Return empty arrays for the measurements of one worker by cameras (C,)."""
    n = len(cameras)
    return Frame(
        cameras=cameras,
        P=cameras["P"].copy(),
        z=np.empty((N_JOINTS, n, 2)),
        sigma=np.empty((N_JOINTS, n)),
        ok=np.empty((N_JOINTS, n), np.bool_),
        belief=np.empty((N_JOINTS, n)),
        views=np.zeros((n, N_VIEW, LANES)),
        images=np.zeros((n, N_IMAGE, LANES)),
        joint_views=np.empty((n, 8)),
    )


@kernel
def read_worker(measured: KeypointArrays, b: int, w: int, sigma_scale: float, frame: Frame) -> bool:
    """Fill in the measurements of one worker, and return whether there are any.

    For missing measurements, the pixel is set to 0 and sigma to 1 to keep NaN out of the
    arithmetic.

    Args:
        measured: detections of all workers.
        b: index of the environment.
        w: index of the worker.
        sigma_scale: factor on the standard deviations.
        frame: measurements of the worker, filled in.
    """
    px, confidence, sigma_px = measured.px, measured.confidence, measured.sigma_px
    z, sigma, ok = frame.z, frame.sigma, frame.ok
    any_ok = False
    for c in range(px.shape[1]):
        for j in range(px.shape[3]):
            u, v = px[b, c, w, j, 0], px[b, c, w, j, 1]
            std = sigma_px[b, c, w, j]
            good = is_measurement(u, v, confidence[b, c, w, j], std)
            ok[j, c] = good
            any_ok |= good
            z[j, c, 0] = u if good else 0.0
            z[j, c, 1] = v if good else 0.0
            sigma[j, c] = max(std * sigma_scale, MIN_SIGMA_PX) if good else 1.0
    return any_ok


@kernel(fastmath=_REORDER)
def compute_pixel_variance(p: Floats, u: float, v: float, depth: float, cov: Floats) -> float:
    """Return the pixel variance of an uncertain point, averaged over both coordinates [px^2].

    Args:
        p: (3, 4) projection of the camera.
        u: column of the point's pixel [px].
        v: row of the point's pixel [px].
        depth: depth of the point in the camera [m].
        cov: (3+, 3+) covariance of the point [m^2].
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
def project_joint(p: Floats, mean: Floats, cov: Floats) -> JointPixel:
    """Return the predicted pixel of a joint.

    Args:
        p: (3, 4) projection of the camera.
        mean: (3+,) position of the joint [m].
        cov: (3+, 3+) covariance of the position [m^2].
    """
    x, y, z = mean[0], mean[1], mean[2]
    depth = p[2, 0] * x + p[2, 1] * y + p[2, 2] * z + p[2, 3]
    u = (p[0, 0] * x + p[0, 1] * y + p[0, 2] * z + p[0, 3]) / depth
    v = (p[1, 0] * x + p[1, 1] * y + p[1, 2] * z + p[1, 3]) / depth
    return JointPixel(u, v, depth, compute_pixel_variance(p, u, v, depth, cov))


@kernel
def is_consistent(
    camera: Floats, z: Points2, sigma: float, gate_sigma: float, mean: Floats, cov: Floats
) -> bool:
    """Return whether a measurement is within the gate around the predicted pixel of a joint.

    Args:
        camera: (3, 4) projection.
        z: (2,) measured pixel.
        sigma: standard deviation of each coordinate [px].
        gate_sigma: the gate, in standard deviations.
        mean: (3+,) position of the joint [m].
        cov: (3+, 3+) covariance of the position [m^2].
    """
    u, v, depth, spread = project_joint(camera, mean, cov)
    if not depth > NEAREST_DEPTH_M:
        return False
    variance = sigma * sigma + spread
    return (z[0] - u) ** 2 + (z[1] - v) ** 2 < gate_sigma * gate_sigma * variance


@kernel
def read_for_hypothesis(
    tree: Tree,
    views: Records1[View],
    noise: Records2[Noise],
    measured: KeypointArrays,
    b: int,
    w: int,
    settings: Settings,
    frame: Frame,
) -> bool:
    """Fill in the measurements of one worker for one hypothesis.

    The standard deviations are scaled by the noise that the hypothesis has learnt, and swapped left
    and right labels are corrected.

    Args:
        tree: the body of the hypothesis.
        views: (C,) state of each camera in the hypothesis, updated in place.
        noise: (J, C) measurement noise that the hypothesis has learnt.
        measured: detections of all workers.
        b: index of the environment.
        w: index of the worker.
        settings: settings of the estimator.
        frame: measurements of the worker, filled in.

    Returns:
        Whether left and right are swapped in the tracked body rather than by the cameras.
    """
    read_worker(measured, b, w, settings.sigma_scale, frame)
    scale_sigma(noise, frame.sigma)
    return undo_swaps(tree, frame, views, settings)


@kernel
def scale_sigma(noise: Records2[Noise], sigma: Floats) -> None:
    """Multiply standard deviations (J, C) by the square roots of the learnt factors, in place."""
    for j in range(len(sigma)):
        for c in range(sigma.shape[1]):
            sigma[j, c] *= math.sqrt(noise[j, c].factor)


@kernel
def undo_swaps(tree: Tree, frame: Frame, views: Records1[View], settings: Settings) -> bool:
    """Correct the measurements of cameras with probably swapped labels, in place.

    Args:
        tree: the body of the hypothesis.
        frame: measurements of the worker.
        views: (C,) state of each camera, updated in place.
        settings: settings of the estimator.

    Returns:
        Whether left and right are swapped in the tracked body instead. This is assumed if several
        cameras seem to be swapped and the other cameras do not contradict it.
    """
    n_seeing, n_swapped, against = 0, 0, 0.0
    for c in range(len(views)):
        sees, view = False, views[c]
        for j in range(len(_MIRROR)):
            sees |= frame.ok[j, c]
        if not sees:
            view.unseen_updates += 1
            continue
        returns = view.unseen_updates > _UNSEEN_UPDATES
        view.trusted_updates = _TRUSTED_UPDATES if returns else max(view.trusted_updates - 1, 0)
        view.unseen_updates = 0
        n_seeing += 1
        if view.trusted_updates > 0:
            view.swap_chance = _LEAST_CHANCE
            continue
        stays = view.swap_chance * (1.0 - settings.swap_end_probability)
        prior = stays + (1.0 - view.swap_chance) * settings.swap_start_probability
        evidence = _weigh_swap(tree, frame, c, settings.inlier_odds)
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
def _weigh_swap(tree: Tree, frame: Frame, c: int, inlier_odds: float) -> float:
    """Return the bounded log-likelihood ratio for swapped labels in one camera.

    Args:
        tree: the body of the hypothesis.
        frame: measurements of the worker.
        c: index of the camera.
        inlier_odds: odds that a measurement without residual is an inlier, times its pixel
            variance [px^2].
    """
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
            swapped *= _compute_mixture_density(
                z[m, c, 0] - u, z[m, c, 1] - v, sigma[m, c], spread, inlier_odds
            )
        if ok[j, c]:
            right *= _compute_mixture_density(
                z[j, c, 0] - u, z[j, c, 1] - v, sigma[j, c], spread, inlier_odds
            )
    return min(max(math.log(swapped / right), -_MOST_EVIDENCE), _MOST_EVIDENCE)


@kernel(fastmath=_REORDER)
def _compute_mixture_density(
    du: float, dv: float, sigma: float, spread: float, inlier_odds: float
) -> float:
    """Return the likelihood of a detection relative to that of an outlier, up to a common factor.

    Args:
        du: residual of the column [px].
        dv: residual of the row [px].
        sigma: standard deviation of each coordinate [px].
        spread: variance of the predicted pixel [px^2].
        inlier_odds: odds that a measurement without residual is an inlier, times its pixel
            variance [px^2].
    """
    near = 1.0 / (sigma * sigma + spread)
    return 1.0 + inlier_odds * near * math.exp(-0.5 * (du * du + dv * dv) * near)


@kernel
def mirror(c: int, z: Points2, sigma: Floats, ok: Bools) -> None:
    """Swap left and right in the measurements of one camera, in place.

    Args:
        c: index of the camera.
        z: (J, C, 2) pixels.
        sigma: (J, C) standard deviations [px].
        ok: (J, C) mask of the existing measurements.
    """
    for j in range(len(_MIRROR)):
        m = _MIRROR[j]
        if m > j:
            for i in range(2):
                z[j, c, i], z[m, c, i] = z[m, c, i], z[j, c, i]
            sigma[j, c], sigma[m, c] = sigma[m, c], sigma[j, c]
            ok[j, c], ok[m, c] = ok[m, c], ok[j, c]
