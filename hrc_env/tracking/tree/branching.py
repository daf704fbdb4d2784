"""Branching: other bodies that one view can hardly tell from the one that is tracked.

A camera sees a limb in front of its joint as it sees it behind (the bas-relief ambiguity). A limb
is reflected: its joints keep their rays, and their depths are reflected in the depth of a pivot.
From there the posterior's mode is searched for, under the same prediction and frame: a mode
several posterior deviations from the known ones, with evidence that is not negligible, becomes a
hypothesis.

A whole body is turned instead: a line from shoulder to shoulder that recedes looks as one that
comes nearer. The other body has its shoulders and hips reflected across the ray to its middle, but
is no mirror image: it is the same body, turned, with nose and toes in front again. Its uncertainty
is the reflected one, because it lies along the same ray.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Bools
from hrc_env.tracking.tree.evidence import (
    anatomy,
    copy_slot,
    distance_between,
    heading,
    log_evidence,
)
from hrc_env.tracking.tree.gaussian import multiply
from hrc_env.tracking.tree.learning import learn_lengths
from hrc_env.tracking.tree.search import find_pose_near, stiff_lengths
from hrc_env.tracking.tree.update import condition_on_frame, correct_mean, update_tree

_LOG_LEAST_EVIDENCE = math.log(0.01)
"""A limb's other mode with less evidence than this beside the known one's is none."""
_MOST_PENALTY = 10.0
"""A turned body that is less likely than this is not tried [nat]."""
_DISTINCT = 3.0
"""A mode beyond so many posterior deviations is new."""
_SEARCH_STEPS = 4
"""Gauss-Newton steps from a mirror image."""
_NEARER_M = 0.05
"""A search that ends with every joint nearer than this has found nothing new [m]."""
_PARTS: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] = (
    (tuple(int(j) for j in TORSO), tuple(range(N_JOINTS))),  # the whole body
    ((1,), (3, 5)), ((2,), (4, 6)),  # arms
    ((3,), (5,)), ((4,), (6,)),  # forearms
    ((7,), (9, 11, 13)), ((8,), (10, 12, 14)),  # legs
    ((9,), (11, 13)), ((10,), (12, 14)),  # shanks
    ((1, 2), (0,)),  # head
)  # fmt: skip
"""Joints whose mean is the pivot, and joints that are reflected."""
WHOLE_BODY = 0
"""The row that reflects the whole body; the others reflect limbs."""
_MOST_SEEN_TWICE = 2
"""So many joints of a whole body may be seen twice, and it may still be mirrored."""
_TORSO = (1, 2, 7, 8)
_LEAST_TURN = 0.35
"""Bodies that are turned by less [rad] are one hypothesis."""


@kernel
def is_ambiguous(tree, frame, s):
    """Whether one view alone carries a part of the body whose depth is open in a prediction."""
    ambiguous = False
    for part in range(N_MIRRORS):
        ambiguous = ambiguous or _find_lone_camera(part, tree, frame, s) >= 0
    return ambiguous


@kernel
def _find_lone_camera(part, tree, frame, s):
    """The camera that leaves the depth of a part open that may be mirrored, or -1.

    One view in this update is not enough: what other views said a moment ago is still known.
    """
    if not (s.mirrors_body if part == WHOLE_BODY else s.mirrors_limbs):
        return -1
    c = lone_camera(part, frame.ok)
    if c < 0 or not open_depth(part, frame.cameras[c].eye, tree.body, tree.cov) > s.open_depth_m:
        return -1
    return c


@kernel(makes_arrays=True)
def branch(own, prior, evidence, frame, s, work):
    """Look for other bodies beside the heaviest hypothesis, and keep them as hypotheses.

    `own` are a worker's `Hypotheses`, of which the first has been updated: `prior` (1,) is what
    it was before, `evidence` the update's log-evidence.
    """
    trees = own.trees
    for part in range(N_MIRRORS):
        n = own.n_alive[0]
        camera = _find_lone_camera(part, prior[0], frame, s) if n < len(trees) else -1
        if camera < 0:
            continue
        copy_slot(own, 0, n)
        penalty = np.inf
        if part == WHOLE_BODY:
            penalty = _try_turned_body(trees, n, camera, prior, frame, s, work)
        elif reflect(part, frame.cameras[camera].eye, trees[0].body, work.point):
            penalty = _search_mode(trees, n, prior[0], evidence, frame, s, work)
        if penalty < np.inf:
            tree = trees[n]
            before, tree.pose_log_prior = tree.pose_log_prior, s.anatomy_trust * anatomy(tree.body)
            tree.log_weight += tree.pose_log_prior - before - penalty
            own.n_alive[0] = n + 1


@kernel(makes_arrays=True)
def _try_turned_body(trees, n, camera, prior, frame, s, work):
    """Make tree n the body that is turned the other way; its penalty [nat], infinite if it is
    known."""
    new = trees[n]
    eye = frame.cameras[camera].eye
    turn = turn_of(eye, prior[0].body)
    penalty = 0.5 * (turn / s.turn_std_rad) ** 2
    if penalty > _MOST_PENALTY:
        return np.inf
    _restore_prediction(new, prior[0])
    turn_body(eye, turn, new.body, new.cov, new.slope)
    if _is_turned_alike(trees, n):
        return np.inf
    condition_on_frame(new, prior, False, frame, s, work)
    learn_lengths(new, work.n_views)
    return np.inf if _is_turned_alike(trees, n) else penalty


@kernel(makes_arrays=True)
def _restore_prediction(tree, prior):
    """Give a tree that was updated the Gaussian from before, but not what was learnt before."""
    tree.body[:], tree.cov[:], tree.slope[:] = prior.body, prior.cov, prior.slope


@kernel
def _is_turned_alike(trees, n):
    """Whether tree n is turned as one of those before it."""
    alike = False
    for k in range(n):
        alike |= heads_like(trees[n].body, trees[k].body)
    return alike


@kernel(makes_arrays=True)
def _search_mode(trees, n, prior, evidence, frame, s, work):
    """Condition tree n at the mode next to a reflected limb (work.point); 0, or infinity for none.

    There is none where the search ends at a known hypothesis, or with negligible evidence.
    """
    new, known = trees[n], trees[0].body
    _restore_prediction(new, prior)
    stiff_lengths(new.bone_variance, s.bone_give, work.bone_variance)
    find_pose_near(new, frame, s, _SEARCH_STEPS, 0.0, work)
    moved = 0.0
    for j in range(len(known)):
        for i in range(3):
            moved = max(moved, abs(work.point[j, i] - known[j, i]))
    if not moved > _NEARER_M:
        return np.inf
    update_tree(new, work)
    if not log_evidence(prior, new, frame, s, work) - evidence > _LOG_LEAST_EVIDENCE:
        return np.inf
    correct_mean(new, frame, s, work)
    learn_lengths(new, work.n_views)
    for k in range(n):
        if not distance_between(trees[k], new, work) > _DISTINCT**2:
            return np.inf
    return 0.0


def _table(which: int) -> Bools:
    table = np.zeros((len(_PARTS), N_JOINTS), bool)
    for row, part in enumerate(_PARTS):
        table[row, list(part[which])] = True
    return table


_PIVOT, _MOVED = _table(0), _table(1)
N_MIRRORS = len(_PARTS)


@kernel
def lone_camera(part, ok):
    """The camera that alone sees a part of the body, of which `ok` (J, C) is seen, or -1."""
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
def open_depth(part, eye, body, cov):
    """Return the least standard deviation of a part's joints along their rays from `eye` (3,) [m].

    `body` is (J, 6), `cov` (J, 6, 6).
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
def reflect(part, eye, body, out):
    """Write positions (J, 3) of a body (J, 6) whose `part` is reflected along the rays from `eye`.

    Returns False where that would bring a joint to the camera or behind it.
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
def turn_of(eye, body):
    """Return the angle [rad] between a body (J, 6) and the other one from `eye`; 0 if unknown."""
    cos, sin, known = heading(body)
    if not known:
        return 0.0
    x, y = 0.0, 0.0
    for j in _TORSO:
        x += 0.25 * body[j, 0]
        y += 0.25 * body[j, 1]
    # forwards is across the shoulders, so that reflecting the shoulders across the ray
    # turns it to the mirror image of its opposite
    turn = 2.0 * math.atan2(y - eye[1], x - eye[0]) - 2.0 * math.atan2(sin, cos)
    return math.atan2(math.sin(turn), math.cos(turn))


@kernel
def heads_like(one, other):
    """Whether two bodies (J, 6) are turned alike."""
    a, b = heading(one), heading(other)
    return a[0] * b[0] + a[1] * b[1] > math.cos(_LEAST_TURN)


@kernel(makes_arrays=True)
def turn_body(eye, turn, body, cov, slope):
    """Make a Gaussian (J, 6), (J, 6, 6), (J, 6, 6) the other body's, in place."""
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
        # relative to the body as it turns; the other one turns the other way
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
