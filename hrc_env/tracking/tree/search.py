"""Where the whole body probably is: robust Gauss-Newton on the positions of the tree.

The prior of the positions alone is taken as a tree of 3-vectors; cameras inform single joints
(as in `proposal`, with the same graduated likelihood), bones inform edges. Each step solves one
45x45 system exactly by elimination from the leaves to the root and substitution back.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.lanes import (
    JOINT_OF_LANE,
    LANE_OF_JOINT,
    LANES,
    add_view,
    set_joints,
    set_views,
)
from hrc_env.tracking.tree.positions import (
    ABOVE_SHIFT,
    BONE,
    CAMERA,
    LENGTH,
    MEAN,
    POINT,
    SHIFT,
    VARIANCE,
    linearise_bones,
    position_prior,
    solve_positions,
)
from hrc_env.tracking.tree.quads import (
    ABOVE,
    COV,
    EDGE,
    QUAD,
    QUADS,
    fetch_above,
    load_tree,
    offset,
)

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]
_REORDER = {"reassoc", "contract", "nsz"}


@kernel
def find_pose(body, cov, slope, seen, bones, inlier_odds, floor_std_m, n_steps, belief, w):
    """Search the most probable positions and leave everything linearised there.

    Args:
        body, cov, slope: the prediction (J, 6), (J, 6, 6), (J, 6, 6).
        seen: P (C, 3, 4), z (J, C, 2), sigma (J, C), ok (J, C).
        bones: lengths (J,) to the parent [m] and their variances as measurements (J,) [m^2].
        inlier_odds: as `proposal.inlier_odds_of` gives.
        floor_std_m: of the floor, as a measurement of whatever is below it [m].
        n_steps: Gauss-Newton steps.
        belief: (J, C) filled: how far each measurement is believed.
        w: scratch; the tree stays in its rows, and so do point and what cameras and bones say
            there: information and gradient of the log-likelihood as a function of the positions
            (of joints, and of joints less their parents') minus their predicted means, at 0.
    """
    for j in range(len(body)):
        for i in range(3):
            w.point[j, i] = body[j, i]
    how = (inlier_odds, floor_std_m, n_steps, 1.0)
    find_pose_near(body, cov, slope, seen, bones, *how, belief, w)


@kernel
def find_pose_near(
    body, cov, slope, seen, bones, inlier_odds, floor_std_m, n_steps, widen, belief, w
):  # fmt: skip
    """As `find_pose`, but the search begins at w.point (J, 3) instead of the predicted means.

    `widen` times the prior's own image variance is added to the detector's in the first step.
    """
    rows = w.rows
    load_tree(cov, slope, rows)
    for quad in range(QUADS):
        position_prior(rows, quad * QUAD)
    _load_positions(body, bones, w.point, rows)
    set_joints(body, cov, w.joints)
    set_views(seen, w.views)
    for step in range(n_steps + 1):
        widening = widen if step < n_steps - 1 else 0.0
        _linearise_cameras(w.views, seen[0], inlier_odds, widening, belief, w)
        _stand_on_the_floor(rows, 1.0 / floor_std_m**2)
        for quad in range(QUADS):
            fetch_above(rows, quad, SHIFT, ABOVE_SHIFT, 6)
            linearise_bones(rows, quad * QUAD)
        _add_second_bone(rows, bones)
        if step < n_steps:
            solve_positions(rows)
        widen *= 0.5
    _keep(rows, w)


@kernel
def _load_positions(body, bones, point, rows):
    """Means, shifts and bones in lanes; what has no parent has a bone that says nothing."""
    length, variance = bones
    for lane in range(LANES):
        j = JOINT_OF_LANE[lane]
        at = _place(lane)
        for i in range(3):
            mean = body[j, i] if j >= 0 else 1.0
            where = point[j, i] if j >= 0 else 1.0
            rows[at + MEAN + 4 * i] = mean
            rows[at + POINT + 4 * i] = where
            rows[at + SHIFT + 4 * i] = where - mean
        bone = j >= 0 and PARENT[j] >= 0
        rows[at + LENGTH] = length[j] if bone else 1.0
        rows[at + VARIANCE] = variance[j] if bone else math.inf


@kernel(forceinline=True)
def _place(lane):
    return lane // 4 * QUAD + lane % 4


@kernel
def _linearise_cameras(views, P, inlier_odds, widening, belief, w):
    """Information and gradient of what the cameras say, at the points."""
    rows, joints, sums = w.rows, w.joints, w.sums
    for quad in range(QUADS):
        for i in range(3):
            for lane in range(4):
                at = quad * QUAD + 4 * i + lane
                joints[i * LANES + 4 * quad + lane] = rows[at + POINT]
    sums[:] = 0.0
    for c in range(len(P)):
        add_view(P[c], joints, views[c], widening, inlier_odds, w.seen, sums)
        for j in range(len(belief)):
            belief[j, c] = w.seen[LANE_OF_JOINT[j]]
    for quad in range(QUADS):
        _take_cameras(sums, 4 * quad, rows, quad * QUAD)


@kernel(fastmath=_REORDER)
def _take_cameras(sums, first, rows, at):
    """A quad's cameras out of the lanes, their gradient moved back to the predicted means."""
    first, at = offset(first), offset(at)
    for lane in range(4):
        n, m = first + lane, at + lane
        i00, i11, i22 = sums[n], sums[n + LANES], sums[n + 2 * LANES]
        i01, i02, i12 = sums[n + 3 * LANES], sums[n + 4 * LANES], sums[n + 5 * LANES]
        x, y, z = rows[m + SHIFT], rows[m + SHIFT + 4], rows[m + SHIFT + 8]
        k = m + CAMERA
        rows[k], rows[k + 4], rows[k + 8] = i00, i01, i11
        rows[k + 12], rows[k + 16], rows[k + 20] = i02, i12, i22
        rows[k + 24] = sums[n + 6 * LANES] + i00 * x + i01 * y + i02 * z
        rows[k + 28] = sums[n + 7 * LANES] + i01 * x + i11 * y + i12 * z
        rows[k + 32] = sums[n + 8 * LANES] + i02 * x + i12 * y + i22 * z


@kernel
def _stand_on_the_floor(rows, information):
    """Joints that are below the floor are measured to be on it; the others hear nothing of it.

    One view leaves the depth open, and a body that looks small is as well a far one. It would go
    through the floor for that.
    """
    for quad in range(QUADS):
        for lane in range(4):
            m = offset(quad * QUAD + lane)
            if rows[m + POINT + 8] < 0.0:
                rows[m + CAMERA + 20] += information
                rows[m + CAMERA + 32] -= information * rows[m + MEAN + 8]


@kernel(fastmath=_REORDER)
def _add_second_bone(rows, bones):
    """The bone from the nose to the right shoulder.

    One bone would hold the nose's mirror image in depth as gladly as the nose: it has two. The
    second is no edge of the tree; the right shoulder counts as a point that the left one
    carries, and what is not known of where it carries it counts as noise.
    """
    length, variance = bones
    nose, right = _place(LANE_OF_JOINT[_NOSE]), _place(LANE_OF_JOINT[_RIGHT_SHOULDER])
    x, y, z = (
        rows[nose + POINT] - rows[right + POINT],
        rows[nose + POINT + 4] - rows[right + POINT + 4],
        rows[nose + POINT + 8] - rows[right + POINT + 8],
    )
    now = math.sqrt(x * x + y * y + z * z) + 1e-9
    along = (x / now, y / now, z / now)
    miss, spread = length[_NOSE] - now, variance[_NOSE]
    for i in range(3):
        miss += along[i] * (rows[nose + SHIFT + 4 * i] - rows[nose + ABOVE_SHIFT + 4 * i])
        for k in range(3):
            n = right + 24 * i + 4 * k
            across = rows[n + COV] + rows[n + ABOVE] - 2.0 * rows[n + EDGE]
            spread += along[i] * across * along[k]
    n, known = nose + BONE, 1.0 / spread
    for i in range(3):
        for k in range(i + 1):
            rows[n] += along[i] * known * along[k]
            n += 4
    for i in range(3):
        rows[n] += along[i] * known * miss
        n += 4


@kernel
def _keep(rows, w):
    """Points, and what cameras and bones say there, by joint."""
    for j in range(len(w.point)):
        at = _place(LANE_OF_JOINT[j])
        camera, bone = at + CAMERA, at + BONE
        for i in range(3):
            w.point[j, i] = rows[at + POINT + 4 * i]
            w.camera_gradient[j, i] = rows[at + CAMERA + 24 + 4 * i]
            w.edge_gradient[j, i] = rows[at + BONE + 24 + 4 * i]
            for k in range(i + 1):
                w.camera_information[j, i, k] = w.camera_information[j, k, i] = rows[camera]
                w.edge_information[j, i, k] = w.edge_information[j, k, i] = rows[bone]
                camera += 4
                bone += 4
