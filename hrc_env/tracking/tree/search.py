"""Search for the most probable positions of a body, given its prediction and one set of frames.

The search is a robust Gauss-Newton method on the positions of the tree. Each camera measurement
depends on a single joint, and each bone length on an edge of the tree. The likelihood of a pixel is
the mixture of a Gaussian about the joint's image and, with the outlier weight, a uniform density
over the image. At first, the Gaussian is widened by the uncertainty of the prediction, so that good
measurements of a badly predicted joint are not mistaken for outliers (graduated non-convexity).
Each step solves one 45x45 system exactly by elimination from the leaves to the root and back
substitution.

All joints in one camera are processed at once, with one row for each quantity and one column for
each joint. The number of columns is padded to a multiple of the vector length, so that loops over
columns are compiled to vector instructions.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.gaussian import LEAVES_FIRST, ORDER, PARENT, invert3, multiply
from hrc_env.tracking.tree.state import EDGE_STIFFNESS_M, LANES, N_IMAGE, Tree, Work

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]
BELIEF, LOG_ODDS, FACTOR, A0, A1, A2, B0, B1, B2, DU, DV, NEARNESS = range(N_IMAGE)
"""Indices of the rows of `Work.image`; see `state.N_IMAGE`."""
_REORDER = {"reassoc", "contract", "nsz"}  # NaN and infinity keep their meaning


@kernel
def find_pose(tree: Tree, frame: Frame, settings: Settings, work: Work) -> None:
    """Find the most probable positions of a predicted tree and linearise the likelihood there.

    Args:
        tree: the predicted hypothesis.
        frame: the measurements; `belief` and `images` are filled in.
        settings: settings of the estimator.
        work: work arrays. The positions (`point`), the variances of the bones as measurements, and
            the information and gradients of cameras and bones are filled in. The gradients are
            those of the linearised log-likelihoods at the predicted means: for cameras with respect
            to the positions of joints, and for bones with respect to the positions relative to the
            parents.
    """
    set_bone_variances(tree.bone_variance, settings.bone_variation_scale, work.bone_variance)
    for j in range(len(tree.body)):
        for i in range(3):
            work.point[j, i] = tree.body[j, i]
    find_pose_near(tree, frame, settings, settings.gauss_newton_steps, 1.0, work)


@kernel
def find_pose_near(
    tree: Tree, frame: Frame, settings: Settings, n_steps: int, widen: float, work: Work
) -> None:
    """Find the most probable positions as in `find_pose`, starting from `work.point`.

    Args:
        tree: the predicted hypothesis.
        frame: the measurements; `belief` and `images` are filled in.
        settings: settings of the estimator.
        n_steps: number of Gauss-Newton steps.
        widen: factor on the prediction's pixel variance, which is added to the detector's variance
            in the first step; it is halved in every further step.
        work: work arrays with the start and the bones' variances; results as in `find_pose`.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in ORDER:
        if PARENT[j] >= 0:
            multiply(slope[j], cov[PARENT[j]], work.edge[j])
        _set_position_prior(j, cov, work)
        for i in range(3):
            work.shift[j, i] = work.point[j, i] - body[j, i]
    _set_covariances(cov, work.points)
    _set_views(frame)
    for step in range(n_steps + 1):
        widening = widen if step < n_steps - 1 else 0.0
        _linearise_cameras(frame, settings.inlier_odds, widening, step == n_steps, work)
        _add_floor(body, 1.0 / settings.floor_std_m**2, work)
        _linearise_bones(tree.bone_length, work)
        _add_second_bone(cov, tree.bone_length, work)
        if step < n_steps:
            _solve_positions(body, work)
        widen *= 0.5


@kernel(fastmath=_REORDER)
def _set_position_prior(j: int, cov: Floats, work: Work) -> None:
    """Compute the precision of a joint's position given its parent's position, and the slope on it.

    Args:
        j: index of the joint.
        cov: (J, 6, 6) predicted covariances.
        work: work arrays with `edge`; the joint's entries in fields named `position_*` are filled
            in.
    """
    q: int = PARENT[j]
    precision = work.position_precision[j]
    if q < 0:
        invert3(cov[j], precision)
        return
    edge, slope = work.edge[j], work.position_slope[j]
    coupling, back = work.position_coupling[j], work.position_back[j]
    above, rest = work.a, work.b
    invert3(cov[q], above)
    for i in range(3):
        for k in range(3):
            slope[i, k] = edge[i, 0] * above[0, k] + edge[i, 1] * above[1, k]
            slope[i, k] += edge[i, 2] * above[2, k]
    for i in range(3):
        for k in range(i + 1):
            known = slope[i, 0] * edge[k, 0] + slope[i, 1] * edge[k, 1] + slope[i, 2] * edge[k, 2]
            rest[i, k] = cov[j, i, k] - known
    invert3(rest, precision)
    for i in range(3):
        for k in range(3):
            coupling[i, k] = precision[i, 0] * slope[0, k] + precision[i, 1] * slope[1, k]
            coupling[i, k] += precision[i, 2] * slope[2, k]
    for i in range(3):
        for k in range(3):
            back[i, k] = slope[0, i] * coupling[0, k] + slope[1, i] * coupling[1, k]
            back[i, k] += slope[2, i] * coupling[2, k]


