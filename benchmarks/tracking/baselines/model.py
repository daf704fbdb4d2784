"""Model of a joint for filter libraries: constant velocity, with pixels as measurements."""

import numpy as np

from benchmarks.tracking.dlt import triangulate_frame
from benchmarks.tracking.rigs import DT_S
from hrc_env.core.typing import Floats, Points2, Points3

ACCELERATION = 10.0
"""Spectral density of the white acceleration of a joint [m^2/s^3]."""
START_STD_M, START_STD_M_S = 0.1, 1.0
"""Standard deviations of position [m] and velocity [m/s] in the first frame."""

_STEP = np.array([[1.0, DT_S], [0.0, 1.0]])
_NOISE = ACCELERATION * np.array([[DT_S**3 / 3, DT_S**2 / 2], [DT_S**2 / 2, DT_S]])
F: Floats = np.asarray(np.kron(_STEP, np.eye(3)), float)
"""Transition matrix (6, 6) of (position, velocity) over one frame at constant velocity."""
Q: Floats = np.asarray(np.kron(_NOISE, np.eye(3)), float)
"""Covariance (6, 6) of the process noise over one frame, for white acceleration."""
START_COV: Floats = np.diag([START_STD_M**2] * 3 + [START_STD_M_S**2] * 3)


def first_joints(P: Floats, px: Points2) -> Points3:
    """Triangulate each joint (J, 3) in the first frame in which two cameras detect it [m]."""
    joints = np.zeros((px.shape[2], 3))
    for frame in px[::-1]:
        joints = triangulate_frame(P, frame[None], joints[None])[0]
    return joints


def pixels(P: Floats, positions: Points3) -> Points2:
    """Project positions (..., 3) to pixels (..., 2 C) by the projection matrices P (C, 3, 4)."""
    shown = np.einsum("cij,...j->...ci", P[:, :, :3], positions) + P[:, :, 3]
    return (shown[..., :2] / shown[..., 2:]).reshape(*positions.shape[:-1], -1)
