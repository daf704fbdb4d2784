"""Acquisition: a track begins, is repaired and is given up, where views agree.

Two cameras that name sides alike triangulate limbs; two that do not meet nowhere, unless one's
sides are exchanged. That splits the cameras in two camps before there is a body; which of them is
right is decided by their numbers and by the body that they show: the nose and the toes are in
front.

`frame` is `measurements.Frame`, `s` are `settings.Settings`, `tree` is a record of `TREE`.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR
from hrc_env.geometry.triangulation import consensus_point, linear_point, misfit
from hrc_env.tracking.measurements import mirror
from hrc_env.tracking.tree.evidence import anatomy, find_heading
from hrc_env.tracking.tree.gaussian import PARENT, is_positive_definite
from hrc_env.tracking.tree.report import forget_pace
from hrc_env.tracking.tree.state import STANDING_M

WIDEST_STD_M = 0.5
"""A triangulated joint that is less certain than this is no find [m]."""
_GUESS_STD_M, _GUESS_STD_WITHOUT_HEADING_M = 0.3, 0.6
_MIRROR = tuple(int(j) for j in MIRROR)
_SWAP_COST = 4.0
"""Negative log-probability that one camera exchanges left and right."""
_MOST, _FITS = 5.0, 0.4
"""No joint counts for more [nat]; where joints miss by more than this share of it, however they are
called, two cameras tell nothing of each other: one may hang askew."""
_FOUND_SPEED_STD_M_S = 1.0
_FURTHEST_STD = 8.0
"""A body further than this many prior deviations from the prior has been lost."""


@kernel(makes_arrays=True)
def start_track(own, frame, s):
    """Begin a track where two views agree on a worker; whether they did."""
    tree = own.trees[0]
    if not acquire(tree, frame, s):
        return False
    tree.slope[:], tree.waited, tree.size_std, own.n_alive[0] = 0.0, 0, 0.0, 1
    tree.log_weight, tree.pose_log_prior, tree.pair.waited = 0.0, 0.0, 0
    forget_pace(own.pace[0])
    return True


@kernel(makes_arrays=True)
def acquire(tree, frame, s):
    """Start a track when two views agree on enough joints; whether one was started."""
    n_joints = len(tree.body)
    points, spread = np.empty((n_joints, 3)), np.empty((n_joints, 3, 3))
    found = np.empty(n_joints, np.bool_)
    if not find_body(frame, s, points, spread, found):
        return False
    for j in range(n_joints):
        place(tree.body[j], tree.cov[j], points[j], spread[j])
        if found[j]:
            tree.age_s[j] = 0.0
    tree.tracked = True
    return True


@kernel(makes_arrays=True)
def place(body, cov, point, spread):
    """Put a joint at rest at a point."""
    body[:3], body[3:] = point, 0.0
    cov[:] = 0.0
    cov[:3, :3] = spread
    for i in range(3):
        cov[3 + i, 3 + i] = _FOUND_SPEED_STD_M_S**2


@kernel(makes_arrays=True)
def find_body(frame, s, points, cov, found):
    """Find joints on which two views agree, and guess the others; whether there are enough.

    Fills points (J, 3), cov (J, 3, 3) and which joints were found (J,).
    """
    use = np.empty(len(frame.P), np.bool_)
    for j in range(len(points)):
        cov[j] = 1.0
        found[j] = _triangulate_agreed(frame, j, s, points[j], cov[j], use) >= 2
    if keep_one_body(points, cov, found, s.body_radius_m) < s.acquire_min_joints:
        return False
    complete_body(points, cov, found)
    return True


@kernel(makes_arrays=True)
def find_again(frame, j, s, middle, point, cov):
    """Fill `point` (3,) and `cov` (3, 3) of joint j, if two views agree near the body's middle."""
    use = np.empty(len(frame.P), np.bool_)
    if _triangulate_agreed(frame, j, s, point, cov, use) < 2:
        return False
    widest = max(cov[0, 0], cov[1, 1], cov[2, 2])
    return widest < WIDEST_STD_M**2 and distance(point, middle) < s.body_radius_m


@kernel(makes_arrays=True)
def _triangulate_agreed(frame, j, s, point, cov, use):
    z, sigma, ok = frame.z[j], frame.sigma[j], frame.ok[j]
    return consensus_point(frame.P, z, sigma, ok, s.gate_sigma, point, cov, use)


