"""The 15 joints as we read the paper's figure 1: names, pairs and bones.

The paper takes 15 of BlazePose's 33 landmarks, which its text does not name. A joint here has
BlazePose's meaning (a "hip" is where BlazePose puts a hip), which is not the anatomical centre; the
distances of the workers' true joints from the detector's are documented with the baked bodies.
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
"""Row of each of `JOINTS` in BlazePose's 33 landmarks (31, 32 are its foot tips)."""

MIRROR: Ints = np.array([0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13])
"""Joint that takes this joint's place when left and right are exchanged."""

TORSO: Ints = np.array([1, 2, 7, 8])
"""Shoulders and hips: their mean is the root of the body."""

BONES: Ints = np.array(
    [
        (1, 2), (7, 8), (1, 7), (2, 8),
        (1, 3), (3, 5), (2, 4), (4, 6),
        (7, 9), (9, 11), (11, 13), (8, 10), (10, 12), (12, 14),
        (0, 1), (0, 2),
    ]
)  # fmt: skip
"""Pairs of joints with a nearly constant distance."""

BONE_LENGTH_M: Floats = np.array(
    [.34, .20, .55, .55, .28, .26, .28, .26, .37, .40, .20, .37, .40, .20, .28, .28]
)  # fmt: skip
"""Lengths for an adult of unknown stature [m], standard deviation about 10 %: the mean of the
baked bodies' joints, which lie where BlazePose puts them (its hips are higher and its toes
farther out than anatomy's); refined per worker by the trackers that learn it."""

SEGMENT_ENDS: tuple[tuple[tuple[int, ...], tuple[int, ...], float], ...] = (
    ((0,), (0,), 0.13),  # head, a sphere round the nose that reaches over the hat's front
    ((1, 2), (7, 8), 0.16),  # trunk: mid-shoulder to mid-hip
    ((1,), (2,), 0.09),  # shoulder girdle
    ((7,), (8,), 0.13),  # pelvis
    ((1,), (3,), 0.065), ((2,), (4,), 0.065),  # upper arms
    ((3,), (5,), 0.055), ((4,), (6,), 0.055),  # forearms (hands: HAND_SEGMENTS)
    ((7,), (9,), 0.09), ((8,), (10,), 0.09),  # thighs
    ((9,), (11,), 0.065), ((10,), (12,), 0.065),  # shanks
    ((11,), (13,), 0.055), ((12,), (14,), 0.055),  # feet
)  # fmt: skip
"""Body segments from joints alone: the joints with their mean as the first end, those of the second
end, and the radius [m]."""

HAND_SEGMENTS: tuple[tuple[int, int, float, float], ...] = (
    (3, 5, 0.18, 0.05),
    (4, 6, 0.18, 0.05),
)
"""Hands, which the 15 joints do not include: elbow, wrist, reach beyond the wrist [m], radius
[m]."""


SEGMENT_RADIUS_M: Floats = np.array(
    [radius for *_, radius in SEGMENT_ENDS] + [radius for *_, radius in HAND_SEGMENTS]
)
