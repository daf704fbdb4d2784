"""Kinematics from a control vector to 22 body segments: a spine and four two-bone limbs."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import anatomy as an
from hrc_env.motion import controls as c
from hrc_env.motion.curves import min_jerk, saturate, soft_min
from hrc_env.motion.state import Worker

ARM_KNEE = 0.97
"""Extension of the arm, relative to its length, beyond which it is compressed smoothly."""
ARM_LIMIT = 0.998
"""Maximum extension of the arm, as a fraction of its length."""
SHOULDER_RAD = 0.22
"""Maximum rotation of a clavicle forward and upward [rad]."""
LEG_LIMIT = 0.998
"""Maximum extension of a leg, as a fraction of its length, which prevents locked knees."""
LEG_SOFTNESS_M = 0.05
"""Width of the smooth transition from the desired pelvis height to the legs' reach [m]."""
REST_SOFTNESS_M = 0.06
"""Height above the floor below which a falling trunk is slowed down [m]."""
TRAILING_SHARE = 0.12
"""Distance by which a runner's trailing foot may be out of reach, divided by the leg length."""
TRAILING_BENT = 0.06
"""Distance from full extension at which a trailing foot begins to follow, in leg lengths."""
HEEL_OFF_M = 0.1
"""Height of a runner's heel at which the foot is trailing [m]."""
LOWER_KNEE_RAD = 0.5
"""Roll above which both knees of a lying worker point to the same side [rad].

The value is an estimate.
"""
TARGET, POLE, HINGE, GRIP = range(22, 26)
"""Auxiliary rows of `Worker.p`: a limb's target, its middle joint's pole and hinge, and a grip."""
TURN = 22
"""Auxiliary row of `Worker.r` for intermediate rotations."""


@kernel
def set_rotation(yaw: float, pitch: float, roll: float, segment: int, worker: Worker) -> None:
    """Set r[segment] = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        yaw: angle about z [rad].
        pitch: angle about y [rad].
        roll: angle about x [rad].
        segment: row of `r`.
        worker: record of the worker; its `r` is written.
    """
    r = worker.r
    cy, sy = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    r[segment, 0, 0] = cy * cp
    r[segment, 0, 1] = cy * sp * sr - sy * cr
    r[segment, 0, 2] = cy * sp * cr + sy * sr
    r[segment, 1, 0] = sy * cp
    r[segment, 1, 1] = sy * sp * sr + cy * cr
    r[segment, 1, 2] = sy * sp * cr - cy * sr
    r[segment, 2, 0] = -sp
    r[segment, 2, 1] = cp * sr
    r[segment, 2, 2] = cp * cr


@kernel
def multiply(a: int, b: int, out: int, worker: Worker) -> None:
    """Set r[out] = r[a] r[b]."""
    r = worker.r
    for i in range(3):
        x, y, z = r[a, i, 0], r[a, i, 1], r[a, i, 2]
        r[out, i, 0] = x * r[b, 0, 0] + y * r[b, 1, 0] + z * r[b, 2, 0]
        r[out, i, 1] = x * r[b, 0, 1] + y * r[b, 1, 1] + z * r[b, 2, 1]
        r[out, i, 2] = x * r[b, 0, 2] + y * r[b, 1, 2] + z * r[b, 2, 2]


@kernel
def attach(child: int, parent: int, worker: Worker) -> None:
    """Compute the origin of a child segment from its rest offset in the parent's frame."""
    p, r = worker.p, worker.r
    x, y, z = worker.bones[child, 0], worker.bones[child, 1], worker.bones[child, 2]
    for i in range(3):
        turned = r[parent, i, 0] * x + r[parent, i, 1] * y + r[parent, i, 2] * z
        p[child, i] = p[parent, i] + turned


