"""Update: a tree given one frame, which is one exact linear-Gaussian update about the mode.

Cameras inform single joints, bones inform edges, so that the posterior is again a Gaussian on the
same tree: elimination from the leaves to the root and substitution back give its marginals and
slopes. Then the means move from the mode to the mean, and lengths of bones are learnt.

Where several views agree with each other and not with the prediction, it was too sure: a limb was
jerked, a person turned over. The part R of a joint's covariance C that is not its parent's then
grows, and the pose is searched for again. With d from the predicted joint to where it is seen, R
is multiplied by 1 + (|d|^4 - d'C d) / d'R d: the variance along d is then |d|^2, the likeliest
(covariance matching: Mehra, IEEE Trans. Automatic Control 17, 1972, doi:10.1109/TAC.1972.1100100).
"""

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats
from hrc_env.geometry.triangulation import consensus_point
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.evidence import log_evidence
from hrc_env.tracking.tree.gaussian import (
    LEAVES_FIRST,
    ORDER,
    PARENT,
    invert,
    invert3,
    multiply,
    multiply_transposed,
    transposed_multiply,
)
from hrc_env.tracking.tree.search import A0, A1, A2, B0, B1, B2, NEARNESS, find_pose
from hrc_env.tracking.tree.state import Tree, Work

_FAR = 16.0
"""Squared Mahalanobis distance of a jump: by chance a joint is as far once in 900 updates."""
_SURE_VIEWS = 1.5
"""Sum of the views' weights above which the pose that was found counts as a joint's place."""
_AGREEING_VIEWS = 3
"""Views that must agree on a joint's place otherwise: two may err alike."""
_NEAREST_M = 0.3
"""Least depth of a joint in the correction of the mean [m]."""
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def condition_on_frame(
    tree: Tree,
    prior: Records1[Tree],
    is_weighed: bool,
    frame: Frame,
    settings: Settings,
    work: Work,
) -> float:
    """Condition a predicted tree on a frame and return the frame's log-evidence.

    Args:
        tree: the predicted hypothesis, changed in place.
        prior: (1,) receives the prediction, if the frame is weighed.
        is_weighed: whether the evidence is wanted; 0 is returned otherwise.
        frame: the measurements; its weights and images are written.
        settings: settings of the estimator.
        work: scratch; `predicted`, the position covariances before the update, and `n_views` are
            for `learning`.
    """
    evidence = 0.0
    if is_weighed:
        prior[0] = tree
    for j in range(len(tree.cov)):
        for i in range(3):
            for k in range(3):
                work.predicted[j, i, k] = tree.cov[j, i, k]
    find_pose(tree, frame, settings, work)
    if widen_jumped_joints(tree, frame, settings, work):
        find_pose(tree, frame, settings, work)
    update_tree(tree, work)
    if is_weighed:  # the mean correction needs the factors that the evidence leaves alone
        evidence = log_evidence(prior[0], tree, frame, settings, work)
    correct_mean(tree, frame, settings, work)
    return evidence


@kernel(makes_arrays=True)
def widen_jumped_joints(tree: Tree, frame: Frame, settings: Settings, work: Work) -> bool:
    """Widen the predicted covariances of joints that have jumped; return whether any has.

    Args:
        tree: the predicted hypothesis, changed in place.
        frame: the measurements, with weights as `find_pose` leaves them.
        settings: settings of the estimator.
        work: scratch, as `find_pose` leaves it.
    """
    cov, growth, has_jumped = tree.cov, work.moved, False
    use, point, spread = np.empty(len(frame.P), np.bool_), np.empty(3), np.empty((3, 3))
    for j in ORDER:
        growth[j] = 0.0
        if has_jumped and PARENT[j] >= 0:  # joints beyond one that jumped go with it
            multiply(tree.slope[j], growth[PARENT[j]], work.a)
            multiply_transposed(work.a, tree.slope[j], growth[j])
        if _find_jump(j, tree, frame, settings, work, point, spread, use):
            has_jumped |= _widen_joint(j, tree, point, work)
    for j in ORDER:
        if not has_jumped:
            break
        for i in range(6):
            for k in range(6):
                cov[j, i, k] += growth[j, i, k]
    return has_jumped


