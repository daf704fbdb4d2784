"""Rotation matrices from unit quaternions (scalar first) and back, over any leading axes."""

import numpy as np

from hrc_env.core.typing import QuaternionsWxyz, Rotations


def matrix_from_quaternion(quaternion_wxyz: QuaternionsWxyz) -> Rotations:
    """Convert unit quaternions (..., 4) to rotation matrices (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternion_wxyz, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def quaternion_from_matrix(rotation: Rotations) -> QuaternionsWxyz:
    """Convert rotation matrices (..., 3, 3) to unit quaternions (..., 4) with w >= 0 (Bar-Itzhack
    2000)."""
    m, trace = rotation, np.trace(rotation, axis1=-2, axis2=-1)
    skew = np.swapaxes(m, -1, -2) - m
    profile = np.empty((*m.shape[:-2], 4, 4))
    profile[..., 0, 0] = trace
    profile[..., 0, 1:] = profile[..., 1:, 0] = skew[..., [1, 2, 0], [2, 0, 1]]
    profile[..., 1:, 1:] = m + np.swapaxes(m, -1, -2) - trace[..., None, None] * np.eye(3)
    quaternion = np.linalg.eigh(profile)[1][..., -1]
    return np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
