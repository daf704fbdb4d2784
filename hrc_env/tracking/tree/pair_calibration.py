"""Pair calibration: the turns of two cameras by which their lines of sight meet.

One of two cameras that alone see a worker may be turned against its calibration. Two lines of
sight with unit directions d_a, d_b from e_a, e_b, nearest to each other at distances r_a, r_b, pass
each other at g = n . (e_b - e_a), n = d_a x d_b / |d_a x d_b|. Small turns w_a, w_b of the cameras
about their centres change that to

    g + r_b (d_b x n) . w_b - r_a (d_a x n) . w_a,

which every joint of a body measures to be 0. The turns are a Gaussian of 6 numbers that begins at
no turn and forgets within seconds. The displacement of the body as a whole that it leaves open is
added to the reported covariance.
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
"""Standard deviation of a camera's turn about each axis [rad]: a judgement about a camera that was
knocked."""
_LEAST_TURN_RAD = 0.014
"""Turn of both cameras together from which they count as misaligned [rad]; half of it keeps them
so."""
_LEAST_EVIDENCE = 16.0
"""Twice the log-likelihood that the turns must explain for that; half of it keeps them so."""
_MOST_TURN_RAD = 0.14
"""Turn above which the lines of sight are those of different people [rad]."""
_MEETING = 3.0
"""Median squared gap, in variances, below which the lines of sight of a body meet."""
_FORGETS = 0.1
"""Share of `Pair.meeting_share` that one update replaces."""
_LEAST_SHARE = 0.5
"""Share of the last updates in which lines must meet for cameras to count as misaligned."""
_LEAST_SHARE_MISALIGNED = 0.3
"""Share that keeps them so; the share before the first update."""
_KEPT = 0.99
"""Share of the information that an update leaves."""
_WEIGHT = 1 / 12
"""Weight of an update: errors of a detector last for about twelve."""
_PASSING_M = 0.03
"""Standard deviation of the gap between two lines of sight for other reasons than noise [m]."""
_TAIL = 4.0
"""Squared gap, in medians, that has half its weight."""


@kernel(makes_arrays=True)
def check_pair_calibration(worker: WorkerHypotheses, frame: Frame, settings: Settings) -> None:
    """Check whether two cameras that alone see a worker are misaligned; if so, start over.

    Where a third camera sees the worker, the two are taken as calibrated: a detector's errors of
    one kind look like a turn before long.

    Args:
        worker: the hypotheses of one worker, changed in place.
        frame: the measurements; its projections are set to those of the turned cameras.
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
    """Return whether a track may begin with two cameras turned.

    Where turned cameras leave open where a body is, as nearly opposite ones do, a present track
    stays.

    Args:
        tree: the worker's heaviest hypothesis; its displacement is overwritten.
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

    The last two of them are written to `cameras` (2,).
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
    """Learn the turns of two cameras from the gaps between their lines of sight.

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
    """Put a pair back to cameras of which nothing was measured."""
    pair.information[:], pair.score[:], pair.turn[:] = 0.0, 0.0, 0.0
    pair.meeting_share, pair.is_misaligned = _LEAST_SHARE_MISALIGNED, False
    pair.untracked_updates = 0


@kernel
def _has_turned(pair: Pair) -> bool:
    """Return whether two cameras show that they are turned."""
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
    """Measure the gaps between two cameras' lines of sight, for the present turns.

    Slopes are those at the tracked body: at the lines themselves they would share the gaps' noise,
    which adds up to a turn.

    Args:
        tree: the worker's heaviest hypothesis, with the pair of cameras.
        frame: the measurements.
        rows: (J, 6) receives the slopes of the gaps on the turns [m/rad].
        gap: (J,) receives the gaps [m].
        variance: (J,) receives their variances [m^2].

    Returns:
        The number of joints that both cameras measured; as many rows are written.
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
    """Write the unit normal (3,) of two lines."""
    cross(one, other, out)
    length = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    for i in range(3):
        out[i] /= length


@kernel
def cross(a: Floats, b: Floats, out: Floats) -> None:
    """Write the cross product of two vectors (3,); `out` may be one of them."""
    x, y = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0], out[1] = x, y


@kernel(makes_arrays=True)
def turn_camera(camera: Camera, turn: Floats, out: Floats) -> None:
    """Write the projection (3, 4) of a camera turned about its centre by a rotation vector (3,)."""
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
    """Write the covariance of a body's displacement that the cameras' uncertain turns leave.

    The point that two cameras triangulate follows their turns w_c with the slope
    (sum M_c)^-1 M_c [d_c r_c]x', M_c = (1 - d_c d_c') / r_c^2.

    Args:
        pair: the two cameras with the covariance of their turns.
        cameras: (C,) cameras of the rig.
        body: (J, 6) positions and velocities.
        out: (3, 3) receives the covariance [m^2].
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
    """Write `frame.P`, the cameras of the rig with the turns of a misaligned pair."""
    for c in range(len(frame.P)):
        for i in range(3):
            for k in range(4):
                frame.P[c, i, k] = frame.cameras[c].P[i, k]
    if pair.is_misaligned:
        for k in range(2):
            c: int = pair.cameras[k]
            turn_camera(frame.cameras[c], pair.turn[3 * k : 3 * k + 3], frame.P[c])
