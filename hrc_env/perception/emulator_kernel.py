"""The emulator's inner loop: one environment after the other, on plain arrays."""

import math
from typing import NamedTuple

import numba
import numpy as np

from hrc_env.compiled import JIT, LEAN
from hrc_env.geometry.shapes import passage, set_capsules, set_rows
from hrc_env.geometry.sight import blocks, line, look, make_table, meets
from hrc_env.optics.lens import FOLD, bent, stretch_at
from hrc_env.perception.noise import error_share
from hrc_env.perception.outline import facing, folded, seen_from, window_round
from hrc_env.perception.self_occlusion import body_blocks
from hrc_env.skeleton import JOINT
from hrc_env.typing import Bools, Floats, Ints

MIN_DEPTH_M = 0.5
"""Nearer to a camera's plane there is no image of a person."""

FOCAL, CENTRE = FOLD + 1, FOLD + 3
"""Columns of a camera's row of `bending` behind its lens: fx and fy, 0 if it has no lens; cx and
cy."""

SEEN, HIDDEN, OUTSIDE, BEHIND = range(4)
"""How a camera sees a joint: nothing before it, something before it, outside the image, behind
the camera."""

SIDE, TURN, VIEW, FOLDING = range(4)
"""How a camera sees a worker: side [px] and turn [rad] of the window round them, from where
(`outline.seen_from`) [rad], how folded they are."""

N_NORMALS = 6
"""Normal variables of a joint in an image: two for errors that last a while, two for new ones,
one for their size, one for the confidence."""

FIRST_OF_LEGS = JOINT["left_knee"]
"""From this joint on left and right are exchanged where the legs are."""


class World(NamedTuple):
    """What there is to see, in B environments."""

    joints: Floats
    """(B, W, J, 3) [m]."""
    velocity: Floats
    """(B, W, J, 3) [m/s]."""
    capsules: Floats
    """(B, W, K, 2, 3) the workers' [m]."""
    radius: Floats
    """(B, W, K) [m]."""
    still: Floats
    """(G, `shapes.WIDTH`)."""
    moving: Floats
    """(B, M, `shapes.WIDTH`)."""
    robot: Floats
    """(B, N, 2, 3) capsules [m]."""
    robot_radius: Floats
    """(N,) [m]."""


class Rig(NamedTuple):
    """C cameras."""

    P: Floats
    """(C, 3, 4) projections."""
    eyes: Floats
    """(C, 3) [m]."""
    image: Floats
    """(C, 3) width, height, focal length [px]."""
    bending: Floats
    """(C, `CENTRE` + 2) lenses; zeros for pinholes."""


class Errors(NamedTuple):
    """What the errors remember; see `emulator.EmulatorState`."""

    lasting: Floats
    slow: Floats
    size: Floats
    sure: Floats
    body: Floats
    wander: Floats
    swapped: Bools
    crossed: Bools
    missed: Bools


class Tables(NamedTuple):
    """A calibration for the kernel: P = 2 upright and folded, K kinds of joints, A views,
    S = 3 sights, Z knots."""

    offset: Floats
    """(P, K, 3) [m]."""
    wander: Floats
    """(P, K, 3) [m]."""
    bias: Floats
    """(A, K, 2) share of the window's side."""
    size: Floats
    """(P, S, K) logarithm of the standard deviation, a share of the window's side."""
    spread: Floats
    """(P, S, K) of that logarithm."""
    shares: Floats
    """(K, 3) roots of the shares of lasting, slow and new errors."""
    limb: Floats
    """(K,) correlation with the joint that is next towards the trunk."""
    doubt: Floats
    """(P, S, K, Z) quantiles of the confidence's logit, least first."""
    follows: Floats
    """(S, K) correlation of confidence and smallness of the error."""
    swap: Floats
    """(A, 2) shares of time, whole body and legs."""
    miss: Floats
    """(P, 16) share of time by number of joints seen."""
    sigma: Floats
    """(K, V) as `noise.ERROR`."""
    visibility: Floats
    """(V,)."""
    kind: Ints
    """(J,) kind of every joint."""
    hand: Floats
    """(J,) 1 left and in the middle, -1 right."""
    inner: Ints
    """(J,) next joint towards the trunk; itself if there is none."""
    mirror: Ints
    """(J,)."""