@kernel
def aim(bone: int, end: int, length: float, worker: Worker) -> None:
    """Orient a bone from its origin towards p[end], with its hinge along p[HINGE].

    Args:
        bone: row of the bone.
        end: row of `p` that the bone points to.
        length: length of the bone [m].
        worker: record of the worker; its `r` is written.
    """
    p, r = worker.p, worker.r
    inverse = 1.0 / length
    bx = (p[end, 0] - p[bone, 0]) * inverse
    by = (p[end, 1] - p[bone, 1]) * inverse
    bz = (p[end, 2] - p[bone, 2]) * inverse
    hx, hy, hz = p[HINGE, 0], p[HINGE, 1], p[HINGE, 2]
    mx, my, mz = hy * bz - hz * by, hz * bx - hx * bz, hx * by - hy * bx
    for j in range(3):
        b, m, h = worker.frame[bone, 0, j], worker.frame[bone, 1, j], worker.frame[bone, 2, j]
        r[bone, 0, j] = bx * b + mx * m + hx * h
        r[bone, 1, j] = by * b + my * m + hy * h
        r[bone, 2, j] = bz * b + mz * m + hz * h


@kernel
def solve_two_bones(
    start: int, end: int, first: float, second: float, knee: float, limit: float, worker: Worker
) -> None:
    """Solve the inverse kinematics of a two-bone chain from p[start] to p[TARGET].

    The middle joint p[start + 1], the end p[end] and p[HINGE] are written.

    Args:
        start: row of the first bone; the middle joint, row start + 1, bends towards p[POLE].
        end: row of `p` for the end of the chain.
        first: length of the first bone [m].
        second: length of the second bone [m].
        knee: extension, relative to the chain's length, beyond which it is compressed smoothly.
        limit: maximum extension of the chain, as a fraction of its length.
        worker: record of the worker; its `p` is written.
    """
    p = worker.p
    dx = p[TARGET, 0] - p[start, 0]
    dy = p[TARGET, 1] - p[start, 1]
    dz = p[TARGET, 2] - p[start, 2]
    wished = math.sqrt(dx * dx + dy * dy + dz * dz) + 1e-9
    total = first + second
    d = max(saturate(wished, knee * total, limit * total), abs(first - second) + 0.03)
    inverse = 1.0 / wished
    ux, uy, uz = dx * inverse, dy * inverse, dz * inverse
    along = (first * first - second * second + d * d) / (2.0 * d)
    away = math.sqrt(max(first * first - along * along, 0.0))
    dot = p[POLE, 0] * ux + p[POLE, 1] * uy + p[POLE, 2] * uz
    px, py, pz = p[POLE, 0] - dot * ux, p[POLE, 1] - dot * uy, p[POLE, 2] - dot * uz
    inverse = 1.0 / (math.sqrt(px * px + py * py + pz * pz) + 1e-9)
    px, py, pz = px * inverse, py * inverse, pz * inverse
    p[start + 1, 0] = p[start, 0] + ux * along + px * away
    p[start + 1, 1] = p[start, 1] + uy * along + py * away
    p[start + 1, 2] = p[start, 2] + uz * along + pz * away
    p[end, 0], p[end, 1] = p[start, 0] + ux * d, p[start, 1] + uy * d
    p[end, 2] = p[start, 2] + uz * d
    p[HINGE, 0], p[HINGE, 1] = py * uz - pz * uy, pz * ux - px * uz
    p[HINGE, 2] = px * uy - py * ux


@kernel
def pose_trunk(worker: Worker) -> None:
    """Pose pelvis, spine, neck and head at the desired height, limited by the reach of the legs."""
    q, p = worker.q, worker.p
    yaw = q[c.HEADING] + q[c.PELVIS_YAW]
    set_rotation(yaw, q[c.PELVIS_PITCH], q[c.PELVIS_ROLL], 0, worker)
    if worker.trunk_roll != 0.0:
        set_rotation(worker.trunk_roll, 0.0, 0.0, TURN, worker)
        multiply(0, TURN, 0, worker)
    p[0, 0], p[0, 1], p[0, 2] = q[c.ROOT_X], q[c.ROOT_Y], q[c.PELVIS_Z]
    longest = LEG_LIMIT * worker.lengths[an.LEG]
    for side in range(2):
        thigh, ankle = an.LEFT + side * an.SIDE_STRIDE + an.THIGH, c.ANKLE + 6 * side
        attach(thigh, 0, worker)
        dx, dy = q[ankle] - p[thigh, 0], q[ankle + 1] - p[thigh, 1]
        may = longest
        if worker.flight_s > 0.0:
            may *= 1.0 + TRAILING_SHARE * _measure_heel_lift(side, worker)
        rise = math.sqrt(max(may * may - dx * dx - dy * dy, 0.01))
        highest = q[ankle + 2] + rise - (p[thigh, 2] - p[0, 2])
        p[0, 2] = soft_min(p[0, 2], highest, LEG_SOFTNESS_M)
    share = 1.0 / 3.0
    twist, flex, lateral = q[c.SPINE_TWIST], q[c.SPINE_FLEX], q[c.SPINE_SIDE]
    set_rotation(share * twist, share * flex, share * lateral, TURN, worker)
    for segment in range(1, an.CHEST + 1):
        attach(segment, segment - 1, worker)
        multiply(segment - 1, TURN, segment, worker)
    yaw = 0.5 * q[c.HEAD_YAW]
    set_pitch(math.cos(yaw), math.sin(yaw), 0.5 * q[c.HEAD_PITCH], TURN, worker)
    for segment in range(an.CHEST + 1, an.HEAD + 1):
        attach(segment, segment - 1, worker)
        multiply(segment - 1, TURN, segment, worker)
    if worker.fall_share > 0.0:
        _rest_on_floor(worker)


