"""Detection of miscalibrated cameras from the disagreement between cameras.

A camera that is rotated, moved or zoomed relative to its calibration sees every body persistently
displaced in the same way. To first order, this displacement has four parameters in the image: a
translation (2), a scaling and a rotation about the principal point. They are estimated for each
camera from the residuals between its detections and the joints triangulated by the *other* cameras,
by least squares with exponential forgetting. A delay is estimated with them, so that a camera that
is only late is not mistaken for a displaced one. The evidence for a displacement is a generalised
likelihood ratio: the parameters in units of their covariance, with an allowance for the detector's
lasting bias (Willsky and Jones, IEEE Transactions on Automatic Control 21, 1976; Basseville and
Nikiforov, Detection of Abrupt Changes, 1993, chapter 7). There are three hypotheses: scaling alone;
translation and scaling; translation, scaling and rotation. Each is penalised for its number of
parameters, and the largest ratio is used.

Each ratio assumes that a single camera is wrong. Therefore a camera is suspected only if its ratio
is clearly the largest. A joint must be seen by three cameras: if only two see it and contradict
each other, either may be wrong.
"""

import math
from typing import Annotated

import numpy as np

from hrc_env.core.declared import Records1, Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Ints, Points2, Points3, Velocities3
from hrc_env.geometry.triangulation import pixel_of
from hrc_env.tracking.measurements import KeypointArrays, get_keypoint_arrays
from hrc_env.tracking.tracks import EstimateArrays, get_estimate_arrays

N_PARAMETERS = 5
"""Number of parameters: translation along u and v [focal lengths], relative scaling, rotation [rad]
and delay [s]."""
KEPT = 0.96
"""Fraction of the evidence that is retained from one sample to the next. The corresponding time
constant is 10 s."""
NAMED_AT = 7.0
"""Likelihood ratio above which a camera becomes suspected."""
CLEARED_AT = 3.5
"""Likelihood ratio below which a suspected camera is cleared."""
DECIDED = 1.3
"""Factor by which the ratio of a camera must exceed those of all others for it to be suspected. It
is above 1 because the error of one camera also increases the ratios of the others."""
SHIFT_COSTS = 3.0
"""Penalty on the likelihood ratio of the hypothesis of translation and scaling, relative to the
hypothesis of scaling alone."""
TURN_COSTS = 7.0
"""Penalty on the likelihood ratio of the hypothesis that includes rotation. It is larger because a
leaning body resembles a rotated camera."""
LEAST_CONFIDENCE = 0.5
"""Minimum confidence of a detection that is used."""
CAUCHY = 0.7
"""Number of standard deviations at which a residual has half its weight. These Cauchy weights bound
the evidence of a single view."""
LEAST_VIEWS = 3
"""Minimum number of cameras that must see a joint for it to be used."""
LEAST_DEPTH_M = 0.3
"""Minimum depth of a joint in a camera at which the camera's detection is used [m]."""
U, V, WEIGHT, DU, DV = 0, 1, 2, 3, 4
"""Columns of a view of a joint: residuals of u and v [px], weight [1/px^2], and velocities of the
joint along u and v [px/s]."""
JACOBIAN = 5
"""First of six columns with the derivatives of u and of v with respect to the joint's position
[px/m]."""
PLACE = 11
"""First of two columns with the expected pixel [px]."""
N_VIEW = 13
"""Number of columns of a view of a joint."""
EVERY = 10
"""Number of updates between two samples. It is similar to the number of updates, about 12, for
which errors of the detector persist."""
PRIOR = (0.3**-2, 0.3**-2, 0.3**-2, 0.3**-2, 0.3**-2)
"""Prior precision of each parameter."""
ALLOWED = (0.00084**2, 0.00084**2, 0.0034**2, 0.005**2)
"""Variances of translation, scaling and rotation that the detector's lasting bias explains."""


