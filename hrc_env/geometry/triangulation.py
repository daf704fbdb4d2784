"""Triangulation of points and their covariances from the points' pixels in several cameras.

A linear solution is refined by Gauss-Newton iterations on the reprojection error (Hartley and
Zisserman, Multiple View Geometry, 2nd ed., chapter 12). If a gate is given, only the largest set of
views that agree with each other is used, so that wrong detections are rejected.

Kernels process one point: projection matrices P (C, 3, 4), pixels z (C, 2), their standard
deviations sigma (C,) [px], and a mask (C,) of the views to use.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Covariances3, Floats, Points2, Points3

NEAREST_DEPTH_M = 0.05
"""Minimum depth of points with usable pixels [m]."""
FURTHEST_PX = 1e5
"""Maximum absolute pixel coordinate that is accepted as a measurement [px]."""


@dataclass(frozen=True, slots=True)
class Triangulation:
    """Triangulated points with covariances, which are NaN if fewer than two views were usable."""

    points_world: Points3
    """(B, W, J, 3) positions of the points in the world frame [m]."""
    cov_world: Covariances3
    """(B, W, J, 3, 3) covariances: the inverse of the information of the used views [m^2]."""
    used: Bools
    """(B, C, W, J) mask of the views from which each point was computed."""


class Pixel(NamedTuple):
    """Projection of a point into the image of a camera."""

    u: float
    """Column [px]."""
    v: float
    """Row [px]."""
    depth: float
    """Depth of the point [m]; zero or negative if it is behind the camera."""


def triangulate(P: Floats, px: Points2, sigma_px: Floats, gate_sigma: float = 0.0) -> Triangulation:
    """Triangulate points by weighted least squares from all views, or from agreeing views.

    Args:
        P: (C, 3, 4) projection matrices.
        px: (B, C, W, J, 2) pixels; NaN where missing.
        sigma_px: (B, C, W, J) standard deviations [px]; only views with finite and positive ones
            are used.
        gate_sigma: maximum reprojection error of agreeing views, in standard deviations; if 0, all
            views are used.

    Raises:
        ConfigError: an array has the wrong shape, or the gate is negative.
    """
    px, sigma_px = np.asarray(px, float), np.asarray(sigma_px, float)
    if not gate_sigma >= 0:
        raise ConfigError(f"gate_sigma must not be negative, got {gate_sigma}.")
    if px.ndim != 5 or px.shape[1] != len(P):
        raise ConfigError(f"px must have shape (B, {len(P)}, W, J, 2), got {px.shape}.")
    check_shape("sigma_px", sigma_px.shape, px.shape[:-1], "B, C, W, J")
    n_batch, _, n_workers, n_joints, _ = px.shape
    points = np.full((n_batch, n_workers, n_joints, 3), np.nan)
    cov = np.full((n_batch, n_workers, n_joints, 3, 3), np.nan)
    used = np.zeros(px.shape[:-1], bool)
    _triangulate_all(
        np.ascontiguousarray(P, float),
        np.ascontiguousarray(px),
        np.ascontiguousarray(sigma_px),
        gate_sigma,
        points,
        cov,
        used,
    )
    return Triangulation(points, cov, used)


@kernel(makes_arrays=True)
def _triangulate_all(
    P: Floats,
    px: Points2,
    sigma_px: Floats,
    gate_sigma: float,
    points: Points3,
    cov: Covariances3,
    used: Bools,
) -> None:
    """Compute the points, covariances and used views of `triangulate`."""
    n_batch, n_cameras, n_workers, n_joints, _ = px.shape
    z, sigma = np.empty((n_cameras, 2)), np.empty(n_cameras)
    ok, use = np.empty(n_cameras, np.bool_), np.empty(n_cameras, np.bool_)
    point, spread = np.empty(3), np.empty((3, 3))
    for b in range(n_batch):
        for w in range(n_workers):
            for j in range(n_joints):
                for c in range(n_cameras):
                    u, v, s = px[b, c, w, j, 0], px[b, c, w, j, 1], sigma_px[b, c, w, j]
                    ok[c] = abs(u) < FURTHEST_PX and abs(v) < FURTHEST_PX and 0 < s < np.inf
                    z[c, 0], z[c, 1], sigma[c] = u, v, s
                if gate_sigma > 0:
                    n_views = consensus_point(P, z, sigma, ok, gate_sigma, point, spread, use)
                else:
                    use[:] = ok
                    n_views = point_from_views(P, z, sigma, use, point, spread)
                if n_views >= 2:
                    points[b, w, j], cov[b, w, j], used[b, :, w, j] = point, spread, use


@kernel
def inverse3(a: Floats, out: Floats) -> float:
    """Compute the inverse `out` of a symmetric matrix (3, 3), and return the determinant."""
    m00 = a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2]
    m01 = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    m02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    m11 = a[0, 0] * a[2, 2] - a[0, 2] * a[0, 2]
    m12 = a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]
    m22 = a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]
    determinant = a[0, 0] * m00 + a[0, 1] * m01 + a[0, 2] * m02
    scale = 1.0 / determinant
    out[0, 0], out[1, 1], out[2, 2] = m00 * scale, m11 * scale, m22 * scale
    out[0, 1] = out[1, 0] = m01 * scale
    out[0, 2] = out[2, 0] = m02 * scale
    out[1, 2] = out[2, 1] = m12 * scale
    return determinant


@kernel
def pixel_of(camera: Floats, x: float, y: float, z: float) -> Pixel:
    """Return the pixel and the depth of a point [m] in a camera with projection matrix (3, 4)."""
    depth = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[2, 3]
    u = (camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z + camera[0, 3]) / depth
    v = (camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z + camera[1, 3]) / depth
    return Pixel(u, v, depth)


@kernel(makes_arrays=True)
def linear_point(P: Floats, z: Points2, use: Bools, out: Points3) -> bool:
    """Compute the linear least-squares point (3,) of the used views [m].

    Returns:
        Whether the point exists and is in front of all of these cameras.
    """
    information, inverse, right = np.zeros((3, 3)), np.empty((3, 3)), np.zeros(3)
    for c in range(len(P)):
        if not use[c]:
            continue
        for axis in range(2):
            n0 = z[c, axis] * P[c, 2, 0] - P[c, axis, 0]
            n1 = z[c, axis] * P[c, 2, 1] - P[c, axis, 1]
            n2 = z[c, axis] * P[c, 2, 2] - P[c, axis, 2]
            length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-300
            n0, n1, n2 = n0 / length, n1 / length, n2 / length
            offset = (P[c, axis, 3] - z[c, axis] * P[c, 2, 3]) / length
            add_outer(information, n0, n1, n2, 1.0)
            right[0] += n0 * offset
            right[1] += n1 * offset
            right[2] += n2 * offset
    trace = information[0, 0] + information[1, 1] + information[2, 2]
    if not inverse3(information, inverse) > 1e-13 * trace**3:
        return False
    for i in range(3):
        out[i] = inverse[i, 0] * right[0] + inverse[i, 1] * right[1] + inverse[i, 2] * right[2]
    for c in range(len(P)):
        if use[c] and not pixel_of(P[c], out[0], out[1], out[2]).depth > NEAREST_DEPTH_M:
            return False
    return True


@kernel
def add_outer(a: Floats, n0: float, n1: float, n2: float, weight: float) -> None:
    """Add the weighted outer product weight n n' to a symmetric matrix (3, 3)."""
    a[0, 0] += weight * n0 * n0
    a[1, 1] += weight * n1 * n1
    a[2, 2] += weight * n2 * n2
    a[0, 1] += weight * n0 * n1
    a[0, 2] += weight * n0 * n2
    a[1, 2] += weight * n1 * n2
    a[1, 0], a[2, 0], a[2, 1] = a[0, 1], a[0, 2], a[1, 2]


