"""The emulator's inner loop: one environment after the other, on plain arrays."""

import math
from typing import NamedTuple

import numba
import numpy as np

from hrc_env.compiled import JIT, LEAN
from hrc_env.geometry.sight import make_table
from hrc_env.perception.noise import error_share
from hrc_env.perception.outline import (
    facing,
    folded,
    mixed,
    seen_from,
    speed,
    stepping,
    weigh,
)
from hrc_env.perception.sightlines import BEHIND, OUTSIDE, SIDE, TURN, VIEW, fill, see
from hrc_env.skeleton import JOINT
from hrc_env.typing import Floats, Ints

N_NORMALS = 6
"""Normal variables of a joint in an image: two for errors that last a while, two for new ones,
one for their size, one for the confidence."""

SWAPPED, CROSSED, MISSED = range(3)
"""What may happen to a worker in an image: left and right of all joints exchanged, of the legs
alone, nobody found."""

N_OF_BODY = 4
"""Normal variables of a worker in an image: one for the errors' size, one for each happening."""

FIRST_OF_LEGS = JOINT["left_knee"]
"""From this joint on left and right are exchanged where the legs are."""


class Errors(NamedTuple):
    """What the errors remember; see `emulator.EmulatorState`."""

    lasting: Floats
    slow: Floats
    size: Floats
    sure: Floats
    body: Floats
    wander: Floats
    happening: Floats


class Tables(NamedTuple):
    """A calibration for the kernel: P = 3 standing, walking and folded, K kinds of joints, A views,
    S = 3 sights, Z knots."""

    offset: Floats
    """(P, K, 3) [m]."""
    wander: Floats
    """(P, K, 3) [m]."""
    tail: Floats
    """(P,)."""
    bias: Floats
    """(A, K, 2) share of the window's side."""
    size: Floats
    """(P, S, K) logarithm of the standard deviation, a share of the window's side."""
    spread: Floats
    """(P, S, K) of that logarithm, joint by joint."""
    body: Floats
    """(P, Q) quantiles of the whole body's part of it, least first."""
    shares: Floats
    """(K, 3) roots of the shares of lasting, slow and new errors."""
    limb: Floats
    """(K,) correlation with the joint that is next towards the trunk."""
    doubt: Floats
    """(P, S, K, Z) quantiles of the confidence's logit, least first."""
    follows: Floats
    """(S, K) correlation of confidence and smallness of the error."""
    swap: Floats
    """(P, A, 2) shares of time, whole body and legs."""
    miss: Floats
    """(P, 16) share of time by number of joints seen."""
    sigma: Floats
    """(P, K, V) as `noise.ERROR`."""
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
    """Root of the share of the sizes' variance that is the whole body's; the confidence's."""
    own: float
    """Root of the rest."""
    error_scale: float
    max_error: float
    """Share of the window's side."""
    keep_swap: float
    keep_cross: float
    keep_miss: float
    min_joints: float
    outside_confidence: float
    stature_of_side: float


