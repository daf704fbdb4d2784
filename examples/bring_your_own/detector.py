"""A detector of your own, such as RTMPose; here BlazePose on the crop and on its mirror image.

python -m hrc_env --import examples/bring_your_own/detector.py play \
    --config detector.keypoints=mirrored
"""

import numpy as np

import hrc_env


def make():
    find_joints = hrc_env.load_blazepose()

    def find(crop):
        here, there = find_joints(crop), find_joints(np.ascontiguousarray(crop[:, ::-1]))
        if here is None or there is None:
            return None
        there = there[hrc_env.MIRROR]
        there[:, 0] = crop.shape[1] - there[:, 0]
        return 0.5 * (here + there)

    return find


hrc_env.register_detector("mirrored", make)
