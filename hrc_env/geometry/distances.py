"""Distances between capsules (segments with a radius), and their closest points.

The closest points of two segments are computed as in Ericson, Real-Time Collision Detection (2005),
5.1.9.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import flatten_axes
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Capsules, Floats, Points3

SLACK_M = 1e-9
"""Tolerance of the distance bounds from bounding spheres, far above their rounding errors [m]."""
_PARALLEL = 1e-13
"""Squared sine of the angle below which segments are considered parallel. Such segments diverge by
less than a micrometre per metre."""


@dataclass(frozen=True, slots=True)
class Separation:
    """The smallest distance between two sets of capsules, with any leading axes (...)."""

    distance_m: Floats
    """(...,) distance between the surfaces [m]; negative for overlaps, infinite for empty sets."""
    point_a_world: Points3
    """(..., 3) closest point on the axis of the nearest capsule of the first set [m]."""
    point_b_world: Points3
    """(..., 3) closest point on the axis of the nearest capsule of the second set [m]."""


class ClosestPoints(NamedTuple):
    """The closest points of two segments."""

    squared_distance: float
    """Squared distance between the closest points [m^2]."""
    s: float
    """Parameter of the point on the first segment, from 0 at the start to 1 at the end."""
    t: float
    """Parameter of the point on the second segment, from 0 at the start to 1 at the end."""


class Bounds(NamedTuple):
    """Work arrays of `find_gap`: bounding spheres, and lower bounds of distances."""

    spheres_a: Floats
    """(5, Ka) bounding spheres of the first set, as `_bound_capsules` computes them."""
    spheres_b: Floats
    """(5, Kb) bounding spheres of the second set."""
    least_m: Floats
    """(Ka, Kb) lower bounds of the distances between capsules [m]."""


def least_separation(
    capsules_a: Capsules, radius_a_m: Floats, capsules_b: Capsules, radius_b_m: Floats
) -> Separation:
    """Return the smallest distance between any capsule of one set and any capsule of another.

    Args:
        capsules_a: (..., Ka, 2, 3) end points of the first set [m].
        radius_a_m: (..., Ka) radii of the first set [m]. The leading axes are the first n of those
            of `capsules_a`, with any n.
        capsules_b: (..., Kb, 2, 3) end points of the second set [m]. The leading axes are those of
            `capsules_a`, optionally followed by further ones; in that case, each first set is
            compared with several second sets.
        radius_b_m: (..., Kb) radii of the second set [m], with leading axes as for `radius_a_m`. If
            there are several second sets, the radii of a single body suffice.
    """
    lead = capsules_b.shape[:-3]
    flat_a, flat_b = flatten_axes(capsules_a, 3), flatten_axes(capsules_b, 3)
    gap, points = np.empty(len(flat_b)), np.empty((len(flat_b), 2, 3))
    _find_narrowest(
        flat_a, flatten_axes(radius_a_m, 1), flat_b, flatten_axes(radius_b_m, 1), gap, points
    )
    points = points.reshape(*lead, 2, 3)
    return Separation(gap.reshape(lead), points[..., 0, :], points[..., 1, :])


@kernel
def closest_parameters(p0: Floats, p1: Floats, q0: Floats, q1: Floats) -> ClosestPoints:
    """Return the closest points of two segments.

    Args:
        p0: (3,) start of the first segment [m].
        p1: (3,) end of the first segment [m].
        q0: (3,) start of the second segment [m].
        q1: (3,) end of the second segment [m].
    """
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
    return ClosestPoints(dx * dx + dy * dy + dz * dz, s, t)


@kernel(makes_arrays=True)
def _find_narrowest(
    a: Capsules, radius_a: Floats, b: Capsules, radius_b: Floats, gap: Floats, points: Points3
) -> None:
    """Compute the distances `gap` (B,) of sets of capsules and the closest points (B, 2, 3).

    Bounding spheres give lower bounds of the distances, and only pairs of capsules that may be the
    nearest are evaluated.
    """
    n_a, n_b = a.shape[1], b.shape[1]
    per_a, per_b = len(b) // max(len(a), 1), len(b) // max(len(radius_b), 1)
    per_first = len(b) // max(len(radius_a), 1)
    bounds = Bounds(np.empty((5, n_a)), np.empty((5, n_b)), np.empty((n_a, n_b)))
    for n in range(len(b)):
        gap[n] = find_gap(
            a[n // per_a], radius_a[n // per_first], b[n], radius_b[n // per_b], bounds, points[n]
        )


@kernel
def find_gap(
    a: Capsules, radius_a: Floats, b: Capsules, radius_b: Floats, bounds: Bounds, points: Points3
) -> float:
    """Return the smallest distance between two sets of capsules; infinite if a set is empty [m].

    Args:
        a: (Ka, 2, 3) capsules of the first set [m].
        radius_a: radii of the first set, as for `_bound_capsules` [m].
        b: (Kb, 2, 3) capsules of the second set [m].
        radius_b: radii of the second set [m].
        bounds: work arrays.
        points: (2, 3) receives the closest points on the axes [m].
    """
    spheres_a, spheres_b, least_m = bounds.spheres_a, bounds.spheres_b, bounds.least_m
    _bound_capsules(a, radius_a, spheres_a)
    _bound_capsules(b, radius_b, spheres_b)
    for k in range(len(a)):
        x, y, z, reach = spheres_a[0, k], spheres_a[1, k], spheres_a[2, k], spheres_a[3, k]
        for m in range(len(b)):
            dx, dy, dz = spheres_b[0, m] - x, spheres_b[1, m] - y, spheres_b[2, m] - z
            least_m[k, m] = math.sqrt(dx * dx + dy * dy + dz * dz) - reach - spheres_b[3, m]
    points[:] = 0.0
    if not least_m.size:
        return np.inf
    return _search_pairs(a, spheres_a[4], b, spheres_b[4], least_m, points)


@kernel
def _bound_capsules(capsules: Capsules, radius: Floats, spheres: Floats) -> None:
    """Compute bounding spheres (5, K) of capsules: centre, radius and the capsule's radius [m].

    If there are fewer radii than capsules, they are the radii of one body and are repeated for
    every body.
    """
    for k in range(len(capsules)):
        squared, capsule_radius = 0.0, radius[k % len(radius)]
        for i in range(3):
            spheres[i, k] = 0.5 * (capsules[k, 0, i] + capsules[k, 1, i])
            squared += (capsules[k, 1, i] - capsules[k, 0, i]) ** 2
        spheres[3, k] = 0.5 * math.sqrt(squared) + capsule_radius
        spheres[4, k] = capsule_radius


@kernel
def _search_pairs(
    a: Capsules,
    radius_a: Floats,
    b: Capsules,
    radius_b: Floats,
    bounds: Floats,
    points: Points3,
) -> float:
    """Return the smallest distance between two sets of capsules, and find the closest points.

    The search begins with the pair with the smallest lower bound; if distances are equal, the first
    pair is used.

    Args:
        a: (Ka, 2, 3) capsules of the first set [m].
        radius_a: (Ka,) radii of the first set [m].
        b: (Kb, 2, 3) capsules of the second set [m].
        radius_b: (Kb,) radii of the second set [m].
        bounds: (Ka, Kb) lower bounds of the distances [m].
        points: (2, 3) output: the closest points on the axes [m].
    """
    likely_k, likely_m, low, best = 0, 0, np.inf, np.inf
    for k in range(len(a)):
        for m in range(len(b)):
            if bounds[k, m] < low:
                likely_k, likely_m, low = k, m, bounds[k, m]
    first, second = a[likely_k], b[likely_m]
    closest = closest_parameters(first[0], first[1], second[0], second[1])
    limit = math.sqrt(closest.squared_distance)
    limit += SLACK_M - radius_a[likely_k] - radius_b[likely_m]
    for k in range(len(a)):
        for m in range(len(b)):
            if bounds[k, m] <= limit:
                closest = closest_parameters(a[k, 0], a[k, 1], b[m, 0], b[m, 1])
                distance = math.sqrt(closest.squared_distance) - radius_a[k] - radius_b[m]
                if distance < best:
                    best, limit = distance, distance + SLACK_M
                    for i in range(3):
                        points[0, i] = a[k, 0, i] + closest.s * (a[k, 1, i] - a[k, 0, i])
                        points[1, i] = b[m, 0, i] + closest.t * (b[m, 1, i] - b[m, 0, i])
    return best