@kernel(makes_arrays=True)
def refine_point(
    P: Floats,
    z: Points2,
    sigma: Floats,
    use: Bools,
    point: Points3,
    cov: Covariances3,
    n_steps: int,
) -> bool:
    """Refine a point by Gauss-Newton iterations on the reprojection error.

    Args:
        P: (C, 3, 4) projection matrices.
        z: (C, 2) pixels.
        sigma: (C,) standard deviations [px].
        use: (C,) mask of the views to use.
        point: (3,) the point, which is changed [m].
        cov: (3, 3) output: the covariance, that is the inverse information [m^2].
        n_steps: number of iterations.

    Returns:
        Whether the point is finite, determined by the views, and in front of the cameras.
    """
    information, step, jacobian = np.empty((3, 3)), np.empty(3), np.empty((2, 3))
    for _ in range(n_steps):
        information[:], step[:] = 0.0, 0.0
        for c in range(len(P)):
            if not use[c]:
                continue
            camera = P[c]
            u, v, depth = pixel_of(camera, point[0], point[1], point[2])
            if not depth > NEAREST_DEPTH_M:
                return False
            for i in range(3):  # derivatives of the pixel with respect to the point [px/m]
                jacobian[0, i] = (camera[0, i] - u * camera[2, i]) / depth
                jacobian[1, i] = (camera[1, i] - v * camera[2, i]) / depth
            weight = 1.0 / sigma[c] ** 2
            for axis in range(2):
                a, b, d = jacobian[axis, 0], jacobian[axis, 1], jacobian[axis, 2]
                residual = weight * (z[c, axis] - (u if axis == 0 else v))
                add_outer(information, a, b, d, weight)
                step[0] += a * residual
                step[1] += b * residual
                step[2] += d * residual
        trace = information[0, 0] + information[1, 1] + information[2, 2]
        if not inverse3(information, cov) > 1e-13 * trace**3:
            return False
        for i in range(3):
            point[i] += cov[i, 0] * step[0] + cov[i, 1] * step[1] + cov[i, 2] * step[2]
    return math.isfinite(point[0] + point[1] + point[2])


