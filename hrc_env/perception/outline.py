"""A body's posture and facing: the few numbers on which a detector's errors depend."""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Points3

UPRIGHT, FOLDED = 0.15, 0.50
"""How much lower the shoulders are above the ankles than they can be, as a share, where a body
begins to count as folded and is folded up: walking is below .12, bending or kneeling above .3."""
SQUATS, KNEELS = 0.40, 0.10
"""How much higher the lower knee is than its ankle, as a share of the shank, where a folded body
begins to count as kneeling and does: squatting is above .5, a knee on the ground at 0."""
STANDS_M_S, WALKS_M_S = 0.3, 0.7
"""Mean speeds of the joints [m/s] where a body begins to count as walking and does: hammering is at
the first, walking slowly above the second."""
HANGS, RAISED = 0.10, 0.25
"""How much nearer in height a wrist is to its shoulder than when it hangs, as a share of the arm,
where hands begin to count as busy and do: swinging is at the first, carrying above the second."""
LEAN_RAD = math.radians(30.0)
"""A torso that leans further is bent: the error of `full` is then half as large again."""
LOW_HIPS = 0.75
"""Hips that are less than this share of the leg's length above the lower ankle squat or kneel; in
a walk they stay above .9."""

# Joints: nose 0; left and right shoulder 1 2, elbow 3 4, wrist 5 6, hip 7 8, knee 9 10,
# ankle 11 12.


@kernel
def facing(joints):
    """(x, y) horizontal unit vector to where a body's (J, 3) front is; +x where there is none."""
    left_x = joints[1, 0] - joints[2, 0] + joints[7, 0] - joints[8, 0]
    left_y = joints[1, 1] - joints[2, 1] + joints[7, 1] - joints[8, 1]
    length = math.sqrt(left_x * left_x + left_y * left_y)
    if length < 1e-9:
        return 1.0, 0.0
    return left_y / length, -left_x / length


@kernel
def folded(joints):
    """How folded a body (J, 3) is: 0 upright, 1 folded up."""
    height = 0.0
    for side in range(2):
        height += joints[1 + side, 2] - joints[11 + side, 2]
    share = 1.0 - 0.5 * height / _length_m(joints)
    return min(max((share - UPRIGHT) / (FOLDED - UPRIGHT), 0.0), 1.0)


@kernel
def kneeling(joints):
    """Whether a body (J, 3), if it is folded, has a knee on the ground: 0 not, 1 certainly."""
    least = 1.0
    for side in range(2):
        knee, ankle = 9 + side, 11 + side
        rise = joints[knee, 2] - joints[ankle, 2]
        least = min(least, rise / max(_apart(joints, knee, ankle), 1e-9))
    return min(max((SQUATS - least) / (SQUATS - KNEELS), 0.0), 1.0)


@kernel
def speed(velocity):
    """Mean speed of joints (J, 3) [m/s]."""
    total = 0.0
    for j in range(len(velocity)):
        x, y, z = velocity[j, 0], velocity[j, 1], velocity[j, 2]
        total += math.sqrt(x * x + y * y + z * z)
    return total / len(velocity)


@kernel
def stepping(mean_speed_m_s):
    """Whether a body walks, by its joints' mean speed: 0 stands, 1 walks."""
    return min(max((mean_speed_m_s - STANDS_M_S) / (WALKS_M_S - STANDS_M_S), 0.0), 1.0)


@kernel
def handling(joints):
    """Whether a body (J, 3) has something in its hands or to do with them: 0 not, 1 certainly."""
    most = 0.0
    for side in range(2):
        shoulder, elbow, wrist = 1 + side, 3 + side, 5 + side
        arm = _apart(joints, shoulder, elbow) + _apart(joints, elbow, wrist)
        drop = joints[shoulder, 2] - joints[wrist, 2]
        most = max(most, 1.0 - drop / max(arm, 1e-9))
    return min(max((most - HANGS) / (RAISED - HANGS), 0.0), 1.0)


