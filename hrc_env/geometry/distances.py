"""Separation of capsules, segments with a radius: how far surfaces are apart, and where.

The closest points of two segments follow Ericson, Real-Time Collision Detection (2005), 5.1.9.
"""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import flat
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import HAND_SEGMENTS, SEGMENT_ENDS, SEGMENT_RADIUS_M
from hrc_env.core.typing import Capsules, Floats, Ints, Points3

SLACK_M = 1e-9
"""Far more than the rounding of a sphere's bound."""
_PARALLEL = 1e-13
"""Squared sine of an angle between segments that are parallel: a micrometre over their length."""
_ENDS: Ints = np.array([[(e[0], e[-1]) for e in ends[:2]] for ends in SEGMENT_ENDS])
"""(K, 2, 2) the two joints whose mean is each end (one twice where it is a joint itself)."""


@dataclass(frozen=True, slots=True)
class Separation:
    """The narrowest place between two sets of capsules, over leading axes (...)."""

    distance_m: Floats  # (...,) of the surfaces [m]; negative inside; infinite: a set is empty
    point_a_world: Points3  # (..., 3) closest point on the axis of the nearest of the first set
    point_b_world: Points3  # (..., 3) the same of the second set [m]


def least_separation(
    capsules_a: Capsules, radius_a_m: Floats, capsules_b: Capsules, radius_b_m: Floats
) -> Separation:
    """The smallest gap between any capsule of one set and any of the other.

    Args:
        capsules_a: (..., Ka, 2, 3) end points [m].
        radius_a_m: (..., Ka) with the first of its leading axes, or none [m].
        capsules_b: (..., Kb, 2, 3) with the same leading axes, or more after them: each first set
            is then held against several second ones.
        radius_b_m: (..., Kb) likewise; or those of one body where the second sets are several.
    """
    lead = capsules_b.shape[:-3]
    flat_a, flat_b = flat(capsules_a, 3), flat(capsules_b, 3)
    gap, points = np.empty(len(flat_b)), np.empty((len(flat_b), 2, 3))
    _narrowest(flat_a, flat(radius_a_m, 1), flat_b, flat(radius_b_m, 1), gap, points)
    points = points.reshape(*lead, 2, 3)
    return Separation(gap.reshape(lead), points[..., 0, :], points[..., 1, :])


@kernel
def closest_parameters(p0, p1, q0, q1):
    """Squared distance of two segments and where along each (0..1) it is attained."""
    ux, uy, uz = p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]
    vx, vy, vz = q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]
    wx, wy, wz = p0[0] - q0[0], p0[1] - q0[1], p0[2] - q0[2]
    a = ux * ux + uy * uy + uz * uz
    e = vx * vx + vy * vy + vz * vz
    f = vx * wx + vy * wy + vz * wz
    c = ux * wx + uy * wy + uz * wz
    b = ux * vx + uy * vy + uz * vz
    s, t = 0.0, 0.0
    if a > 1e-12 and e > 1e-12:
        determinant = a * e - b * b
        if determinant > _PARALLEL * a * e:
            s = min(1.0, max(0.0, (b * f - c * e) / determinant))
        t = (b * s + f) / e
        if t < 0.0:
            t, s = 0.0, min(1.0, max(0.0, -c / a))
        elif t > 1.0:
            t, s = 1.0, min(1.0, max(0.0, (b - c) / a))
    elif a > 1e-12:  # the second is a point
        s = min(1.0, max(0.0, -c / a))
    elif e > 1e-12:  # the first is a point
        t = min(1.0, max(0.0, f / e))
    dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return dx * dx + dy * dy + dz * dz, s, t


@kernel
def _spheres(capsules, radius, spheres):
    """Bounding spheres (5, K) of capsules: centre, radius, and the capsules' own; radii repeat body
    by body."""
    for k in range(len(capsules)):
        squared, own = 0.0, radius[k % len(radius)]
        for i in range(3):
            spheres[i, k] = 0.5 * (capsules[k, 0, i] + capsules[k, 1, i])
            squared += (capsules[k, 1, i] - capsules[k, 0, i]) ** 2
        spheres[3, k], spheres[4, k] = 0.5 * math.sqrt(squared) + own, own