@kernel
def point_from_views(
    P: Floats, z: Points2, sigma: Floats, use: Bools, point: Points3, cov: Covariances3
) -> int:
    """Compute the least-squares point (3,) [m] of the used views and its covariance (3, 3) [m^2].

    Returns:
        The number of used views, or 0 if there is no such point.
    """
    n_views = 0
    for c in range(len(P)):
        n_views += use[c]
    if n_views < 2 or not linear_point(P, z, use, point):
        return 0
    return n_views if refine_point(P, z, sigma, use, point, cov, 4) else 0


@kernel
def misfit(camera: Floats, u: float, v: float, sigma: float, point: Points3) -> float:
    """Return the squared reprojection error of a point, in units of the variance.

    Args:
        camera: (3, 4) projection matrix.
        u: column of the measured pixel [px].
        v: row of the measured pixel [px].
        sigma: standard deviation of each coordinate [px].
        point: (3,) the point [m].
    """
    expected_u, expected_v, depth = pixel_of(camera, point[0], point[1], point[2])
    if not depth > NEAREST_DEPTH_M:
        return np.inf
    return ((u - expected_u) ** 2 + (v - expected_v) ** 2) / sigma**2


@kernel(makes_arrays=True)
def consensus_point(
    P: Floats,
    z: Points2,
    sigma: Floats,
    ok: Bools,
    gate_sigma: float,
    point: Points3,
    cov: Covariances3,
    use: Bools,
) -> int:
    """Find the largest set of views that agree, starting from each pair of cameras.

    Args:
        P: (C, 3, 4) projection matrices.
        z: (C, 2) pixels.
        sigma: (C,) standard deviations [px].
        ok: (C,) mask of the candidate views.
        gate_sigma: maximum reprojection error of agreeing views, in standard deviations.
        point: (3,) output: the point computed from the agreeing views [m].
        cov: (3, 3) output: the covariance of the point [m^2].
        use: (C,) output: the mask of the agreeing views.

    Returns:
        The number of agreeing views, or 0 if there are fewer than two.
    """
    n_cameras, gate = len(P), gate_sigma * gate_sigma
    best, best_cost = np.zeros(3), np.inf
    for first in range(n_cameras):
        for second in range(first + 1, n_cameras):
            if not (ok[first] and ok[second]):
                continue
            use[:] = False
            use[first] = use[second] = True
            if not linear_point(P, z, use, point):
                continue
            cost = 0.0
            for c in range(n_cameras):
                if ok[c]:
                    cost += min(misfit(P[c], z[c, 0], z[c, 1], sigma[c], point), gate)
            if cost < best_cost:
                best_cost = cost
                best[:] = point
    if best_cost == np.inf:
        use[:] = False
        return 0
    point[:] = best
    n_views = 0
    for _ in range(2):  # choose the views again by the refined point, which is less noisy
        n_views = 0
        for c in range(n_cameras):
            use[c] = ok[c] and misfit(P[c], z[c, 0], z[c, 1], sigma[c], point) < gate
            n_views += use[c]
        if n_views < 2 or not refine_point(P, z, sigma, use, point, cov, 3):
            use[:] = False
            return 0
    return n_views