@kernel(makes_arrays=True)
def _find_jump(
    j: int,
    tree: Tree,
    frame: Frame,
    settings: Settings,
    work: Work,
    point: Floats,
    spread: Floats,
    use: Bools,
) -> bool:
    """Return whether cameras agree on a position of a joint far from the predicted one.

    If the fitted pose is supported by enough cameras, its position counts. If not, they may agree
    on another one, which is triangulated: its covariance and the prediction's are added.

    Args:
        j: index of the joint.
        tree: the predicted hypothesis, in the world frame.
        frame: the measurements, with the weights `belief` (J, C) as `find_pose` leaves them.
        settings: settings of the estimator.
        work: `point` (J, 3) is the fitted pose [m]; the matrix `c` is overwritten.
        point: (3,) receives the position [m]; meaningless if False is returned.
        spread: (3, 3) scratch for the covariance of a triangulated position [m^2].
        use: (C,) scratch for the cameras that agree.
    """
    ok, predicted, predicted_cov = frame.ok[j], tree.body[j], tree.cov[j]
    scratch = work.c
    n_supporting = 0.0  # a sum of weights
    for c in range(len(ok)):
        n_supporting += frame.belief[j, c] if ok[c] else 0.0
    if n_supporting > _SURE_VIEWS:
        for i in range(3):
            point[i] = work.point[j, i]
        return _is_far(point, predicted, predicted_cov, scratch)
    if ok.sum() < _AGREEING_VIEWS:
        return False
    pixels, sigma, gate = frame.z[j], frame.sigma[j], settings.gate_sigma
    n_agreeing = consensus_point(frame.P, pixels, sigma, ok, gate, point, cov=spread, use=use)
    if n_agreeing < _AGREEING_VIEWS:
        return False
    for i in range(3):
        for k in range(3):
            spread[i, k] += predicted_cov[i, k]  # the covariance of the difference
    return _is_far(point, predicted, spread, scratch)


@kernel
def _is_far(point: Floats, body: Floats, cov: Floats, inverse: Floats) -> bool:
    """Return whether a place counts as a jump.

    Args:
        point: (3,) the place [m].
        body: (3+,) predicted position [m].
        cov: (3+, 3+) covariance of the difference [m^2].
        inverse: (3+, 3+) scratch.
    """
    invert3(cov, inverse)
    squared = 0.0
    for i in range(3):
        for k in range(3):
            squared += (point[i] - body[i]) * inverse[i, k] * (point[k] - body[k])
    return squared > _FAR


@kernel
def _widen_joint(j: int, tree: Tree, point: Floats, work: Work) -> bool:
    """Make the predicted variance of a joint as large as its jump; return whether it grew.

    Args:
        j: the joint.
        tree: the predicted hypothesis.
        point: (3,) the place to which the joint has jumped [m].
        work: scratch; `moved` receives the growth.
    """
    q: int = PARENT[j]
    body, cov, inherited = tree.body[j], tree.cov[j], work.b
    for i in range(6):
        for k in range(6):
            inherited[i, k] = 0.0
    if q >= 0:
        multiply(tree.slope[j], tree.cov[q], work.a)
        multiply_transposed(work.a, tree.slope[j], inherited)
    squared = known = own = 0.0
    for i in range(3):
        d = point[i] - body[i]
        squared += d * d
        for k in range(3):
            product = d * (point[k] - body[k])
            known += product * (cov[i, k] + work.moved[j, i, k])
            own += product * (cov[i, k] - inherited[i, k])
    if not (own > 0.0 and squared * squared > known):
        return False
    more = (squared * squared - known) / own
    for i in range(6):
        for k in range(6):
            work.moved[j, i, k] += more * (cov[i, k] - inherited[i, k])
    return True