@numba.njit(**JIT)
def emulate_batch(errors, normals, world, rig, tables, scalars, px, confidence, sigma):
    """Advance the errors by one image and write keypoints.

    `normals` (B, N) are used in the order bodies, then images.
    """
    batch, n_cameras, n_workers, n_joints = confidence.shape
    n_body = world.radius.shape[2]
    first_body = len(world.still) + len(world.robot_radius) + world.moving.shape[1]
    table = make_table(world.still, first_body - len(world.still) + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth, state = np.empty((n_joints, 2)), np.empty(n_joints), np.empty(n_joints, np.int64)
    meant, off, look_of = np.empty((n_joints, 3)), np.zeros((n_joints, 2)), np.empty(5)
    n_bodies = 3 * n_joints * n_workers
    for b in range(batch):
        fill(table, world, b)
        for w in range(n_workers):
            joints, next_normal = world.joints[b, w], 3 * n_joints * w
            pace = speed(world.velocity[b, w])
            keep = math.exp(-scalars.at_rest - scalars.per_speed * pace)
            front_x, front_y = facing(joints)
            posture = weigh(folded(joints), stepping(pace))
            _wander(
                errors.wander[b, w], normals[b, next_normal:], joints, front_x, front_y,
                posture, keep, tables, scalars, meant,
            )  # fmt: skip
            for c in range(n_cameras):
                n_seen = see(
                    rig, c, joints, meant, table, first_body, view, rows, uv, depth, state, look_of
                )
                look_of[VIEW] = seen_from(joints, front_x, front_y, rig.eyes[c])
                first = n_bodies + (c * n_workers + w) * (N_NORMALS * n_joints + N_OF_BODY)
                mine = normals[b, first:]
                swapped, crossed, found = _happen(
                    errors.happening[b, c, w], mine[N_NORMALS * n_joints + 1 :], n_seen, look_of,
                    posture, tables, scalars,
                )  # fmt: skip
                _report(
                    errors.lasting[b, c, w], errors.slow[b, c, w], errors.size[b, c, w],
                    errors.sure[b, c, w], errors.body[b, c], w, mine, keep, uv, state, look_of,
                    posture, found, swapped, crossed, tables, scalars, off, px[b, c, w],
                    confidence[b, c, w], sigma[b, c, w],
                )  # fmt: skip


@numba.njit(**LEAN)
def _wander(wander, normals, joints, front_x, front_y, posture, keep, tables, scalars, meant):
    """Write where in space the detector means the joints to be, whatever the camera."""
    renew = math.sqrt(1.0 - keep * keep)
    tail = mixed(posture, tables.tail[0], tables.tail[1], tables.tail[2]) / 3.0
    for j in range(len(joints)):
        kind, hand = tables.kind[j], tables.hand[j]
        for i in range(3):
            wander[j, i] = keep * wander[j, i] + renew * normals[3 * j + i]
        n = wander[j]
        far = 1.0 + tail * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        ahead = _away(tables, posture, kind, 0, far * n[0])
        left = hand * _away(tables, posture, kind, 1, far * n[1])
        up = _away(tables, posture, kind, 2, far * n[2])
        scale = scalars.error_scale
        meant[j, 0] = joints[j, 0] + scale * (front_x * ahead - front_y * left)
        meant[j, 1] = joints[j, 1] + scale * (front_y * ahead + front_x * left)
        meant[j, 2] = joints[j, 2] + scale * up


@numba.njit(**LEAN)
def _away(tables, posture, kind, axis, normal):
    at, wide = tables.offset, tables.wander
    middle = mixed(posture, at[0, kind, axis], at[1, kind, axis], at[2, kind, axis])
    std = mixed(posture, wide[0, kind, axis], wide[1, kind, axis], wide[2, kind, axis])
    return middle + std * normal


@numba.njit(**LEAN)
def _happen(happening, normals, n_seen, look_of, posture, tables, scalars):
    """Whether left and right are exchanged now, of all joints and of the legs; whether the worker
    is found.

    Each happens while a normal variable that changes slowly is in its lower tail, which is as
    large as the share of the time that it happens when so many joints are seen from here.
    """
    low, high, part = _between(look_of[VIEW], tables.swap.shape[1])
    swap = _swap_share(tables.swap, posture, low, high, part, 0)
    cross = _swap_share(tables.swap, posture, low, high, part, 1)
    missing = tables.miss
    miss = mixed(posture, missing[0, n_seen], missing[1, n_seen], missing[2, n_seen])
    swapped = _goes_on(happening, SWAPPED, normals, scalars.keep_swap) < swap
    crossed = _goes_on(happening, CROSSED, normals, scalars.keep_cross) < cross
    missed = _goes_on(happening, MISSED, normals, scalars.keep_miss) < miss
    return swapped, crossed, n_seen >= scalars.min_joints and not missed


@numba.njit(**LEAN)
def _swap_share(swap, posture, low, high, part, which):
    """Of two neighbouring views."""
    a = mixed(posture, swap[0, low, which], swap[1, low, which], swap[2, low, which])
    b = mixed(posture, swap[0, high, which], swap[1, high, which], swap[2, high, which])
    return _lerp(a, b, part)


@numba.njit(**LEAN)
def _goes_on(happening, which, normals, keep):
    """Advance a normal variable; the share of its distribution that is below it."""
    renew = math.sqrt(1.0 - keep * keep)
    happening[which] = keep * happening[which] + renew * normals[which]
    return 0.5 * math.erfc(-happening[which] / math.sqrt(2.0))


@numba.njit(**LEAN)
def _between(angle, n):
    """Of n directions round the circle the two on either side of an angle [rad], and how far it
    is from the first to the second."""
    place = angle * n / (2.0 * math.pi)
    low = math.floor(place)
    return int(low) % n, (int(low) + 1) % n, place - low


@numba.njit(**LEAN)
def _report(
    lasting, slow, size, sure, body, w, normals, keep, uv, state, look_of, posture, found,
    swapped, crossed, tables, scalars, off, px, confidence, sigma,
):  # fmt: skip
    """Errors of one worker in one image, and what is then reported of each joint."""
    n_joints, side = len(uv), look_of[SIDE]
    renew = math.sqrt(1.0 - keep * keep)
    turn_cos, turn_sin = math.cos(look_of[TURN]), math.sin(look_of[TURN])
    view_cos, view_sin = math.cos(look_of[VIEW]), math.sin(look_of[VIEW])
    from_left = _between(look_of[VIEW], len(tables.bias))
    from_right = _between(-look_of[VIEW], len(tables.bias))
    body[w] = scalars.keep_size * body[w] + scalars.renew_size * normals[N_NORMALS * n_joints]
    badly = _quantile(tables.body[0], tables.body[1], tables.body[2], posture, body[w])
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
        sight, size_of, spread_of = state[j], tables.size, tables.spread
        scale = mixed(
            posture, size_of[0, sight, kind], size_of[1, sight, kind], size_of[2, sight, kind]
        )
        wide = mixed(
            posture, spread_of[0, sight, kind], spread_of[1, sight, kind], spread_of[2, sight, kind]
        )
        scale = math.exp(scale + badly + wide * size[j])
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
            tables.doubt[0, sight, kind], tables.doubt[1, sight, kind],
            tables.doubt[2, sight, kind], posture,
            math.sqrt(1.0 - follows * follows) * sure[j] - follows * z,
        )  # fmt: skip
        visible = 1.0 / (1.0 + math.exp(-logit))
        if state[j] == OUTSIDE:
            visible = min(visible, scalars.outside_confidence)
        confidence[label] = visible
        share = 0.0
        for p in range(len(posture)):
            if posture[p] > 0.0:
                error = tables.sigma[p, kind]
                share += posture[p] * error_share(visible, tables.visibility, error)
        sigma[label] = scalars.stature_of_side * side * share


@numba.njit(**LEAN)
def _lerp(a, b, part):
    return a + part * (b - a)


@numba.njit(**LEAN)
def _quantile(standing, walking, folded_up, posture, normal):
    """Of a distribution given by its quantiles at whole standard deviations, 0 in the middle."""
    last = len(standing) - 1
    place = min(max(normal + 0.5 * last, 0.0), float(last))
    low = min(int(place), last - 1)
    a = mixed(posture, standing[low], walking[low], folded_up[low])
    b = mixed(posture, standing[low + 1], walking[low + 1], folded_up[low + 1])
    return a + (place - low) * (b - a)
