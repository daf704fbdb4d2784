"""From a control vector to 22 body segments: a spine, and four limbs by two-bone IK."""

import math

import numba

from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import (
    ARM,
    CHEST,
    CLAVICLE,
    FOREARM,
    FOREARM_GRIP,
    HEAD,
    LEG,
    LEFT,
    SHANK,
    SHANK_LENGTH,
    SIDE_STRIDE,
    THIGH,
    THIGH_LENGTH,
    UPPER_ARM,
)
from hrc_env.motion.curves import saturate, soft_min
from hrc_env.typing import Floats

ARM_KNEE, ARM_LIMIT = 0.97, 0.998
"""Shares of the arm's length where stretching begins to resist, and that it never passes."""
LEG_LIMIT = 0.998
"""Share of the leg's length that a walking or standing leg uses at most (knees never lock)."""
LEG_SOFTNESS_M = 0.03
"""Width over which the longest possible leg takes over from the wished pelvis height."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def yaw_pitch_roll(yaw: float, pitch: float, roll: float, r: Floats) -> None:
    """r = Rz(yaw) Ry(pitch) Rx(roll)."""
    cy, sy = math.cos(yaw), math.sin(yaw)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cr, sr = math.cos(roll), math.sin(roll)
    r[0, 0] = cy * cp
    r[0, 1] = cy * sp * sr - sy * cr
    r[0, 2] = cy * sp * cr + sy * sr
    r[1, 0] = sy * cp
    r[1, 1] = sy * sp * sr + cy * cr
    r[1, 2] = sy * sp * cr - cy * sr
    r[2, 0] = -sp
    r[2, 1] = cp * sr
    r[2, 2] = cp * cr


@numba.njit(cache=True, nogil=True, error_model="numpy")
def product(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b, 3 by 3."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def attach(child: int, parent: int, offset: Floats, p: Floats, r: Floats) -> None:
    """Put the child's origin where its rest offset lies in the parent's frame."""
    for i in range(3):
        p[child, i] = p[parent, i] + (
            r[parent, i, 0] * offset[child, 0]
            + r[parent, i, 1] * offset[child, 1]
            + r[parent, i, 2] * offset[child, 2]
        )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def aim(start: Floats, end: Floats, hinge: Floats, rest_frame: Floats, out: Floats) -> None:
    """Rotation that takes a bone from rest to start -> end with its hinge axis along `hinge`.

    `rest_frame` holds the rows (bone, hinge x bone, hinge) of the rest pose.
    """
    bx, by, bz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    n = 1.0 / math.sqrt(bx * bx + by * by + bz * bz)
    bx, by, bz = bx * n, by * n, bz * n
    hx, hy, hz = hinge[0], hinge[1], hinge[2]
    b = (bx, by, bz)
    m = (hy * bz - hz * by, hz * bx - hx * bz, hx * by - hy * bx)
    h = (hx, hy, hz)
    for i in range(3):
        for j in range(3):
            out[i, j] = b[i] * rest_frame[0, j] + m[i] * rest_frame[1, j] + h[i] * rest_frame[2, j]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def bend(
    start: Floats,
    target: Floats,
    lengths: tuple[float, float],
    reach: tuple[float, float],
    pole: Floats,
    middle: Floats,
    end: Floats,
    hinge: Floats,
) -> None:
    """Two-bone IK: the middle joint on the pole's side, the end at (or towards) the target."""
    first, second = lengths
    dx, dy, dz = target[0] - start[0], target[1] - start[1], target[2] - start[2]
    wished = math.sqrt(dx * dx + dy * dy + dz * dz) + 1e-9
    total = first + second
    d = max(saturate(wished, reach[0] * total, reach[1] * total), abs(first - second) + 0.03)
    ux, uy, uz = dx / wished, dy / wished, dz / wished
    along = (first * first - second * second + d * d) / (2.0 * d)
    away = math.sqrt(max(first * first - along * along, 0.0))
    dot = pole[0] * ux + pole[1] * uy + pole[2] * uz
    px, py, pz = pole[0] - dot * ux, pole[1] - dot * uy, pole[2] - dot * uz
    n = 1.0 / (math.sqrt(px * px + py * py + pz * pz) + 1e-9)
    px, py, pz = px * n, py * n, pz * n
    middle[0] = start[0] + ux * along + px * away
    middle[1] = start[1] + uy * along + py * away
    middle[2] = start[2] + uz * along + pz * away
    end[0], end[1], end[2] = start[0] + ux * d, start[1] + uy * d, start[2] + uz * d
    hinge[0], hinge[1], hinge[2] = py * uz - pz * uy, pz * ux - px * uz, px * uy - py * ux