@kernel
def _linearise_cameras(
    frame: Frame, inlier_odds: float, widening: float, is_last: bool, work: Work
) -> None:
    """Compute the cameras' information and gradient at `work.point`.

    Args:
        frame: the measurements; `belief` is filled in.
        inlier_odds: odds that a measurement without residual is an inlier, times its pixel
            variance [px^2].
        widening: factor on the prediction's pixel variance, which is added to the detector's.
        is_last: whether to store the Jacobians and residuals in `frame.images`.
        work: work arrays.
    """
    points, sums, belief = work.points, work.sums, frame.belief
    for j in range(len(belief)):
        for i in range(3):
            points[i, j] = work.point[j, i]
    sums[:] = 0.0
    for c in range(len(frame.P)):
        _add_view(frame.P[c], points, frame.views[c], widening, inlier_odds, work.image, sums)
        for j in range(len(belief)):
            belief[j, c] = work.image[BELIEF, j]
        if is_last:
            for row in range(A0, N_IMAGE):
                for j in range(LANES):
                    frame.images[c, row, j] = work.image[row, j]
    for j in range(len(belief)):
        h, shift = work.camera_information[j], work.shift[j]
        h[0, 0], h[1, 1], h[2, 2] = sums[0, j], sums[1, j], sums[2, j]
        h[0, 1] = h[1, 0] = sums[3, j]
        h[0, 2] = h[2, 0] = sums[4, j]
        h[1, 2] = h[2, 1] = sums[5, j]
        for i in range(3):
            back = h[i, 0] * shift[0] + h[i, 1] * shift[1] + h[i, 2] * shift[2]
            work.camera_gradient[j, i] = sums[6 + i, j] + back


@kernel
def _add_floor(body: Floats, information: float, work: Work) -> None:
    """Add a measurement of height 0 to joints below the floor.

    The measurement bounds the distance of a body from the camera, which is uncertain in one view.

    Args:
        body: (J, 6) predicted means.
        information: information of the measurement [1/m^2].
        work: work arrays; the camera information and gradient are changed.
    """
    for j in range(len(body)):
        if work.point[j, 2] < 0.0:
            work.camera_information[j, 2, 2] += information
            work.camera_gradient[j, 2] -= information * body[j, 2]


@kernel(fastmath=_REORDER)
def _linearise_bones(bone_length: Floats, work: Work) -> None:
    """Compute the information and gradients of the bones (J,) from joints to their parents."""
    for j in ORDER:
        q: int = PARENT[j]
        a, b = work.point[j], work.point[q]
        if q < 0:
            continue
        x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        length = math.sqrt(x * x + y * y + z * z) + 1e-9
        along = (x / length, y / length, z / length)
        miss = bone_length[j] - length
        for i in range(3):
            miss += along[i] * (work.shift[j, i] - work.shift[q, i])
        for i in range(3):
            known = along[i] / work.bone_variance[j]
            work.edge_gradient[j, i] = known * miss
            for k in range(3):
                work.edge_information[j, i, k] = known * along[k]


