"""From a control vector to 22 body segments: a spine, and four limbs by two-bone IK."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import anatomy as an
from hrc_env.motion import controls as c
from hrc_env.motion.curves import min_jerk, saturate, soft_min
from hrc_env.motion.state import Worker

ARM_KNEE, ARM_LIMIT = 0.97, 0.998
"""Shares of the arm's length where stretching begins to resist, and that it never passes."""
SHOULDER_RAD = 0.22
"""How far a clavicle turns forward, and up, at most."""
LEG_LIMIT, LEG_SOFTNESS_M = 0.998, 0.05
"""Share of its length that a leg uses at most (knees never lock), and the width over which that
takes over from the wished height of the pelvis."""
REST_SOFTNESS_M = 0.06
"""Nearer than this to the floor a trunk's fall is slowed down, so that it does not stop at once."""
TRAILING_SHARE, TRAILING_BENT, HEEL_OFF_M = 0.12, 0.06, 0.1
"""A runner's trailing foot does not hold the pelvis back, though the leg be too short by the first
share, but comes along once its heel is so far up [m]: from the last of the leg's length on."""
LOWER_KNEE_RAD = 0.5
"""How far on a side who lies there has both knees to the same one; judgement."""
TARGET, POLE, HINGE, GRIP = range(22, 26)
TURN = 22
"""Rows after the 22 segments that the kinematics work in: points and vectors, a rotation."""


@kernel
def yaw_pitch_roll(yaw: float, pitch: float, roll: float, s: int, me: Worker) -> None:
    """r[s] = Rz(yaw) Ry(pitch) Rx(roll)."""
    r = me.r
    cy, sy = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    r[s, 0, 0] = cy * cp
    r[s, 0, 1] = cy * sp * sr - sy * cr
    r[s, 0, 2] = cy * sp * cr + sy * sr
    r[s, 1, 0] = sy * cp
    r[s, 1, 1] = sy * sp * sr + cy * cr
    r[s, 1, 2] = sy * sp * cr - cy * sr
    r[s, 2, 0] = -sp
    r[s, 2, 1] = cp * sr
    r[s, 2, 2] = cp * cr


@kernel
def product(a: int, b: int, out: int, me: Worker) -> None:
    """r[out] = r[a] r[b]."""
    r = me.r
    for i in range(3):
        x, y, z = r[a, i, 0], r[a, i, 1], r[a, i, 2]
        r[out, i, 0] = x * r[b, 0, 0] + y * r[b, 1, 0] + z * r[b, 2, 0]
        r[out, i, 1] = x * r[b, 0, 1] + y * r[b, 1, 1] + z * r[b, 2, 1]
        r[out, i, 2] = x * r[b, 0, 2] + y * r[b, 1, 2] + z * r[b, 2, 2]


@kernel
def attach(child: int, parent: int, me: Worker) -> None:
    """Put the child's origin where its rest offset lies in the parent's frame."""
    p, r = me.p, me.r
    x, y, z = me.bones[child, 0], me.bones[child, 1], me.bones[child, 2]
    for i in range(3):
        turned = r[parent, i, 0] * x + r[parent, i, 1] * y + r[parent, i, 2] * z
        p[child, i] = p[parent, i] + turned


@kernel
def aim(bone: int, end: int, length: float, me: Worker) -> None:
    """Turn a bone to point from its origin to p[end], its hinge along p[HINGE]."""
    p, r = me.p, me.r
    inverse = 1.0 / length
    bx = (p[end, 0] - p[bone, 0]) * inverse
    by = (p[end, 1] - p[bone, 1]) * inverse
    bz = (p[end, 2] - p[bone, 2]) * inverse
    hx, hy, hz = p[HINGE, 0], p[HINGE, 1], p[HINGE, 2]
    mx, my, mz = hy * bz - hz * by, hz * bx - hx * bz, hx * by - hy * bx
    for j in range(3):
        b, m, h = me.frame[bone, 0, j], me.frame[bone, 1, j], me.frame[bone, 2, j]
        r[bone, 0, j] = bx * b + mx * m + hx * h
        r[bone, 1, j] = by * b + my * m + hy * h
        r[bone, 2, j] = bz * b + mz * m + hz * h