@kernel
def _rest_on_floor(worker: Worker) -> None:
    """Raise the trunk and head if they would penetrate the floor."""
    p, r = worker.p, worker.r
    low = math.inf
    for k in range(an.N_ROUND):
        end, segment = worker.trunk_ends[k], int(worker.trunk_ends[k, 0])
        above = p[segment, 2] - end[4]
        for i in range(3):
            above += r[segment, 2, i] * end[1 + i]
        low = min(low, above)
    up = -soft_min(-low, 0.0, REST_SOFTNESS_M) - low
    for segment in range(an.HEAD + 1):
        p[segment, 2] += up


@kernel
def _level_pole(side: int, segment: int, ahead: float, out: float, worker: Worker) -> None:
    """Blend the pole of a limb with the pole of a fallen worker, by the weight `fall_share`.

    A fallen worker's pole is a mix of the segment's x axis and, with weight `out`, a level
    direction outwards (for elbows also towards the feet). When the worker lies on a side, the lower
    knee points forward.

    Args:
        side: 0 left, 1 right.
        segment: row of the segment whose x axis is used.
        ahead: 1 for a knee, -1 for an elbow.
        out: weight of the outward direction.
        worker: record of the worker; its p[POLE] is changed.
    """
    p, r = worker.p, worker.r
    left = 1.0 - 2.0 * side
    if ahead > 0.0 and left * worker.lie_roll < -LOWER_KNEE_RAD:
        left = -left
    cos, sin = math.cos(worker.q[c.HEADING]), math.sin(worker.q[c.HEADING])
    back = 0.8 if ahead < 0.0 else 0.0
    for i, level in enumerate((-left * sin - back * cos, left * cos - back * sin, 0.0)):
        pole = (1.0 - out) * ahead * r[segment, i, 0] + out * level
        p[POLE, i] += worker.fall_share * (pole - p[POLE, i])


@kernel
def pose_shoulder(side: int, cos: float, sin: float, worker: Worker) -> None:
    """Pose a clavicle, which slightly follows the hand, and set p[TARGET] to the grip.

    Args:
        side: 0 left, 1 right.
        cos: cosine of the chest's heading.
        sin: sine of the chest's heading.
        worker: record of the worker; its `p` and `r` are written.
    """
    q, p, r = worker.q, worker.p, worker.r
    sign = 1.0 - 2.0 * side
    clavicle = an.LEFT + side * an.SIDE_STRIDE + an.CLAVICLE
    upper = clavicle + 1
    attach(clavicle, an.CHEST, worker)
    for i in range(3):
        for j in range(3):
            r[clavicle, i, j] = r[an.CHEST, i, j]
    attach(upper, clavicle, worker)
    rel, tgt, share = c.HAND_OFFSET + 3 * side, c.HAND_TARGET + 3 * side, q[c.HAND_SHARE + side]
    x = p[upper, 0] + cos * q[rel] - sin * q[rel + 1]
    y = p[upper, 1] + sin * q[rel] + cos * q[rel + 1]
    z = p[upper, 2] + q[rel + 2]
    p[TARGET, 0] = x + share * (q[tgt] - x)
    p[TARGET, 1] = y + share * (q[tgt + 1] - y)
    p[TARGET, 2] = z + share * (q[tgt + 2] - z)
    dx, dy = p[TARGET, 0] - p[upper, 0], p[TARGET, 1] - p[upper, 1]
    ahead = (cos * dx + sin * dy) / worker.lengths[an.ARM]
    above = (p[TARGET, 2] - p[upper, 2]) / worker.lengths[an.ARM]
    forward, up = min(max(ahead - 0.3, 0.0) / 0.7, 1.0), min(max(above + 0.5, 0.0), 1.0)
    if forward > 0.0 or up > 0.0:
        forward, up = forward * forward * (3.0 - 2.0 * forward), up * up * (3.0 - 2.0 * up)
        give = sign * SHOULDER_RAD * (1.0 - worker.fall_share)
        set_rotation(-give * forward, 0.0, give * up, TURN, worker)
        multiply(an.CHEST, TURN, clavicle, worker)
        attach(upper, clavicle, worker)


