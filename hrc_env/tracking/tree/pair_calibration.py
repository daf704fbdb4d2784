"""Estimation of the rotations of two cameras with which their lines of sight meet.

If only two cameras see a worker, one of them may be rotated relative to its calibration. Two lines
of sight with unit directions d_a, d_b from e_a, e_b, which are closest to each other at the
distances r_a, r_b, have the gap g = n . (e_b - e_a) with n = d_a x d_b / |d_a x d_b|. Small
rotations w_a, w_b of the cameras about their centres change the gap to

    g + r_b (d_b x n) . w_b - r_a (d_a x n) . w_a.

Every joint of a body is a measurement that this gap is 0. The rotations are estimated as a Gaussian
of 6 numbers, with mean zero initially and with a memory of a few seconds. The remaining uncertainty
of a displacement of the whole body is added to the reported covariance.
"""

import math

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.lines_of_sight import CAMERA, Camera, look, model_cameras, nearest_places
from hrc_env.geometry.triangulation import inverse3
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.acquisition import WIDEST_STD_M, start_track
from hrc_env.tracking.tree.gaussian import invert, multiply, multiply_transposed
from hrc_env.tracking.tree.state import Pair, Tree, WorkerHypotheses

TURN_STD_RAD = 0.05
"""Prior standard deviation of a camera's rotation about each axis [rad], an estimate for a camera
that was knocked."""
_LEAST_TURN_RAD = 0.014
"""Combined rotation of both cameras above which they are considered misaligned [rad]. Misaligned
cameras remain so above half of this value."""
_LEAST_EVIDENCE = 16.0
"""Twice the gain in log-likelihood from the rotations above which cameras are considered
misaligned. Misaligned cameras remain so above half of this value."""
_MOST_TURN_RAD = 0.14
"""Combined rotation above which the lines of sight are assumed to belong to different people
[rad]."""
_MEETING = 3.0
"""Median squared gap, divided by its variance, below which the lines of sight of a body meet."""
_FORGETS = 0.1
"""Weight of one update in `Pair.meeting_share`."""
_LEAST_SHARE = 0.5
"""Value of `Pair.meeting_share` above which cameras may become misaligned."""
_LEAST_SHARE_MISALIGNED = 0.3
"""Value of `Pair.meeting_share` above which cameras may remain misaligned; also its initial
value."""
_KEPT = 0.99
"""Fraction of the information that is retained in an update."""
_WEIGHT = 1 / 12
"""Weight of an update. It is below 1 because errors of a detector persist for about twelve
updates."""
_PASSING_M = 0.03
"""Standard deviation of the gap between two lines of sight that is not due to pixel noise [m]."""
_TAIL = 4.0
"""Squared gap, relative to the median, at which a gap has half its weight."""


@kernel(makes_arrays=True)
def check_pair_calibration(worker: WorkerHypotheses, frame: Frame, settings: Settings) -> None:
    """Check whether the only two cameras that see a worker are misaligned, and restart tracks.

    A track is restarted whenever the cameras become misaligned or are found to be calibrated.

    If a third camera sees the worker, the two are considered calibrated, because persistent errors
    of the detector eventually resemble a rotation.

    Args:
        worker: the hypotheses about one worker, changed in place.
        frame: the measurements; its projections are set to those of the rotated cameras.
        settings: settings of the estimator.
    """
    tree, cameras = worker.trees[0], np.zeros(2, np.int64)
    pair, n_views = tree.pair, count_views(frame, settings.acquire_min_joints, cameras)
    if n_views == 2:
        _update_turns(tree, cameras, frame, settings.acquire_min_joints)
    elif n_views > 2:
        was_misaligned = pair.is_misaligned
        _forget_turns(pair)
        if was_misaligned:
            write_projections(pair, frame)
            start_track(worker, frame, settings)
    if not tree.tracked:
        n = pair.untracked_updates
        pair.untracked_updates = n + 1 if n_views == 2 else max(n - 1, 0)
    if pair.is_misaligned:
        pair.is_misaligned = _has_turned(pair)
    elif _has_turned(pair) and n_views == 2 and _may_start_turned(tree, frame.cameras, settings):
        pair.is_misaligned = True
        write_projections(pair, frame)
        pair.is_misaligned = start_track(worker, frame, settings)
    tree.displaced_m2[:] = 0.0
    if pair.is_misaligned and tree.tracked:
        measure_displacement(pair, frame.cameras, tree.body, tree.displaced_m2)


@kernel(makes_arrays=True)
def _may_start_turned(tree: Tree, cameras: Records1[Camera], settings: Settings) -> bool:
    """Return whether a track may start with two rotated cameras.

    An existing track is kept if the rotations leave the position of the body too uncertain, which
    is the case if the cameras are almost opposite each other.

    Args:
        tree: the worker's heaviest hypothesis; its `displaced_m2` is overwritten.
        cameras: (C,) cameras of the rig.
        settings: settings of the estimator.
    """
    if not tree.tracked:
        return tree.pair.untracked_updates > settings.one_view_wait_updates
    measure_displacement(tree.pair, cameras, tree.body, tree.displaced_m2)
    return np.diag(tree.displaced_m2).max() < WIDEST_STD_M**2


