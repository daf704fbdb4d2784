"""A body from its joints: the segments between them, and the hands beyond the wrists."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import HAND_SEGMENTS, N_JOINTS, SEGMENT_ENDS, SEGMENT_RADIUS_M
from hrc_env.core.typing import Floats, Ints

_FIRST_ENDS: Ints = np.array([(first[0], first[-1]) for first, _, _ in SEGMENT_ENDS])
_SECOND_ENDS: Ints = np.array([(second[0], second[-1]) for _, second, _ in SEGMENT_ENDS])
"""The two joints whose mean is each end (the same one twice where it is a joint itself)."""
_HANDS: Ints = np.array([(elbow, wrist) for elbow, wrist, _, _ in HAND_SEGMENTS])
_HAND_REACH_M: Floats = np.array([reach_m for _, _, reach_m, _ in HAND_SEGMENTS])


def segments(joints_world: Floats) -> Floats:
    """End points of the body's segments, the hands last.

    Args:
        joints_world: (..., 15, 3) joints [m].

    Returns:
        (..., 16, 2, 3) end points [m]; radii are `SEGMENT_RADIUS_M`.
    """
    lead = joints_world.shape[:-2]
    flat = np.ascontiguousarray(joints_world).reshape(math.prod(lead), N_JOINTS, 3)
    ends = np.empty((len(flat), len(SEGMENT_RADIUS_M), 2, 3))
    _segments(flat, _FIRST_ENDS, _SECOND_ENDS, _HANDS, _HAND_REACH_M, ends)
    return ends.reshape(*lead, *ends.shape[1:])


@kernel
def _segments(joints, first, second, hands, hand_reach_m, ends):
    for b in range(joints.shape[0]):
        for k in range(len(first)):
            for i in range(3):
                ends[b, k, 0, i] = 0.5 * (joints[b, first[k, 0], i] + joints[b, first[k, 1], i])
                ends[b, k, 1, i] = 0.5 * (joints[b, second[k, 0], i] + joints[b, second[k, 1], i])
        for h in range(len(hands)):
            elbow, wrist, k = joints[b, hands[h, 0]], joints[b, hands[h, 1]], len(first) + h
            squared = 0.0
            for i in range(3):
                squared += (wrist[i] - elbow[i]) ** 2
            share = hand_reach_m[h] / max(math.sqrt(squared), 1e-6)
            for i in range(3):
                ends[b, k, 0, i] = wrist[i]
                ends[b, k, 1, i] = wrist[i] + share * (wrist[i] - elbow[i])