class MonitoredCamera:
    """Evidence for an error in the calibration of one camera of one environment."""

    updates: int
    """Number of updates since the reset."""
    information: Annotated[Floats, (N_PARAMETERS, N_PARAMETERS)]
    """Information matrix of the parameters, of which only the upper triangle is filled."""
    score: Annotated[Floats, (N_PARAMETERS,)]
    """Product of the information matrix and the parameters."""
    ratio: float
    """Generalised likelihood ratio at the last sample, less the penalties."""
    suspected: bool
    """Whether the camera is suspected to be miscalibrated."""


CAMERA = dtype_of(MonitoredCamera)


def make_monitor(batch: int, n_cameras: int) -> Records2[MonitoredCamera]:
    """Return initial evidence (B, C), with which no camera is suspected."""
    return make_records(MonitoredCamera, (batch, n_cameras))


def forget_monitor(state: Records2[MonitoredCamera], ids: Ints) -> None:
    """Discard the evidence of environments `ids`."""
    state[ids] = np.zeros((), CAMERA)


def monitor(
    state: Records2[MonitoredCamera],
    ids: Ints,
    keypoints: Keypoints,
    age_s: Floats,
    estimate: PoseEstimate,
    P: Floats,
    axes: Floats,
) -> None:
    """Update the evidence of some environments, in place, with a sample of every tenth update.

    Args:
        state: (B, C) evidence of the whole batch.
        ids: (b,) indices of the environments, to which the rows of the next arguments belong.
        keypoints: (b, C, W, J) pinhole pixels, assigned to workers.
        age_s: (b, C) age of each camera's frame [s].
        estimate: (b, W, J) estimate of the tracker.
        P: (C, 3, 4) projections of the calibrated cameras.
        axes: (C, 3) principal point and focal length [px].
    """
    due = np.empty(len(ids), np.int64)
    n_due = _list_due(state, ids, due)
    if n_due == 0:
        return
    sample_views(
        state,
        due[:n_due],
        ids,
        get_keypoint_arrays(keypoints),
        age_s,
        get_estimate_arrays(estimate),
        P,
        axes,
    )


@kernel
def _list_due(state: Records2[MonitoredCamera], ids: Ints, due: Ints) -> int:
    """Count an update, fill in the rows (b,) with a due sample, and return their number."""
    n_due = 0
    for row in range(len(ids)):
        for c in range(state.shape[1]):
            state[ids[row], c].updates += 1
        if state[ids[row], 0].updates % EVERY == 0:
            due[n_due] = row
            n_due += 1
    return n_due


@kernel(makes_arrays=True)
def sample_views(
    state: Records2[MonitoredCamera],
    due: Ints,
    ids: Ints,
    detections: KeypointArrays,
    age_s: Floats,
    estimate: EstimateArrays,
    P: Floats,
    axes: Floats,
) -> None:
    """Add the evidence of one sample for rows `due`; the other arguments are those of `monitor`."""
    mean, velocity, tracked = estimate.mean_world, estimate.velocity_world, estimate.tracked
    n_cameras = len(P)
    view, scratch = np.empty((n_cameras, N_VIEW)), np.empty((N_PARAMETERS, N_PARAMETERS))
    sees = np.empty(n_cameras, np.bool_)
    for row in due:
        cameras: Records1[MonitoredCamera] = state[int(ids[row])]
        for c in range(n_cameras):
            for i in range(N_PARAMETERS):
                cameras[c].score[i] *= KEPT
                for j in range(i, N_PARAMETERS):
                    cameras[c].information[i, j] *= KEPT
        for w in range(tracked.shape[1]):
            if not tracked[row, w]:
                continue
            for j in range(mean.shape[2]):
                n = 0
                for c in range(n_cameras):
                    sees[c] = detections.confidence[
                        row, c, w, j
                    ] >= LEAST_CONFIDENCE and _fill_view(
                        detections.px[row, c, w, j],
                        detections.sigma_px[row, c, w, j],
                        age_s[row, c],
                        mean[row, w, j],
                        velocity[row, w, j],
                        P[c],
                        view[c],
                    )
                    n += sees[c]
                if n >= LEAST_VIEWS:
                    _add_joint(view, sees, axes, cameras, scratch)
        for c in range(n_cameras):
            cameras[c].ratio = _compute_ratio(cameras[c].information, cameras[c].score, scratch)
        _suspect_worst(cameras)


