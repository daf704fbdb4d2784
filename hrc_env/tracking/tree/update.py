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

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import consensus_point
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

_FAR = 16.0
"""Squared Mahalanobis distance of a jump: by chance a joint is as far once in 900 updates."""
_SURE_VIEWS, _AGREEING_VIEWS = 1.5, 3
"""Where more views than this are believed, the pose that was found counts; where not, it takes so
many that agree: two may err alike."""
_NEAREST_M = 0.3
"""The mean correction knows no joint nearer to a lens than this."""
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def condition_on_frame(tree, prior, weigh, frame, s, work):
    """Condition a predicted tree on a frame; return its log-evidence, 0 if not to `weigh` it.

    `prior` (1,) then holds the prediction. frame.belief says which pixels are believed; the
    predicted covariances of the positions stay in work.predicted.
    """
    evidence = 0.0
    if weigh:
        prior[0] = tree
    for j in range(len(tree.cov)):
        for i in range(3):
            for k in range(3):
                work.predicted[j, i, k] = tree.cov[j, i, k]
    find_pose(tree, frame, s, work)
    if widen_jumped(tree, frame, s, work):
        find_pose(tree, frame, s, work)
    update_tree(tree, work)
    if weigh:  # the mean correction needs the factors that the evidence leaves alone
        evidence = log_evidence(prior[0], tree, frame, s, work)
    correct_mean(tree, frame, s, work)
    return evidence


@kernel(makes_arrays=True)
def widen_jumped(tree, frame, s, w):
    """Widen the predicted covariances of joints that have jumped, in place; whether any has."""
    cov, grown, jumped = tree.cov, w.moved, False
    use, point, spread = np.empty(len(frame.P), np.bool_), np.empty(3), np.empty((3, 3))
    for j in ORDER:
        grown[j] = 0.0
        if jumped and PARENT[j] >= 0:  # joints beyond one that jumped go with it
            multiply(tree.slope[j], grown[PARENT[j]], w.a)
            multiply_transposed(w.a, tree.slope[j], grown[j])
        if _has_jumped(j, tree, frame, s, (point, spread, use, w)):
            jumped |= _grow(j, tree, point, w)
    for j in ORDER:
        if not jumped:
            break
        for i in range(6):
            for k in range(6):
                cov[j, i, k] += grown[j, i, k]
    return jumped


@kernel
def _grow(j, tree, point, w):
    """Add to w.moved[j] what makes the predicted variance as large as the jump to `point`."""
    q, body, cov, inherited = PARENT[j], tree.body[j], tree.cov[j], w.b
    for i in range(6):
        for k in range(6):
            inherited[i, k] = 0.0
    if q >= 0:
        multiply(tree.slope[j], tree.cov[q], w.a)
        multiply_transposed(w.a, tree.slope[j], inherited)
    squared = known = own = 0.0
    for i in range(3):
        d = point[i] - body[i]
        squared += d * d
        for k in range(3):
            product = d * (point[k] - body[k])
            known += product * (cov[i, k] + w.moved[j, i, k])
            own += product * (cov[i, k] - inherited[i, k])
    if not (own > 0.0 and squared * squared > known):
        return False
    more = (squared * squared - known) / own
    for i in range(6):
        for k in range(6):
            w.moved[j, i, k] += more * (cov[i, k] - inherited[i, k])
    return True


@kernel(makes_arrays=True)
def _has_jumped(j, tree, frame, s, scratch):
    """Whether views agree on another place of a joint than the expected one: `point`."""
    point, spread, use, w = scratch
    ok, body, cov = frame.ok[j], tree.body[j], tree.cov[j]
    n_believed = 0.0
    for c in range(len(ok)):
        n_believed += frame.belief[j, c] if ok[c] else 0.0
    if n_believed > _SURE_VIEWS:
        for i in range(3):
            point[i] = w.point[j, i]
        return _is_far(point, body, cov, w.c)
    views = (frame.P, frame.z[j], frame.sigma[j], ok)
    if ok.sum() < _AGREEING_VIEWS:
        return False
    if consensus_point(*views, s.gate_sigma, point, spread, use) < _AGREEING_VIEWS:
        return False
    for i in range(3):
        for k in range(3):
            spread[i, k] += cov[i, k]
    return _is_far(point, body, spread, w.c)


@kernel
def _is_far(point, body, cov, inverse):
    invert3(cov, inverse)
    squared = 0.0
    for i in range(3):
        for k in range(3):
            squared += (point[i] - body[i]) * inverse[i, k] * (point[k] - body[k])
    return squared > _FAR


