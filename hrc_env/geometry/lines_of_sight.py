"""Lines of sight of cameras, and the points at which two lines are closest to each other."""

import math
from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats

MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines at which their closest points are well defined."""


class Camera:
    """Parameters of a pinhole camera, derived from its projection matrix."""

    P: Annotated[Floats, (3, 4)]
    """Projection matrix from homogeneous world coordinates to homogeneous pixels."""
    back: Annotated[Floats, (3, 3)]
    """Matrix that converts homogeneous pixels to directions in the world."""
    eye: Annotated[Floats, (3,)]
    """Optical centre in the world frame [m]."""
    focal: float
    """Focal length [px]."""


CAMERA = dtype_of(Camera)
"""The dtype of `Camera`."""


class Crossing(NamedTuple):
    """The points at which two lines are closest to each other."""

    distance_1: float
    """Distance of the point along the first line [m]; negative if behind the line's origin."""
    distance_2: float
    """Distance of the point along the second line [m]; negative if behind the line's origin."""
    squared_gap: float
    """Squared distance between the points [m^2]; infinite if the lines are nearly parallel."""


def cameras_of(P: Floats) -> Records1[Camera]:
    """Return the cameras (C,) with projection matrices P (C, 3, 4)."""
    cameras = make_records(Camera, len(P))
    model_cameras(np.ascontiguousarray(P, np.float64), cameras)
    return cameras


@kernel
def model_cameras(P: Floats, cameras: Records1[Camera]) -> None:
    """Compute the fields of cameras (C,) from their projection matrices P (C, 3, 4)."""
    for c in range(len(P)):
        a, camera, inverse = P[c], cameras[c], cameras[c].back
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            for n in range(3):
                p, q = (n + 1) % 3, (n + 2) % 3
                inverse[n, i] = a[k, p] * a[m, q] - a[k, q] * a[m, p]
        determinant = a[0, 0] * inverse[0, 0] + a[0, 1] * inverse[1, 0] + a[0, 2] * inverse[2, 0]
        along = squared = 0.0
        for i in range(3):
            for n in range(3):
                inverse[i, n] /= determinant
            along += a[0, i] * a[2, i]
            squared += a[0, i] * a[0, i]
        camera.focal = math.sqrt(max(squared - along * along, 1e-12))
        for i in range(3):
            camera.eye[i] = -(
                inverse[i, 0] * a[0, 3] + inverse[i, 1] * a[1, 3] + inverse[i, 2] * a[2, 3]
            )
            for k in range(4):
                camera.P[i, k] = a[i, k]


@kernel(makes_arrays=True)
def nearest_places(
    eye_1: Floats, ray_1: Floats, eye_2: Floats, ray_2: Floats, middle: Floats
) -> Crossing:
    """Find the points at which two lines are closest to each other, and the points' midpoint.

    Args:
        eye_1: (3,) origin of the first line [m].
        ray_1: (3,) unit direction of the first line.
        eye_2: (3,) origin of the second line [m].
        ray_2: (3,) unit direction of the second line.
        middle: (3,) output: the midpoint [m]; unchanged if the lines are nearly parallel.
    """
    cosine, a, b = 0.0, 0.0, 0.0
    for i in range(3):
        between = eye_2[i] - eye_1[i]
        cosine += ray_1[i] * ray_2[i]
        a += between * ray_1[i]
        b += between * ray_2[i]
    crossing = 1.0 - cosine * cosine
    if crossing < MIN_CROSSING**2:
        return Crossing(-1.0, -1.0, np.inf)
    far_1, far_2, gap = (a - b * cosine) / crossing, (a * cosine - b) / crossing, 0.0
    for i in range(3):
        first, second = eye_1[i] + far_1 * ray_1[i], eye_2[i] + far_2 * ray_2[i]
        middle[i] = 0.5 * (first + second)
        gap += (first - second) ** 2
    return Crossing(far_1, far_2, gap)


@kernel
def look(back: Floats, u: float, v: float, ray: Floats) -> None:
    """Compute the viewing direction of a pixel in the world frame.

    Args:
        back: (3, 3) matrix `Camera.back`.
        u: column of the pixel [px].
        v: row of the pixel [px].
        ray: (3,) output: the unit direction.
    """
    length = 0.0
    for i in range(3):
        ray[i] = back[i, 0] * u + back[i, 1] * v + back[i, 2]
        length += ray[i] * ray[i]
    for i in range(3):
        ray[i] /= math.sqrt(length)