@kernel
def _fill_view(
    px: Points2,
    sigma_px: float,
    age_s: float,
    mean: Points3,
    velocity: Velocities3,
    p: Floats,
    out: Floats,
) -> bool:
    """Fill in one camera's view of a joint, and return whether it can be used.

    Args:
        px: (2,) detected pixel.
        sigma_px: standard deviation of the pixel [px].
        age_s: age of the frame [s].
        mean: (3,) current position of the joint [m].
        velocity: (3,) velocity of the joint [m/s].
        p: (3, 4) projection of the camera.
        out: (N_VIEW,) view, filled in.
    """
    dx, dy, dz = velocity[0], velocity[1], velocity[2]
    u, v, depth = pixel_of(p, mean[0] - age_s * dx, mean[1] - age_s * dy, mean[2] - age_s * dz)
    out[U], out[V] = px[0] - u, px[1] - v
    squares = (out[U] ** 2 + out[V] ** 2) / sigma_px**2
    if not (depth > LEAST_DEPTH_M and math.isfinite(squares)):
        return False
    out[WEIGHT] = 1.0 / (sigma_px**2 * (1.0 + squares / CAUCHY**2))
    for i in range(3):
        out[JACOBIAN + i] = (p[0, i] - u * p[2, i]) / depth
        out[JACOBIAN + 3 + i] = (p[1, i] - v * p[2, i]) / depth
    out[DU] = out[JACOBIAN] * dx + out[JACOBIAN + 1] * dy + out[JACOBIAN + 2] * dz
    out[DV] = out[JACOBIAN + 3] * dx + out[JACOBIAN + 4] * dy + out[JACOBIAN + 5] * dz
    out[PLACE], out[PLACE + 1] = u, v
    return True


@kernel
def _add_joint(
    view: Floats, sees: Bools, axes: Floats, cameras: Records1[MonitoredCamera], scratch: Floats
) -> None:
    """Add the evidence of the views of one joint, in place.

    The joint is triangulated from all views. The residual of each view is then weighted with the
    information that remains beside the other views, which is equivalent to leaving that view out
    of the triangulation (Woodbury).

    Args:
        view: (C, N_VIEW) views of the joint.
        sees: (C,) mask of the views that are used.
        axes: (C, 3) principal point and focal length [px].
        cameras: (C,) evidence, increased in place.
        scratch: (N_PARAMETERS, N_PARAMETERS) work array.
    """
    for i in range(3):
        for j in range(4):
            scratch[i, j] = 0.0
    for c in range(len(sees)):
        if sees[c]:
            v, weight = view[c], view[c, WEIGHT]
            for i in range(3):
                first, second = weight * v[JACOBIAN + i], weight * v[JACOBIAN + 3 + i]
                for j in range(3):
                    scratch[i, j] += first * v[JACOBIAN + j] + second * v[JACOBIAN + 3 + j]
                scratch[i, 3] += first * v[U] + second * v[V]
    _invert(scratch, 3)
    for c in range(len(sees)):
        if sees[c]:
            _add_view(view[c], axes[c], scratch, cameras[c].information, cameras[c].score)


