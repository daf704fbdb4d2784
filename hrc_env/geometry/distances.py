"""Gaps between capsules: how far two bodies' surfaces are apart, and where.

A capsule is a segment with a radius. The closest points of two segments follow Ericson,
Real-Time Collision Detection (2005), section 5.1.9; the gap is the distance of the
segments less both radii, negative when the surfaces overlap.
"""

import math
from dataclasses import dataclass

import numba
import numpy as np

from hrc_env.typing import Capsules, Floats, Points3


@dataclass(frozen=True, slots=True)
class Gap:
    """The narrowest place between two sets of capsules, over leading axes (...)."""

    distance_m: Floats
    """(...,) surface distance [m]; negative inside; infinite where one set is empty."""
    point_a_world: Points3
    """(..., 3) closest point on the axis of the nearest capsule of the first set [m]."""
    point_b_world: Points3
    """(..., 3) the same of the second set [m]."""


def narrowest_gap(
    capsules_a: Capsules, radius_a_m: Floats, capsules_b: Capsules, radius_b_m: Floats
) -> Gap:
    """The smallest gap between any capsule of one set and any of the other.

    Args:
        capsules_a: (..., Ka, 2, 3) end points [m].
        radius_a_m: (Ka,) [m].
        capsules_b: (..., Kb, 2, 3), the same leading axes.
        radius_b_m: (Kb,).
    """
    lead = capsules_a.shape[:-3]
    count = math.prod(lead)
    flat_a = np.ascontiguousarray(capsules_a).reshape(count, *capsules_a.shape[-3:])
    flat_b = np.ascontiguousarray(capsules_b).reshape(count, *capsules_b.shape[-3:])
    gap, points = np.empty(count), np.empty((count, 2, 3))
    _narrowest(flat_a, radius_a_m, flat_b, radius_b_m, gap, points)
    points = points.reshape(*lead, 2, 3)
    return Gap(gap.reshape(lead), points[..., 0, :], points[..., 1, :])


@numba.njit(cache=True, nogil=True, error_model="numpy")
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
        if determinant > 1e-9 * a * e:  # not parallel
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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _spheres(capsules, radius, centre, reach):
    """Bounding spheres of capsules: they spare most of the pairs."""
    for k in range(len(radius)):
        length = 0.0
        for i in range(3):
            centre[k, i] = 0.5 * (capsules[k, 0, i] + capsules[k, 1, i])
            length += (capsules[k, 1, i] - capsules[k, 0, i]) ** 2
        reach[k] = 0.5 * math.sqrt(length) + radius[k]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _narrowest(a, radius_a, b, radius_b, gap, points):
    centre_a, reach_a = np.empty((len(radius_a), 3)), np.empty(len(radius_a))
    centre_b, reach_b = np.empty((b.shape[1], 3)), np.empty(b.shape[1])
    n_repeat = b.shape[1] // max(len(radius_b), 1)
    radii_b = np.empty(b.shape[1])
    for r in range(n_repeat):
        radii_b[r * len(radius_b) : (r + 1) * len(radius_b)] = radius_b
    for n in range(a.shape[0]):
        _spheres(a[n], radius_a, centre_a, reach_a)
        _spheres(b[n], radii_b, centre_b, reach_b)
        best = np.inf
        points[n] = 0.0
        for k in range(a.shape[1]):
            for m in range(b.shape[1]):
                dx = centre_a[k, 0] - centre_b[m, 0]
                dy = centre_a[k, 1] - centre_b[m, 1]
                dz = centre_a[k, 2] - centre_b[m, 2]
                near = best + reach_a[k] + reach_b[m]
                if dx * dx + dy * dy + dz * dz > near * near and near > 0.0:
                    continue
                squared, s, t = closest_parameters(a[n, k, 0], a[n, k, 1], b[n, m, 0], b[n, m, 1])
                distance = math.sqrt(squared) - radius_a[k] - radii_b[m]
                if distance < best:
                    best = distance
                    for i in range(3):
                        points[n, 0, i] = a[n, k, 0, i] + s * (a[n, k, 1, i] - a[n, k, 0, i])
                        points[n, 1, i] = b[n, m, 0, i] + t * (b[n, m, 1, i] - b[n, m, 0, i])
        gap[n] = best
