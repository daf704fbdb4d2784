"""Separation of capsules, segments with a radius: how far surfaces are apart, and where.

The closest points of two segments follow Ericson, Real-Time Collision Detection (2005), 5.1.9.
"""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Capsules, Floats, Points3

SLACK_M = 1e-9
"""Far more than the rounding of a sphere's bound."""
_PARALLEL = 1e-13
"""Squared sine of an angle between segments that are parallel: a micrometre over their length."""


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
        capsules_b: (..., Kb, 2, 3), the same leading axes and perhaps more after them: then
            each first set is held against several second ones.
        radius_b_m: (..., Kb) likewise; or those of one body where the second sets are several.
    """
    lead = capsules_b.shape[:-3]
    flat_a, flat_b = _flat(capsules_a, 3), _flat(capsules_b, 3)
    gap, points = np.empty(len(flat_b)), np.empty((len(flat_b), 2, 3))
    _narrowest(flat_a, _flat(radius_a_m, 1), flat_b, _flat(radius_b_m, 1), gap, points)
    points = points.reshape(*lead, 2, 3)
    return Separation(gap.reshape(lead), points[..., 0, :], points[..., 1, :])


def _flat(array: Floats, n_last: int) -> Floats:
    """(..., *last) as (count, *last), contiguous."""
    shape = array.shape[-n_last:]
    return np.ascontiguousarray(array).reshape(math.prod(array.shape[:-n_last]), *shape)


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
    """Bounding spheres (4, K) of capsules: centre, radius; radii repeat body by body."""
    for k in range(len(capsules)):
        squared = 0.0
        for i in range(3):
            spheres[i, k] = 0.5 * (capsules[k, 0, i] + capsules[k, 1, i])
            squared += (capsules[k, 1, i] - capsules[k, 0, i]) ** 2
        spheres[3, k] = 0.5 * math.sqrt(squared) + radius[k % len(radius)]


@kernel(makes_arrays=True)
def _narrowest(a, radius_a, b, radius_b, gap, points):
    """Spheres bound the gaps from below: only pairs that they leave open are measured."""
    n_a, n_b = a.shape[1], b.shape[1]
    per_a, per_b = len(b) // max(len(a), 1), len(b) // max(len(radius_b), 1)
    per_first = len(b) // max(len(radius_a), 1)
    spheres_a, spheres_b = np.empty((4, n_a)), np.empty((4, n_b))
    for n in range(len(b)):
        first, first_m, second_m = a[n // per_a], radius_a[n // per_first], radius_b[n // per_b]
        _spheres(first, first_m, spheres_a)
        _spheres(b[n], second_m, spheres_b)
        gap[n], points[n] = np.inf, 0.0
        for k in range(n_a):
            for m in range(n_b):
                if _bound(spheres_a, k, spheres_b, m) > gap[n] + SLACK_M:
                    continue
                squared, s, t = closest_parameters(first[k, 0], first[k, 1], b[n, m, 0], b[n, m, 1])
                distance = math.sqrt(squared) - first_m[k] - second_m[m % len(second_m)]
                if distance < gap[n]:
                    gap[n] = distance
                    for i in range(3):
                        points[n, 0, i] = first[k, 0, i] + s * (first[k, 1, i] - first[k, 0, i])
                        points[n, 1, i] = b[n, m, 0, i] + t * (b[n, m, 1, i] - b[n, m, 0, i])


@kernel
def _bound(a, k, b, m):
    """The gap of two spheres."""
    dx, dy, dz = b[0, m] - a[0, k], b[1, m] - a[1, k], b[2, m] - a[2, k]
    return math.sqrt(dx * dx + dy * dy + dz * dz) - a[3, k] - b[3, m]
