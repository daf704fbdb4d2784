"""Where the pose network means joints to be, and where they are.

A hip of BlazePose is 17 mm above ours, from wherever it is seen, and six centimetres ahead of it in
who bends. Trackers follow what the network means; what is told of a worker are our joints. By how
much they differ was measured on renders, with the numbers that the emulator draws from
(`Calibration.offset_m`).
"""

from dataclasses import replace

import numba

from hrc_env.compiled import LEAN
from hrc_env.perception.calibration import HAND, KIND, read_calibration
from hrc_env.perception.outline import facing, folded, mixed, speed, stepping, weigh
from hrc_env.records import PoseEstimate
from hrc_env.typing import Floats

OFFSET_M: Floats = read_calibration().offset_m
"""(P, K, 3) ahead, to the joint's own side, up [m]."""


def our_joints(estimate: PoseEstimate) -> PoseEstimate:
    """An estimate (B, W, ...) of what the network means, as one of joints.

    Which way a body faces, how folded it is and whether it walks are the estimate's own; the prior
    of who is not tracked stays. Covariances and velocities are the same.
    """
    mean_world = estimate.mean_world.copy()
    _put_right(mean_world, estimate.velocity_world, estimate.tracked, OFFSET_M, KIND, HAND)
    return replace(estimate, mean_world=mean_world)


@numba.njit(**LEAN)
def _put_right(mean, velocity, tracked, offset, kinds, hands):
    for b in range(len(mean)):
        for w in range(mean.shape[1]):
            if not tracked[b, w]:
                continue
            joints = mean[b, w]
            front_x, front_y = facing(joints)
            posture = weigh(folded(joints), stepping(speed(velocity[b, w])))
            for j in range(len(joints)):
                k = kinds[j]
                ahead = mixed(posture, offset[0, k, 0], offset[1, k, 0], offset[2, k, 0])
                side = mixed(posture, offset[0, k, 1], offset[1, k, 1], offset[2, k, 1])
                up = mixed(posture, offset[0, k, 2], offset[1, k, 2], offset[2, k, 2])
                left = hands[j] * side
                joints[j, 0] -= front_x * ahead - front_y * left
                joints[j, 1] -= front_y * ahead + front_x * left
                joints[j, 2] -= up
