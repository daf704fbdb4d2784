"""Which cameras are not where they are said to be: what cameras say of each other, over seconds.

A camera that is turned, moved or zoomed against its calibration sees every body displaced in the
same way, second after second. To first order that is four numbers of its image: a shift (2), a
growth and a turn about the principal point. They are estimated for each camera from the residuals
between what it reports and what the *other* cameras say, by least squares with exponential
forgetting, together with a delay, so that a camera that is merely late is not taken for a displaced
one. What they explain, in units of their covariance with an allowance for the detector's lasting
bias, is a generalised likelihood ratio (Willsky and Jones, IEEE Transactions on Automatic Control
21, 1976; Basseville and Nikiforov, Detection of Abrupt Changes, 1993, chapter 7). Growth alone,
shift and growth, and the turn as well are three hypotheses; each pays for its numbers, and the best
counts.

Each ratio supposes that one camera alone is wrong: it is named when its ratio is clearly the
largest. A joint must be seen by three cameras: of two that contradict each other nobody knows which
is wrong.
"""

import math
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.triangulation import pixel_of

N_NUMBERS = 5
"""Shift along u and v, growth, turn, all in radians or shares; delay [s]."""
KEPT = 0.96
"""Share of the evidence that is kept from sample to sample: it is forgotten within 10 s."""
NAMED_AT, CLEARED_AT = 7.0, 3.5
"""A camera is named when its ratio exceeds the one, and cleared when it is below the other."""
DECIDED = 1.3
"""And only if it is so many times every other's, where its error shows, too, but less."""
SHIFT_COSTS, TURN_COSTS = 3.0, 7.0
"""So much more than growth alone, shift and growth have to explain, and all with the turn: more
numbers explain more where nothing is wrong, and a body that leans looks like a turn."""
LEAST_CONFIDENCE = 0.5
CAUCHY = 0.7
"""Deviations at which a residual has half its weight (Cauchy): no view, however far off, says more
than a bounded amount, and many have to agree."""
LEAST_VIEWS = 3
LEAST_DEPTH_M = 0.3
U, V, WEIGHT, DU, DV = 0, 1, 2, 3, 4
JACOBIAN = 5
PLACE = 11
N_VIEW = 13
"""One view of a joint: residual (2), weight, velocity in the image (2), slope on the joint
(2 x 3), pixel (2)."""
EVERY = 10
"""Updates between two samples: errors of the detector last for about twelve."""
PRIOR = (0.3**-2, 0.3**-2, 0.3**-2, 0.3**-2, 0.3**-2)
"""Precision of these numbers before anything was seen."""
ALLOWED = (0.00084**2, 0.00084**2, 0.0034**2, 0.005**2)
"""Variance of the first four that no calibration is to blame for: the detector's lasting bias."""
CAMERA = np.dtype(
    [
        # updates since the reset
        ("updates", "i8"),
        # of the five numbers (the upper triangle); that times the numbers
        ("information", "f8", (N_NUMBERS, N_NUMBERS)), ("score", "f8", (N_NUMBERS,)),
        # likelihood ratio, less its costs, at the last sample; whether the camera is named
        ("ratio", "f8"), ("suspected", "?"),
    ],
    align=True,
)  # fmt: skip
"""What is remembered of one camera of one environment."""


def make_monitor(batch: int, n_cameras: int) -> Any:
    """(B, C) records of `CAMERA`, nobody suspected."""
    return np.zeros((batch, n_cameras), CAMERA)


def forget_monitor(state: Any, ids: Ints) -> None:
    """Begin environments `ids` anew."""
    state[ids] = np.zeros((), CAMERA)


def monitor(
    state: Any, ids: Ints, keypoints: Keypoints, age_s: Floats, estimate: PoseEstimate,
    P: Floats, axes: Floats,
) -> None:  # fmt: skip
    """Count an update of environments `ids`, whose rows the other arguments are.

    Args:
        state: (B, C) of the whole batch.
        ids: (B,) environments.
        keypoints: pinhole pixels, by worker.
        age_s: (B, C) how old each camera's frame is [s].
        estimate: what is believed now.
        P: (C, 3, 4) projections, as the cameras are said to be.
        axes: (C, 3) principal point and focal length [px].
    """
    state["updates"][ids] += 1
    due = np.flatnonzero(state["updates"][ids, 0] % EVERY == 0)
    if len(due) == 0:
        return
    seen = (keypoints.px, keypoints.confidence, keypoints.sigma_px, age_s)
    believed = (estimate.mean_world, estimate.velocity_world, estimate.tracked)
    gather(state, due, ids, seen, believed, P, axes)


