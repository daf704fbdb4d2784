"""Posture and facing of bodies, on which a detector's errors depend.

Joints (J, 3) are in the order of `core.skeleton.JOINTS`: nose 0; left and right shoulder 1 2, elbow
3 4, wrist 5 6, hip 7 8, knee 9 10, ankle 11 12. Their z axis is up.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Points3, Velocities3

UPRIGHT, FOLDED = 0.15, 0.50
"""Relative reductions of the shoulders' height above the ankles from which a body is partly and
fully regarded as folded. The reduction is below 0.12 in walking and above 0.3 in bending or
kneeling."""
SQUATS, KNEELS = 0.40, 0.10
"""Heights of the lower knee above its ankle, as fractions of the shank's length, below which a
folded body is partly and fully regarded as kneeling. The height is above 0.5 in squatting and 0
with a knee on the ground."""
STANDS_M_S, WALKS_M_S = 0.3, 0.7
"""Mean speeds of the joints above which a body is partly and fully regarded as walking [m/s]. The
speed is equal to the first value in hammering, and above the second one in slow walking."""
HANGS, RAISED = 0.10, 0.25
"""Reductions of a shoulder's height above its wrist, as fractions of the arm's length, above which
hands are partly and fully regarded as busy. The reduction is equal to the first value for swinging
arms, and above the second one in carrying."""
LEAN_RAD = math.radians(30.0)
"""Angle from the vertical above which a torso is regarded as bent [rad]. For bent bodies, the
errors of the network `full` are 50 % larger."""
LOW_HIPS = 0.75
"""Height of the hips above the lower ankle, as a fraction of the leg's length, below which a body
is regarded as squatting or kneeling. In walking, it remains above 0.9."""


class Facing(NamedTuple):
    """The horizontal unit vector towards the front of a body."""

    x: float
    """First coordinate in the world frame."""
    y: float
    """Second coordinate in the world frame."""


class Posture(NamedTuple):
    """Posture of a body as weights of `calibration.POSTURES`, with a sum of 1."""

    standing: float
    """Weight of the posture "standing, with free hands"."""
    walking: float
    """Weight of the posture "walking, with free hands"."""
    handling: float
    """Weight of the posture "upright, with busy hands"."""
    folded: float
    """Weight of the posture "bending or squatting"."""
    kneeling: float
    """Weight of the posture "kneeling, with a knee on the ground"."""


STANDING = Posture(1.0, 0.0, 0.0, 0.0, 0.0)
"""The posture of a standing body with free hands."""


@kernel
def facing(joints: Points3) -> Facing:
    """Return the direction towards the front of a body (J, 3), or +x if it is not defined."""
    left_x = joints[1, 0] - joints[2, 0] + joints[7, 0] - joints[8, 0]
    left_y = joints[1, 1] - joints[2, 1] + joints[7, 1] - joints[8, 1]
    length = math.sqrt(left_x * left_x + left_y * left_y)
    if length < 1e-9:
        return Facing(1.0, 0.0)
    return Facing(left_y / length, -left_x / length)


@kernel
def folding(joints: Points3) -> float:
    """Return the degree to which a body (J, 3) is folded, from 0 (upright) to 1 (folded)."""
    height = 0.0
    for side in range(2):
        height += joints[1 + side, 2] - joints[11 + side, 2]
    share = 1.0 - 0.5 * height / _length_m(joints)
    return min(max((share - UPRIGHT) / (FOLDED - UPRIGHT), 0.0), 1.0)


@kernel
def kneeling(joints: Points3) -> float:
    """Return the degree to which a folded body (J, 3) kneels, from 0 to 1 (knee on the ground)."""
    least = 1.0
    for side in range(2):
        knee, ankle = 9 + side, 11 + side
        rise = joints[knee, 2] - joints[ankle, 2]
        least = min(least, rise / max(_distance(joints, knee, ankle), 1e-9))
    return min(max((SQUATS - least) / (SQUATS - KNEELS), 0.0), 1.0)


@kernel
def speed(velocity: Velocities3) -> float:
    """Return the mean speed of joints (J, 3) [m/s]."""
    total = 0.0
    for j in range(len(velocity)):
        x, y, z = velocity[j, 0], velocity[j, 1], velocity[j, 2]
        total += math.sqrt(x * x + y * y + z * z)
    return total / len(velocity)


@kernel
def stepping(mean_speed_m_s: float) -> float:
    """Return the degree of walking, from 0 (standing) to 1, for a mean speed of the joints."""
    return min(max((mean_speed_m_s - STANDS_M_S) / (WALKS_M_S - STANDS_M_S), 0.0), 1.0)


@kernel
def handling(joints: Points3) -> float:
    """Return the degree to which hands of a body (J, 3) are busy, from 0 (hanging arms) to 1."""
    most = 0.0
    for side in range(2):
        shoulder, elbow, wrist = 1 + side, 3 + side, 5 + side
        arm = _distance(joints, shoulder, elbow) + _distance(joints, elbow, wrist)
        drop = joints[shoulder, 2] - joints[wrist, 2]
        most = max(most, 1.0 - drop / max(arm, 1e-9))
    return min(max((most - HANGS) / (RAISED - HANGS), 0.0), 1.0)


@kernel
def weigh(folds: float, kneels: float, hands: float, steps: float) -> Posture:
    """Combine the measures of a body's posture to weights.

    Args:
        folds: result of `folding`.
        kneels: result of `kneeling`.
        hands: result of `handling`.
        steps: result of `stepping`.
    """
    up = 1.0 - folds
    free = up * (1.0 - hands)
    return Posture(
        free * (1.0 - steps), free * steps, up * hands, folds * (1.0 - kneels), folds * kneels
    )


@kernel
def posture_of(joints: Points3, velocity: Velocities3) -> Posture:
    """Return the posture of a body with joints (J, 3) [m] and their velocities (J, 3) [m/s]."""
    steps = stepping(speed(velocity))
    return weigh(folding(joints), kneeling(joints), handling(joints), steps)


@kernel
def mix(posture: Posture, tables: Floats, out: Floats) -> None:
    """Compute the mean `out` (N,) of the postures' tables (P, N), weighted by a body's posture."""
    out[:] = 0.0
    for p in range(len(posture)):
        if posture[p] > 0.0:
            for k in range(len(out)):
                out[k] += posture[p] * tables[p, k]


@kernel(makes_arrays=True)
def pose_of(joints: Points3) -> Floats:
    """Return a body's joints (J, 3) relative to mid-hip in body axes: ahead, left and up.

    The unit of length is the sum of the lengths of the body's trunk and leg.
    """
    front = facing(joints)
    pose, length_m = np.empty((len(joints), 3)), _length_m(joints)
    for j in range(len(joints)):
        away_x = (joints[j, 0] - 0.5 * (joints[7, 0] + joints[8, 0])) / length_m
        away_y = (joints[j, 1] - 0.5 * (joints[7, 1] + joints[8, 1])) / length_m
        pose[j, 0] = front.x * away_x + front.y * away_y
        pose[j, 1] = front.x * away_y - front.y * away_x
        pose[j, 2] = (joints[j, 2] - 0.5 * (joints[7, 2] + joints[8, 2])) / length_m
    return pose


@kernel(makes_arrays=True)
def novelty_m(joints: Points3, poses: Floats) -> float:
    """Return the distance of a body (J, 3) from the nearest of M poses (J, 3, M) [m].

    The distance is the root mean square over the joints; poses are in the coordinates of `pose_of`.
    """
    pose, squared = pose_of(joints), np.zeros(poses.shape[2])
    for j in range(len(pose)):
        for i in range(3):
            for m in range(len(squared)):  # innermost loop, so that it is vectorized
                squared[m] += (pose[j, i] - poses[j, i, m]) ** 2
    return _length_m(joints) * math.sqrt(squared.min() / len(pose))


@kernel
def _length_m(joints: Points3) -> float:
    """Return the total length of trunk and leg of a body (J, 3), averaged over both sides [m]."""
    length = 0.0
    for side in range(2):
        shoulder, hip, knee, ankle = 1 + side, 7 + side, 9 + side, 11 + side
        length += _distance(joints, shoulder, hip)
        length += _distance(joints, hip, knee) + _distance(joints, knee, ankle)
    return max(0.5 * length, 1e-9)


@kernel
def _distance(joints: Points3, i: int, k: int) -> float:
    """Return the distance between two joints [m]."""
    x, y = joints[i, 0] - joints[k, 0], joints[i, 1] - joints[k, 1]
    z = joints[i, 2] - joints[k, 2]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def view_angle(joints: Points3, front: Facing, eye: Floats) -> float:
    """Return the direction from which a body is seen: 0 from its front, pi / 2 from its left.

    Args:
        joints: (J, 3) joints of the body [m].
        front: result of `facing`.
        eye: (3,) position of the camera [m].

    Returns:
        Angle in (-pi, pi] [rad].
    """
    x = eye[0] - 0.25 * (joints[1, 0] + joints[2, 0] + joints[7, 0] + joints[8, 0])
    y = eye[1] - 0.25 * (joints[1, 1] + joints[2, 1] + joints[7, 1] + joints[8, 1])
    return math.atan2(front.x * y - front.y * x, front.x * x + front.y * y)


def is_folded(joints_world: Points3) -> bool:
    """Return whether a body (J, 3) bends, squats or kneels; it is False if joints are NaN.

    The parts of such a body occlude each other, and the network's errors are much larger.
    """
    shoulders, hips, knees, ankles = (joints_world[k : k + 2] for k in (1, 7, 9, 11))
    torso = shoulders.mean(0) - hips.mean(0)
    limbs_m = np.linalg.norm(np.stack([knees - hips, ankles - knees]), axis=-1).mean(-1)
    rise_m = hips[:, 2].mean() - ankles[:, 2].min()
    lean_rad = math.atan2(math.hypot(torso[0], torso[1]), torso[2])
    return bool(lean_rad > LEAN_RAD or rise_m < LOW_HIPS * limbs_m.sum())
