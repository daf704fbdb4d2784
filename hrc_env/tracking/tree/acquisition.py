"""Initialization, repair and termination of tracks, based on bodies on which views agree.

The lines of sight of two cameras meet at the limbs only if both cameras label left and right alike.
This divides the cameras into two groups before a body is known. The sizes of the groups, and the
position of nose and toes in front of the body, decide which group labels the sides correctly.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.triangulation import consensus_point, linear_point, misfit
from hrc_env.tracking.measurements import Frame, mirror
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.evidence import find_heading_from, score_pose
from hrc_env.tracking.tree.gaussian import PARENT, is_positive_definite
from hrc_env.tracking.tree.report import forget_pace
from hrc_env.tracking.tree.state import STANDING_M, Tree, Work, WorkerHypotheses

_LEAST_VARIANCE = 1e-4
"""Lower bound on the variances of a repaired joint [m^2, m^2/s^2]."""
WIDEST_STD_M = 0.5
"""Standard deviation above which a triangulated joint is not used [m]."""
_GUESS_STD_M = 0.3
"""Standard deviation of the position of a joint guessed from a body of known heading [m]."""
_GUESS_STD_WITHOUT_HEADING_M = 0.6
"""Standard deviation of the position of a joint guessed from a body of unknown heading [m]."""
_MIRROR = tuple(int(j) for j in MIRROR)
_SWAP_COST = 4.0
"""Negative log-probability that a camera swaps left and right labels [nat]."""
_MOST = 5.0
"""Upper bound of the misfit of one joint [nat]."""
_FITS = 0.4
"""Mean misfit, relative to its upper bound, above which two cameras are not compared. One of them
may be rotated relative to its calibration."""
_FOUND_SPEED_STD_M_S = 1.0
"""Standard deviation of the speed of a joint that has just been acquired [m/s]."""
_FURTHEST_STD = 8.0
"""Distance from the prior mean beyond which a track is dropped, in prior standard deviations."""


class Misfit(NamedTuple):
    """Misfit between the lines of sight of two cameras."""

    total: float
    """Negative log-likelihood, summed over the joints [nat]."""
    n_joints: int
    """Number of joints that both cameras measured."""


@kernel(makes_arrays=True)
def start_track(worker: WorkerHypotheses, frame: Frame, settings: Settings) -> bool:
    """Start a track if two views agree on a worker, and return whether they do.

    Args:
        worker: the hypotheses about one worker, replaced by a single one.
        frame: the measurements.
        settings: settings of the estimator.
    """
    tree = worker.trees[0]
    if not acquire(tree, frame, settings):
        return False
    tree.slope[:], tree.one_view_updates, tree.size_std, worker.n_alive[0] = 0.0, 0, 0.0, 1
    tree.log_weight, tree.pose_log_prior, tree.pair.untracked_updates = 0.0, 0.0, 0
    forget_pace(worker.pace[0])
    return True


@kernel(makes_arrays=True)
def acquire(tree: Tree, frame: Frame, settings: Settings) -> bool:
    """Set a tree to the body on which two views agree, if any, and return whether they do."""
    n_joints = len(tree.body)
    points, spread = np.empty((n_joints, 3)), np.empty((n_joints, 3, 3))
    found = np.empty(n_joints, np.bool_)
    if not find_body(frame, settings, points, spread, found):
        return False
    for j in range(n_joints):
        _place_joint(tree.body[j], tree.cov[j], points[j], spread[j])
        if found[j]:
            tree.age_s[j] = 0.0
    tree.tracked = True
    return True


@kernel(makes_arrays=True)
def _place_joint(body: Floats, cov: Floats, point: Floats, spread: Floats) -> None:
    """Set a joint to a position at rest.

    Args:
        body: (6,) position and velocity, filled in.
        cov: (6, 6) covariance of position and velocity, filled in.
        point: (3,) the position [m].
        spread: (3, 3) covariance of the position [m^2].
    """
    body[:3], body[3:] = point, 0.0
    cov[:] = 0.0
    cov[:3, :3] = spread
    for i in range(3):
        cov[3 + i, 3 + i] = _FOUND_SPEED_STD_M_S**2


@kernel(makes_arrays=True)
def find_body(frame: Frame, settings: Settings, points: Floats, cov: Floats, found: Bools) -> bool:
    """Triangulate the joints on which two views agree, and guess the others.

    Args:
        frame: the measurements.
        settings: settings of the estimator.
        points: (J, 3) positions [m], filled in.
        cov: (J, 3, 3) covariances of the positions [m^2], filled in.
        found: (J,) mask of the triangulated joints, filled in.

    Returns:
        Whether enough joints were triangulated for a body.
    """
    use = np.empty(len(frame.P), np.bool_)
    for j in range(len(points)):
        cov[j] = 1.0
        found[j] = _triangulate(frame, j, settings, points[j], cov[j], use) >= 2
    if keep_one_body(points, cov, found, settings.body_radius_m) < settings.acquire_min_joints:
        return False
    complete_body(points, cov, found)
    return True


@kernel(makes_arrays=True)
def find_again(
    frame: Frame, j: int, settings: Settings, middle: Floats, point: Floats, cov: Floats
) -> bool:
    """Triangulate one joint if two views agree on a position near the centre of the body.

    Args:
        frame: the measurements.
        j: index of the joint.
        settings: settings of the estimator.
        middle: (3,) centre of the body [m].
        point: (3,) position [m], filled in.
        cov: (3, 3) covariance of the position [m^2], filled in.

    Returns:
        Whether two views agree on such a position.
    """
    use = np.empty(len(frame.P), np.bool_)
    if _triangulate(frame, j, settings, point, cov, use) < 2:
        return False
    widest = max(cov[0, 0], cov[1, 1], cov[2, 2])
    return widest < WIDEST_STD_M**2 and distance(point, middle) < settings.body_radius_m


@kernel(makes_arrays=True)
def _triangulate(
    frame: Frame, j: int, settings: Settings, point: Floats, cov: Floats, use: Bools
) -> int:
    """Triangulate one joint; return the number of agreeing views and mark them in `use` (C,)."""
    z, sigma, ok = frame.z[j], frame.sigma[j], frame.ok[j]
    return consensus_point(frame.P, z, sigma, ok, settings.gate_sigma, point, cov, use)


@kernel(makes_arrays=True)
def keep_one_body(points: Floats, cov: Floats, found: Bools, radius_m: float) -> int:
    """Drop joints that are too uncertain or too far from the others; return how many remain.

    Args:
        points: (J, 3) positions [m].
        cov: (J, 3, 3) covariances of the positions [m^2].
        found: (J,) mask of the joints that are used, changed in place.
        radius_m: largest distance of a joint from the centre of the body [m].
    """
    middle, n_found = np.empty(3), 0
    for j in range(len(points)):
        widest = max(cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2])
        found[j] = found[j] and widest < WIDEST_STD_M**2
        n_found += found[j]
    if n_found == 0 or not find_middle(points, found, middle):
        return 0
    for j in range(len(points)):
        if found[j] and not distance(points[j], middle) < radius_m:
            found[j] = False
            n_found -= 1
    return n_found


@kernel(makes_arrays=True)
def find_middle(points: Floats, among: Bools, out: Floats) -> bool:
    """Compute the median of some points on each axis; return whether there are any points.

    Args:
        points: (J, 3+) positions [m].
        among: (J,) mask of the points that are used.
        out: (3,) median [m], filled in.
    """
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
def distance(a: Floats, b: Floats | tuple[float, float, float]) -> float:
    """Return the Euclidean distance between two points (3+,)."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@kernel(makes_arrays=True)