@kernel(fastmath=_REORDER)
def _add_second_bone(cov: Floats, bone_length: Floats, work: Work) -> None:
    """Add the bone from the nose to the right shoulder to the edge of the nose.

    One bone alone does not exclude the mirror image of the nose. The second one is not an edge of
    the tree. Therefore the right shoulder is considered rigidly connected to the left one, and the
    uncertainty of their relative position is added to the noise.

    Args:
        cov: (J, 6, 6) predicted covariances.
        bone_length: (J,) lengths of the bones [m].
        work: work arrays; information and gradient of the nose's edge are changed.
    """
    nose, right = _NOSE, _RIGHT_SHOULDER
    left: int = PARENT[_RIGHT_SHOULDER]
    a, b = work.point[nose], work.point[right]
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    length = math.sqrt(x * x + y * y + z * z) + 1e-9
    along = (x / length, y / length, z / length)
    miss, spread = bone_length[nose] - length, work.bone_variance[nose]
    for i in range(3):
        miss += along[i] * (work.shift[nose, i] - work.shift[PARENT[nose], i])
        for k in range(3):
            across = cov[right, i, k] + cov[left, i, k] - 2.0 * work.edge[right, i, k]
            spread += along[i] * across * along[k]
    known = 1.0 / spread
    for i in range(3):
        work.edge_gradient[nose, i] += along[i] * known * miss
        for k in range(3):
            work.edge_information[nose, i, k] += along[i] * known * along[k]


@kernel
def _solve_positions(body: Floats, work: Work) -> None:
    """Compute the shifts that minimise the quadratic form of prior, cameras and bones.

    Args:
        body: (J, 6) predicted means.
        work: work arrays with the linearised likelihood; `shift` and `point` are filled in.
    """
    for j in ORDER:
        for i in range(3):
            work.node_gradient[j, i] = work.camera_gradient[j, i]
            for k in range(3):
                work.node[j, i, k] = work.camera_information[j, i, k]
    for j in LEAVES_FIRST:
        _eliminate(j, work)
    for j in ORDER:
        q: int = PARENT[j]
        for i in range(3):
            total = 0.0
            for k in range(3):
                total += work.position_inverse[j, i, k] * work.node_gradient[j, k]
                if q >= 0:
                    total += work.position_slope[j, i, k] * work.shift[q, k]
            work.shift[j, i] = total
            work.point[j, i] = body[j, i] + total


@kernel(fastmath=_REORDER)
def _eliminate(j: int, work: Work) -> None:
    """Compute slope and inverse Hessian of a joint's shift; pass its information to the parent."""
    q: int = PARENT[j]
    bone, node, gradient = work.edge_information[j], work.node[j], work.node_gradient[j]
    inverse, total, together = work.position_inverse[j], work.a, work.b
    for i in range(3):
        for k in range(3):
            total[i, k] = node[i, k] + work.position_precision[j, i, k]
            if q >= 0:
                total[i, k] += bone[i, k]
                together[i, k] = work.position_coupling[j, i, k] + bone[i, k]
    invert3(total, inverse)
    if q < 0:
        return
    slope = work.position_slope[j]
    for i in range(3):
        gradient[i] += work.edge_gradient[j, i]
        for k in range(3):
            slope[i, k] = inverse[i, 0] * together[0, k] + inverse[i, 1] * together[1, k]
            slope[i, k] += inverse[i, 2] * together[2, k]
    for i in range(3):
        passed = slope[0, i] * gradient[0] + slope[1, i] * gradient[1] + slope[2, i] * gradient[2]
        work.node_gradient[q, i] += passed - work.edge_gradient[j, i]
        for k in range(3):
            taken = together[0, i] * slope[0, k] + together[1, i] * slope[1, k]
            taken += together[2, i] * slope[2, k]
            work.node[q, i, k] += work.position_back[j, i, k] + bone[i, k] - taken


@kernel
def _set_views(frame: Frame) -> None:
    """Copy pixels and precisions to `frame.views`."""
    z, sigma, ok, views = frame.z, frame.sigma, frame.ok, frame.views
    for c in range(len(views)):
        for j in range(len(ok)):
            good = ok[j, c]
            views[c, 0, j] = z[j, c, 0] if good else 0.0
            views[c, 1, j] = z[j, c, 1] if good else 0.0
            views[c, 2, j] = 1.0 / (sigma[j, c] * sigma[j, c]) if good else 0.0


@kernel
def _set_covariances(cov: Floats, points: Floats) -> None:
    """Copy position covariances (J, 3+, 3+) to their rows of `points` (N_POINT, LANES)."""
    for j in range(len(cov)):
        points[3, j], points[4, j], points[5, j] = cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2]
        points[6, j], points[7, j], points[8, j] = cov[j, 0, 1], cov[j, 0, 2], cov[j, 1, 2]