@numba.njit(cache=True, nogil=True, error_model="numpy")
def trunk(q: Floats, offset: Floats, size: Floats, p: Floats, r: Floats, bend_: Floats) -> None:
    """Pelvis (as high as wished and as the legs allow), spine, neck and head."""
    yaw_pitch_roll(q[c.HEADING] + q[c.PELVIS_YAW], q[c.PELVIS_PITCH], q[c.PELVIS_ROLL], r[0])
    p[0, 0], p[0, 1], p[0, 2] = q[c.ROOT_X], q[c.ROOT_Y], q[c.PELVIS_Z]
    longest = LEG_LIMIT * size[LEG]
    for side in range(2):
        thigh, ankle = LEFT + side * SIDE_STRIDE + THIGH, c.ANKLE + 6 * side
        attach(thigh, 0, offset, p, r)
        dx, dy = q[ankle] - p[thigh, 0], q[ankle + 1] - p[thigh, 1]
        rise = math.sqrt(max(longest * longest - dx * dx - dy * dy, 0.01))
        highest = q[ankle + 2] + rise - (p[thigh, 2] - p[0, 2])
        p[0, 2] = soft_min(p[0, 2], highest, LEG_SOFTNESS_M)
    third = 1.0 / 3.0
    yaw_pitch_roll(q[c.SPINE_TWIST] * third, q[c.SPINE_FLEX] * third, q[c.SPINE_SIDE] * third, bend_)
    for s in range(1, CHEST + 1):
        attach(s, s - 1, offset, p, r)
        product(r[s - 1], bend_, r[s])
    yaw_pitch_roll(0.5 * q[c.HEAD_YAW], 0.5 * q[c.HEAD_PITCH], 0.0, bend_)
    for s in range(CHEST + 1, HEAD + 1):
        attach(s, s - 1, offset, p, r)
        product(r[s - 1], bend_, r[s])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def shoulder(
    side: int, q: Floats, turn: tuple[float, float], offset: Floats, size: Floats,
    p: Floats, r: Floats, work: Floats,
) -> None:  # fmt: skip
    """The clavicle, a little up and forward with the hand; the grip's target in work[0]."""
    sign = 1.0 - 2.0 * side
    clavicle = LEFT + side * SIDE_STRIDE + CLAVICLE
    upper = clavicle + UPPER_ARM - CLAVICLE
    attach(clavicle, CHEST, offset, p, r)
    for i in range(3):
        for j in range(3):
            r[clavicle, i, j] = r[CHEST, i, j]
    attach(upper, clavicle, offset, p, r)
    cos, sin = turn
    rel, tgt, share = c.HAND_OFFSET + 3 * side, c.HAND_TARGET + 3 * side, q[c.HAND_SHARE + side]
    local = (
        cos * q[rel] - sin * q[rel + 1],
        sin * q[rel] + cos * q[rel + 1],
        q[rel + 2],
    )
    for i in range(3):
        work[0, i] = (1.0 - share) * (p[upper, i] + local[i]) + share * q[tgt + i]
    arm = size[ARM]
    ahead = (cos * (work[0, 0] - p[upper, 0]) + sin * (work[0, 1] - p[upper, 1])) / arm
    above = (work[0, 2] - p[upper, 2]) / arm
    forward, up = min(max(ahead - 0.3, 0.0) / 0.7, 1.0), min(max(above + 0.5, 0.0), 1.0)
    forward, up = forward * forward * (3.0 - 2.0 * forward), up * up * (3.0 - 2.0 * up)
    yaw_pitch_roll(-sign * 0.22 * forward, 0.0, sign * 0.22 * up, work[1:4])
    product(r[CHEST], work[1:4], r[clavicle])
    attach(upper, clavicle, offset, p, r)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def arm(
    side: int, q: Floats, turn: tuple[float, float], offset: Floats, frame: Floats,
    size: Floats, p: Floats, r: Floats, work: Floats,
) -> None:  # fmt: skip
    """Shoulder to hand; the elbow down, back and outwards."""
    shoulder(side, q, turn, offset, size, p, r, work)
    sign = 1.0 - 2.0 * side
    upper = LEFT + side * SIDE_STRIDE + UPPER_ARM
    cos, sin = turn
    swivel = q[c.SWIVEL + side]
    level, out = math.cos(swivel), math.sin(swivel)
    back, left = -0.7 * level, sign * (0.35 * level + out)
    pole, hinge = work[4], work[5]
    pole[0], pole[1], pole[2] = cos * back - sin * left, sin * back + cos * left, -0.9 * level
    lengths = (size[ARM] - size[FOREARM_GRIP], size[FOREARM_GRIP])
    bend(p[upper], work[0], lengths, (ARM_KNEE, ARM_LIMIT), pole, p[upper + 1], work[6], hinge)
    aim(p[upper], p[upper + 1], hinge, frame[upper], r[upper])
    aim(p[upper + 1], work[6], hinge, frame[upper + 1], r[upper + 1])
    attach(upper + 2, upper + 1, offset, p, r)
    for i in range(3):
        for j in range(3):
            r[upper + 2, i, j] = r[upper + 1, i, j]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def leg(
    side: int, q: Floats, offset: Floats, frame: Floats, size: Floats,
    p: Floats, r: Floats, work: Floats,
) -> None:  # fmt: skip
    """Hip to toes; the knee over the foot."""
    thigh, ankle = LEFT + side * SIDE_STRIDE + THIGH, c.ANKLE + 6 * side
    attach(thigh, 0, offset, p, r)
    yaw, foot_pitch = q[ankle + 3], q[ankle + 4]
    yaw_pitch_roll(yaw, foot_pitch, 0.0, r[thigh + 2])
    yaw_pitch_roll(yaw, q[ankle + 5], 0.0, r[thigh + 3])
    pole, hinge = work[4], work[5]
    pole[0] = 0.75 * r[thigh + 3, 1, 1] + 0.25 * r[0, 0, 0]
    pole[1] = -0.75 * r[thigh + 3, 0, 1] + 0.25 * r[0, 1, 0]
    pole[2] = 0.12
    for i in range(3):
        work[0, i] = q[ankle + i]
    lengths = (size[THIGH_LENGTH], size[SHANK_LENGTH])
    bend(p[thigh], work[0], lengths, (1.0, 1.001), pole, p[thigh + 1], p[thigh + 2], hinge)
    aim(p[thigh], p[thigh + 1], hinge, frame[thigh], r[thigh])
    aim(p[thigh + 1], p[thigh + 2], hinge, frame[thigh + SHANK - THIGH], r[thigh + SHANK - THIGH])
    attach(thigh + 3, thigh + 2, offset, p, r)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def pose(
    q: Floats, offset: Floats, frame: Floats, size: Floats, p: Floats, r: Floats, work: Floats
) -> None:
    """Fill p (22, 3) and r (22, 3, 3) from the control vector q; work is (7, 3) scratch."""
    trunk(q, offset, size, p, r, work[1:4])
    yaw = q[c.HEADING] + q[c.PELVIS_YAW] + q[c.SPINE_TWIST]
    turn = (math.cos(yaw), math.sin(yaw))
    for side in range(2):
        arm(side, q, turn, offset, frame, size, p, r, work)
        leg(side, q, offset, frame, size, p, r, work)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def quaternion(m: Floats, q: Floats) -> None:
    """Unit quaternion (scalar first, w >= 0) of a rotation matrix, by Shepperd's method."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(trace + 1.0)
        q[0], q[1] = 0.25 * s, (m[2, 1] - m[1, 2]) / s
        q[2], q[3] = (m[0, 2] - m[2, 0]) / s, (m[1, 0] - m[0, 1]) / s
        return
    i = 0
    if m[1, 1] > m[0, 0]:
        i = 1
    if m[2, 2] > m[i, i]:
        i = 2
    j, k = (i + 1) % 3, (i + 2) % 3
    s = 2.0 * math.sqrt(max(1.0 + m[i, i] - m[j, j] - m[k, k], 1e-12))
    w = (m[k, j] - m[j, k]) / s
    sign = -1.0 if w < 0.0 else 1.0
    q[0] = sign * w
    q[1 + i] = sign * 0.25 * s
    q[1 + j] = sign * (m[i, j] + m[j, i]) / s
    q[1 + k] = sign * (m[i, k] + m[k, i]) / s


@numba.njit(cache=True, nogil=True, error_model="numpy")
def spin(before: Floats, after: Floats, duration: float, out: Floats) -> None:
    """Angular velocity (world) that takes one rotation to a close later one."""
    inverse = 0.5 / duration
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total = 0.0
        for a in range(3):
            total += after[k, a] * before[j, a] - after[j, a] * before[k, a]
        out[i] = total * inverse


