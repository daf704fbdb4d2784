"""Where the whole body probably is: robust Gauss-Newton on the positions of the tree.

The prior of the positions alone is taken as a tree of 3-vectors; cameras inform single joints
(as in `proposal`, with the same graduated likelihood), bones inform edges. Each step solves one
45x45 system exactly by elimination from the leaves to the root and substitution back.
"""

import math

import numba

from hrc_env.skeleton import JOINT
from hrc_env.tracking.lanes import add_view, lanes_of, read_sums, set_points
from hrc_env.tracking.tree import ORDER, PARENT, inverse_of

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
    joints, views = lanes_of(cov, seen)
    for j in range(len(body)):
        for i in range(3):
            w.shift[j, i] = w.point[j, i] - body[j, i]
    for step in range(n_steps + 1):
        widening = widen if step < n_steps - 1 else 0.0
        _linearise_cameras(joints, views, seen[0], contrast, widening, belief, w)
        _linearise_bones(bones, w)
        if step < n_steps:
            _solve_positions(w)
            for j in range(len(body)):
                for i in range(3):
                    w.point[j, i] = body[j, i] + w.shift[j, i]
        widen *= 0.5


@numba.njit(fastmath=_REORDER, **_JIT)
def _position_prior(cov, slope, w):
    precision, pull, through = w.prior[0], w.prior[1], w.prior[2]
    edge, follow, rest = w.small[0], w.small[1], w.small[2]
    for m in range(len(ORDER)):
        j = ORDER[m]
        q = PARENT[j]
        if q < 0:
            _put(_inverse(cov[j]), precision[j])
            continue
        for i in range(3):
            for k in range(3):
                near = slope[j, i, 0] * cov[q, 0, k] + slope[j, i, 1] * cov[q, 1, k]
                near += slope[j, i, 2] * cov[q, 2, k] + slope[j, i, 3] * cov[q, 3, k]
                edge[i, k] = near + slope[j, i, 4] * cov[q, 4, k] + slope[j, i, 5] * cov[q, 5, k]
        if j == _RIGHT_SHOULDER:
            for i in range(3):
                for k in range(3):
                    w.across[i, k] = cov[j, i, k] + cov[q, i, k] - edge[i, k] - edge[k, i]
        _multiply_transposed(_inverse(cov[q]), edge, follow)  # the slope's transpose
        for i in range(3):
            for k in range(3):
                known = edge[i, 0] * follow[0, k] + edge[i, 1] * follow[1, k]
                rest[i, k] = cov[j, i, k] - known - edge[i, 2] * follow[2, k]
        given = _inverse(rest)
        _put(given, precision[j])
        _multiply_transposed(given, follow, pull[j])
        for i in range(3):
            for k in range(3):
                near = follow[i, 0] * pull[j, 0, k] + follow[i, 1] * pull[j, 1, k]
                through[j, i, k] = near + follow[i, 2] * pull[j, 2, k]


@numba.njit(forceinline=True, **_JIT)
def _inverse(a):
    """Of the upper left 3x3 block of a symmetric matrix, as `tree.inverse_of` gives it."""
    return inverse_of(a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2])


@numba.njit(forceinline=True, **_JIT)
def _put(half, out):
    out[0, 0], out[1, 1], out[2, 2] = half[0], half[2], half[5]
    out[1, 0] = out[0, 1] = half[1]
    out[2, 0] = out[0, 2] = half[3]
    out[2, 1] = out[1, 2] = half[4]


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _multiply(half, a, out):
    """out = s a for a symmetric s given as `inverse_of` gives it."""
    for k in range(3):
        x, y, z = a[0, k], a[1, k], a[2, k]
        out[0, k] = half[0] * x + half[1] * y + half[3] * z
        out[1, k] = half[1] * x + half[2] * y + half[4] * z
        out[2, k] = half[3] * x + half[4] * y + half[5] * z


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _multiply_transposed(half, a, out):
    """out = s a' for a symmetric s."""
    for k in range(3):
        x, y, z = a[k, 0], a[k, 1], a[k, 2]
        out[0, k] = half[0] * x + half[1] * y + half[3] * z
        out[1, k] = half[1] * x + half[2] * y + half[4] * z
        out[2, k] = half[3] * x + half[4] * y + half[5] * z


@numba.njit(**_JIT)
def _linearise_cameras(joints, views, P, contrast, widening, belief, w):
    """Information and gradient of what the cameras say, at w.point; `joints`, `views`: `camera`."""
    sums = w.sums
    set_points(w.point, joints)
    sums[:] = 0.0
    for c in range(len(P)):
        add_view(P[c], joints, views[c], widening, contrast, w.seen, sums)
        for j in range(len(belief)):
            belief[j, c] = w.seen[j]
    for j in range(len(belief)):
        read_sums(sums, j, w.camera_information[j], w.camera_gradient[j])
        for i in range(3):
            w.camera_gradient[j, i] += (
                w.camera_information[j, i, 0] * w.shift[j, 0]
                + w.camera_information[j, i, 1] * w.shift[j, 1]
                + w.camera_information[j, i, 2] * w.shift[j, 2]
            )


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


@numba.njit(fastmath=_REORDER, forceinline=True, **_JIT)
def _add_bone(j, end, length, variance, across, w):
    """A bone from joint j to `end`, its parent or (`across`) the right shoulder.

    One bone would hold the nose's mirror image in depth as gladly as the nose: it has two. The
    second is no edge of the tree; the right shoulder counts as a point that the left one
    carries, and what is not known of where it carries it counts as noise.
    """
    x, y = w.point[j, 0] - w.point[end, 0], w.point[j, 1] - w.point[end, 1]
    z = w.point[j, 2] - w.point[end, 2]
    now = math.sqrt(x * x + y * y + z * z) + 1e-9
    scale = 1.0 / now
    along = (x * scale, y * scale, z * scale)
    miss, q = length - now, PARENT[j]
    for i in range(3):
        miss += along[i] * (w.shift[j, i] - w.shift[q, i])
        for k in range(3):
            variance += along[i] * w.across[i, k] * along[k] if across else 0.0
    known = 1.0 / variance
    for i in range(3):
        pull = along[i] * known
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
        half = _inverse(hessian)
        _put(half, inverse[j])
        if q < 0:
            continue
        _multiply(half, coupling, follow[j])
        g0, g1, g2 = gradient[j, 0], gradient[j, 1], gradient[j, 2]
        for i in range(3):
            known = follow[j, 0, i] * g0 + follow[j, 1, i] * g1
            gradient[q, i] += known + follow[j, 2, i] * g2
            for k in range(3):
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
                for k in range(3):
                    total += follow[j, i, k] * w.shift[q, k]
            w.shift[j, i] = total
