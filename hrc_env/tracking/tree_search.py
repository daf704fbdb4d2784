"""Where the whole body probably is: robust Gauss-Newton on the positions of the tree.

The prior of the positions alone is taken as a tree of 3-vectors; cameras inform single joints
(as in `proposal`, with the same graduated likelihood), bones inform edges. Each step solves one
45x45 system exactly by elimination from the leaves to the root and substitution back.
"""

import math

import numba

from hrc_env.geometry.triangulation import inverse3
from hrc_env.skeleton import JOINT
from hrc_env.tracking.proposal import add_cameras
from hrc_env.tracking.tree import ORDER, PARENT

_NOSE, _RIGHT_SHOULDER = JOINT["nose"], JOINT["right_shoulder"]
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}
_REORDER = {"reassoc", "contract", "nsz"}


@numba.njit(**_JIT)
def find_pose(body, cov, slope, seen, bones, contrast, n_steps, belief, w):
    """Search the most probable positions and leave everything linearised there.

    Args:
        body, cov, slope: the prediction (J, 6), (J, 6, 6), (J, 6, 6).
        seen: P (C, 3, 4), z (J, C, 2), sigma (J, C), ok (J, C).
        bones: lengths (J,) to the parent [m] and their variances as measurements (J,) [m^2].
        contrast: as `proposal.contrast_of` gives.
        n_steps: Gauss-Newton steps.
        belief: (J, C) filled: how far each measurement is believed.
        w: scratch; point stays, and so does what cameras and bones say there: information
            and gradient of the log-likelihood as a function of the positions (of joints, and
            of joints less their parents') minus their predicted means, at 0.
    """
    for j in range(len(body)):
        for i in range(3):
            w.point[j, i] = body[j, i]
    find_pose_near(body, cov, slope, seen, bones, contrast, n_steps, 1.0, belief, w)


@numba.njit(**_JIT)
def find_pose_near(body, cov, slope, seen, bones, contrast, n_steps, widen, belief, w):
    """As `find_pose`, but the search begins at w.point (J, 3) instead of the predicted means.

    `widen` times the prior's own image variance is added to the detector's in the first step.
    """
    _position_prior(cov, slope, w)
    for j in range(len(body)):
        for i in range(3):
            w.shift[j, i] = w.point[j, i] - body[j, i]
    for step in range(n_steps + 1):
        widening = widen if step < n_steps - 1 else 0.0
        _linearise_cameras(cov, seen, contrast, widening, belief, w)
        _linearise_bones(bones, w)
        if step < n_steps:
            _solve_positions(w)
            for j in range(len(body)):
                for i in range(3):
                    w.point[j, i] = body[j, i] + w.shift[j, i]
        widen *= 0.5


@numba.njit(**_JIT)
def _position_prior(cov, slope, w):
    precision, pull, through = w.prior[0], w.prior[1], w.prior[2]
    edge, follow, rest = w.small[0], w.small[1], w.small[2]
    for m in range(len(ORDER)):
        j = ORDER[m]
        q = PARENT[j]
        if q < 0:
            rest[:] = cov[j, :3, :3]
            inverse3(rest, precision[j])
            continue
        inverse3(cov[q], rest)
        for i in range(3):
            for k in range(3):
                total = 0.0
                for h in range(6):
                    total += slope[j, i, h] * cov[q, h, k]
                edge[i, k] = total
        if j == _RIGHT_SHOULDER:
            for i in range(3):
                for k in range(3):
                    w.across[i, k] = cov[j, i, k] + cov[q, i, k] - edge[i, k] - edge[k, i]
        _product(edge, rest, follow)
        for i in range(3):
            for k in range(3):
                known = follow[i, 0] * edge[k, 0] + follow[i, 1] * edge[k, 1]
                rest[i, k] = cov[j, i, k] - known - follow[i, 2] * edge[k, 2]
        inverse3(rest, precision[j])
        _product(precision[j], follow, pull[j])
        _transposed_product(follow, pull[j], through[j])


@numba.njit(**_JIT)
def _linearise_cameras(cov, seen, contrast, widening, belief, w):
    P, z, sigma, ok = seen
    for j in range(len(ok)):
        information, gradient = w.camera_information[j], w.camera_gradient[j]
        for i in range(3):
            gradient[i] = 0.0
            for k in range(3):
                information[i, k] = 0.0
        add_cameras(
            P, z[j], sigma[j], ok[j], w.point[j], cov[j], widening, contrast,
            information, gradient, belief[j],
        )  # fmt: skip
        s0, s1, s2 = w.shift[j, 0], w.shift[j, 1], w.shift[j, 2]
        for i in range(3):
            gradient[i] += information[i, 0] * s0 + information[i, 1] * s1 + information[i, 2] * s2