@kernel
def count_views(frame: Frame, least_joints: int, cameras: Ints) -> int:
    """Return the number of cameras that measured at least `least_joints` joints.

    The indices of the last two of them are written to `cameras` (2,).
    """
    n = 0
    for c in range(len(frame.P)):
        n_joints = 0
        for j in range(len(frame.ok)):
            n_joints += frame.ok[j, c]
        if n_joints >= least_joints:
            cameras[0], cameras[1] = cameras[1], c
            n += 1
    return n


@kernel(makes_arrays=True)
def _update_turns(tree: Tree, cameras: Ints, frame: Frame, least_joints: int) -> None:
    """Learn the rotations of two cameras from the gaps between their lines of sight.

    Args:
        tree: the worker's heaviest hypothesis; its `pair` is changed in place.
        cameras: (2,) indices of the cameras.
        frame: the measurements.
        least_joints: number of joints below which nothing is learnt.
    """
    pair = tree.pair
    if pair.cameras[0] != cameras[0] or pair.cameras[1] != cameras[1]:
        _forget_turns(pair)
        pair.cameras[0], pair.cameras[1] = cameras[0], cameras[1]
    n_joints = len(frame.ok)
    rows, gap, variance = np.empty((n_joints, 6)), np.empty(n_joints), np.empty(n_joints)
    n = measure_gaps(tree, frame, rows, gap, variance)
    if n < least_joints:
        return
    squares = gap[:n] ** 2 / variance[:n]
    usual = np.median(squares)
    pair.meeting_share += _FORGETS * ((usual < _MEETING) - pair.meeting_share)
    usual = max(usual, 1.0)
    pair.information[:] *= _KEPT
    pair.score[:] *= _KEPT
    for m in range(n):
        weight = _WEIGHT / (variance[m] * (usual + squares[m] / _TAIL))
        measured = -gap[m]
        for i in range(6):
            measured += rows[m, i] * pair.turn[i]
        for i in range(6):
            pair.score[i] += weight * rows[m, i] * measured
            for k in range(6):
                pair.information[i, k] += weight * rows[m, i] * rows[m, k]
    precision = pair.information.copy()
    for i in range(6):
        precision[i, i] += TURN_STD_RAD**-2
    invert(precision, pair.turn_cov)
    for i in range(6):
        pair.turn[i] = 0.0
        for k in range(6):
            pair.turn[i] += pair.turn_cov[i, k] * pair.score[k]


@kernel(makes_arrays=True)
def _forget_turns(pair: Pair) -> None:
    """Reset a pair to its state before any measurement."""
    pair.information[:], pair.score[:], pair.turn[:] = 0.0, 0.0, 0.0
    pair.meeting_share, pair.is_misaligned = _LEAST_SHARE_MISALIGNED, False
    pair.untracked_updates = 0


@kernel
def _has_turned(pair: Pair) -> bool:
    """Return whether the learnt rotations of two cameras are large and certain enough."""
    squared, evidence = 0.0, 0.0
    for i in range(6):
        squared += pair.turn[i] ** 2
        evidence += pair.turn[i] * pair.score[i]
    least_share, times = _LEAST_SHARE, 1.0
    if pair.is_misaligned:
        least_share, times = _LEAST_SHARE_MISALIGNED, 0.5
    is_one_body = pair.meeting_share > least_share and squared < _MOST_TURN_RAD**2
    is_turned = squared > (times * _LEAST_TURN_RAD) ** 2 and evidence > times * _LEAST_EVIDENCE
    return is_one_body and is_turned