@kernel(makes_arrays=True)
def keep_one_body(points, cov, found, radius):
    """Drop points that are too uncertain, or not near the others as a body's are; how many stay."""
    middle, n_found = np.empty(3), 0
    for j in range(len(points)):
        widest = max(cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2])
        found[j] = found[j] and widest < WIDEST_STD_M**2
        n_found += found[j]
    if n_found == 0 or not middle_of(points, found, middle):
        return 0
    for j in range(len(points)):
        if found[j] and not distance(points[j], middle) < radius:
            found[j] = False
            n_found -= 1
    return n_found


@kernel(makes_arrays=True)
def middle_of(points, among, out):
    """Median of the points `among`, axis by axis; False if there is none."""
    values = np.empty(len(points))
    for i in range(3):
        n = 0
        for j in range(len(points)):
            if among[j]:
                values[n] = points[j, i]
                n += 1
        if n == 0:
            return False
        out[i] = np.median(values[:n])
    return True


@kernel
def distance(a, b):
    """Euclidean distance of two points."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@kernel(makes_arrays=True)
def complete_body(points, cov, found):
    """Guess the joints that were not found, from a standing body turned as the torso is."""
    cos, sin, known = find_heading(points, found[1] and found[2], found[7] and found[8])
    root, n_found = np.zeros(3), 0
    for j in range(len(points)):
        if found[j]:
            forward, left, up = STANDING_M[j]
            root[0] += points[j, 0] - (cos * forward - sin * left)
            root[1] += points[j, 1] - (sin * forward + cos * left)
            root[2] += points[j, 2] - up
            n_found += 1
    root /= n_found
    std = _GUESS_STD_M if known else _GUESS_STD_WITHOUT_HEADING_M
    for j in range(len(points)):
        if not found[j]:
            forward, left, up = STANDING_M[j]
            points[j, 0] = root[0] + cos * forward - sin * left
            points[j, 1] = root[1] + sin * forward + cos * left
            points[j, 2] = root[2] + up
            cov[j] = np.eye(3) * std**2


@kernel(makes_arrays=True)
def agree_on_sides(frame, s):
    """Mirror, in place, what was seen by cameras that exchange left and right."""
    n_cameras, n_joints = len(frame.P), len(_MIRROR)
    gain = np.zeros((n_cameras, n_cameras))
    for a in range(n_cameras):
        for b in range(a):
            gain[a, b] = gain[b, a] = _gain(frame, a, b)
    other = _camps(gain)
    n_other = other.sum()
    if n_other == 0:
        return
    for c in range(n_cameras):
        if other[c]:
            mirror(c, frame.z, frame.sigma, frame.ok)
    points, found = np.empty((n_joints, 3)), np.empty(n_joints, np.bool_)
    if not find_body(frame, s, points, np.empty((n_joints, 3, 3)), found):
        return
    turned, n_seeing = np.empty((n_joints, 3)), 0
    for j in range(n_joints):
        turned[_MIRROR[j]] = points[j]
    for c in range(n_cameras):
        n_seeing += frame.ok[:, c].any()
    fewer = _SWAP_COST * (n_seeing - 2 * n_other)
    if anatomy(turned) > anatomy(points) + fewer:
        for c in range(n_cameras):
            mirror(c, frame.z, frame.sigma, frame.ok)


@kernel(makes_arrays=True)
def _camps(gain):
    """(C,) which cameras name sides otherwise than the rest, the fewer: gain (C, C) is what two
    cameras' misfit falls by if one of them is mirrored."""
    other = gain[0] > _SWAP_COST
    for _ in range(len(gain)):
        best, most = -1, 0.0
        for c in range(len(gain)):
            more = -_SWAP_COST * (1.0 - 2.0 * other[c])
            for d in range(len(gain)):
                more += gain[c, d] if other[c] == other[d] else -gain[c, d]
            if more > most:
                best, most = c, more
        if best < 0:
            break
        other[best] = not other[best]
    if 2 * other.sum() > len(gain):
        for c in range(len(gain)):
            other[c] = not other[c]
    return other