@kernel
def _sphere_gaps(a, b, least):
    """least[k, m] = gap of sphere k of one set and sphere m of the other."""
    for k in range(a.shape[1]):
        x, y, z, reach = a[0, k], a[1, k], a[2, k], a[3, k]
        for m in range(b.shape[1]):
            dx, dy, dz = b[0, m] - x, b[1, m] - y, b[2, m] - z
            least[k, m] = math.sqrt(dx * dx + dy * dy + dz * dz) - reach - b[3, m]


@kernel(makes_arrays=True)
def _narrowest(a, radius_a, b, radius_b, gap, points):
    """Spheres bound the gaps from below: only pairs that they leave open are measured."""
    n_a, n_b = a.shape[1], b.shape[1]
    per_a, per_b = len(b) // max(len(a), 1), len(b) // max(len(radius_b), 1)
    per_first = len(b) // max(len(radius_a), 1)
    spheres_a, spheres_b = np.empty((5, n_a)), np.empty((5, n_b))
    least = np.empty((n_a, n_b))
    for n in range(len(b)):
        first = a[n // per_a]
        _spheres(first, radius_a[n // per_first], spheres_a)
        _spheres(b[n], radius_b[n // per_b], spheres_b)
        _sphere_gaps(spheres_a, spheres_b, least)
        points[n], gap[n] = 0.0, np.inf
        if least.size:
            gap[n] = _search(first, spheres_a[4], b[n], spheres_b[4], least, points[n])


@kernel
def _search(a, radius_a, b, radius_b, least, points):
    """The narrowest gap, below that of the most promising pair; of equal ones the first pair's."""
    likely, low, best = (0, 0), np.inf, np.inf
    for k in range(len(a)):
        for m in range(len(b)):
            if least[k, m] < low:
                likely, low = (k, m), least[k, m]
    k, m = likely
    limit = math.sqrt(closest_parameters(a[k, 0], a[k, 1], b[m, 0], b[m, 1])[0])
    limit += SLACK_M - radius_a[k] - radius_b[m]
    for k in range(len(a)):
        for m in range(len(b)):
            if least[k, m] <= limit:
                squared, s, t = closest_parameters(a[k, 0], a[k, 1], b[m, 0], b[m, 1])
                distance = math.sqrt(squared) - radius_a[k] - radius_b[m]
                if distance < best:
                    best, limit = distance, distance + SLACK_M
                    for i in range(3):
                        points[0, i] = a[k, 0, i] + s * (a[k, 1, i] - a[k, 0, i])
                        points[1, i] = b[m, 0, i] + t * (b[m, 1, i] - b[m, 0, i])
    return best


def segments(joints_world: Floats) -> Floats:
    """(..., 16, 2, 3) end points of a body's segments, the hands last, of joints (..., 15, 3) [m];
    radii are `SEGMENT_RADIUS_M`."""
    joints = flat(joints_world, 2)
    ends = np.empty((len(joints), len(SEGMENT_RADIUS_M), 2, 3))
    _segments(joints, ends)
    return ends.reshape(*joints_world.shape[:-2], *ends.shape[1:])


@kernel
def _segments(joints, ends):
    for b in range(joints.shape[0]):
        for k in range(len(_ENDS)):
            for e in range(2):
                first, second = joints[b, _ENDS[k, e, 0]], joints[b, _ENDS[k, e, 1]]
                for i in range(3):
                    ends[b, k, e, i] = 0.5 * (first[i] + second[i])
        for h in range(len(HAND_SEGMENTS)):
            elbow, wrist = joints[b, HAND_SEGMENTS[h][0]], joints[b, HAND_SEGMENTS[h][1]]
            squared, k = 0.0, len(_ENDS) + h
            for i in range(3):
                squared += (wrist[i] - elbow[i]) ** 2
            share = HAND_SEGMENTS[h][2] / max(math.sqrt(squared), 1e-6)
            for i in range(3):
                ends[b, k, 0, i] = wrist[i]
                ends[b, k, 1, i] = wrist[i] + share * (wrist[i] - elbow[i])
