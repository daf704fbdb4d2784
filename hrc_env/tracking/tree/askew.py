"""Two cameras of which one hangs askew: the turns by which their lines of sight meet.

Two lines of sight with unit directions d_a, d_b from e_a, e_b, nearest to each other at distances
r_a, r_b, pass each other at g = n . (e_b - e_a), n = d_a x d_b / |d_a x d_b|. Small turns w_a, w_b
of the cameras about their centres change that to

    g + r_b (d_b x n) . w_b - r_a (d_a x n) . w_a,

which every joint of a body measures to be 0. The turns are a Gaussian of 6 numbers that begins at
no turn and forgets within seconds. What it leaves open is how far off the body may be as a whole.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.lines_of_sight import CAMERA, look, model_cameras, nearest_places
from hrc_env.geometry.triangulation import inverse3
from hrc_env.tracking.tree.acquisition import WIDEST_STD_M, start_track
from hrc_env.tracking.tree.gaussian import invert, multiply, multiply_transposed

TURN_STD_RAD = 0.05
"""Of a camera that was knocked, about each axis: a judgement."""
_LEAST_TURN_RAD, _LEAST_EVIDENCE = 0.014, 16.0
"""Two cameras whose turns are smaller together, or explain less (twice the log-likelihood), are not
askew; those that were stay so down to half as much."""
_MOST_TURN_RAD, _MEETING, _FORGETS, _FITS, _FITTED = 0.14, 3.0, 0.1, 0.5, 0.3
"""What has to be turned by more is not one body, nor is what leaves larger gaps (their median
square, in variances): of the last updates, an average that forgets so much with each, this share
has to fit, and this one of those that count as askew."""
_KEPT, _SHARE = 0.99, 1 / 12
"""Share of what is known that an update leaves; what an update counts for: errors of a detector
last for twelve."""
_PASSING_M, _TAIL = 0.03, 4.0
"""Lines of sight may pass each other at this distance [m] for other reasons than noise; squares so
many times the median have half their weight."""


@kernel(makes_arrays=True)
def check_pair_calibration(own, frame, s):
    """Check whether two cameras that alone see a worker hang askew; then start with them turned.

    Where a third one sees the worker, too, nothing is held against two: a detector's errors of one
    kind look like a turn before long.
    """
    tree, cameras = own.trees[0], np.zeros(2, np.int64)
    pair, n_views = tree.pair, count_views(frame, s.acquire_min_joints, cameras)
    if n_views == 2:
        compare(tree, cameras, frame, s.acquire_min_joints)
    elif n_views > 2:
        was_askew = pair.askew
        forget_turns(pair)
        if was_askew:
            aim_cameras(pair, frame)
            start_track(own, frame, s)
    if not tree.tracked:
        pair.waited = pair.waited + 1 if n_views == 2 else max(pair.waited - 1, 0)
    if pair.askew:
        pair.askew = hang_askew(pair)
    elif hang_askew(pair) and n_views == 2 and _may_be_turned(tree, frame.cameras, s):
        pair.askew = True
        aim_cameras(pair, frame)
        pair.askew = start_track(own, frame, s)
    tree.displaced_m2[:] = 0.0
    if pair.askew and tree.tracked:
        displacement(pair, frame.cameras, tree.body, tree.displaced_m2)


@kernel(makes_arrays=True)
def _may_be_turned(tree, cameras, s):
    """Whether a track may begin with two cameras turned: where these leave open where a body is, as
    nearly opposite ones do, whoever is followed already is better off without."""
    if not tree.tracked:
        return tree.pair.waited > s.wait_updates
    displacement(tree.pair, cameras, tree.body, tree.displaced_m2)
    return np.diag(tree.displaced_m2).max() < WIDEST_STD_M**2


@kernel
def count_views(frame, least_joints, cameras):
    """How many cameras show so many joints; the last two of them go to `cameras` (2,)."""
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
def compare(tree, cameras, frame, least_joints):
    """Learn the turns of two cameras, by number, from what they show now."""
    pair = tree.pair
    if pair.cameras[0] != cameras[0] or pair.cameras[1] != cameras[1]:
        forget_turns(pair)
        pair.cameras[0], pair.cameras[1] = cameras[0], cameras[1]
    n_joints = len(frame.ok)
    rows, gap, variance = np.empty((n_joints, 6)), np.empty(n_joints), np.empty(n_joints)
    n = _gaps(tree, frame, rows, gap, variance)
    if n < least_joints:
        return
    squares = gap[:n] ** 2 / variance[:n]
    usual = np.median(squares)
    pair.fits += _FORGETS * ((usual < _MEETING) - pair.fits)
    usual = max(usual, 1.0)
    pair.information[:] *= _KEPT
    pair.score[:] *= _KEPT
    for m in range(n):
        weight = _SHARE / (variance[m] * (usual + squares[m] / _TAIL))
        measured = -gap[m]
        for i in range(6):
            measured += rows[m, i] * pair.turn[i]
        for i in range(6):
            pair.score[i] += weight * rows[m, i] * measured
            for k in range(6):
                pair.information[i, k] += weight * rows[m, i] * rows[m, k]
    _solve(pair)


@kernel(makes_arrays=True)
def _solve(pair):
    precision = pair.information.copy()
    for i in range(6):
        precision[i, i] += TURN_STD_RAD**-2
    invert(precision, pair.turn_cov)
    for i in range(6):
        pair.turn[i] = 0.0
        for k in range(6):
            pair.turn[i] += pair.turn_cov[i, k] * pair.score[k]


@kernel(makes_arrays=True)
def forget_turns(pair):
    """Nothing is known of two cameras."""
    pair.information[:], pair.score[:], pair.turn[:] = 0.0, 0.0, 0.0
    pair.fits, pair.askew, pair.waited = _FITTED, False, 0


@kernel
def hang_askew(pair):
    """Whether two cameras show that they are turned."""
    squared, evidence, times = 0.0, 0.0, 0.5 if pair.askew else 1.0
    for i in range(6):
        squared += pair.turn[i] ** 2
        evidence += pair.turn[i] * pair.score[i]
    fits = pair.fits > (_FITTED if pair.askew else _FITS) and squared < _MOST_TURN_RAD**2
    return fits and squared > (times * _LEAST_TURN_RAD) ** 2 and evidence > times * _LEAST_EVIDENCE


@kernel(makes_arrays=True)
def _gaps(tree, frame, rows, gap, variance):
    """Gaps of the joints [m] as the cameras are turned now, their slopes on the turns [m/rad] and
    variances [m^2]; how many joints both see.

    Slopes are those at the body that is followed: at the lines themselves they would share the
    gaps' noise, which adds up to a turn.
    """
    pair, n = tree.pair, 0
    a, b = pair.cameras
    turned, cameras = np.empty((2, 3, 4)), np.empty(2, CAMERA)
    for k in range(2):
        turn_camera(frame.cameras[pair.cameras[k]], pair.turn[3 * k : 3 * k + 3], turned[k])
    model_cameras(turned, cameras)
    one, other, middle, normal = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for j in range(len(frame.ok)):
        if not (frame.ok[j, a] and frame.ok[j, b]):
            continue
        look(cameras[0].back, frame.z[j, a, 0], frame.z[j, a, 1], one)
        look(cameras[1].back, frame.z[j, b, 0], frame.z[j, b, 1], other)
        far_a, far_b, _ = nearest_places(cameras[0].eye, one, cameras[1].eye, other, middle)
        if not (far_a > 0.0 and far_b > 0.0):
            continue
        _normal(one, other, normal)
        gap[n] = 0.0
        for i in range(3):
            gap[n] += normal[i] * (cameras[1].eye[i] - cameras[0].eye[i])
        variance[n] = (frame.sigma[j, a] * far_a / cameras[0].focal) ** 2 + _PASSING_M**2
        variance[n] += (frame.sigma[j, b] * far_b / cameras[1].focal) ** 2
        for i in range(3):
            place = tree.body[j, i] if tree.tracked else middle[i]
            one[i], other[i] = place - cameras[0].eye[i], place - cameras[1].eye[i]
        _normal(one, other, normal)
        cross(normal, one, rows[n, :3])
        cross(other, normal, rows[n, 3:])
        n += 1
    return n


@kernel
def _normal(one, other, out):
    """The unit normal of two lines."""
    cross(one, other, out)
    length = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    for i in range(3):
        out[i] /= length


@kernel
def cross(a, b, out):
    """out = a x b."""
    x, y = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    out[0], out[1] = x, y


@kernel(makes_arrays=True)
def turn_camera(camera, turn, out):
    """Write the projection (3, 4) of a record of `CAMERA` that is turned about its centre."""
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
def displacement(pair, cameras, body, out):
    """How far off a body (J, 6) may be as a whole: covariance (3, 3) [m^2].

    The point that two cameras triangulate follows their turns w_c with the slope
    (sum M_c)^-1 M_c [d_c r_c]x', M_c = (1 - d_c d_c') / r_c^2.
    """
    total, inverse, own = np.zeros((3, 3)), np.empty((3, 3)), np.empty((2, 3, 3))
    slope, half, full = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 6))
    line, moved, axis, middle = np.empty((2, 3)), np.empty(3), np.zeros(3), np.zeros(3)
    for j in range(len(body)):
        for i in range(3):
            middle[i] += body[j, i] / len(body)
    for k in range(2):
        line[k] = middle - cameras[pair.cameras[k]].eye
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


@kernel(makes_arrays=True)
def aim_cameras(pair, frame):
    """Write the projections frame.P as the cameras are believed to hang for one worker."""
    for c in range(len(frame.P)):
        frame.P[c] = frame.cameras[c].P
    if pair.askew:
        for k in range(2):
            c = pair.cameras[k]
            turn_camera(frame.cameras[c], pair.turn[3 * k : 3 * k + 3], frame.P[c])
