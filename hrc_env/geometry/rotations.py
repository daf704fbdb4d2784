"""Rotations by matrices with any leading axes, and by unit quaternions (scalar first)."""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Points3, QuaternionsWxyz, Rotations, Vector3


def about_axis(axis: str, angle_rad: Floats | float) -> Rotations:
    """Return the rotations (..., 3, 3) about axis "x", "y" or "z" by angles of any shape."""
    angle = np.asarray(angle_rad, float)
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = {
        "x": [[one, zero, zero], [zero, c, -s], [zero, s, c]],
        "y": [[c, zero, s], [zero, one, zero], [-s, zero, c]],
        "z": [[c, -s, zero], [s, c, zero], [zero, zero, one]],
    }[axis]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def look_at(eye_world: Points3, target_world: Points3) -> Rotations:
    """Return the orientation R_world_from_cam of a camera that is aimed at a point.

    The camera's axes are OpenCV's (+X right, +Y down, +Z forward), and its image is upright. If the
    line of sight is vertical, +Y of the image is -Y of the world.
    """
    forward = np.asarray(target_world, float) - np.asarray(eye_world, float)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    length = np.linalg.norm(right)
    right = right / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
    return np.stack([right, np.cross(forward, right), forward], -1)


def from_rotation_vector(vector_rad: Floats) -> Rotations:
    """Return the rotation (3, 3) of a rotation vector (3,) [rad], by Rodrigues' formula."""
    x, y, z = np.asarray(vector_rad, float)
    angle = float(np.linalg.norm((x, y, z)))
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    half = np.sinc(angle / (2.0 * np.pi))  # sin(angle / 2) / (angle / 2)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * cross @ cross


def matrix(quaternion_wxyz: QuaternionsWxyz) -> Rotations:
    """Convert unit quaternions (..., 4) to rotation matrices (..., 3, 3)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion_wxyz, float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, -1) for row in rows], -2)


@kernel
def rotate(
    quaternion: Floats | tuple[float, ...], vector: Floats | tuple[float, float, float]
) -> Vector3:
    """Rotate a vector (3,) by a unit quaternion (w, u): v + 2 w (u x v) + 2 u x (u x v)."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    a = 2.0 * (y * vector[2] - z * vector[1])
    b = 2.0 * (z * vector[0] - x * vector[2])
    c = 2.0 * (x * vector[1] - y * vector[0])
    return Vector3(
        vector[0] + w * a + y * c - z * b,
        vector[1] + w * b + z * a - x * c,
        vector[2] + w * c + x * b - y * a,
    )
