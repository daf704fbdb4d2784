"""A detector of your own, as RTMPose would be: here BlazePose on the crop and on its mirror image.

python -m hrc_env --import examples/bring_your_own/detector.py play \
    --config detector.keypoints=mirrored
"""

import numpy as np

import hrc_env
from hrc_env.core.skeleton import BLAZEPOSE_INDEX, MIRROR
from hrc_env.perception import blazepose
from hrc_env.perception.network import LANDMARK_SIDE, load_landmarker


def make():
    network = load_landmarker()

    def joints_in(crop):
        points, presence, heat = network(blazepose.landmark_input(crop))
        return blazepose.decode_landmarks(points, heat)[BLAZEPOSE_INDEX], presence

    def find(crop):
        here, presence = joints_in(crop)
        there, also = joints_in(np.ascontiguousarray(crop[:, ::-1]))
        if min(presence, also) < 0.5:
            return None
        there = there[MIRROR]
        there[:, 0] = 1.0 - there[:, 0]
        both = 0.5 * (here[:, :3] + there[:, :3])
        return np.c_[LANDMARK_SIDE * both[:, :2], both[:, 2]]

    return find


hrc_env.register_detector("mirrored", make)
