"""The 15 joints, as inferred from figure 1 of the paper: names, pairs and bones.

The paper uses 15 of BlazePose's 33 landmarks but does not name them. Joints are defined as in
BlazePose (a "hip" is where BlazePose detects a hip), not as anatomical centres; the remaining
distances between the workers' true joints and the detected ones are documented with the body
models.
"""

import numpy as np

from hrc_env.core.typing import Floats, Ints

JOINTS: tuple[str, ...] = (
    "nose",
    "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow",
    "left_wrist", "right_wrist",
    "left_hip", "right_hip",
    "left_knee", "right_knee",
    "left_ankle", "right_ankle",
    "left_foot", "right_foot",
)  # fmt: skip
"""Names of the joints in the order of every array (..., J, ...); left is the worker's left."""
N_JOINTS = len(JOINTS)
JOINT: dict[str, int] = {name: index for index, name in enumerate(JOINTS)}

BLAZEPOSE_INDEX: Ints = np.array([0, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28, 31, 32])
"""Index of each of `JOINTS` among BlazePose's 33 landmarks (31 and 32 are the tips of the feet)."""

MIRROR: Ints = np.array([0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13])
"""Index of the joint that corresponds to each joint on the opposite side of the body."""

TORSO: Ints = np.array([1, 2, 7, 8])
"""Indices of the shoulders and hips; their mean is the root of the body."""

BONES: Ints = np.array(
    [
        (1, 2), (7, 8), (1, 7), (2, 8),
        (1, 3), (3, 5), (2, 4), (4, 6),
        (7, 9), (9, 11), (11, 13), (8, 10), (10, 12), (12, 14),
        (0, 1), (0, 2),
    ]
)  # fmt: skip
"""Pairs of joints at a nearly constant distance."""

BONE_LENGTH_M: Floats = np.array(
    [.34, .20, .55, .55, .28, .26, .28, .26, .37, .40, .20, .37, .40, .20, .28, .28]
)  # fmt: skip
"""Bone lengths of an adult of unknown stature [m], with a standard deviation of about 10 %. They
are means over the workers' body models, with joints as BlazePose locates them: the hips are higher
and the toes farther out than the anatomical ones. Trackers that learn bone lengths refine them for
each worker."""
