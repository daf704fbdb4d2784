"""Search: the most probable positions of a body, given its prediction and one frame.

Robust Gauss-Newton on the positions of the tree. Cameras inform single joints, bones inform edges.
The likelihood of a pixel is a Gaussian about the joint's image or, with the outlier weight,
anything in the image. The search begins with it widened by the prior's own uncertainty, so that
good measurements of a badly predicted joint are not taken for outliers (graduated non-convexity).
Each step solves one 45x45 system exactly by elimination from the leaves to the root and
substitution back.

All joints in one camera are computed at once: a row for each quantity, a column for each joint.
Columns are filled up to a whole number of processor vectors, so that loops over them are compiled
to vector instructions.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M
from hrc_env.tracking.tree.gaussian import LEAVES_FIRST, ORDER, PARENT, invert3, multiply
from hrc_env.tracking.tree.state import EDGE_STIFFNESS_M, LANES, N_IMAGE

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]
BELIEF, LOG_ODDS, FACTOR, A0, A1, A2, B0, B1, B2, DU, DV, NEARNESS = range(N_IMAGE)
_REORDER = {"reassoc", "contract", "nsz"}  # NaN and infinity keep their meaning


@kernel
def find_pose(tree, frame, s, w):
    """Search the most probable positions of a predicted tree and leave everything linearised there.

    In `w` stay the point, the variances of the bones as measurements, and the information and
    gradient of cameras and bones there: those of the log-likelihood as a function of the positions
    (of joints, and of joints less their parents') minus their predicted means, at 0. Fills
    frame.belief and frame.images.
    """
    stiff_lengths(tree.bone_variance, s.bone_give, w.bone_variance)
    for j in range(len(tree.body)):
        for i in range(3):
            w.point[j, i] = tree.body[j, i]
    find_pose_near(tree, frame, s, s.gauss_newton_steps, 1.0, w)


@kernel
def find_pose_near(tree, frame, s, n_steps, widen, w):
    """As `find_pose`, but the search begins at w.point (J, 3) instead of the predicted means.

    `widen` times the prior's own image variance is added to the detector's in the first step.
    """
    body, cov, slope = tree.body, tree.cov, tree.slope
    for j in ORDER:
        if PARENT[j] >= 0:
            multiply(slope[j], cov[PARENT[j]], w.edge[j])
        _position_prior(j, cov, w)
        for i in range(3):
            w.shift[j, i] = w.point[j, i] - body[j, i]
    set_covariances(cov, w.points)
    set_views(frame)
    for step in range(n_steps + 1):
        widening = widen if step < n_steps - 1 else 0.0
        _linearise_cameras(frame, s.inlier_odds, widening, step == n_steps, w)
        _stand_on_the_floor(body, 1.0 / s.floor_std_m**2, w)
        _linearise_bones(tree.bone_length, w)
        _add_second_bone(cov, tree.bone_length, w)
        if step < n_steps:
            _solve_positions(body, w)
        widen *= 0.5


@kernel(fastmath=_REORDER)
def _position_prior(j, cov, w):
    """Precision of a position given its parent's, and how it follows that."""
    q, precision = PARENT[j], w.precision[j]
    if q < 0:
        invert3(cov[j], precision)
        return
    edge, follow, pull, back = w.edge[j], w.follow[j], w.pull_position[j], w.back_position[j]
    above, rest = w.a, w.b
    invert3(cov[q], above)
    for i in range(3):
        for k in range(3):
            follow[i, k] = edge[i, 0] * above[0, k] + edge[i, 1] * above[1, k]
            follow[i, k] += edge[i, 2] * above[2, k]
    for i in range(3):
        for k in range(i + 1):
            known = (
                follow[i, 0] * edge[k, 0] + follow[i, 1] * edge[k, 1] + follow[i, 2] * edge[k, 2]
            )
            rest[i, k] = cov[j, i, k] - known
    invert3(rest, precision)
    for i in range(3):
        for k in range(3):
            pull[i, k] = precision[i, 0] * follow[0, k] + precision[i, 1] * follow[1, k]
            pull[i, k] += precision[i, 2] * follow[2, k]
    for i in range(3):
        for k in range(3):
            back[i, k] = follow[0, i] * pull[0, k] + follow[1, i] * pull[1, k]
            back[i, k] += follow[2, i] * pull[2, k]


@kernel
def _linearise_cameras(frame, inlier_odds, widening, keep, w):
    """Write the cameras' information and gradient at the points; `keep` their images."""
    points, sums, belief = w.points, w.sums, frame.belief
    for j in range(len(belief)):
        for i in range(3):
            points[i, j] = w.point[j, i]
    sums[:] = 0.0
    for c in range(len(frame.P)):
        add_view(frame.P[c], points, frame.views[c], widening, inlier_odds, w.image, sums)
        for j in range(len(belief)):
            belief[j, c] = w.image[BELIEF, j]
        if keep:
            _keep_image(w.image, frame.images[c])
    for j in range(len(belief)):
        h, shift = w.camera_information[j], w.shift[j]
        h[0, 0], h[1, 1], h[2, 2] = sums[0, j], sums[1, j], sums[2, j]
        h[0, 1] = h[1, 0] = sums[3, j]
        h[0, 2] = h[2, 0] = sums[4, j]
        h[1, 2] = h[2, 1] = sums[5, j]
        for i in range(3):
            back = h[i, 0] * shift[0] + h[i, 1] * shift[1] + h[i, 2] * shift[2]
            w.camera_gradient[j, i] = sums[6 + i, j] + back


@kernel
def _keep_image(image, out):
    """Copy Jacobians, residuals and depths of a camera out of the scratch."""
    for row in range(A0, N_IMAGE):
        for j in range(LANES):
            out[row, j] = image[row, j]


@kernel
def _stand_on_the_floor(body, information, w):
    """Joints below the floor are measured to be on it: one view leaves open how far a body is."""
    for j in range(len(body)):
        if w.point[j, 2] < 0.0:
            w.camera_information[j, 2, 2] += information
            w.camera_gradient[j, 2] -= information * body[j, 2]


@kernel(fastmath=_REORDER)
def _linearise_bones(length, w):
    """What the bones from joints to their parents say, at the points."""
    for j in ORDER:
        q, a, b = PARENT[j], w.point[j], w.point[PARENT[j]]
        if q < 0:
            continue
        x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        now = math.sqrt(x * x + y * y + z * z) + 1e-9
        along = (x / now, y / now, z / now)
        miss = length[j] - now
        for i in range(3):
            miss += along[i] * (w.shift[j, i] - w.shift[q, i])
        for i in range(3):
            known = along[i] / w.bone_variance[j]
            w.edge_gradient[j, i] = known * miss
            for k in range(3):
                w.edge_information[j, i, k] = known * along[k]


@kernel(fastmath=_REORDER)
def _add_second_bone(cov, length, w):
    """The bone from the nose to the right shoulder: one alone would hold the nose's mirror image.

    It is no edge of the tree: the right shoulder counts as a point that the left one carries, and
    what is not known of where it carries it counts as noise.
    """
    nose, right, left = _NOSE, _RIGHT_SHOULDER, PARENT[_RIGHT_SHOULDER]
    a, b = w.point[nose], w.point[right]
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    now = math.sqrt(x * x + y * y + z * z) + 1e-9
    along = (x / now, y / now, z / now)
    miss, spread = length[nose] - now, w.bone_variance[nose]
    for i in range(3):
        miss += along[i] * (w.shift[nose, i] - w.shift[PARENT[nose], i])
        for k in range(3):
            across = cov[right, i, k] + cov[left, i, k] - 2.0 * w.edge[right, i, k]
            spread += along[i] * across * along[k]
    known = 1.0 / spread
    for i in range(3):
        w.edge_gradient[nose, i] += along[i] * known * miss
        for k in range(3):
            w.edge_information[nose, i, k] += along[i] * known * along[k]


@kernel
def _solve_positions(body, w):
    """Shifts = the minimum of the quadratic that prior, cameras and bones make."""
    for j in ORDER:
        for i in range(3):
            w.node_gradient[j, i] = w.camera_gradient[j, i]
            for k in range(3):
                w.node[j, i, k] = w.camera_information[j, i, k]
    for j in LEAVES_FIRST:
        _eliminate(j, w)
    for j in ORDER:
        q = PARENT[j]
        for i in range(3):
            total = 0.0
            for k in range(3):
                total += w.inverse_position[j, i, k] * w.node_gradient[j, k]
                if q >= 0:
                    total += w.follow[j, i, k] * w.shift[q, k]
            w.shift[j, i] = total
            w.point[j, i] = body[j, i] + total


@kernel(fastmath=_REORDER)
def _eliminate(j, w):
    """Slope and inverse Hessian of a joint's shift, and what it tells the parent's."""
    q, bone, node, gradient = PARENT[j], w.edge_information[j], w.node[j], w.node_gradient[j]
    inverse, total, together = w.inverse_position[j], w.a, w.b
    for i in range(3):
        for k in range(3):
            total[i, k] = node[i, k] + w.precision[j, i, k]
            if q >= 0:
                total[i, k] += bone[i, k]
                together[i, k] = w.pull_position[j, i, k] + bone[i, k]
    invert3(total, inverse)
    if q < 0:
        return
    follow = w.follow[j]
    for i in range(3):
        gradient[i] += w.edge_gradient[j, i]
        for k in range(3):
            follow[i, k] = inverse[i, 0] * together[0, k] + inverse[i, 1] * together[1, k]
            follow[i, k] += inverse[i, 2] * together[2, k]
    for i in range(3):
        passed = (
            follow[0, i] * gradient[0] + follow[1, i] * gradient[1] + follow[2, i] * gradient[2]
        )
        w.node_gradient[q, i] += passed - w.edge_gradient[j, i]
        for k in range(3):
            taken = together[0, i] * follow[0, k] + together[1, i] * follow[1, k]
            taken += together[2, i] * follow[2, k]
            w.node[q, i, k] += w.back_position[j, i, k] + bone[i, k] - taken


@kernel
def set_views(frame):
    """Put pixels and precisions into frame.views (C, N_VIEW, LANES)."""
    z, sigma, ok, views = frame.z, frame.sigma, frame.ok, frame.views
    for c in range(len(views)):
        for j in range(len(ok)):
            good = ok[j, c]
            views[c, 0, j] = z[j, c, 0] if good else 0.0
            views[c, 1, j] = z[j, c, 1] if good else 0.0
            views[c, 2, j] = 1.0 / (sigma[j, c] * sigma[j, c]) if good else 0.0


@kernel
def set_covariances(cov, points):
    """Put position covariances (J, 3+, 3+) into their rows."""
    for j in range(len(cov)):
        points[3, j], points[4, j], points[5, j] = cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2]
        points[6, j], points[7, j], points[8, j] = cov[j, 0, 1], cov[j, 0, 2], cov[j, 1, 2]


@kernel(fastmath=_REORDER)
def add_view(p, points, view, widen, inlier_odds, image, sums):
    """Add one camera's information and gradient, of all joints, to `sums` (N_SUM, LANES).

    `p` is (3, 4), `points` (N_POINT, LANES), `view` (N_VIEW, LANES); `widen` times the prior's
    variance in the image is added to the detector's in the decision how far each measurement is
    believed, which is left in `image` (N_IMAGE, LANES).
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
def _project(p, points, view, widen, inlier_odds, image):
    """Where the camera sees the joints, and how odd that the pixels lie where they do."""
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
def stiff_lengths(variance, give, out):
    """Variances (J,) of the lengths as measurements: what is not known of them, and the give."""
    for j in range(len(variance)):
        out[j] = variance[j] + (give * EDGE_STIFFNESS_M[j]) ** 2