@kernel
def update_tree(tree: Tree, work: Work) -> None:
    """Condition a tree on cameras and bones, in place.

    `work` is as `find_pose` leaves it; the factors stay in it for `shift_to_mean`.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in LEAVES_FIRST:
        _add_information(j, cov, slope, work)
    for j in LEAVES_FIRST:
        _eliminate(j, slope, work)
    for j in ORDER:
        _marginalise(j, cov, slope, work)
    for j in range(len(body)):
        for i in range(3):
            work.gradient[j, i], work.gradient[j, 3 + i] = work.camera_gradient[j, i], 0.0
    for j in range(len(body)):
        q: int = PARENT[j]
        if q >= 0:
            for i in range(3):
                work.gradient[j, i] += work.edge_gradient[j, i]
                work.gradient[q, i] -= work.edge_gradient[j, i]
    _substitute(body, slope, work)


@kernel
def _add_information(j: int, cov: Floats, slope: Floats, work: Work) -> None:
    """Write the information of the prediction, the cameras and the bone about a joint.

    Args:
        j: the joint.
        cov: (J, 6, 6) predicted covariances.
        slope: (J, 6, 6) predicted slopes; 0 is written where an edge has to be cut.
        work: scratch; the joint's `precision`, `coupling`, `back` and `known` are written.
    """
    own, rest, shared = work.precision[j], work.a, work.b
    if PARENT[j] >= 0:
        multiply_transposed(work.edge[j], slope[j], shared)
    for i in range(6):
        for k in range(6):
            rest[i, k] = cov[j, i, k] - (shared[i, k] if PARENT[j] >= 0 else 0.0)
    if not invert(rest, own):  # cut the edge rather than believe it
        slope[j] = 0.0
        own[:] = 0.0
        for i in range(6):
            own[i, i] = 1.0 / cov[j, i, i]
    if PARENT[j] >= 0:
        multiply(own, slope[j], work.coupling[j])
        transposed_multiply(slope[j], work.coupling[j], work.back[j])
    work.known[j] = 0.0
    for i in range(3):
        for k in range(3):
            work.known[j, i, k] = work.camera_information[j, i, k]
            if PARENT[j] >= 0:
                bone = work.edge_information[j, i, k]
                own[i, k] += bone
                work.coupling[j, i, k] += bone
                work.back[j, i, k] += bone


@kernel
def _eliminate(j: int, slope: Floats, work: Work) -> None:
    """Write a joint's posterior slope and inverse Hessian; pass its information to the parent."""
    hessian, message = work.a, work.b
    q: int = PARENT[j]
    for i in range(6):
        for k in range(6):
            hessian[i, k] = work.precision[j, i, k] + work.known[j, i, k]
    invert(hessian, work.inverse[j])
    if q >= 0:
        multiply(work.inverse[j], work.coupling[j], slope[j])
        transposed_multiply(work.coupling[j], slope[j], message)
        for i in range(6):
            for k in range(6):
                work.known[q, i, k] += work.back[j, i, k] - message[i, k]


@kernel
def _marginalise(j: int, cov: Floats, slope: Floats, work: Work) -> None:
    """Write a joint's marginal covariance, C_j = inverse Hessian + B_j C_q B_j'.

    Args:
        j: the joint; its parent q is done.
        cov: (J, 6, 6) covariances, written for the joint.
        slope: (J, 6, 6) posterior slopes.
        work: scratch with the inverse Hessians.
    """
    q: int = PARENT[j]
    if q >= 0:
        multiply(slope[j], cov[q], work.a)
        multiply_transposed(work.a, slope[j], work.b)
    for i in range(6):
        for k in range(i + 1):
            shared = work.b[i, k] if q >= 0 else 0.0
            cov[j, i, k] = cov[j, k, i] = shared + work.inverse[j, i, k]