@kernel
def bend(
    start: int, end: int, first: float, second: float, knee: float, limit: float, me: Worker
) -> None:
    """Two-bone IK from p[start] to p[TARGET]: p[start + 1], towards p[POLE], and p[end]."""
    p = me.p
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
def trunk(me: Worker) -> None:
    """Pelvis (as high as wished and as the legs allow), spine, neck and head."""
    q, p = me.q, me.p
    yaw = q[c.HEADING] + q[c.PELVIS_YAW]
    yaw_pitch_roll(yaw, q[c.PELVIS_PITCH], q[c.PELVIS_ROLL], 0, me)
    if me.rolled != 0.0:
        yaw_pitch_roll(me.rolled, 0.0, 0.0, TURN, me)
        product(0, TURN, 0, me)
    p[0, 0], p[0, 1], p[0, 2] = q[c.ROOT_X], q[c.ROOT_Y], q[c.PELVIS_Z]
    longest = LEG_LIMIT * me.size[an.LEG]
    for side in range(2):
        thigh, ankle = an.LEFT + side * an.SIDE_STRIDE + an.THIGH, c.ANKLE + 6 * side
        attach(thigh, 0, me)
        dx, dy = q[ankle] - p[thigh, 0], q[ankle + 1] - p[thigh, 1]
        may = longest
        if me.flight_s > 0.0:
            may *= 1.0 + TRAILING_SHARE * _heel_off(side, me)
        rise = math.sqrt(max(may * may - dx * dx - dy * dy, 0.01))
        highest = q[ankle + 2] + rise - (p[thigh, 2] - p[0, 2])
        p[0, 2] = soft_min(p[0, 2], highest, LEG_SOFTNESS_M)
    share = 1.0 / 3.0
    twist, flex, lateral = q[c.SPINE_TWIST], q[c.SPINE_FLEX], q[c.SPINE_SIDE]
    yaw_pitch_roll(share * twist, share * flex, share * lateral, TURN, me)
    for s in range(1, an.CHEST + 1):
        attach(s, s - 1, me)
        product(s - 1, TURN, s, me)
    yaw = 0.5 * q[c.HEAD_YAW]
    pitched(math.cos(yaw), math.sin(yaw), 0.5 * q[c.HEAD_PITCH], TURN, me)
    for s in range(an.CHEST + 1, an.HEAD + 1):
        attach(s, s - 1, me)
        product(s - 1, TURN, s, me)
    if me.fallen > 0.0:
        _rest_on_floor(me)


@kernel
def _rest_on_floor(me: Worker) -> None:
    """Raise a trunk, head included, out of the floor."""
    p, r = me.p, me.r
    low = math.inf
    for k in range(an.N_ROUND):
        end, s = me.round[k], int(me.round[k, 0])
        above = p[s, 2] - end[4]
        for i in range(3):
            above += r[s, 2, i] * end[1 + i]
        low = min(low, above)
    up = -soft_min(-low, 0.0, REST_SOFTNESS_M) - low
    for s in range(an.HEAD + 1):
        p[s, 2] += up


@kernel
def _level_pole(side: int, s: int, ahead: float, out: float, me: Worker) -> None:
    """Turn the pole to what it is of who has fallen, by that share: `ahead` of segment s, or, by a
    share `out`, level and outwards, elbows also to the feet; the lower knee of who lies on a side
    to where they face."""
    p, r = me.p, me.r
    left = 1.0 - 2.0 * side
    if ahead > 0.0 and left * me.lie_roll < -LOWER_KNEE_RAD:
        left = -left
    cos, sin = math.cos(me.q[c.HEADING]), math.sin(me.q[c.HEADING])
    back = 0.8 if ahead < 0.0 else 0.0
    for i, level in enumerate((-left * sin - back * cos, left * cos - back * sin, 0.0)):
        pole = (1.0 - out) * ahead * r[s, i, 0] + out * level
        p[POLE, i] += me.fallen * (pole - p[POLE, i])