@numba.njit(**_JIT)
def _linearise_bones(bones, w):
    length, variance = bones
    for m in range(1, len(ORDER)):
        j = ORDER[m]
        for i in range(3):
            w.edge_gradient[j, i] = 0.0
            for k in range(3):
                w.edge_information[j, i, k] = 0.0
        _add_bone(j, PARENT[j], length[j], variance[j], False, w)
    _add_bone(_NOSE, _RIGHT_SHOULDER, length[_NOSE], variance[_NOSE], True, w)


@numba.njit(**_JIT)
def _add_bone(j, end, length, variance, across, w):
    """A bone from joint j to `end`, its parent or (`across`) the right shoulder.

    One bone would hold the nose's mirror image in depth as gladly as the nose: it has two. The
    second is no edge of the tree; the right shoulder counts as a point that the left one
    carries, and what is not known of where it carries it counts as noise.
    """
    x, y = w.point[j, 0] - w.point[end, 0], w.point[j, 1] - w.point[end, 1]
    z = w.point[j, 2] - w.point[end, 2]
    now = math.sqrt(x * x + y * y + z * z) + 1e-9
    along = (x / now, y / now, z / now)
    miss, q = length - now, PARENT[j]
    for i in range(3):
        miss += along[i] * (w.shift[j, i] - w.shift[q, i])
        for k in range(3):
            variance += along[i] * w.across[i, k] * along[k] if across else 0.0
    for i in range(3):
        pull = along[i] / variance
        w.edge_gradient[j, i] += pull * miss
        for k in range(3):
            w.edge_information[j, i, k] += pull * along[k]


@numba.njit(fastmath=_REORDER, **_JIT)
def _solve_positions(w):
    """shift (J, 3) = the minimum of the quadratic that prior, cameras and bones make."""
    precision, pull, through = w.prior[0], w.prior[1], w.prior[2]
    inverse, follow, gradient = w.node[0], w.node[1], w.node_gradient
    coupling, hessian = w.small[0], w.small[1]
    for j in range(len(gradient)):
        for i in range(3):
            gradient[j, i] = w.camera_gradient[j, i]
            for k in range(3):
                inverse[j, i, k] = w.camera_information[j, i, k]  # the Hessian, until inverted
    for m in range(len(ORDER) - 1, -1, -1):
        j = ORDER[m]
        q = PARENT[j]
        for i in range(3):
            for k in range(3):
                hessian[i, k] = inverse[j, i, k] + precision[j, i, k]
        if q >= 0:
            for i in range(3):
                gradient[j, i] += w.edge_gradient[j, i]
                gradient[q, i] -= w.edge_gradient[j, i]
                for k in range(3):
                    both = w.edge_information[j, i, k]
                    hessian[i, k] += both
                    coupling[i, k] = pull[j, i, k] + both
                    inverse[q, i, k] += through[j, i, k] + both
        inverse3(hessian, inverse[j])
        if q < 0:
            continue
        _product(inverse[j], coupling, follow[j])
        for i in range(3):
            for k in range(3):
                gradient[q, i] += follow[j, k, i] * gradient[j, k]
                known = coupling[0, i] * follow[j, 0, k] + coupling[1, i] * follow[j, 1, k]
                inverse[q, i, k] -= known + coupling[2, i] * follow[j, 2, k]
    for m in range(len(ORDER)):
        j = ORDER[m]
        q = PARENT[j]
        for i in range(3):
            total = 0.0
            for k in range(3):
                total += inverse[j, i, k] * gradient[j, k]
                if q >= 0:
                    total += follow[j, i, k] * w.shift[q, k]
            w.shift[j, i] = total


@numba.njit(**_JIT)
def _product(a, b, out):
    for i in range(3):
        for k in range(3):
            out[i, k] = a[i, 0] * b[0, k] + a[i, 1] * b[1, k] + a[i, 2] * b[2, k]


@numba.njit(**_JIT)
def _transposed_product(a, b, out):
    for i in range(3):
        for k in range(3):
            out[i, k] = a[0, i] * b[0, k] + a[1, i] * b[1, k] + a[2, i] * b[2, k]
