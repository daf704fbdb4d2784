"""Search for alternative bodies that are hard to distinguish from the tracked one in one view.

In one view, a limb that points towards the camera looks almost like one that points away from it
(the bas-relief ambiguity). To find the alternative, a limb is reflected: its joints stay on their
rays, and their depths are reflected about the depth of a pivot. From there, a posterior mode is
searched for with the same prediction and frame. If the mode is several posterior standard
deviations from the existing ones and its evidence is not negligible, it becomes a hypothesis.

A whole body is rotated instead, because in one view a shoulder line that recedes looks like one
that approaches. The shoulders and hips of the alternative are reflected across the ray to the
body's centre. The alternative is not a mirror image, but the same body rotated, with nose and toes
in front again. Its covariance is reflected, because the uncertainty lies along the same ray.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Bools, Floats
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.evidence import (
    copy_slot,
    distance_between,
    find_heading,
    log_evidence,
    score_pose,
)
from hrc_env.tracking.tree.gaussian import multiply
from hrc_env.tracking.tree.learning import learn_lengths
from hrc_env.tracking.tree.search import find_pose_near, set_bone_variances
from hrc_env.tracking.tree.state import Tree, Work, WorkerHypotheses
from hrc_env.tracking.tree.update import condition_on_frame, correct_mean, update_tree

_LOG_LEAST_EVIDENCE = math.log(0.01)
"""Log-evidence, relative to that of the existing mode, below which a limb's other mode is
ignored."""
_MOST_PENALTY = 10.0
"""Negative log-probability above which a rotated body is not tried [nat]."""
_DISTINCT = 3.0
"""Distance from the existing hypotheses above which a mode is new, in posterior standard
deviations."""
_SEARCH_STEPS = 4
"""Number of Gauss-Newton steps in a search that starts from a reflected limb."""
_NEARER_M = 0.05
"""Maximum difference of each coordinate of the joints at which two modes are considered the same
[m]."""


class Part(NamedTuple):
    """A part of the body that may be reflected."""

    pivot: tuple[int, ...]
    """Indices of the joints of which the mean position is the pivot."""
    moved: tuple[int, ...]
    """Indices of the joints that are reflected."""


_PARTS = (
    Part(tuple(int(j) for j in TORSO), tuple(range(N_JOINTS))),  # the whole body
    Part((1,), (3, 5)),  # arms
    Part((2,), (4, 6)),
    Part((3,), (5,)),  # forearms
    Part((4,), (6,)),
    Part((7,), (9, 11, 13)),  # legs
    Part((8,), (10, 12, 14)),
    Part((9,), (11, 13)),  # shanks
    Part((10,), (12, 14)),
    Part((1, 2), (0,)),  # head
)
N_PARTS = len(_PARTS)
"""Number of parts that may be reflected."""
WHOLE_BODY = 0
"""Index of the part that is the whole body; the other parts are limbs and the head."""
_MOST_SEEN_TWICE = 2
"""Maximum number of joints seen by several cameras at which a body is considered seen by only
one."""
_TORSO = (1, 2, 7, 8)
_LEAST_TURN_RAD = 0.35
"""Angle between the headings of two bodies below which they are the same hypothesis [rad]."""


def _mark_joints(joints: list[tuple[int, ...]]) -> Bools:
    """Return a mask (n, J) of the joints in each of n groups."""
    table = np.zeros((len(joints), N_JOINTS), bool)
    for row, group in enumerate(joints):
        table[row, list(group)] = True
    return table


_PIVOT = _mark_joints([part.pivot for part in _PARTS])
_MOVED = _mark_joints([part.moved for part in _PARTS])


@kernel
def is_ambiguous(tree: Tree, frame: Frame, settings: Settings) -> bool:
    """Return whether the depth of any part of a predicted body is ambiguous in a single view."""
    ambiguous = False
    for part in range(N_PARTS):
        ambiguous = ambiguous or _find_ambiguous_view(part, tree, frame, settings) >= 0
    return ambiguous


@kernel
def _find_ambiguous_view(part: int, tree: Tree, frame: Frame, settings: Settings) -> int:
    """Return the only camera that sees a part if the part's depth is ambiguous, otherwise -1.

    The depth of a part that one camera sees is not ambiguous if recent measurements by other
    cameras still determine the predicted depth.

    Args:
        part: index of the part.
        tree: the predicted hypothesis.
        frame: the measurements.
        settings: settings of the estimator.
    """
    if not (settings.mirrors_body if part == WHOLE_BODY else settings.mirrors_limbs):
        return -1
    c = find_lone_camera(part, frame.ok)
    if c < 0:
        return -1
    depth_std = measure_depth_std(part, frame.cameras[c].eye, tree.body, tree.cov)
    return c if depth_std > settings.min_ambiguous_depth_std_m else -1


@kernel(makes_arrays=True)
def branch(
    worker: WorkerHypotheses,
    prior: Records1[Tree],
    evidence: float,
    frame: Frame,
    settings: Settings,
    work: Work,
) -> None:
    """Search for alternatives to the heaviest hypothesis, and add them to the hypotheses.

    Args:
        worker: the hypotheses about one worker, of which the first has been updated.
        prior: (1,) the first hypothesis before its update.
        evidence: log-evidence of the first hypothesis's update.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays.
    """
    trees = worker.trees
    for part in range(N_PARTS):
        n: int = worker.n_alive[0]
        camera = _find_ambiguous_view(part, prior[0], frame, settings) if n < len(trees) else -1
        if camera < 0:
            continue
        copy_slot(worker, 0, n)
        penalty = np.inf
        if part == WHOLE_BODY:
            penalty = _try_turned_body(trees, n, camera, prior, frame, settings, work)
        elif reflect(part, frame.cameras[camera].eye, trees[0].body, work.point):
            penalty = _search_mode(trees, n, prior[0], evidence, frame, settings, work)
        if penalty < np.inf:
            tree = trees[n]
            before = tree.pose_log_prior
            tree.pose_log_prior = settings.anatomy_exponent * score_pose(tree.body)
            tree.log_weight += tree.pose_log_prior - before - penalty
            worker.n_alive[0] = n + 1


@kernel(makes_arrays=True)
def _try_turned_body(
    trees: Records1[Tree],
    n: int,
    camera: int,
    prior: Records1[Tree],
    frame: Frame,
    settings: Settings,
    work: Work,
) -> float:
    """Set tree `n` to the body with the alternative heading, conditioned on the frame.

    Args:
        trees: (H,) the worker's hypotheses, of which tree `n` is a copy of the first.
        n: slot of the new hypothesis.
        camera: index of the only camera that sees the body.
        prior: (1,) the first hypothesis before its update.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays.

    Returns:
        Negative log-probability of the rotation [nat]; infinite if a hypothesis has this heading.
    """
    new, eye = trees[n], frame.cameras[camera].eye
    turn = find_other_turn(eye, prior[0].body)
    penalty = 0.5 * (turn / settings.turn_std_rad) ** 2
    if penalty > _MOST_PENALTY:
        return np.inf
    _restore_prediction(new, prior[0])
    turn_body(eye, turn, new.body, new.cov, new.slope)
    if _has_known_heading(trees, n):
        return np.inf
    condition_on_frame(new, prior, False, frame, settings, work)
    learn_lengths(new, work.n_views)
    return np.inf if _has_known_heading(trees, n) else penalty


@kernel(makes_arrays=True)
def _restore_prediction(tree: Tree, prior: Tree) -> None:
    """Restore the Gaussian of a tree before its update; bone lengths and offsets are unchanged."""
    tree.body[:], tree.cov[:], tree.slope[:] = prior.body, prior.cov, prior.slope


@kernel
def _has_known_heading(trees: Records1[Tree], n: int) -> bool:
    """Return whether tree `n` has the same heading as one of the trees before it."""
    alike = False
    for k in range(n):
        alike |= has_same_heading(trees[n].body, trees[k].body)
    return alike


@kernel(makes_arrays=True)
def _search_mode(
    trees: Records1[Tree],
    n: int,
    prior: Tree,
    evidence: float,
    frame: Frame,
    settings: Settings,
    work: Work,
) -> float:
    """Search for the posterior mode near a reflected limb, and set tree `n` to it.

    Args:
        trees: (H,) the worker's hypotheses, of which tree `n` is a copy of the first.
        n: slot of the new hypothesis.
        prior: the first hypothesis before its update.
        evidence: log-evidence of that update.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays; the search starts at `point`.

    Returns:
        0, or infinity if the search ends at an existing hypothesis or with negligible evidence.
    """
    new, known = trees[n], trees[0].body
    _restore_prediction(new, prior)
    set_bone_variances(new.bone_variance, settings.bone_variation_scale, work.bone_variance)
    find_pose_near(new, frame, settings, _SEARCH_STEPS, 0.0, work)
    moved = 0.0
    for j in range(len(known)):
        for i in range(3):
            moved = max(moved, abs(work.point[j, i] - known[j, i]))
    if not moved > _NEARER_M:
        return np.inf
    update_tree(new, work)
    if not log_evidence(prior, new, frame, settings, work) - evidence > _LOG_LEAST_EVIDENCE:
        return np.inf
    correct_mean(new, frame, settings, work)
    learn_lengths(new, work.n_views)
    for k in range(n):
        if not distance_between(trees[k], new, work) > _DISTINCT**2:
            return np.inf
    return 0.0


@kernel
def find_lone_camera(part: int, ok: Bools) -> int:
    """Return the index of the only camera that sees a part of the body, or -1 if there is none.

    Args:
        part: index of the part.
        ok: (J, C) mask of the joints that each camera measured.
    """
    n_cameras, seen_twice, best, most = ok.shape[1], 0, -1, 0
    for c in range(n_cameras):
        n = 0
        for j in range(len(ok)):
            n += _MOVED[part, j] and ok[j, c]
        if n > most:
            best, most = c, n
    for j in range(len(ok)):
        n_views = 0
        for c in range(n_cameras):
            n_views += ok[j, c]
        seen_twice += _MOVED[part, j] and n_views > 1
    return best if seen_twice <= (_MOST_SEEN_TWICE if part == WHOLE_BODY else 0) else -1


@kernel(makes_arrays=True)
def measure_depth_std(part: int, eye: Floats, body: Floats, cov: Floats) -> float:
    """Return the smallest standard deviation of a part's joints along their rays [m].

    Args:
        part: index of the part.
        eye: (3,) optical centre of the camera [m].
        body: (J, 6) positions and velocities.
        cov: (J, 6, 6) covariances of positions and velocities.
    """
    ray, least = np.empty(3), np.inf
    for j in range(len(body)):
        if not _MOVED[part, j]:
            continue
        variance, square = 0.0, 0.0
        for i in range(3):
            ray[i] = body[j, i] - eye[i]
            square += ray[i] * ray[i]
        for i in range(3):
            for k in range(3):
                variance += ray[i] * cov[j, i, k] * ray[k]
        least = min(least, variance / square)
    return np.sqrt(max(least, 0.0))


@kernel(makes_arrays=True)
def reflect(part: int, eye: Floats, body: Floats, out: Floats) -> bool:
    """Reflect a part of a body in depth along a camera's rays.

    Args:
        part: index of the part.
        eye: (3,) optical centre of the camera [m].
        body: (J, 6) positions and velocities.
        out: (J, 3) positions of the reflected body [m], filled in.

    Returns:
        Whether all joints remain in front of the camera; otherwise `out` is undefined.
    """
    middle, n = np.zeros(3), 0
    for j in range(len(body)):
        for i in range(3):
            out[j, i] = body[j, i]
            middle[i] += body[j, i] if _PIVOT[part, j] else 0.0
        n += _PIVOT[part, j]
    for i in range(3):
        middle[i] = middle[i] / n - eye[i]
    away = np.sqrt(middle[0] ** 2 + middle[1] ** 2 + middle[2] ** 2)
    for j in range(len(body)):
        if not _MOVED[part, j]:
            continue
        along = 0.0
        for i in range(3):
            along += (body[j, i] - eye[i]) * middle[i] / away
        if not (along > 0.0 and 2.0 * away - along > 0.2):
            return False
        for i in range(3):
            out[j, i] = eye[i] + (body[j, i] - eye[i]) * (2.0 * away - along) / along
    return True


@kernel
def find_other_turn(eye: Floats, body: Floats) -> float:
    """Return the rotation from a body (J, 6) to its alternative, seen from `eye` (3,).

    The angle is in [-pi, pi] [rad], and 0 if the heading is unknown.
    """
    heading = find_heading(body)
    if not heading.is_known:
        return 0.0
    x, y = 0.0, 0.0
    for j in _TORSO:
        x += 0.25 * body[j, 0]
        y += 0.25 * body[j, 1]
    # forward is perpendicular to the shoulder line; therefore, reflecting the shoulders across the
    # ray rotates it to the mirror image of its opposite
    ray = math.atan2(y - eye[1], x - eye[0])
    turn = 2.0 * ray - 2.0 * math.atan2(heading.sin, heading.cos)
    return math.atan2(math.sin(turn), math.cos(turn))


@kernel
def has_same_heading(one: Floats, other: Floats) -> bool:
    """Return whether two bodies (J, 6) have almost the same heading."""
    a, b = find_heading(one), find_heading(other)
    return a.cos * b.cos + a.sin * b.sin > math.cos(_LEAST_TURN_RAD)


@kernel(makes_arrays=True)
def turn_body(eye: Floats, turn: float, body: Floats, cov: Floats, slope: Floats) -> None:
    """Rotate a Gaussian body to its alternative heading, in place.

    Args:
        eye: (3,) optical centre of the only camera that sees the body [m].
        turn: angle about the vertical, as `find_other_turn` returns it [rad].
        body: (J, 6) means, changed in place.
        cov: (J, 6, 6) covariances, reflected in place along the ray to the body's centre.
        slope: (J, 6, 6) slopes on the parents, reflected in the same way.
    """
    middle, across, speed = np.zeros(6), np.zeros(2), np.zeros(2)
    for j in _TORSO:
        for i in range(6):
            middle[i] += 0.25 * body[j, i]
    for left in (1, 7):
        for i in range(2):
            across[i] += body[left, i] - body[left + 1, i]
            speed[i] += body[left, 3 + i] - body[left + 1, 3 + i]
    rate = (across[0] * speed[1] - across[1] * speed[0]) / (across[0] ** 2 + across[1] ** 2)
    rate = min(max(rate, -4.0), 4.0)
    cos, sin = math.cos(turn), math.sin(turn)
    for j in range(len(body)):
        x, y = body[j, 0] - middle[0], body[j, 1] - middle[1]
        # relative to the rotating body; the alternative rotates in the opposite direction
        vx, vy = body[j, 3] - middle[3] + rate * y, body[j, 4] - middle[4] - rate * x
        body[j, 0], body[j, 1] = middle[0] + cos * x - sin * y, middle[1] + sin * x + cos * y
        x, y = body[j, 0] - middle[0], body[j, 1] - middle[1]
        body[j, 3] = middle[3] + cos * vx - sin * vy + rate * y
        body[j, 4] = middle[4] + sin * vx + cos * vy - rate * x
    mirror = np.eye(3)
    ray = middle[:3] - eye
    ray /= math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2)
    for i in range(3):
        for k in range(3):
            mirror[i, k] -= 2.0 * ray[i] * ray[k]
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = mirror, mirror
    half = np.empty((6, 6))
    for j in range(len(body)):
        multiply(both, cov[j], half)
        multiply(half, both, cov[j])
        multiply(both, slope[j], half)
        multiply(half, both, slope[j])