def complete_body(points: Floats, cov: Floats, found: Bools) -> None:
    """Guess missing joints from a standing body with the heading of the torso.

    Args:
        points: (J, 3) positions [m], filled in for missing joints.
        cov: (J, 3, 3) covariances of the positions [m^2], filled in for missing joints.
        found: (J,) mask of the joints that are not missing.
    """
    heading = find_heading_from(points, found[1] and found[2], found[7] and found[8])
    cos, sin = heading.cos, heading.sin
    root, n_found = np.zeros(3), 0
    for j in range(len(points)):
        if found[j]:
            forward, left, up = STANDING_M[j]
            root[0] += points[j, 0] - (cos * forward - sin * left)
            root[1] += points[j, 1] - (sin * forward + cos * left)
            root[2] += points[j, 2] - up
            n_found += 1
    root /= n_found
    std = _GUESS_STD_M if heading.is_known else _GUESS_STD_WITHOUT_HEADING_M
    for j in range(len(points)):
        if not found[j]:
            forward, left, up = STANDING_M[j]
            points[j, 0] = root[0] + cos * forward - sin * left
            points[j, 1] = root[1] + sin * forward + cos * left
            points[j, 2] = root[2] + up
            cov[j] = np.eye(3) * std**2


@kernel(makes_arrays=True)
def agree_on_sides(frame: Frame, settings: Settings) -> None:
    """Correct the measurements of cameras with swapped left and right labels, in place."""
    n_cameras, n_joints = len(frame.P), len(_MIRROR)
    gain = np.zeros((n_cameras, n_cameras))
    for a in range(n_cameras):
        for b in range(a):
            gain[a, b] = gain[b, a] = _measure_mirroring_gain(frame, a, b)
    other = _find_camp(gain)
    n_other = other.sum()
    if n_other == 0:
        return
    for c in range(n_cameras):
        if other[c]:
            mirror(c, frame.z, frame.sigma, frame.ok)
    points, found = np.empty((n_joints, 3)), np.empty(n_joints, np.bool_)
    if not find_body(frame, settings, points, np.empty((n_joints, 3, 3)), found):
        return
    turned, n_seeing = np.empty((n_joints, 3)), 0
    for j in range(n_joints):
        turned[_MIRROR[j]] = points[j]
    for c in range(n_cameras):
        n_seeing += frame.ok[:, c].any()
    fewer = _SWAP_COST * (n_seeing - 2 * n_other)
    if score_pose(turned) > score_pose(points) + fewer:
        for c in range(n_cameras):
            mirror(c, frame.z, frame.sigma, frame.ok)