@kernel
def shoulder(side: int, cos: float, sin: float, me: Worker) -> None:
    """The clavicle, going a little up and forward with the hand; the grip goes to p[TARGET]."""
    q, p, r = me.q, me.p, me.r
    sign = 1.0 - 2.0 * side
    clavicle = an.LEFT + side * an.SIDE_STRIDE + an.CLAVICLE
    upper = clavicle + 1
    attach(clavicle, an.CHEST, me)
    for i in range(3):
        for j in range(3):
            r[clavicle, i, j] = r[an.CHEST, i, j]
    attach(upper, clavicle, me)
    rel, tgt, share = c.HAND_OFFSET + 3 * side, c.HAND_TARGET + 3 * side, q[c.HAND_SHARE + side]
    x = p[upper, 0] + cos * q[rel] - sin * q[rel + 1]
    y = p[upper, 1] + sin * q[rel] + cos * q[rel + 1]
    z = p[upper, 2] + q[rel + 2]
    p[TARGET, 0] = x + share * (q[tgt] - x)
    p[TARGET, 1] = y + share * (q[tgt + 1] - y)
    p[TARGET, 2] = z + share * (q[tgt + 2] - z)
    dx, dy = p[TARGET, 0] - p[upper, 0], p[TARGET, 1] - p[upper, 1]
    ahead = (cos * dx + sin * dy) / me.size[an.ARM]
    above = (p[TARGET, 2] - p[upper, 2]) / me.size[an.ARM]
    forward, up = min(max(ahead - 0.3, 0.0) / 0.7, 1.0), min(max(above + 0.5, 0.0), 1.0)
    if forward > 0.0 or up > 0.0:
        forward, up = forward * forward * (3.0 - 2.0 * forward), up * up * (3.0 - 2.0 * up)
        give = sign * SHOULDER_RAD * (1.0 - me.fallen)
        yaw_pitch_roll(-give * forward, 0.0, give * up, TURN, me)
        product(an.CHEST, TURN, clavicle, me)
        attach(upper, clavicle, me)


@kernel
def arm(side: int, cos: float, sin: float, me: Worker) -> None:
    """Shoulder to hand, the elbow back and out; cos and sin: level heading of the chest."""
    p = me.p
    shoulder(side, cos, sin, me)
    sign = 1.0 - 2.0 * side
    upper = an.LEFT + side * an.SIDE_STRIDE + an.UPPER_ARM
    fore, hand = upper + 1, upper + 2
    swivel = me.q[c.SWIVEL + side]
    level, out = math.cos(swivel), math.sin(swivel)
    back, left = -0.7 * level, sign * (0.45 * level + out)
    p[POLE, 0], p[POLE, 1] = cos * back - sin * left, sin * back + cos * left
    above = (p[TARGET, 2] - p[upper, 2]) / me.size[an.ARM]
    p[POLE, 2] = -0.9 * level * (0.15 + 0.85 * min_jerk(1.2 * (above + 1.0)))
    if me.fallen > 0.0:
        _level_pole(side, an.CHEST, -1.0, me.elbows_out, me)
    bend(upper, GRIP, me.size[an.UPPER_LENGTH], me.size[an.FOREARM_GRIP], ARM_KNEE, ARM_LIMIT, me)
    aim(upper, fore, me.size[an.UPPER_LENGTH], me)
    aim(fore, GRIP, me.size[an.FOREARM_GRIP], me)
    attach(hand, fore, me)
    aim(hand, GRIP, an.GRIP_M, me)


@kernel
def _heel_off(side: int, me: Worker) -> float:
    """How far a runner's heel has left the floor, as a share."""
    return min_jerk((me.q[c.ANKLE + 6 * side + 2] - me.size[an.ANKLE_Z]) / HEEL_OFF_M - 0.5)


