"""The 22 segments of a body in given control vectors, for pictures and checks."""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Points3, QuaternionsWxyz
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS, pose, quaternion
from hrc_env.worker.body import N_SEGMENTS


def segments_in(controls: Floats, anatomy: Anatomy) -> tuple[Points3, QuaternionsWxyz]:
    """Origins (T, 22, 3) [m] and turns (T, 22, 4) of control vectors (T, N_CONTROLS)."""
    position = np.empty((len(controls), N_SEGMENTS, 3))
    turn = np.empty((len(controls), N_SEGMENTS, 4))
    q = np.ascontiguousarray(controls)
    _segments(q, anatomy.offset, anatomy.frame, anatomy.size, position, turn)
    return position, turn


@kernel(makes_arrays=True)
def _segments(
    q: Floats, bones: Floats, frame: Floats, size: Floats, position: Floats, turn: Floats
) -> None:
    """One pose after the other."""
    p, r = np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3))
    for n in range(q.shape[0]):
        pose(q[n], bones, frame, size, p, r)
        for s in range(position.shape[1]):
            for i in range(3):
                position[n, s, i] = p[s, i]
            quaternion(r, s, turn[n])