@kernel(fastmath=_REORDER)
def _add_view(
    p: Floats,
    points: Floats,
    view: Floats,
    widen: float,
    inlier_odds: float,
    image: Floats,
    sums: Floats,
) -> None:
    """Add one camera's information and gradient for all joints.

    Args:
        p: (3, 4) projection.
        points: (N_POINT, LANES) positions and predicted covariances.
        view: (N_VIEW, LANES) pixels and precisions.
        widen: factor on the prediction's pixel variance, which is added to the detector's variance
            in the weights of the measurements.
        inlier_odds: odds that a measurement without residual is an inlier, times its pixel
            variance [px^2].
        image: (N_IMAGE, LANES) weights, Jacobians and residuals, filled in.
        sums: (N_SUM, LANES) information and gradient, increased in place.
    """
    _project(p, points, view, widen, inlier_odds, image)
    for j in range(LANES):
        odds = math.exp(image[LOG_ODDS, j]) * image[FACTOR, j]
        image[BELIEF, j] = odds / (odds + 1.0)
    for j in range(LANES):
        a0, a1, a2 = image[A0, j], image[A1, j], image[A2, j]
        b0, b1, b2 = image[B0, j], image[B1, j], image[B2, j]
        weight = image[BELIEF, j] * view[2, j]
        sums[0, j] += weight * (a0 * a0 + b0 * b0)
        sums[1, j] += weight * (a1 * a1 + b1 * b1)
        sums[2, j] += weight * (a2 * a2 + b2 * b2)
        sums[3, j] += weight * (a0 * a1 + b0 * b1)
        sums[4, j] += weight * (a0 * a2 + b0 * b2)
        sums[5, j] += weight * (a1 * a2 + b1 * b2)
        du, dv = weight * image[DU, j], weight * image[DV, j]
        sums[6, j] += a0 * du + b0 * dv
        sums[7, j] += a1 * du + b1 * dv
        sums[8, j] += a2 * du + b2 * dv


@kernel(fastmath=_REORDER)
def _project(
    p: Floats,
    points: Floats,
    view: Floats,
    widen: float,
    inlier_odds: float,
    image: Floats,
) -> None:
    """Compute Jacobians, residuals and odds of all joints in one camera; see `_add_view`."""
    p00, p01, p02, p03 = p[0, 0], p[0, 1], p[0, 2], p[0, 3]
    p10, p11, p12, p13 = p[1, 0], p[1, 1], p[1, 2], p[1, 3]
    p20, p21, p22, p23 = p[2, 0], p[2, 1], p[2, 2], p[2, 3]
    for j in range(LANES):
        x, y, z = points[0, j], points[1, j], points[2, j]
        depth = p20 * x + p21 * y + p22 * z + p23
        near = 1.0 / depth if depth > NEAREST_DEPTH_M else 0.0
        u = (p00 * x + p01 * y + p02 * z + p03) * near
        v = (p10 * x + p11 * y + p12 * z + p13) * near
        a0, b0 = (p00 - u * p20) * near, (p10 - v * p20) * near
        a1, b1 = (p01 - u * p21) * near, (p11 - v * p21) * near
        a2, b2 = (p02 - u * p22) * near, (p12 - v * p22) * near
        own = points[3, j] * (a0 * a0 + b0 * b0) + points[4, j] * (a1 * a1 + b1 * b1)
        own += points[5, j] * (a2 * a2 + b2 * b2)
        cross = points[6, j] * (a0 * a1 + b0 * b1) + points[7, j] * (a0 * a2 + b0 * b2)
        cross += points[8, j] * (a1 * a2 + b1 * b2)
        du, dv, precision = view[0, j] - u, view[1, j] - v, view[2, j]
        usable = near * precision > 0.0
        spread = 1.0 / precision + widen * (0.5 * own + cross)
        narrow = 1.0 / spread if usable else 0.0
        image[LOG_ODDS, j] = -0.5 * (du * du + dv * dv) * narrow
        image[FACTOR, j] = inlier_odds * narrow
        image[A0, j], image[A1, j], image[A2, j] = a0, a1, a2
        image[B0, j], image[B1, j], image[B2, j] = b0, b1, b2
        image[DU, j], image[DV, j], image[NEARNESS, j] = du, dv, near


@kernel
def set_bone_variances(variance: Floats, give: float, out: Floats) -> None:
    """Compute the variances of the bones' lengths as measurements.

    Args:
        variance: (J,) variances of the learnt lengths [m^2].
        give: factor on the standard deviation of a length within one person.
        out: (J,) sums of the variances of the learnt lengths and of those within one person [m^2],
            filled in.
    """
    for j in range(len(variance)):
        out[j] = variance[j] + (give * EDGE_STIFFNESS_M[j]) ** 2