@kernel
def pose_arm(side: int, cos: float, sin: float, worker: Worker) -> None:
    """Pose an arm from shoulder to hand, with the elbow pointing back and outwards.

    Args:
        side: 0 left, 1 right.
        cos: cosine of the chest's heading.
        sin: sine of the chest's heading.
        worker: record of the worker; its `p` and `r` are written.
    """
    p = worker.p
    pose_shoulder(side, cos, sin, worker)
    sign = 1.0 - 2.0 * side
    upper = an.LEFT + side * an.SIDE_STRIDE + an.UPPER_ARM
    fore, hand = upper + 1, upper + 2
    swivel = worker.q[c.SWIVEL + side]
    level, out = math.cos(swivel), math.sin(swivel)
    back, left = -0.7 * level, sign * (0.45 * level + out)
    p[POLE, 0], p[POLE, 1] = cos * back - sin * left, sin * back + cos * left
    above = (p[TARGET, 2] - p[upper, 2]) / worker.lengths[an.ARM]
    p[POLE, 2] = -0.9 * level * (0.15 + 0.85 * min_jerk(1.2 * (above + 1.0)))
    if worker.fall_share > 0.0:
        _level_pole(side, an.CHEST, -1.0, worker.elbows_out, worker)
    solve_two_bones(
        upper,
        GRIP,
        worker.lengths[an.UPPER_LENGTH],
        worker.lengths[an.FOREARM_GRIP],
        ARM_KNEE,
        ARM_LIMIT,
        worker,
    )
    aim(upper, fore, worker.lengths[an.UPPER_LENGTH], worker)
    aim(fore, GRIP, worker.lengths[an.FOREARM_GRIP], worker)
    attach(hand, fore, worker)
    aim(hand, GRIP, an.GRIP_M, worker)


@kernel
def _measure_heel_lift(side: int, worker: Worker) -> float:
    """Return the degree to which a runner's heel has left the floor, from 0 to 1."""
    return min_jerk(
        (worker.q[c.ANKLE + 6 * side + 2] - worker.lengths[an.ANKLE_Z]) / HEEL_OFF_M - 0.5
    )


@kernel
def pose_leg(side: int, worker: Worker) -> None:
    """Pose a leg from hip to toes, with the knee above the foot."""
    q, p, r = worker.q, worker.p, worker.r
    thigh, ankle = an.LEFT + side * an.SIDE_STRIDE + an.THIGH, c.ANKLE + 6 * side
    shank, foot, toes = thigh + 1, thigh + 2, thigh + 3
    attach(thigh, 0, worker)
    cos, sin = math.cos(q[ankle + 3]), math.sin(q[ankle + 3])
    set_pitch(cos, sin, q[ankle + 4], foot, worker)
    set_pitch(cos, sin, q[ankle + 5], toes, worker)
    p[POLE, 0], p[POLE, 1] = 0.75 * cos + 0.25 * r[0, 0, 0], 0.75 * sin + 0.25 * r[0, 1, 0]
    p[POLE, 2] = 0.12
    if worker.fall_share > 0.0:
        _level_pole(side, 0, 1.0, worker.knees_out, worker)
    for i in range(3):
        p[TARGET, i] = q[ankle + i]
    straight = 1.0
    if worker.flight_s > 0.0:
        straight -= TRAILING_BENT * _measure_heel_lift(side, worker)
    solve_two_bones(
        thigh,
        foot,
        worker.lengths[an.THIGH_LENGTH],
        worker.lengths[an.SHANK_LENGTH],
        straight,
        1.001,
        worker,
    )
    aim(thigh, shank, worker.lengths[an.THIGH_LENGTH], worker)
    aim(shank, foot, worker.lengths[an.SHANK_LENGTH], worker)
    attach(toes, foot, worker)