class Scalars(NamedTuple):
    """Single numbers; `keep` and `renew` of a first-order autoregression."""

    at_rest: float
    """Share of a time constant that an image is, while the worker stands still."""
    per_speed: float
    """How much more for every m/s."""
    keep_size: float
    renew_size: float
    common: float
    """Root of the share of the sizes' variance that is the whole body's."""
    own: float
    """Root of the rest."""
    error_scale: float
    max_error: float
    """Share of the window's side."""
    swap_end: float
    """Chance per image that exchanged sides are put right."""
    cross_end: float
    miss_end: float
    min_joints: float
    outside_confidence: float
    stature_of_side: float


@numba.njit(**JIT)
def emulate_batch(errors, normals, uniforms, world, rig, tables, scalars, px, confidence, sigma):
    """Advance the errors by one image and write keypoints.

    `normals` (B, N) are used in the order bodies, then images; `uniforms` are (B, C, W, 3).
    """
    batch, n_cameras, n_workers, n_joints = confidence.shape
    n_body = world.radius.shape[2]
    first_body = len(world.still) + len(world.robot_radius) + world.moving.shape[1]
    table = make_table(world.still, first_body - len(world.still) + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth, state = np.empty((n_joints, 2)), np.empty(n_joints), np.empty(n_joints, np.int64)
    meant, off, look_of = np.empty((n_joints, 3)), np.zeros((n_joints, 2)), np.empty(4)
    for b in range(batch):
        _fill(table, world, b)
        for w in range(n_workers):
            joints, next_normal = world.joints[b, w], 3 * n_joints * w
            keep = math.exp(-scalars.at_rest - scalars.per_speed * _speed(world.velocity[b, w]))
            front_x, front_y = facing(joints)
            look_of[FOLDING] = folded(joints)
            _wander(
                errors.wander[b, w], normals[b, next_normal:], joints, front_x, front_y,
                look_of[FOLDING], keep, tables, scalars, meant,
            )  # fmt: skip
            for c in range(n_cameras):
                n_seen = _see(
                    rig, c, joints, meant, table, first_body, view, rows, uv, depth, state, look_of
                )
                look_of[VIEW] = seen_from(joints, front_x, front_y, rig.eyes[c])
                found = _bursts(
                    errors, b, c, w, uniforms[b, c, w], n_seen, look_of, tables, scalars
                )
                first = 3 * n_joints * n_workers + (c * n_workers + w) * (N_NORMALS * n_joints + 1)
                _report(
                    errors.lasting[b, c, w], errors.slow[b, c, w], errors.size[b, c, w],
                    errors.sure[b, c, w], errors.body[b, c], w, normals[b, first:],
                    keep, uv, state, look_of, found,
                    errors.swapped[b, c, w], errors.crossed[b, c, w],
                    tables, scalars, off, px[b, c, w], confidence[b, c, w], sigma[b, c, w],
                )  # fmt: skip


@numba.njit(**JIT)
def sight_batch(world, rig, sight, look_of):
    """Write how joints (B, C, W, J) and workers (B, C, W, 4) are seen; nothing errs."""
    n_workers, n_joints = world.joints.shape[1:3]
    n_body = world.radius.shape[2]
    first_body = len(world.still) + len(world.robot_radius) + world.moving.shape[1]
    table = make_table(world.still, first_body - len(world.still) + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth = np.empty((n_joints, 2)), np.empty(n_joints)
    for b in range(len(world.joints)):
        _fill(table, world, b)
        for w in range(n_workers):
            joints = world.joints[b, w]
            front_x, front_y = facing(joints)
            for c in range(len(rig.P)):
                mine = look_of[b, c, w]
                _see(
                    rig, c, joints, joints, table, first_body, view, rows, uv, depth,
                    sight[b, c, w], mine,
                )  # fmt: skip
                mine[VIEW] = seen_from(joints, front_x, front_y, rig.eyes[c])
                mine[FOLDING] = folded(joints)


@numba.njit(**LEAN)
def _fill(table, world, b):
    """Write everything that moves in environment b behind what never does."""
    row, n_body = len(world.still), world.radius.shape[2]
    set_capsules(table, row, world.robot[b], world.robot_radius)
    row += len(world.robot_radius)
    set_rows(table, row, world.moving[b])
    row += world.moving.shape[1]
    for w in range(world.radius.shape[1]):
        set_capsules(table, row + w * n_body, world.capsules[b, w], world.radius[b, w])


@numba.njit(**LEAN)
def _wander(wander, normals, joints, front_x, front_y, fold, keep, tables, scalars, meant):
    """Write where in space the detector means the joints to be, whatever the camera."""
    renew = math.sqrt(1.0 - keep * keep)
    for j in range(len(joints)):
        kind, hand = tables.kind[j], tables.hand[j]
        for i in range(3):
            wander[j, i] = keep * wander[j, i] + renew * normals[3 * j + i]
        ahead = _away(tables, fold, kind, 0, wander[j, 0])
        left = hand * _away(tables, fold, kind, 1, wander[j, 1])
        up = _away(tables, fold, kind, 2, wander[j, 2])
        scale = scalars.error_scale
        meant[j, 0] = joints[j, 0] + scale * (front_x * ahead - front_y * left)
        meant[j, 1] = joints[j, 1] + scale * (front_y * ahead + front_x * left)
        meant[j, 2] = joints[j, 2] + scale * up


@numba.njit(**LEAN)
def _speed(velocity):
    """Mean speed of joints (J, 3) [m/s]."""
    total = 0.0
    for j in range(len(velocity)):
        x, y, z = velocity[j, 0], velocity[j, 1], velocity[j, 2]
        total += math.sqrt(x * x + y * y + z * z)
    return total / len(velocity)


@numba.njit(**LEAN)
def _away(tables, fold, kind, axis, normal):
    upright = tables.offset[0, kind, axis] + tables.wander[0, kind, axis] * normal
    folded_up = tables.offset[1, kind, axis] + tables.wander[1, kind, axis] * normal
    return upright + fold * (folded_up - upright)


@numba.njit(**LEAN)
def _see(rig, c, joints, meant, table, first_body, view, rows, uv, depth, state, look_of):
    """Project what is meant, find out what hides the joints. How many of these are seen."""
    _project(rig.P[c], meant, uv, depth)
    total = 0.0
    for j in range(1, 3):
        total += depth[j] + depth[j + 6]
    px_per_m = 4.0 * rig.image[c, 2] / max(total, 4.0 * MIN_DEPTH_M)
    if rig.bending[c, FOCAL] > 0.0:
        px_per_m /= _bend(rig.bending[c], uv, depth)
    look_of[SIDE], look_of[TURN] = window_round(uv, depth, px_per_m, MIN_DEPTH_M)
    _image(uv, depth, rig.image[c], state)
    return _sight(rig.eyes[c], joints, table, first_body, view, rows, state)


@numba.njit(**LEAN)
def _project(P, joints, uv, depth):
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        depth[j] = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + P[2, 3]
        safe = depth[j] if abs(depth[j]) > 1e-9 else 1e-9
        uv[j, 0] = (P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + P[0, 3]) / safe
        uv[j, 1] = (P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + P[1, 3]) / safe


@numba.njit(**LEAN)
def _bend(bending, uv, depth):
    """Bend pinhole pixels in place. How many times longer the pinhole shows the body."""
    fx, fy, cx, cy = bending[FOCAL], bending[FOCAL + 1], bending[CENTRE], bending[CENTRE + 1]
    total, n = 0.0, 0
    for j in range(len(depth)):
        if depth[j] >= MIN_DEPTH_M:
            x, y = (uv[j, 0] - cx) / fx, (uv[j, 1] - cy) / fy
            total += stretch_at(bending, x, y)
            n += 1
            x, y = bent(bending, x, y)
            uv[j, 0], uv[j, 1] = x * fx + cx, y * fy + cy
    return total / n if n > 0 else 1.0


@numba.njit(**LEAN)
def _image(uv, depth, image, state):
    """Which joints are in the image."""
    for j in range(len(depth)):
        if depth[j] < MIN_DEPTH_M:
            state[j] = BEHIND
        elif uv[j, 0] < 0 or uv[j, 0] >= image[0] or uv[j, 1] < 0 or uv[j, 1] >= image[1]:
            state[j] = OUTSIDE
        else:
            state[j] = SEEN


@numba.njit(**LEAN)
def _sight(eye, joints, table, first_body, view, rows, state):
    """Mark the joints in the image that something hides. Counts the seen.

    Bodies are the table's rows from `first_body` on; the rest is as in `geometry.sight`.
    """
    n_view, n_seen = look(eye, joints, table, view, rows), 0
    for j in range(len(joints)):
        if state[j] == SEEN:
            if _is_hidden(eye, joints, j, table, first_body, view, rows, n_view):
                state[j] = HIDDEN
            else:
                n_seen += 1
    return n_seen


@numba.njit(**LEAN)
def _is_hidden(eye, joints, j, table, first_body, view, rows, n_view):
    dx, dy, dz, length = line(eye, joints, j)
    for i in range(n_view):
        if meets(view, i, dx, dy, dz, length):
            row, px, py, pz = rows[i], -view[0, i], -view[1, i], -view[2, i]
            if row >= first_body:
                if body_blocks(table, row, px, py, pz, dx, dy, dz, length):
                    return True
                continue
            enter, leave = passage(table, row, px, py, pz, dx, dy, dz)
            if blocks(enter, leave, length):
                return True
    return False


@numba.njit(**LEAN)
def _bursts(errors, b, c, w, uniforms, n_seen, look_of, tables, scalars):
    """Let exchanged sides and losses begin and end. Whether the worker is found."""
    low, high, part = _between(look_of[VIEW], len(tables.swap))
    swap = tables.swap[low, 0] + part * (tables.swap[high, 0] - tables.swap[low, 0])
    cross = tables.swap[low, 1] + part * (tables.swap[high, 1] - tables.swap[low, 1])
    miss = tables.miss[0, n_seen]
    miss += look_of[FOLDING] * (tables.miss[1, n_seen] - miss)
    _burst(errors.swapped, b, c, w, uniforms[0], swap, scalars.swap_end)
    _burst(errors.crossed, b, c, w, uniforms[1], cross, scalars.cross_end)
    _burst(errors.missed, b, c, w, uniforms[2], miss, scalars.miss_end)
    return n_seen >= scalars.min_joints and not errors.missed[b, c, w]


@numba.njit(**LEAN)
def _burst(active, b, c, w, uniform, share, end):
    """A two-state Markov chain: bursts of mean length 1 / end images, for a share of the time.

    Shares that need longer ones get them.
    """
    end = min(end, (1.0 - share) / max(share, 1e-9))
    begin = end * share / (1.0 - share) if share < 1.0 else 1.0
    active[b, c, w] = uniform >= end if active[b, c, w] else uniform < begin


@numba.njit(**LEAN)
def _between(angle, n):
    """Of n directions round the circle the two on either side of an angle [rad], and how far it
    is from the first to the second."""
    place = angle * n / (2.0 * math.pi)
    low = math.floor(place)
    return int(low) % n, (int(low) + 1) % n, place - low


@numba.njit(**LEAN)
def _report(
    lasting, slow, size, sure, body, w, normals, keep, uv, state, look_of, found, swapped, crossed,
    tables, scalars, off, px, confidence, sigma,
):  # fmt: skip
    """Errors of one worker in one image, and what is then reported of each joint."""
    n_joints, side, fold = len(uv), look_of[SIDE], look_of[FOLDING]
    renew = math.sqrt(1.0 - keep * keep)
    turn_cos, turn_sin = math.cos(look_of[TURN]), math.sin(look_of[TURN])
    view_cos, view_sin = math.cos(look_of[VIEW]), math.sin(look_of[VIEW])
    from_left = _between(look_of[VIEW], len(tables.bias))
    from_right = _between(-look_of[VIEW], len(tables.bias))
    body[w] = scalars.keep_size * body[w] + scalars.renew_size * normals[N_NORMALS * n_joints]
    for j in range(n_joints):
        kind, first = tables.kind[j], N_NORMALS * j
        size[j] = scalars.keep_size * size[j] + scalars.renew_size * normals[first + 4]
        sure[j] = scalars.keep_size * sure[j] + scalars.renew_size * normals[first + 5]
        for i in range(2):
            slow[j, i] = keep * slow[j, i] + renew * normals[first + i]
            stays = view_cos * lasting[j, i, 0] + view_sin * lasting[j, i, 1]
            own = tables.shares[kind, 0] * stays + tables.shares[kind, 1] * slow[j, i]
            own += tables.shares[kind, 2] * normals[first + 2 + i]
            limb = tables.limb[kind]
            off[j, i] = limb * off[tables.inner[j], i] + math.sqrt(1.0 - limb * limb) * own
        label = j
        if swapped != (crossed and j >= FIRST_OF_LEGS):
            label = tables.mirror[j]
        if not found or state[j] == BEHIND:
            px[label, 0] = px[label, 1] = np.nan
            confidence[label] = 0.0
            sigma[label] = np.inf
            continue
        z = scalars.common * body[w] + scalars.own * size[j]
        scale = _lerp(tables.size[0, state[j], kind], tables.size[1, state[j], kind], fold)
        wide = _lerp(tables.spread[0, state[j], kind], tables.spread[1, state[j], kind], fold)
        scale = math.exp(scale + wide * z)
        low, high, part = from_left if tables.hand[j] > 0.0 else from_right
        bias, x, y = tables.bias, scale * off[j, 0], scale * off[j, 1]
        x += tables.hand[j] * _lerp(bias[low, kind, 0], bias[high, kind, 0], part)
        y += _lerp(bias[low, kind, 1], bias[high, kind, 1], part)
        length = max(math.sqrt(x * x + y * y), 1e-12)
        shrink = side * scalars.error_scale * min(1.0, scalars.max_error / length)
        px[label, 0] = uv[j, 0] + shrink * (turn_cos * x - turn_sin * y)
        px[label, 1] = uv[j, 1] + shrink * (turn_sin * x + turn_cos * y)
        follows = tables.follows[state[j], kind]
        logit = _quantile(
            tables.doubt[0, state[j], kind], tables.doubt[1, state[j], kind], fold,
            math.sqrt(1.0 - follows * follows) * sure[j] - follows * z,
        )  # fmt: skip
        visible = 1.0 / (1.0 + math.exp(-logit))
        if state[j] == OUTSIDE:
            visible = min(visible, scalars.outside_confidence)
        confidence[label] = visible
        share = error_share(visible, tables.visibility, tables.sigma[kind])
        sigma[label] = scalars.stature_of_side * side * share


@numba.njit(**LEAN)
def _lerp(a, b, part):
    return a + part * (b - a)


@numba.njit(**LEAN)
def _quantile(upright, folded_up, fold, normal):
    """Of a distribution given by its quantiles at -2 .. 2 standard deviations."""
    last = len(upright) - 1
    place = min(max(normal + 0.5 * last, 0.0), float(last))
    low = min(int(place), last - 1)
    a = _lerp(upright[low], folded_up[low], fold)
    b = _lerp(upright[low + 1], folded_up[low + 1], fold)
    return a + (place - low) * (b - a)
