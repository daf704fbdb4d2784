"""Where the pose network means joints to be, and where they are.

A hip of BlazePose is 17 mm above ours, and 60 mm ahead of it in who bends. Trackers follow what the
network means; estimates are of our joints, by `Calibration.offset_m`.
"""

from dataclasses import replace

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import HAND, KIND, read_calibration
from hrc_env.perception.outline import facing, mix, posture_of

OFFSET_M: Floats = read_calibration().offset_m
"""(P, K, 3) ahead, to the joint's own side, up [m]."""


def our_joints(estimate: PoseEstimate) -> PoseEstimate:
    """An estimate (B, W, ...) of what the network means, as one of joints; the prior of who is not
    tracked, covariances and velocities stay."""
    mean_world = estimate.mean_world.copy()
    offset_of = OFFSET_M.reshape(len(OFFSET_M), -1)
    _put_right(mean_world, estimate.velocity_world, estimate.tracked, offset_of, KIND, HAND)
    return replace(estimate, mean_world=mean_world)


@kernel(makes_arrays=True)
def _put_right(mean, velocity, tracked, offset_of, kinds, hands):
    row = np.empty(offset_of.shape[1])
    offset = row.reshape(-1, 3)
    for b in range(len(mean)):
        for w in range(mean.shape[1]):
            if not tracked[b, w]:
                continue
            joints = mean[b, w]
            front_x, front_y = facing(joints)
            mix(posture_of(joints, velocity[b, w]), offset_of, row)
            for j in range(len(joints)):
                ahead, up = offset[kinds[j], 0], offset[kinds[j], 2]
                left = hands[j] * offset[kinds[j], 1]
                joints[j, 0] -= front_x * ahead - front_y * left
                joints[j, 1] -= front_y * ahead + front_x * left
                joints[j, 2] -= up