@kernel(makes_arrays=True)
def measure_gaps(tree: Tree, frame: Frame, rows: Floats, gap: Floats, variance: Floats) -> int:
    """Measure the gaps between two cameras' lines of sight with the current rotations.

    Slopes are evaluated at the tracked body. If they were evaluated at the measured lines, they
    would correlate with the noise of the gaps, which would bias the rotations.

    Args:
        tree: the worker's heaviest hypothesis, with the pair of cameras.
        frame: the measurements.
        rows: (J, 6) derivatives of the gaps with respect to the rotations [m/rad], filled in.
        gap: (J,) gaps [m], filled in.
        variance: (J,) variances of the gaps [m^2], filled in.

    Returns:
        The number of joints that both cameras measured, which is the number of filled rows.
    """
    pair, n = tree.pair, 0
    a, b = pair.cameras[0], pair.cameras[1]
    turned, cameras = np.empty((2, 3, 4)), np.empty(2, CAMERA)
    for k in range(2):
        c: int = pair.cameras[k]
        turn_camera(frame.cameras[c], pair.turn[3 * k : 3 * k + 3], turned[k])
    model_cameras(turned, cameras)
    one, other, middle, normal = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for j in range(len(frame.ok)):
        if not (frame.ok[j, a] and frame.ok[j, b]):
            continue
        look(cameras[0].back, frame.z[j, a, 0], frame.z[j, a, 1], one)
        look(cameras[1].back, frame.z[j, b, 0], frame.z[j, b, 1], other)
        crossing = nearest_places(cameras[0].eye, one, cameras[1].eye, other, middle)
        far_a, far_b = crossing.distance_1, crossing.distance_2
        if not (far_a > 0.0 and far_b > 0.0):
            continue
        _write_normal(one, other, normal)
        gap[n] = 0.0
        for i in range(3):
            gap[n] += normal[i] * (cameras[1].eye[i] - cameras[0].eye[i])
        variance[n] = (frame.sigma[j, a] * far_a / cameras[0].focal) ** 2 + _PASSING_M**2
        variance[n] += (frame.sigma[j, b] * far_b / cameras[1].focal) ** 2
        for i in range(3):
            place = tree.body[j, i] if tree.tracked else middle[i]
            one[i], other[i] = place - cameras[0].eye[i], place - cameras[1].eye[i]
        _write_normal(one, other, normal)
        cross(normal, one, rows[n, :3])
        cross(other, normal, rows[n, 3:])
        n += 1
    return n


@kernel
def _write_normal(one: Floats, other: Floats, out: Floats) -> None:
    """Compute the unit normal (3,) of two directions in `out`."""
    cross(one, other, out)
    length = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    for i in range(3):
        out[i] /= length


@kernel
def cross(a: Floats, b: Floats, out: Floats) -> None:
    """Compute the cross product of two vectors (3,) in `out`, which may be one of them."""
    x, y = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0], out[1] = x, y


@kernel(makes_arrays=True)
def turn_camera(camera: Camera, turn: Floats, out: Floats) -> None:
    """Compute the projection (3, 4) of a camera rotated about its centre by a rotation vector."""
    P, angle, first, second = camera.P, 1e-12, np.empty(3), np.empty(3)
    for i in range(3):
        angle += turn[i] ** 2
    angle = math.sqrt(angle)
    sine, versine = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2
    for row in range(3):
        cross(turn, P[row, :3], first)
        cross(turn, first, second)
        out[row, 3] = 0.0
        for i in range(3):
            out[row, i] = P[row, i] + sine * first[i] + versine * second[i]
            out[row, 3] -= out[row, i] * camera.eye[i]


@kernel(makes_arrays=True)
def measure_displacement(pair: Pair, cameras: Records1[Camera], body: Floats, out: Floats) -> None:
    """Compute the covariance of a body's displacement due to the cameras' uncertain rotations.

    The derivative of the point that two cameras triangulate with respect to their rotations w_c is
    (sum M_c)^-1 M_c [d_c r_c]x' with M_c = (1 - d_c d_c') / r_c^2.

    Args:
        pair: the two cameras with the covariance of their rotations.
        cameras: (C,) cameras of the rig.
        body: (J, 6) positions and velocities.
        out: (3, 3) covariance [m^2], filled in.
    """
    total, inverse, own = np.zeros((3, 3)), np.empty((3, 3)), np.empty((2, 3, 3))
    slope, half, full = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 6))
    line, moved, axis, middle = np.empty((2, 3)), np.empty(3), np.zeros(3), np.zeros(3)
    for j in range(len(body)):
        for i in range(3):
            middle[i] += body[j, i] / len(body)
    for k in range(2):
        c: int = pair.cameras[k]
        line[k] = middle - cameras[c].eye
        squared = line[k, 0] ** 2 + line[k, 1] ** 2 + line[k, 2] ** 2
        for i in range(3):
            for m in range(3):
                own[k, i, m] = ((i == m) - line[k, i] * line[k, m] / squared) / squared
        total += own[k]
    inverse3(total, inverse)
    for k in range(2):
        for m in range(3):
            axis[:] = 0.0
            axis[m] = 1.0
            cross(axis, line[k], moved)
            for i in range(3):
                for p in range(3):
                    for q in range(3):
                        slope[i, 3 * k + m] += inverse[i, p] * own[k, p, q] * moved[q]
    multiply(slope, pair.turn_cov, half)
    multiply_transposed(half, slope, full)
    out[:] = full[:3, :3]


@kernel
def write_projections(pair: Pair, frame: Frame) -> None:
    """Set `frame.P` to the cameras' projections, with the rotations of a misaligned pair."""
    for c in range(len(frame.P)):
        for i in range(3):
            for k in range(4):
                frame.P[c, i, k] = frame.cameras[c].P[i, k]
    if pair.is_misaligned:
        for k in range(2):
            c: int = pair.cameras[k]
            turn_camera(frame.cameras[c], pair.turn[3 * k : 3 * k + 3], frame.P[c])