@kernel
def _add_view(v: Floats, axes: Floats, joint: Floats, information: Floats, score: Floats) -> None:
    """Add the evidence of one view, in place.

    Args:
        v: (N_VIEW,) view of a joint.
        axes: (3,) principal point and focal length of the camera [px].
        joint: (3, 4) inverse information matrix of the joint and, in the last column, its score.
        information: (N_PARAMETERS, N_PARAMETERS) information matrix of the camera's parameters,
            increased in place.
        score: (N_PARAMETERS,) score of the camera's parameters, increased in place.
    """
    b00 = b01 = b11 = 0.0
    e0, e1, weight = v[U], v[V], v[WEIGHT]
    for i in range(3):
        first = second = shift = 0.0
        for j in range(3):
            first += joint[i, j] * v[JACOBIAN + j]
            second += joint[i, j] * v[JACOBIAN + 3 + j]
            shift += joint[i, j] * joint[j, 3]
        b00 += v[JACOBIAN + i] * first
        b01 += v[JACOBIAN + i] * second
        b11 += v[JACOBIAN + 3 + i] * second
        e0 -= v[JACOBIAN + i] * shift
        e1 -= v[JACOBIAN + 3 + i] * shift
    m00, m01, m11 = weight - weight**2 * b00, -(weight**2) * b01, weight - weight**2 * b11
    r0, r1 = weight * e0, weight * e1
    f, x, y = axes[2], v[PLACE] - axes[0], v[PLACE + 1] - axes[1]
    a0 = (f, 0.0, x, -y, -v[DU])
    a1 = (0.0, f, y, x, -v[DV])
    for i in range(N_PARAMETERS):
        score[i] += a0[i] * r0 + a1[i] * r1
        left, right = a0[i] * m00 + a1[i] * m01, a0[i] * m01 + a1[i] * m11
        for j in range(i, N_PARAMETERS):
            information[i, j] += left * a0[j] + right * a1[j]


@kernel
def _compute_ratio(information: Floats, score: Floats, small: Floats) -> float:
    """Return the largest likelihood ratio of the three hypotheses, less their penalties.

    Args:
        information: (N_PARAMETERS, N_PARAMETERS) information matrix of the parameters.
        score: (N_PARAMETERS,) score of the parameters.
        small: (N_PARAMETERS, N_PARAMETERS) work array.
    """
    n, growth, turn = N_PARAMETERS, N_PARAMETERS - 3, N_PARAMETERS - 2
    for i in range(n):
        for j in range(i, n):
            small[i, j] = small[j, i] = information[i, j]
        small[i, i] += PRIOR[i]
    _invert(small, n)
    for i in range(turn + 1):
        total = 0.0
        for j in range(n):
            total += small[i, j] * score[j]
        small[turn + 1, i] = total
    for i in range(turn + 1):
        small[i, i] += ALLOWED[i]
    _invert(small, turn + 1)
    for i in range(turn + 1):
        total = 0.0
        for j in range(turn + 1):
            total += small[i, j] * small[turn + 1, j]
        small[i, turn + 1] = total
    grown = small[growth, turn + 1] ** 2 / small[growth, growth]
    turned = 0.0
    for i in range(turn + 1):
        turned += small[i, turn + 1] * small[turn + 1, i]
    _invert(small, turn)
    shifted = 0.0
    for i in range(turn):
        for j in range(turn):
            shifted += small[i, turn + 1] * small[i, j] * small[j, turn + 1]
    return max(grown, shifted - SHIFT_COSTS, turned - TURN_COSTS)


@kernel
def _suspect_worst(cameras: Records1[MonitoredCamera]) -> None:
    """Suspect the camera with the largest ratio if that ratio is decisive, and clear all others."""
    worst, second = 0, 0.0
    for c in range(1, len(cameras)):
        if cameras[c].ratio > cameras[worst].ratio:
            worst = c
    for c in range(len(cameras)):
        if c != worst:
            second = max(second, cameras[c].ratio)
            cameras[c].suspected = False
    ratio, named = cameras[worst].ratio, cameras[worst].suspected
    decided = ratio > NAMED_AT and ratio > DECIDED * second
    cameras[worst].suspected = ratio > CLEARED_AT if named else decided


@kernel
def _invert(a: Floats, n: int) -> None:
    """Invert the leading n x n block of a symmetric positive definite matrix, in place."""
    for k in range(n):
        pivot = 1.0 / a[k, k]
        for j in range(n):
            a[k, j] *= pivot
        for i in range(n):
            if i != k:
                factor = a[i, k]
                for j in range(n):
                    a[i, j] -= factor * a[k, j]
                a[i, k] = -factor * pivot
        a[k, k] = pivot