@kernel(makes_arrays=True)
def _find_camp(gain: Floats) -> Bools:
    """Return a mask (C,) of the minority of cameras that label left and right unlike the others.

    `gain` (C, C) is the decrease of the misfit of each pair of cameras if one of the two is
    mirrored [nat].
    """
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
def _measure_mirroring_gain(frame: Frame, a: int, b: int) -> float:
    """Return the decrease of the misfit of cameras `a` and `b` if one of them is mirrored [nat]."""
    direct, exchanged = _measure_misfit(frame, a, b, False), _measure_misfit(frame, a, b, True)
    is_fitting = min(direct.total, exchanged.total) < _FITS * _MOST * direct.n_joints
    return direct.total - exchanged.total if is_fitting else 0.0


@kernel(makes_arrays=True)
def _measure_misfit(frame: Frame, a: int, b: int, is_mirrored: bool) -> Misfit:
    """Return the misfit between two cameras over all joints that occur on both sides of the body.

    Args:
        frame: the measurements.
        a: index of the first camera.
        b: index of the second camera.
        is_mirrored: whether to swap left and right of the second camera.
    """
    total, n_joints = 0.0, 0
    use, z, point = np.zeros(len(frame.P), np.bool_), np.empty((len(frame.P), 2)), np.empty(3)
    use[a] = use[b] = True
    for j in range(len(_MIRROR)):
        i = _MIRROR[j] if is_mirrored else j
        if _MIRROR[j] == j or not (frame.ok[j, a] and frame.ok[i, b]):
            continue
        z[a], z[b] = frame.z[j, a], frame.z[i, b]
        miss = _MOST
        if linear_point(frame.P, z, use, point):
            miss = 0.5 * misfit(frame.P[a], z[a, 0], z[a, 1], frame.sigma[j, a], point)
            miss += 0.5 * misfit(frame.P[b], z[b, 0], z[b, 1], frame.sigma[i, b], point)
        total += min(miss, _MOST)
        n_joints += 1
    return Misfit(total, n_joints)