@kernel
def update_tree(tree, w):
    """Condition a tree on cameras and bones, in place.

    `w` is as `find_pose` leaves it; the factors stay in it for `shift_to_mean`.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in LEAVES_FIRST:
        _split(j, cov, slope, w)
        _add_measurements(j, w)
    for j in LEAVES_FIRST:
        _eliminate(j, slope, w)
    for j in ORDER:
        _marginalise(j, cov, slope, w)
    for j in range(len(body)):
        for i in range(3):
            w.gradient[j, i], w.gradient[j, 3 + i] = w.camera_gradient[j, i], 0.0
    for j in range(len(body)):
        q = PARENT[j]
        if q >= 0:
            for i in range(3):
                w.gradient[j, i] += w.edge_gradient[j, i]
                w.gradient[q, i] -= w.edge_gradient[j, i]
    _substitute(body, slope, w)


@kernel
def _split(j, cov, slope, w):
    """Write the precision of a joint given its parent, and how it follows that."""
    own, rest, shared = w.own[j], w.a, w.b
    if PARENT[j] >= 0:
        multiply_transposed(w.edge[j], slope[j], shared)
    for i in range(6):
        for k in range(6):
            rest[i, k] = cov[j, i, k] - (shared[i, k] if PARENT[j] >= 0 else 0.0)
    if not invert(rest, own):  # cut the edge rather than believe it
        slope[j] = 0.0
        own[:] = 0.0
        for i in range(6):
            own[i, i] = 1.0 / cov[j, i, i]
    if PARENT[j] >= 0:
        multiply(own, slope[j], w.pull[j])
        transposed_multiply(slope[j], w.pull[j], w.back[j])


@kernel
def _add_measurements(j, w):
    """Add the information of cameras on a joint, and of its bone on it and its parent."""
    w.known[j] = 0.0
    for i in range(3):
        for k in range(3):
            w.known[j, i, k] = w.camera_information[j, i, k]
            if PARENT[j] >= 0:
                bone = w.edge_information[j, i, k]
                w.own[j, i, k] += bone
                w.pull[j, i, k] += bone
                w.back[j, i, k] += bone


@kernel
def _eliminate(j, slope, w):
    """Write a joint's posterior slope and inverse Hessian; pass on its information."""
    hessian, message, q = w.a, w.b, PARENT[j]
    for i in range(6):
        for k in range(6):
            hessian[i, k] = w.own[j, i, k] + w.known[j, i, k]
    invert(hessian, w.inverse[j])
    if q >= 0:
        multiply(w.inverse[j], w.pull[j], slope[j])
        transposed_multiply(w.pull[j], slope[j], message)
        for i in range(6):
            for k in range(6):
                w.known[q, i, k] += w.back[j, i, k] - message[i, k]


@kernel
def _marginalise(j, cov, slope, w):
    """C_j = inverse Hessian + B_j C_parent B_j'."""
    q = PARENT[j]
    if q >= 0:
        multiply(slope[j], cov[q], w.a)
        multiply_transposed(w.a, slope[j], w.b)
    for i in range(6):
        for k in range(i + 1):
            shared = w.b[i, k] if q >= 0 else 0.0
            cov[j, i, k] = cov[j, k, i] = shared + w.inverse[j, i, k]


@kernel
def _substitute(body, slope, w):
    """Add to the means what w.gradient asks for, by the factors of the elimination."""
    for j in LEAVES_FIRST:
        q = PARENT[j]
        if q >= 0:
            for i in range(6):
                for k in range(6):
                    w.gradient[q, k] += slope[j, i, k] * w.gradient[j, i]
    for j in ORDER:
        q = PARENT[j]
        for i in range(6):
            total = 0.0
            for k in range(6):
                total += w.inverse[j, i, k] * w.gradient[j, k]
                if q >= 0:
                    total += slope[j, i, k] * w.step[q, k]
            w.step[j, i] = total
            body[j, i] += total


@kernel
def shift_to_mean(tree, frame, share, w):
    """Move the means from the mode towards the mean of the posterior (Laplace's next term).

    A camera's information falls with the square of the depth: there is more room behind the mode
    than before it. With J the Jacobian of joint j's pixel, n the camera's optical axis (both in the
    world), d the depth and S_j the posterior covariance, mean - mode = H^-1 g with g_j = sum over
    cameras of n tr(S_j J'J / sigma^2) / d, H being the Hessian of all joints, whose factors
    `update_tree` left. `share` of it is applied.
    """
    sigma, ok, belief = frame.sigma, frame.ok, frame.belief
    for j in range(len(ok)):
        for i in range(6):
            w.gradient[j, i] = 0.0
        for c in range(len(frame.P)):
            if not (ok[j, c] and belief[j, c] > 0.0):
                continue
            image = frame.images[c]
            pull = share * belief[j, c] * _pixel_variance(image, j, tree.cov[j]) / sigma[j, c] ** 2
            pull *= min(image[NEARNESS, j], 1.0 / _NEAREST_M)
            for i in range(3):
                w.gradient[j, i] += pull * frame.P[c, 2, i]
    _substitute(tree.body, tree.slope, w)


@kernel(fastmath=_REORDER)
def _pixel_variance(image, j, cov):
    """Return the variance of both coordinates of joint j's pixel together [px^2]."""
    a0, a1, a2 = image[A0, j], image[A1, j], image[A2, j]
    b0, b1, b2 = image[B0, j], image[B1, j], image[B2, j]
    own = cov[0, 0] * (a0 * a0 + b0 * b0) + cov[1, 1] * (a1 * a1 + b1 * b1)
    own += cov[2, 2] * (a2 * a2 + b2 * b2)
    cross = cov[0, 1] * (a0 * a1 + b0 * b1) + cov[0, 2] * (a0 * a2 + b0 * b2)
    return own + 2.0 * (cross + cov[1, 2] * (a1 * a2 + b1 * b2))


@kernel
def correct_mean(tree, frame, s, work):
    """Move from the mode to the mean; update ages, and in work.n_views the views of joints."""
    if s.mean_correction > 0.0:
        shift_to_mean(tree, frame, s.mean_correction, work)
    _update_ages(tree, frame, work.n_views)


@kernel
def _update_ages(tree, frame, n_views):
    """Update ages and conflicts of a worker's joints; count the cameras that saw each."""
    ok, belief = frame.ok, frame.belief
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        tree.age_s[j] = 0.0 if n_supporting > 0 else tree.age_s[j]
        tree.conflict[j] = count_conflict(n_views[j], n_supporting, tree.conflict[j])


@kernel
def count_conflict(n_ok, n_supporting, conflict):
    """Count updates in a row with two views of a joint of which fewer than two support it."""
    if n_ok < 2 or n_supporting >= 2:
        return 0 if n_supporting >= 2 or n_ok == 0 else conflict
    return conflict + 1
