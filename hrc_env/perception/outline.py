"""How a worker looks to a camera, in the few numbers on which a detector's errors depend."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.perception.blazepose import ROI_MARGIN
from hrc_env.perception.windows import CROWN, HAND, MIN_REACH_M, MIN_TORSO_M

UPRIGHT, FOLDED = 0.15, 0.50
"""How much lower the shoulders are above the ankles than they can be, as a share, where a body
begins to count as folded, and from where on it counts as folded up. Judgement: who walks is below
.12, who bends, kneels or squats above .3."""

SQUATS, KNEELS = 0.40, 0.10
"""How much higher the lower knee is than its ankle, as a share of the shank's length, where a
folded body begins to count as kneeling, and from where on it does. Judgement: who squats or bends
is above .5, who has a knee on the ground at 0."""

STANDS_M_S, WALKS_M_S = 0.3, 0.7
"""Mean speeds of the joints from where a body begins to count as walking, and does [m/s]: hands
that hammer are at the first, people who walk slowly above the second."""

HANGS, RAISED = 0.10, 0.25
"""How much nearer in height a wrist is to its shoulder than when it hangs, as a share of the arm's
length, from where on hands begin to count as busy, and do. Judgement: arms that swing are at the
first, those that push a barrow between the two, those that carry, work or point above."""

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
    length, height = 0.0, 0.0
    for side in range(2):
        shoulder, hip, knee, ankle = 1 + side, 7 + side, 9 + side, 11 + side
        length += _apart(joints, shoulder, hip)
        length += _apart(joints, hip, knee) + _apart(joints, knee, ankle)
        height += joints[shoulder, 2] - joints[ankle, 2]
    share = 1.0 - height / max(length, 1e-9)
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
    """How far a body counts as standing, walking, handling something, folded over its feet and
    kneeling; together 1."""
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


@kernel
def window_round(uv, depth, px_per_m, nearest_m):
    """Side [px] and turn [rad] of the window round joints (J, 2), as `window_from_joints` has it.

    `px_per_m` is at the worker's distance; joints nearer than `nearest_m` do not count.
    """
    hip_x, hip_y = 0.5 * (uv[7, 0] + uv[8, 0]), 0.5 * (uv[7, 1] + uv[8, 1])
    neck_x, neck_y = 0.5 * (uv[1, 0] + uv[2, 0]), 0.5 * (uv[1, 1] + uv[2, 1])
    x, y = neck_x - hip_x, neck_y - hip_y
    y -= max(0.0, MIN_TORSO_M * px_per_m - math.sqrt(x * x + y * y))
    reach = MIN_REACH_M * px_per_m
    reach *= reach
    for j in range(len(depth)):
        if depth[j] > nearest_m:
            reach = max(reach, _squared(uv[j, 0] - hip_x, uv[j, 1] - hip_y))
    for j in range(5, 7):
        hand_x = uv[j, 0] + HAND * (uv[j, 0] - uv[j - 2, 0]) - hip_x
        hand_y = uv[j, 1] + HAND * (uv[j, 1] - uv[j - 2, 1]) - hip_y
        if depth[j] > nearest_m and depth[j - 2] > nearest_m:
            reach = max(reach, _squared(hand_x, hand_y))
    if depth[0] > nearest_m:
        crown_x = uv[0, 0] + CROWN * (uv[0, 0] - neck_x) - hip_x
        crown_y = uv[0, 1] + CROWN * (uv[0, 1] - neck_y) - hip_y
        reach = max(reach, _squared(crown_x, crown_y))
    return 2.0 * ROI_MARGIN * math.sqrt(reach), math.atan2(x, -y)


@kernel
def _squared(x, y):
    return x * x + y * y