@kernel
def recover(tree: Tree, frame: Frame, settings: Settings, work: Work) -> None:
    """Reacquire joints or the whole body where views contradict the estimate; end invalid tracks.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays.
    """
    is_placed = work.is_placed
    is_placed[:] = _acquire_anew(tree, frame, settings)
    _find_joints_again(tree, frame, settings, is_placed)
    for j in range(len(is_placed)):
        if is_placed[j] or (PARENT[j] >= 0 and is_placed[PARENT[j]]):
            tree.slope[j] = 0.0
    if not _repair(tree, settings):
        tree.slope[:] = 0.0


@kernel(makes_arrays=True)
def _find_joints_again(
    tree: Tree, frame: Frame, settings: Settings, is_placed: NDArray[np.int8]
) -> None:
    """Reacquire joints that views have contradicted for `conflict_frames` updates.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements.
        settings: settings of the estimator.
        is_placed: (J,) flags, set to 1 for the reacquired joints.
    """
    everything, middle = np.ones(len(is_placed), np.bool_), np.empty(3)
    point, spread = np.empty(3), np.empty((3, 3))
    for j in range(len(is_placed)):
        if tree.conflict[j] < settings.conflict_frames:
            continue
        find_middle(tree.body, everything, middle)
        if find_again(frame, j, settings, middle, point, spread):
            _place_joint(tree.body[j], tree.cov[j], point, spread)
            tree.age_s[j], tree.conflict[j], is_placed[j] = 0.0, 0, True


@kernel
def _acquire_anew(tree: Tree, frame: Frame, settings: Settings) -> bool:
    """Reacquire the whole body if enough joints are contradicted; return whether this succeeds."""
    n_wrong = 0
    for j in range(len(tree.conflict)):
        n_wrong += tree.conflict[j] >= settings.conflict_frames
    if n_wrong < settings.acquire_min_joints or not acquire(tree, frame, settings):
        return False
    tree.conflict[:] = 0
    return True


@kernel
def _repair(tree: Tree, settings: Settings) -> bool:
    """Repair covariances that are not positive definite, and reset an implausible body.

    Such a covariance is replaced by its diagonal. If any joint is not finite, or more than
    `_FURTHEST_STD` standard deviations of the prior away from its mean, all joints are reset to the
    prior, at rest, and the track is lost.

    Args:
        tree: the hypothesis, changed in place: `body` (J, 6) positions [m] and velocities [m/s] in
            the world frame, `cov` (J, 6, 6) covariances of both.
        settings: mean and standard deviation of the prior position, and maximum age.

    Returns:
        True if nothing had to be changed.
    """
    states, covariances = tree.body, tree.cov
    prior_mean, prior_std_m = settings.prior_mean_world, settings.prior_std_m
    is_inside, is_proper = True, True
    for j in range(len(states)):
        if not is_positive_definite(covariances[j]):
            is_proper = False
            for i in range(6):
                variance = covariances[j, i, i]
                covariances[j, i, :], covariances[j, :, i] = 0.0, 0.0
                covariances[j, i, i] = max(variance, _LEAST_VARIANCE)
        from_prior_m = distance(states[j], prior_mean)
        variance_sum, state_sum = 0.0, 0.0
        for i in range(6):
            variance_sum += covariances[j, i, i]  # if finite, all covariances of the joint are
            state_sum += states[j, i]
        is_near = from_prior_m < _FURTHEST_STD * prior_std_m
        is_inside &= is_near and math.isfinite(variance_sum + state_sum)
    if is_inside:
        return is_proper
    tree.tracked = False
    for j in range(len(states)):
        tree.age_s[j] = settings.max_age_s
        for i in range(6):
            states[j, i] = prior_mean[i] if i < 3 else 0.0
            for k in range(6):
                covariances[j, i, k] = prior_std_m**2 if i == k else 0.0
    return False