@kernel(makes_arrays=True)
def gather(cameras, due, ids, seen, believed, P, axes):
    """Take a sample of rows `due`, environments `ids[due]`; arguments as of `monitor`."""
    (px, confidence, sigma_px, age_s), (mean, velocity, tracked) = seen, believed
    n_cameras = len(P)
    view, small = np.empty((n_cameras, N_VIEW)), np.empty((N_NUMBERS, N_NUMBERS))
    sees = np.empty(n_cameras, np.bool_)
    for row in due:
        own = cameras[ids[row]]
        for c in range(n_cameras):
            for i in range(N_NUMBERS):
                own[c].score[i] *= KEPT
                for j in range(i, N_NUMBERS):
                    own[c].information[i, j] *= KEPT
        for w in range(tracked.shape[1]):
            if not tracked[row, w]:
                continue
            for j in range(mean.shape[2]):
                n = 0
                for c in range(n_cameras):
                    sees[c] = _view(
                        px[row, c, w, j], confidence[row, c, w, j], sigma_px[row, c, w, j],
                        age_s[row, c], mean[row, w, j], velocity[row, w, j], P[c], view[c],
                    )  # fmt: skip
                    n += sees[c]
                if n >= LEAST_VIEWS:
                    _triangulate(view, sees, axes, own, small)
        for c in range(n_cameras):
            own[c].ratio = _ratio(own[c].information, own[c].score, small)
        _judge(own)


@kernel
def _view(px, confidence, sigma_px, age_s, mean, velocity, p, out):
    """Write one camera's view of a joint; whether there is one."""
    if not confidence >= LEAST_CONFIDENCE:
        return False
    dx, dy, dz = velocity
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
def _triangulate(view, seen, axes, cameras, small):
    """Add what the views of one joint say of the cameras that it is seen by.

    All triangulate the joint; the residual of each counts with the information that is left when
    the others are asked, which is the same as to leave it out (Woodbury).
    """
    for i in range(3):
        for j in range(4):
            small[i, j] = 0.0
    for c in range(len(seen)):
        if seen[c]:
            v, weight = view[c], view[c, WEIGHT]
            for i in range(3):
                first, second = weight * v[JACOBIAN + i], weight * v[JACOBIAN + 3 + i]
                for j in range(3):
                    small[i, j] += first * v[JACOBIAN + j] + second * v[JACOBIAN + 3 + j]
                small[i, 3] += first * v[U] + second * v[V]
    _invert(small, 3)
    for c in range(len(seen)):
        if seen[c]:
            _add(view[c], axes[c], small, cameras[c].information, cameras[c].score)


@kernel
def _add(v, axes, small, information, score):
    """Add one view; `small` holds the inverse information of the joint, and its score beside."""
    b00 = b01 = b11 = 0.0
    e0, e1, weight = v[U], v[V], v[WEIGHT]
    for i in range(3):
        first = second = shift = 0.0
        for j in range(3):
            first += small[i, j] * v[JACOBIAN + j]
            second += small[i, j] * v[JACOBIAN + 3 + j]
            shift += small[i, j] * small[j, 3]
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
    for i in range(N_NUMBERS):
        score[i] += a0[i] * r0 + a1[i] * r1
        left, right = a0[i] * m00 + a1[i] * m01, a0[i] * m01 + a1[i] * m11
        for j in range(i, N_NUMBERS):
            information[i, j] += left * a0[j] + right * a1[j]


@kernel
def _ratio(information, score, small):
    """What growth alone explains, or shift and growth, or all four numbers, at their costs."""
    n, growth, turn = N_NUMBERS, N_NUMBERS - 3, N_NUMBERS - 2
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
def _judge(cameras):
    """Name the worst camera, keep whom one has named until others are worse or it agrees again."""
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
def _invert(a, n):
    """Invert the leading n rows and columns of a symmetric positive matrix in place."""
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
