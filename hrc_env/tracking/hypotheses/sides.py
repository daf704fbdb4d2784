"""Which cameras exchange left and right before there is a body to tell it by.

Two cameras that name sides alike triangulate limbs; two that do not meet nowhere, unless one's
sides are exchanged. That splits the cameras in two camps. Which of them is right is told by their
numbers and by the body that they show: the nose and the toes are in front.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import MIRROR
from hrc_env.geometry.triangulation import linear_point, misfit
from hrc_env.tracking.measurements import mirror
from hrc_env.tracking.models.acquisition import find_body
from hrc_env.tracking.tree.evidence import anatomy

_MIRROR = tuple(int(j) for j in MIRROR)
_SWAP_COST = 4.0
"""Negative log-probability that one camera exchanges left and right."""
_MOST, _FITS = 5.0, 0.4
"""No joint counts for more [nat]; where joints miss by more than this share of it, however they are
called, two cameras tell nothing of each other: one may hang askew."""


@kernel(makes_arrays=True)
def agree_on_sides(seen, s):
    """Mirror, in place, what was seen by cameras that exchange left and right."""
    n_cameras, n_joints = len(seen.P), len(_MIRROR)
    gain = np.zeros((n_cameras, n_cameras))
    for a in range(n_cameras):
        for b in range(a):
            gain[a, b] = gain[b, a] = _gain(seen, a, b)
    other = _camps(gain)
    n_other = other.sum()
    if n_other == 0:
        return
    for c in range(n_cameras):
        if other[c]:
            mirror(c, seen.z, seen.sigma, seen.ok)
    points, found = np.empty((n_joints, 3)), np.empty(n_joints, np.bool_)
    if not find_body(seen, s, points, np.empty((n_joints, 3, 3)), found):
        return
    turned, n_seeing = np.empty((n_joints, 3)), 0
    for j in range(n_joints):
        turned[_MIRROR[j]] = points[j]
    for c in range(n_cameras):
        n_seeing += seen.ok[:, c].any()
    fewer = _SWAP_COST * (n_seeing - 2 * n_other)
    if anatomy(turned) > anatomy(points) + fewer:
        for c in range(n_cameras):
            mirror(c, seen.z, seen.sigma, seen.ok)


@kernel(makes_arrays=True)
def _camps(gain):
    """(C,) which cameras name sides otherwise than the rest, the fewer: gain (C, C) is what two
    cameras' misfit falls by if one of them is mirrored."""
    other = gain[0] > _SWAP_COST
    for _ in range(len(gain)):
        best, most = -1, 0.0
        for c in range(len(gain)):
            more = -_SWAP_COST * (1.0 - 2.0 * other[c])
            for d in range(len(gain)):
                more += gain[c, d] if other[c] == other[d] else -gain[c, d]
            if more > most:
                best, most = c, more
        if best < 0:
            break
        other[best] = not other[best]
    if 2 * other.sum() > len(gain):
        for c in range(len(gain)):
            other[c] = not other[c]
    return other


@kernel(makes_arrays=True)
def _gain(seen, a, b):
    """By how much [nat] limbs fit better in two cameras if one of them is mirrored."""
    as_they_are, n_joints = _misfit(seen, a, b, False)
    exchanged, _ = _misfit(seen, a, b, True)
    fits = min(as_they_are, exchanged) < _FITS * _MOST * n_joints
    return as_they_are - exchanged if fits else 0.0


@kernel(makes_arrays=True)
def _misfit(seen, a, b, mirrored):
    """Negative log-likelihood [nat] of limbs' joints in two cameras, and how many there are."""
    total, n_joints = 0.0, 0
    use, z, point = np.zeros(len(seen.P), np.bool_), np.empty((len(seen.P), 2)), np.empty(3)
    use[a] = use[b] = True
    for j in range(len(_MIRROR)):
        i = _MIRROR[j] if mirrored else j
        if _MIRROR[j] == j or not (seen.ok[j, a] and seen.ok[i, b]):
            continue
        z[a], z[b] = seen.z[j, a], seen.z[i, b]
        miss = _MOST
        if linear_point(seen.P, z, use, point):
            miss = 0.5 * misfit(seen.P[a], z[a, 0], z[a, 1], seen.sigma[j, a], point)
            miss += 0.5 * misfit(seen.P[b], z[b, 0], z[b, 1], seen.sigma[i, b], point)
        total += min(miss, _MOST)
        n_joints += 1
    return total, n_joints