@kernel
def set_pitch(cos: float, sin: float, pitch: float, segment: int, worker: Worker) -> None:
    """Set r[segment] = Rz(yaw) Ry(pitch).

    Args:
        cos: cosine of the yaw.
        sin: sine of the yaw.
        pitch: angle about y [rad].
        segment: row of `r`.
        worker: record of the worker; its `r` is written.
    """
    r = worker.r
    cp, sp = 1.0, 0.0
    if pitch != 0.0:
        cp, sp = math.cos(pitch), math.sin(pitch)
    r[segment, 0, 0], r[segment, 0, 1], r[segment, 0, 2] = cos * cp, -sin, cos * sp
    r[segment, 1, 0], r[segment, 1, 1], r[segment, 1, 2] = sin * cp, cos, sin * sp
    r[segment, 2, 0], r[segment, 2, 1], r[segment, 2, 2] = -sp, 0.0, cp


@kernel
def pose(worker: Worker) -> None:
    """Compute the segments' rows of `p` and `r` from the control vector `q`."""
    q = worker.q
    pose_trunk(worker)
    yaw = q[c.HEADING] + q[c.PELVIS_YAW] + q[c.SPINE_TWIST]
    cos, sin = math.cos(yaw), math.sin(yaw)
    for side in range(2):
        pose_arm(side, cos, sin, worker)
        pose_leg(side, worker)


@kernel
def write_quaternion(r: Floats, segment: int, out: Floats) -> None:
    """Compute the unit quaternion (scalar first, w >= 0) of r[segment] by Shepperd's method.

    Args:
        r: rotations (N, 3, 3).
        segment: row of `r` and of `out`.
        out: quaternions (N, 4), of which one row is written.
    """
    trace = r[segment, 0, 0] + r[segment, 1, 1] + r[segment, 2, 2]
    if trace > 0.0:
        w = 0.5 * math.sqrt(trace + 1.0)
        n = 0.25 / w
        out[segment, 0], out[segment, 1] = w, (r[segment, 2, 1] - r[segment, 1, 2]) * n
        out[segment, 2], out[segment, 3] = (
            (r[segment, 0, 2] - r[segment, 2, 0]) * n,
            (r[segment, 1, 0] - r[segment, 0, 1]) * n,
        )
        return
    i = 0
    if r[segment, 1, 1] > r[segment, 0, 0]:
        i = 1
    if r[segment, 2, 2] > r[segment, i, i]:
        i = 2
    j, k = (i + 1) % 3, (i + 2) % 3
    largest = 0.5 * math.sqrt(1.0 + r[segment, i, i] - r[segment, j, j] - r[segment, k, k])
    n = 0.25 / largest
    w = (r[segment, k, j] - r[segment, j, k]) * n
    sign = -1.0 if w < 0.0 else 1.0
    out[segment, 0], out[segment, 1 + i] = sign * w, sign * largest
    out[segment, 1 + j] = sign * (r[segment, i, j] + r[segment, j, i]) * n
    out[segment, 1 + k] = sign * (r[segment, i, k] + r[segment, k, i]) * n


@kernel
def write_angular_velocity(
    before: Floats, after: Floats, segment: int, duration: float, out: Floats
) -> None:
    """Compute the angular velocity in the world frame from two successive rotations.

    Args:
        before: rotations (N, 3, 3).
        after: rotations (N, 3, 3) a short time later.
        segment: row of `before`, `after` and `out`.
        duration: time between `before` and `after` [s].
        out: angular velocities (N, 3), of which one row is written [rad/s].
    """
    x = y = z = 0.0
    for a in range(3):
        bx, by, bz = before[segment, 0, a], before[segment, 1, a], before[segment, 2, a]
        ax, ay, az = after[segment, 0, a], after[segment, 1, a], after[segment, 2, a]
        x, y, z = x + by * az - bz * ay, y + bz * ax - bx * az, z + bx * ay - by * ax
    half = 0.5 / duration
    out[segment, 0], out[segment, 1], out[segment, 2] = half * x, half * y, half * z
