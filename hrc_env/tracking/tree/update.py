"""Update of a tree by one set of frames, as an exact linear-Gaussian update about the mode.

Each camera measurement depends on a single joint, and each bone length on an edge of the tree.
Therefore the posterior is a Gaussian on the same tree: elimination from the leaves to the root and
back substitution compute its marginals and slopes. The estimate is then shifted from the mode to
the mean.

If several views agree with each other but not with the prediction, the predicted covariance was too
small, for example because a person jerked a limb or rolled over. In this case, the conditional part
R of a joint's covariance C given its parent is increased, and the search for the pose is repeated.
With the vector d from the predicted joint to the measured one, R is multiplied by
1 + (|d|^4 - d'C d) / d'R d. The variance along d is then |d|^2, its maximum-likelihood value
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
"""Squared Mahalanobis distance above which a joint is considered to have jumped. By chance, a joint
exceeds this distance once in 900 updates."""
_SURE_VIEWS = 1.5
"""Sum of a joint's inlier probabilities above which its position in the found pose is trusted."""
_AGREEING_VIEWS = 3
"""Minimum number of views that agree on a triangulated position for it to be trusted otherwise. Two
views may have the same error."""
_NEAREST_M = 0.3
"""Lower bound of a joint's depth in the correction of the mean [m]."""
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
    """Condition a predicted tree on one set of frames and return their log-evidence.

    Args:
        tree: the predicted hypothesis, changed in place.
        prior: (1,) copy of the prediction, filled in if `is_weighed`.
        is_weighed: whether to compute the evidence; otherwise 0 is returned.
        frame: the measurements; inlier probabilities and images are filled in.
        settings: settings of the estimator.
        work: work arrays; `predicted`, the position covariances before the update, and `n_views`
            are filled in for `learning`.
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
    if is_weighed:  # before the correction of the mean; it keeps the factors in `work`
        evidence = log_evidence(prior[0], tree, frame, settings, work)
    correct_mean(tree, frame, settings, work)
    return evidence


@kernel(makes_arrays=True)
def widen_jumped_joints(tree: Tree, frame: Frame, settings: Settings, work: Work) -> bool:
    """Widen the predicted covariances of joints that have jumped; return whether any has.

    Args:
        tree: the predicted hypothesis, changed in place.
        frame: the measurements, with inlier probabilities from `find_pose`.
        settings: settings of the estimator.
        work: work arrays with the results of `find_pose`.
    """
    cov, growth, has_jumped = tree.cov, work.moved, False
    use, point, spread = np.empty(len(frame.P), np.bool_), np.empty(3), np.empty((3, 3))
    for j in ORDER:
        growth[j] = 0.0
        if has_jumped and PARENT[j] >= 0:  # descendants move with a joint that jumped
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

    If enough cameras support the joint's position in the fitted pose, that position is used.
    Otherwise, the position on which the cameras agree, if any, is triangulated, and its covariance
    is added to that of the prediction.

    Args:
        j: index of the joint.
        tree: the predicted hypothesis, in the world frame.
        frame: the measurements, with the weights `belief` (J, C) computed by `find_pose`.
        settings: settings of the estimator.
        work: `point` (J, 3) is the fitted pose [m]; the matrix `c` is overwritten.
        point: (3,) the position [m], filled in; undefined if False is returned.
        spread: (3, 3) work array for the covariance of a triangulated position [m^2].
        use: (C,) work array for the mask of the cameras that agree.
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
    """Return whether a position is far enough from the predicted one for a jump.

    Args:
        point: (3,) the position [m].
        body: (3+,) predicted position [m].
        cov: (3+, 3+) covariance of the difference [m^2].
        inverse: (3+, 3+) work array.
    """
    invert3(cov, inverse)
    squared = 0.0
    for i in range(3):
        for k in range(3):
            squared += (point[i] - body[i]) * inverse[i, k] * (point[k] - body[k])
    return squared > _FAR


@kernel
def _widen_joint(j: int, tree: Tree, point: Floats, work: Work) -> bool:
    """Compute the increase of a joint's covariance that matches a jump; return whether it grows.

    Args:
        j: index of the joint.
        tree: the predicted hypothesis.
        point: (3,) the position to which the joint has jumped [m].
        work: work arrays; the increase is added to `moved`.
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

    `work` must contain the results of `find_pose`; the factors remain in it for `shift_to_mean`.
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
    """Compute the information of the prediction, the cameras and the bone about a joint.

    Args:
        j: index of the joint.
        cov: (J, 6, 6) predicted covariances.
        slope: (J, 6, 6) predicted slopes; the joint's slope is set to 0 if its conditional
            covariance is not positive definite.
        work: work arrays; the joint's `precision`, `coupling`, `back` and `known` are filled in.
    """
    own, rest, shared = work.precision[j], work.a, work.b
    if PARENT[j] >= 0:
        multiply_transposed(work.edge[j], slope[j], shared)
    for i in range(6):
        for k in range(6):
            rest[i, k] = cov[j, i, k] - (shared[i, k] if PARENT[j] >= 0 else 0.0)
    if not invert(rest, own):  # cut the edge, because its covariance is invalid
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
    """Compute a joint's posterior slope and inverse Hessian; pass its information to the parent."""
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
    """Compute a joint's marginal covariance, C_j = inverse Hessian + B_j C_q B_j'.

    Args:
        j: index of the joint; its parent q must be marginalised already.
        cov: (J, 6, 6) covariances, filled in for the joint.
        slope: (J, 6, 6) posterior slopes.
        work: work arrays with the inverse Hessians.
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
        work: work arrays with the factors of the elimination; the gradient is overwritten.
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
    """Move the means from the mode to the posterior mean, by the next term of Laplace's method.

    A camera's information decreases with the square of the depth; therefore the posterior extends
    farther behind the mode than in front of it. With the Jacobian J of joint j's pixel and the
    camera's optical axis n (both in the world frame), the depth d and the posterior covariance S_j,
    mean - mode = H^-1 g, where g_j is the sum of n tr(S_j J'J / sigma^2) / d over cameras. H is the
    Hessian of all joints; `update_tree` has stored its factors in `work`.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements, with inlier probabilities and images.
        share: fraction of the shift that is applied, 0 to 1.
        work: work arrays with the results of `update_tree`.
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
        image: (N_IMAGE, LANES) linearised projections of the joints in one camera.
        j: index of the joint.
        cov: (3+, 3+) covariance of the joint's position [m^2].
    """
    a0, a1, a2 = image[A0, j], image[A1, j], image[A2, j]
    b0, b1, b2 = image[B0, j], image[B1, j], image[B2, j]
    own = cov[0, 0] * (a0 * a0 + b0 * b0) + cov[1, 1] * (a1 * a1 + b1 * b1)
    own += cov[2, 2] * (a2 * a2 + b2 * b2)
    cross = cov[0, 1] * (a0 * a1 + b0 * b1) + cov[0, 2] * (a0 * a2 + b0 * b2)
    return own + 2.0 * (cross + cov[1, 2] * (a1 * a2 + b1 * b2))


@kernel
def correct_mean(tree: Tree, frame: Frame, settings: Settings, work: Work) -> None:
    """Move the means from the mode to the mean; update ages, conflicts and numbers of views.

    Args:
        tree: the updated hypothesis, changed in place.
        frame: the measurements, with inlier probabilities and images.
        settings: settings of the estimator.
        work: work arrays with the results of `update_tree`; `n_views` is filled in.
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
    """Return the number of successive updates in which views contradict the estimate of a joint.

    The number increases if at least two cameras measured the joint and at most one of them supports
    the estimate. It is reset to 0 if at least two cameras support the estimate or no camera
    measured the joint, and does not change if a single camera measured the joint.

    Args:
        n_ok: number of cameras that measured the joint.
        n_supporting: number of these cameras that support the estimate.
        conflict: the number before this update.
    """
    if n_ok < 2 or n_supporting >= 2:
        return 0 if n_supporting >= 2 or n_ok == 0 else conflict
    return conflict + 1
