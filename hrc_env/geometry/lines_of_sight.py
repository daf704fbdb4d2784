"""Lines of sight: cameras as centres that look along rays, and where two rays pass each other."""

import math
from typing import Annotated

import numpy as np

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats

MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines that fixes a point."""


class Camera:
    """A pinhole camera of the rig."""

    P: Annotated[Floats, (3, 4)]
    """Projection from the world frame to pixels."""
    back: Annotated[Floats, (3, 3)]
    """Matrix from homogeneous pixels to ray directions in the world frame."""
    eye: Annotated[Floats, (3,)]
    """Optical centre in the world frame [m]."""
    focal: float
    """Focal length [px]."""


CAMERA = dtype_of(Camera)


def cameras_of(P: Floats) -> Records1[Camera]:
    """Return the cameras (C,) of projections P (C, 3, 4)."""
    cameras = make_records(Camera, len(P))
    model_cameras(np.ascontiguousarray(P, np.float64), cameras)
    return cameras


@kernel
def model_cameras(P, cameras):
    """Fill cameras (C,) in from their projections P (C, 3, 4)."""
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
def nearest_places(eye_1, ray_1, eye_2, ray_2, middle):
    """Distances along two lines to where they pass each other, their squared gap; the middle."""
    cosine, a, b = 0.0, 0.0, 0.0
    for i in range(3):
        between = eye_2[i] - eye_1[i]
        cosine += ray_1[i] * ray_2[i]
        a += between * ray_1[i]
        b += between * ray_2[i]
    crossing = 1.0 - cosine * cosine
    if crossing < MIN_CROSSING**2:
        return -1.0, -1.0, np.inf
    far_1, far_2, gap = (a - b * cosine) / crossing, (a * cosine - b) / crossing, 0.0
    for i in range(3):
        first, second = eye_1[i] + far_1 * ray_1[i], eye_2[i] + far_2 * ray_2[i]
        middle[i] = 0.5 * (first + second)
        gap += (first - second) ** 2
    return far_1, far_2, gap


@kernel
def look(back, u, v, ray):
    """Fill in the unit direction in which a pixel lies; `back` (3, 3) as in `CAMERA`."""
    length = 0.0
    for i in range(3):
        ray[i] = back[i, 0] * u + back[i, 1] * v + back[i, 2]
        length += ray[i] * ray[i]
    for i in range(3):
        ray[i] /= math.sqrt(length)
