"""All joints of a body in one camera at once: rows of numbers, one lane for each joint.

The robust likelihood of `proposal.add_cameras`, laid out so that a processor's vector
instructions take several joints at a time: a buffer is a sequence of rows of `LANES` numbers,
one number for each joint and one that is nobody's.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M

LANES = 16
"""Joints, rounded up to a whole number of vectors."""
JOINT_OF_LANE = (14, 13, 6, 5, 12, 11, 4, 3, 10, 9, 0, -1, 8, 7, 2, 1)
"""Joints from the leaves of the tree to its root (`quads` says why so); -1: nobody's lane."""
LANE_OF_JOINT = tuple(JOINT_OF_LANE.index(j) for j in range(N_JOINTS))
N_JOINT_ROWS = 9
"""x, y, z [m]; then 00, 11, 22, 01, 02, 12 of the prior's position covariance [m^2]."""
N_VIEW_ROWS = 12
"""Belief; logarithm and factor of its odds; Jacobian of u, of v [px/m]; precision [1/px^2];
residual of u, of v [px]."""
N_SUM_ROWS = 9
"""Information 00, 11, 22, 01, 02, 12 [1/m^2], then gradient [1/m]."""
_REORDER = {"reassoc", "contract", "nsz"}  # NaN and infinity keep their meaning


@kernel
def set_views(seen, views):
    """Put pixels and precisions into views (C, 3 rows); 0 stands for what was not measured."""
    _, z, sigma, ok = seen
    for c in range(len(views)):
        for n in range(3 * LANES):
            views[c, n] = 0.0
    for j in range(len(ok)):
        lane = LANE_OF_JOINT[j]
        for c in range(ok.shape[1]):
            if ok[j, c]:
                views[c, lane], views[c, LANES + lane] = z[j, c, 0], z[j, c, 1]
                views[c, 2 * LANES + lane] = 1.0 / (sigma[j, c] * sigma[j, c])


@kernel
def set_joints(body, cov, joints):
    """Put positions (J, 3+) and their covariances (J, 3+, 3+) into the rows of the joints."""
    for j in range(len(body)):
        lane = LANE_OF_JOINT[j]
        for i in range(3):
            joints[i * LANES + lane] = body[j, i]
            joints[(3 + i) * LANES + lane] = cov[j, i, i]
        joints[6 * LANES + lane], joints[7 * LANES + lane] = cov[j, 0, 1], cov[j, 0, 2]
        joints[8 * LANES + lane] = cov[j, 1, 2]


@kernel(fastmath=_REORDER)
def add_view(p, joints, view, widen, inlier_odds, seen, sums):
    """Add one camera's information and gradient, of all joints, to the rows of `sums`.

    Args:
        p: (3, 4).
        joints, view: rows, as `set_joints` and `set_views` give them.
        widen, inlier_odds: as in `proposal.add_cameras`.
        seen: rows filled, beliefs first.
        sums: rows added to.
    """
    _image(p, joints, view, widen, inlier_odds, seen)
    for j in range(LANES):
        odds = math.exp(seen[LANES + j]) * seen[2 * LANES + j]
        seen[j] = odds / (odds + 1.0)
    for j in range(LANES):
        a0, a1, a2 = seen[3 * LANES + j], seen[4 * LANES + j], seen[5 * LANES + j]
        b0, b1, b2 = seen[6 * LANES + j], seen[7 * LANES + j], seen[8 * LANES + j]
        weight = seen[j] * seen[9 * LANES + j]
        sums[j] += weight * (a0 * a0 + b0 * b0)
        sums[LANES + j] += weight * (a1 * a1 + b1 * b1)
        sums[2 * LANES + j] += weight * (a2 * a2 + b2 * b2)
        sums[3 * LANES + j] += weight * (a0 * a1 + b0 * b1)
        sums[4 * LANES + j] += weight * (a0 * a2 + b0 * b2)
        sums[5 * LANES + j] += weight * (a1 * a2 + b1 * b2)
        du, dv = weight * seen[10 * LANES + j], weight * seen[11 * LANES + j]
        sums[6 * LANES + j] += a0 * du + b0 * dv
        sums[7 * LANES + j] += a1 * du + b1 * dv
        sums[8 * LANES + j] += a2 * du + b2 * dv


@kernel(fastmath=_REORDER)
def _image(p, joints, view, widen, inlier_odds, seen):
    """Where the camera sees the joints, and how odd that the pixels lie where they do."""
    p00, p01, p02, p03 = p[0, 0], p[0, 1], p[0, 2], p[0, 3]
    p10, p11, p12, p13 = p[1, 0], p[1, 1], p[1, 2], p[1, 3]
    p20, p21, p22, p23 = p[2, 0], p[2, 1], p[2, 2], p[2, 3]
    for j in range(LANES):
        x, y, z = joints[j], joints[LANES + j], joints[2 * LANES + j]
        depth = p20 * x + p21 * y + p22 * z + p23
        near = 1.0 / depth if depth > NEAREST_DEPTH_M else 0.0
        u = (p00 * x + p01 * y + p02 * z + p03) * near
        v = (p10 * x + p11 * y + p12 * z + p13) * near
        a0, b0 = (p00 - u * p20) * near, (p10 - v * p20) * near
        a1, b1 = (p01 - u * p21) * near, (p11 - v * p21) * near
        a2, b2 = (p02 - u * p22) * near, (p12 - v * p22) * near
        own = joints[3 * LANES + j] * (a0 * a0 + b0 * b0)
        own += joints[4 * LANES + j] * (a1 * a1 + b1 * b1)
        own += joints[5 * LANES + j] * (a2 * a2 + b2 * b2)
        cross = joints[6 * LANES + j] * (a0 * a1 + b0 * b1)
        cross += joints[7 * LANES + j] * (a0 * a2 + b0 * b2)
        cross += joints[8 * LANES + j] * (a1 * a2 + b1 * b2)
        du, dv, precision = view[j] - u, view[LANES + j] - v, view[2 * LANES + j]
        usable = near * precision > 0.0
        spread = 1.0 / precision + widen * (0.5 * own + cross)
        narrow = 1.0 / spread if usable else 0.0
        seen[LANES + j] = -0.5 * (du * du + dv * dv) * narrow
        seen[2 * LANES + j] = inlier_odds * narrow
        seen[3 * LANES + j], seen[4 * LANES + j], seen[5 * LANES + j] = a0, a1, a2
        seen[6 * LANES + j], seen[7 * LANES + j], seen[8 * LANES + j] = b0, b1, b2
        seen[9 * LANES + j] = precision
        seen[10 * LANES + j], seen[11 * LANES + j] = du, dv