@kernel
def _substitute(body: Floats, slope: Floats, work: Work) -> None:
    """Move the means by the inverse Hessian of all joints times `work.gradient`.

    Args:
        body: (J, 6) means, changed in place.
        slope: (J, 6, 6) posterior slopes.
        work: scratch with the factors of the elimination; the gradient is used up.
    """
    for j in LEAVES_FIRST:
        q: int = PARENT[j]
        if q >= 0:
            for i in range(6):
                for k in range(6):
                    work.gradient[q, k] += slope[j, i, k] * work.gradient[j, i]
    for j in ORDER:
        q: int = PARENT[j]
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += work.inverse[j, i, k] * work.gradient[j, k]
                if q >= 0:
                    total += slope[j, i, k] * work.step[q, k]
            work.step[j, i] = total
            body[j, i] += total


@kernel
def shift_to_mean(tree: Tree, frame: Frame, share: float, work: Work) -> None:
    """Move the means from the mode towards the mean of the posterior (Laplace's next term).

    A camera's information falls with the square of the depth: there is more room behind the mode
    than before it. With J the Jacobian of joint j's pixel, n the camera's optical axis (both in the
    world), d the depth and S_j the posterior covariance, mean - mode = H^-1 g with g_j = sum over
    cameras of n tr(S_j J'J / sigma^2) / d, H being the Hessian of all joints in the factors that
    `update_tree` left.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements, with weights and images.
        share: share of the shift that is applied, 0 to 1.
        work: scratch, as `update_tree` leaves it.
    """
    sigma, ok, belief = frame.sigma, frame.ok, frame.belief
    for j in range(len(ok)):
        for i in range(6):
            work.gradient[j, i] = 0.0
        for c in range(len(frame.P)):
            if not (ok[j, c] and belief[j, c] > 0.0):
                continue
            image = frame.images[c]
            variance = _find_pixel_variance(image, j, tree.cov[j])
            pull = share * belief[j, c] * variance / sigma[j, c] ** 2
            pull *= min(image[NEARNESS, j], 1.0 / _NEAREST_M)
            for i in range(3):
                work.gradient[j, i] += pull * frame.P[c, 2, i]
    _substitute(tree.body, tree.slope, work)


@kernel(fastmath=_REORDER)
def _find_pixel_variance(image: Floats, j: int, cov: Floats) -> float:
    """Return the sum of the variances of both coordinates of a joint's pixel [px^2].

    Args:
        image: (N_IMAGE, LANES) the joints in one camera.
        j: the joint.
        cov: (3+, 3+) covariance of its position [m^2].
    """
    a0, a1, a2 = image[A0, j], image[A1, j], image[A2, j]
    b0, b1, b2 = image[B0, j], image[B1, j], image[B2, j]
    own = cov[0, 0] * (a0 * a0 + b0 * b0) + cov[1, 1] * (a1 * a1 + b1 * b1)
    own += cov[2, 2] * (a2 * a2 + b2 * b2)
    cross = cov[0, 1] * (a0 * a1 + b0 * b1) + cov[0, 2] * (a0 * a2 + b0 * b2)
    return own + 2.0 * (cross + cov[1, 2] * (a1 * a2 + b1 * b2))


@kernel
def correct_mean(tree: Tree, frame: Frame, settings: Settings, work: Work) -> None:
    """Move from the mode to the mean; update ages, conflicts and the numbers of views.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements, with weights and images.
        settings: settings of the estimator.
        work: scratch, as `update_tree` leaves it; `n_views` is written.
    """
    if settings.mean_correction > 0.0:
        shift_to_mean(tree, frame, settings.mean_correction, work)
    ok, belief, n_views = frame.ok, frame.belief, work.n_views
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        tree.age_s[j] = 0.0 if n_supporting > 0 else tree.age_s[j]
        tree.conflict[j] = count_conflict(n_views[j], n_supporting, tree.conflict[j])


@kernel
def count_conflict(n_ok: int, n_supporting: int, conflict: int) -> int:
    """Return the number of updates in a row in which a joint's views contradict its estimate.

    Args:
        n_ok: number of cameras that measured the joint.
        n_supporting: number of those that support the estimate; two or more end the row, and so
            does a joint that no camera measured.
        conflict: the number before this update; it stays with one view that does not support.
    """
    if n_ok < 2 or n_supporting >= 2:
        return 0 if n_supporting >= 2 or n_ok == 0 else conflict
    return conflict + 1