@kernel
def weigh(folding, kneels, hands, steps):
    """How far a body counts as each of `calibration.POSTURES`; together 1."""
    up = 1.0 - folding
    free = up * (1.0 - hands)
    folded_up = folding * (1.0 - kneels), folding * kneels
    return free * (1.0 - steps), free * steps, up * hands, folded_up[0], folded_up[1]


@kernel
def posture_of(joints, velocity):
    """`weigh` of a body's joints (J, 3) [m] and their velocities (J, 3) [m/s]."""
    steps = stepping(speed(velocity))
    return weigh(folded(joints), kneeling(joints), handling(joints), steps)


@kernel
def mix(posture, tables, out):
    """Write what tables (P, N), one for each posture, are for a body: (N,)."""
    out[:] = 0.0
    for p in range(len(posture)):
        if posture[p] > 0.0:
            for k in range(len(out)):
                out[k] += posture[p] * tables[p, k]


@kernel(makes_arrays=True)
def pose_of(joints):
    """A body's joints (J, 3) from between its hips: ahead, left, up; its trunk and leg are 1."""
    x, y = facing(joints)
    pose, length_m = np.empty((len(joints), 3)), _length_m(joints)
    for j in range(len(joints)):
        away_x = (joints[j, 0] - 0.5 * (joints[7, 0] + joints[8, 0])) / length_m
        away_y = (joints[j, 1] - 0.5 * (joints[7, 1] + joints[8, 1])) / length_m
        pose[j, 0] = x * away_x + y * away_y
        pose[j, 1] = x * away_y - y * away_x
        pose[j, 2] = (joints[j, 2] - 0.5 * (joints[7, 2] + joints[8, 2])) / length_m
    return pose


@kernel(makes_arrays=True)
def novelty_m(joints, poses):
    """How far a body (J, 3) is from the nearest of some `pose_of` (J, 3, M): root mean square over
    its joints [m]."""
    pose, squared = pose_of(joints), np.zeros(poses.shape[2])
    for j in range(len(pose)):
        for i in range(3):
            for m in range(len(squared)):  # innermost, so that it is done for several at once
                squared[m] += (pose[j, i] - poses[j, i, m]) ** 2
    return _length_m(joints) * math.sqrt(squared.min() / len(pose))


@kernel
def _length_m(joints):
    """Length of a body's trunk and leg (J, 3), the mean of both sides [m]."""
    length = 0.0
    for side in range(2):
        shoulder, hip, knee, ankle = 1 + side, 7 + side, 9 + side, 11 + side
        length += _apart(joints, shoulder, hip)
        length += _apart(joints, hip, knee) + _apart(joints, knee, ankle)
    return max(0.5 * length, 1e-9)


@kernel
def _apart(joints, i, k):
    x, y = joints[i, 0] - joints[k, 0], joints[i, 1] - joints[k, 1]
    z = joints[i, 2] - joints[k, 2]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def seen_from(joints, front_x, front_y, eye):
    """From where an eye sees a body: 0 its front, pi / 2 its left [rad]."""
    x = eye[0] - 0.25 * (joints[1, 0] + joints[2, 0] + joints[7, 0] + joints[8, 0])
    y = eye[1] - 0.25 * (joints[1, 1] + joints[2, 1] + joints[7, 1] + joints[8, 1])
    return math.atan2(front_x * y - front_y * x, front_x * x + front_y * y)


def is_folded(joints_world: Points3) -> bool:
    """Whether a body (J, 3) is bent, squatting or kneeling: its joints hide each other, and the
    network errs much more. z is up, NaN is not folded."""
    shoulders, hips, knees, ankles = (joints_world[k : k + 2] for k in (1, 7, 9, 11))
    torso = shoulders.mean(0) - hips.mean(0)
    limbs_m = np.linalg.norm(np.stack([knees - hips, ankles - knees]), axis=-1).mean(-1)
    rise_m = hips[:, 2].mean() - ankles[:, 2].min()
    lean_rad = math.atan2(math.hypot(torso[0], torso[1]), torso[2])
    return bool(lean_rad > LEAN_RAD or rise_m < LOW_HIPS * limbs_m.sum())