@kernel(makes_arrays=True)
def _gain(frame, a, b):
    """By how much [nat] limbs fit better in two cameras if one of them is mirrored."""
    as_they_are, n_joints = _misfit(frame, a, b, False)
    exchanged, _ = _misfit(frame, a, b, True)
    fits = min(as_they_are, exchanged) < _FITS * _MOST * n_joints
    return as_they_are - exchanged if fits else 0.0


@kernel(makes_arrays=True)
def _misfit(frame, a, b, mirrored):
    """Negative log-likelihood [nat] of limbs' joints in two cameras, and how many there are."""
    total, n_joints = 0.0, 0
    use, z, point = np.zeros(len(frame.P), np.bool_), np.empty((len(frame.P), 2)), np.empty(3)
    use[a] = use[b] = True
    for j in range(len(_MIRROR)):
        i = _MIRROR[j] if mirrored else j
        if _MIRROR[j] == j or not (frame.ok[j, a] and frame.ok[i, b]):
            continue
        z[a], z[b] = frame.z[j, a], frame.z[i, b]
        miss = _MOST
        if linear_point(frame.P, z, use, point):
            miss = 0.5 * misfit(frame.P[a], z[a, 0], z[a, 1], frame.sigma[j, a], point)
            miss += 0.5 * misfit(frame.P[b], z[b, 0], z[b, 1], frame.sigma[i, b], point)
        total += min(miss, _MOST)
        n_joints += 1
    return total, n_joints


@kernel
def recover(tree, frame, s, work):
    """Find joints or the whole body again where the views say so; notice a body that is lost."""
    placed = work.placed
    placed[:] = acquire_anew(tree, frame, s)
    find_joints_again(tree, frame, s, placed)
    for j in range(len(placed)):
        if placed[j] or (PARENT[j] >= 0 and placed[PARENT[j]]):
            tree.slope[j] = 0.0
    if not check(tree, s):
        tree.slope[:] = 0.0


@kernel(makes_arrays=True)
def find_joints_again(tree, frame, s, placed):
    """Put joints where two views have seen them for a while; `placed` (J,) says which."""
    everyone, middle = np.ones(len(placed), np.bool_), np.empty(3)
    point, spread = np.empty(3), np.empty((3, 3))
    for j in range(len(placed)):
        if tree.conflict[j] < s.conflict_frames:
            continue
        middle_of(tree.body, everyone, middle)
        if find_again(frame, j, s, middle, point, spread):
            place(tree.body[j], tree.cov[j], point, spread)
            tree.age_s[j], tree.conflict[j], placed[j] = 0.0, 0, True


@kernel
def acquire_anew(tree, frame, s):
    """Start over when the views have long agreed on another body; whether that happened."""
    n_wrong = 0
    for j in range(len(tree.conflict)):
        n_wrong += tree.conflict[j] >= s.conflict_frames
    if n_wrong < s.acquire_min_joints or not acquire(tree, frame, s):
        return False
    tree.conflict[:] = 0
    return True


@kernel
def check(tree, s):
    """Keep covariances positive definite, lose a body that has left the world; was all well?"""
    body, cov, inside, well = tree.body, tree.cov, True, True
    for j in range(len(body)):
        if not is_positive_definite(cov[j]):
            well = False
            for i in range(6):
                variance = cov[j, i, i]
                cov[j, i, :], cov[j, :, i] = 0.0, 0.0
                cov[j, i, i] = max(variance, 1e-4)
        away = distance(body[j], s.prior_mean_world)
        variances, numbers = 0.0, 0.0
        for i in range(6):
            variances += cov[j, i, i]  # where these are finite, what lies between them is
            numbers += body[j, i]
        inside &= away < _FURTHEST_STD * s.prior_std_m and math.isfinite(variances + numbers)
    if inside:
        return well
    _lose(tree, s)
    return False


@kernel
def _lose(tree, s):
    """Put a worker who has left the world back to the prior."""
    body, cov = tree.body, tree.cov
    tree.tracked = False
    for j in range(len(body)):
        tree.age_s[j] = s.max_age_s
        for i in range(6):
            body[j, i] = s.prior_mean_world[i] if i < 3 else 0.0
            for k in range(6):
                cov[j, i, k] = s.prior_std_m**2 if i == k else 0.0
