"""A worker of sticks for tests that need no picture: x forward, y left, z up [m]."""

import numpy as np

from hrc_env.core.records import WorkerTruth
from hrc_env.geometry.enclosure import enclose

STANDING = np.array(
    [
        (0.12, 0.0, 1.60),
        (0.0, 0.18, 1.43), (0.0, -0.18, 1.43),
        (0.0, 0.28, 1.16), (0.0, -0.28, 1.16),
        (0.1, 0.32, 0.92), (0.1, -0.32, 0.92),
        (0.0, 0.11, 0.94), (0.0, -0.11, 0.94),
        (0.03, 0.12, 0.51), (0.03, -0.12, 0.51),
        (0.0, 0.13, 0.10), (0.0, -0.13, 0.10),
        (0.17, 0.14, 0.04), (0.17, -0.14, 0.04),
    ]
)  # fmt: skip


def truth(batch=1, n_workers=1, at=(0.9, 0.0, 0.0)):
    """`STANDING` at a place in every environment; further workers stand 1 m aside."""
    shift = np.array(at) + np.arange(n_workers)[:, None] * [0.0, 1.0, 0.0]
    joints = np.broadcast_to(STANDING + shift[:, None], (batch, n_workers, 15, 3)).copy()
    return WorkerTruth(joints, np.zeros_like(joints), *enclose(joints))