@kernel
def leg(side: int, me: Worker) -> None:
    """Hip to toes; the knee over the foot."""
    q, p, r = me.q, me.p, me.r
    thigh, ankle = an.LEFT + side * an.SIDE_STRIDE + an.THIGH, c.ANKLE + 6 * side
    shank, foot, toes = thigh + 1, thigh + 2, thigh + 3
    attach(thigh, 0, me)
    cos, sin = math.cos(q[ankle + 3]), math.sin(q[ankle + 3])
    pitched(cos, sin, q[ankle + 4], foot, me)
    pitched(cos, sin, q[ankle + 5], toes, me)
    p[POLE, 0], p[POLE, 1] = 0.75 * cos + 0.25 * r[0, 0, 0], 0.75 * sin + 0.25 * r[0, 1, 0]
    p[POLE, 2] = 0.12
    if me.fallen > 0.0:
        _level_pole(side, 0, 1.0, me.knees_out, me)
    for i in range(3):
        p[TARGET, i] = q[ankle + i]
    straight = 1.0
    if me.flight_s > 0.0:
        straight -= TRAILING_BENT * _heel_off(side, me)
    bend(thigh, foot, me.size[an.THIGH_LENGTH], me.size[an.SHANK_LENGTH], straight, 1.001, me)
    aim(thigh, shank, me.size[an.THIGH_LENGTH], me)
    aim(shank, foot, me.size[an.SHANK_LENGTH], me)
    attach(toes, foot, me)


@kernel
def pitched(cos: float, sin: float, pitch: float, s: int, me: Worker) -> None:
    """r[s] = Rz Ry(pitch), the cosine and sine of the first angle given."""
    r = me.r
    cp, sp = 1.0, 0.0
    if pitch != 0.0:
        cp, sp = math.cos(pitch), math.sin(pitch)
    r[s, 0, 0], r[s, 0, 1], r[s, 0, 2] = cos * cp, -sin, cos * sp
    r[s, 1, 0], r[s, 1, 1], r[s, 1, 2] = sin * cp, cos, sin * sp
    r[s, 2, 0], r[s, 2, 1], r[s, 2, 2] = -sp, 0.0, cp


@kernel
def pose(me: Worker) -> None:
    """Fill the first 22 rows of p and r from q."""
    q = me.q
    trunk(me)
    yaw = q[c.HEADING] + q[c.PELVIS_YAW] + q[c.SPINE_TWIST]
    cos, sin = math.cos(yaw), math.sin(yaw)
    for side in range(2):
        arm(side, cos, sin, me)
        leg(side, me)


@kernel
def quaternion(r: Floats, s: int, out: Floats) -> None:
    """Unit quaternion (scalar first, w >= 0) of r[s] into out[s], by Shepperd's method."""
    trace = r[s, 0, 0] + r[s, 1, 1] + r[s, 2, 2]
    if trace > 0.0:
        w = 0.5 * math.sqrt(trace + 1.0)
        n = 0.25 / w
        out[s, 0], out[s, 1] = w, (r[s, 2, 1] - r[s, 1, 2]) * n
        out[s, 2], out[s, 3] = (r[s, 0, 2] - r[s, 2, 0]) * n, (r[s, 1, 0] - r[s, 0, 1]) * n
        return
    i = 0
    if r[s, 1, 1] > r[s, 0, 0]:
        i = 1
    if r[s, 2, 2] > r[s, i, i]:
        i = 2
    j, k = (i + 1) % 3, (i + 2) % 3
    largest = 0.5 * math.sqrt(1.0 + r[s, i, i] - r[s, j, j] - r[s, k, k])
    n = 0.25 / largest
    w = (r[s, k, j] - r[s, j, k]) * n
    sign = -1.0 if w < 0.0 else 1.0
    out[s, 0], out[s, 1 + i] = sign * w, sign * largest
    out[s, 1 + j] = sign * (r[s, i, j] + r[s, j, i]) * n
    out[s, 1 + k] = sign * (r[s, i, k] + r[s, k, i]) * n


@kernel
def spin(before: Floats, after: Floats, s: int, duration: float, out: Floats) -> None:
    """Angular velocity (world) that takes before[s] to a close later after[s], into out[s]."""
    x = y = z = 0.0
    for a in range(3):
        bx, by, bz = before[s, 0, a], before[s, 1, a], before[s, 2, a]
        ax, ay, az = after[s, 0, a], after[s, 1, a], after[s, 2, a]
        x, y, z = x + by * az - bz * ay, y + bz * ax - bx * az, z + bx * ay - by * ax
    half = 0.5 / duration
    out[s, 0], out[s, 1], out[s, 2] = half * x, half * y, half * z
