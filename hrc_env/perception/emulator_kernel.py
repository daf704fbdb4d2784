"""The emulator's inner loop: one environment after the other, on plain arrays."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.sight import make_table
from hrc_env.perception.calibration import POSTURED, SHAPES
from hrc_env.perception.noise import error_share
from hrc_env.perception.outline import facing, mix, posture_of, seen_from, speed
from hrc_env.perception.sightlines import (
    BEHIND,
    N_LOOK,
    OUTSIDE,
    SIDE,
    TURN,
    VIEW,
    Rig,
    World,
    fill,
    see,
)

N_NORMALS = 6
"""Normal variables of a joint in an image: two for errors that last a while, two for new ones,
one for their size, one for the confidence."""

SWAPPED, CROSSED, MISSED = range(3)
"""What may happen to a worker in an image: left and right of all joints exchanged, of the legs
alone, nobody found."""

N_OF_BODY = 4
"""Normal variables of a worker in an image: one for the errors' size, one for each happening."""

SHAPE = tuple(SHAPES[name][1:] or (1,) for name in POSTURED)
FROM = (0, *itertools.accumulate(math.prod(shape) for shape in SHAPE))
"""What a calibration has for each posture, and where it begins in a row of all of it."""

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


class Postured(NamedTuple):
    """What a calibration says of a body as it stands: K kinds of joints, A views, S = 3 sights, Z
    knots. Parts of one row, in this order."""

    offset: Floats
    """(K, 3) [m]."""
    wander: Floats
    """(K, 3) [m]."""
    tail: Floats
    """(1,)."""
    size: Floats
    """(S, K) logarithm of the standard deviation, a share of the window's side."""
    spread: Floats
    """(S, K) of that logarithm, joint by joint."""
    body: Floats
    """(Q,) quantiles of the whole body's part of it, least first."""
    doubt: Floats
    """(S, K, Z) quantiles of the confidence's logit, least first."""
    swap: Floats
    """(A, 2) shares of time, whole body and legs."""
    miss: Floats
    """(16,) share of time by number of joints seen."""
    sigma: Floats
    """(K, V) as `noise.ERROR`."""


class Tables(NamedTuple):
    """A calibration for the kernel."""

    by_posture: Floats
    """(P, N) a row of `Postured` for each posture."""
    space_limb: Floats
    """(K, 3) correlation of what varies in space with the `next` joint's."""
    bias: Floats
    """(A, K, 2) share of the window's side."""
    shares: Floats
    """(K, 3) roots of the shares of lasting, slow and new errors."""
    limb: Floats
    """(K,) correlation with the joint that is next towards the trunk."""
    follows: Floats
    """(S, K) correlation of confidence and smallness of the error."""
    visibility: Floats
    """(V,)."""
    kind: Ints
    """(J,) kind of every joint."""
    hand: Floats
    """(J,) 1 left and in the middle, -1 right."""
    inner: Ints
    """(J,) next joint towards the trunk; itself if there is none."""
    next: Ints
    """(J,) `calibration.NEXT`."""
    mirror: Ints
    """(J,)."""


class Scalars(NamedTuple):
    """Single numbers; `keep` and `renew` of a first-order autoregression."""

    at_rest: float
    """Share of a time constant that an image is, while the worker stands still."""
    per_speed: float
    """How much more for every m/s."""
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


@kernel(makes_arrays=True)
def emulate_batch(errors, normals, world, rig, tables, scalars, px, confidence, sigma):
    """Advance the errors by one image and write keypoints.

    `normals` (B, N) are used in the order bodies, then images. `errors`, `world`, `rig`, `tables`
    and `scalars` are plain tuples of what `Errors` to `Scalars` hold.
    """
    errors, world, rig = Errors(*errors), World(*world), Rig(*rig)
    tables, scalars = Tables(*tables), Scalars(*scalars)
    batch, n_cameras, n_workers, n_joints = confidence.shape
    n_body = world.radius.shape[2]
    first_body = len(world.still) + len(world.robot_radius) + world.moving.shape[1]
    table = make_table(world.still, first_body - len(world.still) + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth, state = np.empty((n_joints, 2)), np.empty(n_joints), np.empty(n_joints, np.int64)
    meant, off, look_of = np.zeros((n_joints, 3)), np.zeros((n_joints, 2)), np.empty(N_LOOK)
    row = np.empty(tables.by_posture.shape[1])
    here = _parts(row)
    n_bodies = 3 * n_joints * n_workers
    for b in range(batch):
        fill(table, world, b)
        for w in range(n_workers):
            joints, next_normal = world.joints[b, w], 3 * n_joints * w
            pace = speed(world.velocity[b, w])
            keep = math.exp(-scalars.at_rest - scalars.per_speed * pace)
            front_x, front_y = facing(joints)
            mix(posture_of(joints, world.velocity[b, w]), tables.by_posture, row)
            _wander(
                errors.wander[b, w], normals[b, next_normal:], joints, front_x, front_y,
                keep, here, tables, scalars, meant,
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
                    here, scalars,
                )  # fmt: skip
                _report(
                    errors.lasting[b, c, w], errors.slow[b, c, w], errors.size[b, c, w],
                    errors.sure[b, c, w], errors.body[b, c], w, mine, keep, uv, state, look_of,
                    found, swapped, crossed, here, tables, scalars, off, px[b, c, w],
                    confidence[b, c, w], sigma[b, c, w],
                )  # fmt: skip


@kernel
def _wander(wander, normals, joints, front_x, front_y, keep, here, tables, scalars, meant):
    """Write where in space the detector means the joints to be, whatever the camera."""
    renew = math.sqrt(1.0 - keep * keep)
    tail = here.tail[0] / 3.0
    for j in range(len(joints)):
        before = tables.next[j]
        for i in range(3):
            wander[j, i] = keep * wander[j, i] + renew * normals[3 * j + i]
            limb = tables.space_limb[tables.kind[j], i] if before != j else 0.0
            meant[j, i] = limb * meant[before, i] + math.sqrt(1.0 - limb * limb) * wander[j, i]
    for j in range(len(joints)):
        kind, hand, n = tables.kind[j], tables.hand[j], meant[j]
        far = 1.0 + tail * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        ahead = here.offset[kind, 0] + here.wander[kind, 0] * far * n[0]
        left = hand * (here.offset[kind, 1] + here.wander[kind, 1] * far * n[1])
        up = here.offset[kind, 2] + here.wander[kind, 2] * far * n[2]
        scale = scalars.error_scale
        meant[j, 0] = joints[j, 0] + scale * (front_x * ahead - front_y * left)
        meant[j, 1] = joints[j, 1] + scale * (front_y * ahead + front_x * left)
        meant[j, 2] = joints[j, 2] + scale * up


@kernel
def _happen(happening, normals, n_seen, look_of, here, scalars):
    """Whether left and right are exchanged now, of all joints and of the legs; whether the worker
    is found.

    Each happens while a normal variable that changes slowly is in its lower tail, which is as
    large as the share of the time that it happens when so many joints are seen from here.
    """
    low, high, part = _between(look_of[VIEW], len(here.swap))
    swap = _lerp(here.swap[low, 0], here.swap[high, 0], part)
    cross = _lerp(here.swap[low, 1], here.swap[high, 1], part)
    swapped = _goes_on(happening, SWAPPED, normals, scalars.keep_swap) < swap
    crossed = _goes_on(happening, CROSSED, normals, scalars.keep_cross) < cross
    missed = _goes_on(happening, MISSED, normals, scalars.keep_miss) < here.miss[n_seen]
    return swapped, crossed, n_seen >= scalars.min_joints and not missed


@kernel
def _goes_on(happening, which, normals, keep):
    """Advance a normal variable; the share of its distribution that is below it."""
    renew = math.sqrt(1.0 - keep * keep)
    happening[which] = keep * happening[which] + renew * normals[which]
    return 0.5 * math.erfc(-happening[which] / math.sqrt(2.0))


@kernel
def _between(angle, n):
    """Of n directions round the circle the two on either side of an angle [rad], and how far it
    is from the first to the second."""
    place = angle * n / (2.0 * math.pi)
    low = math.floor(place)
    return int(low) % n, (int(low) + 1) % n, place - low


@kernel
def _report(
    lasting, slow, size, sure, body, w, normals, keep, uv, state, look_of, found, swapped,
    crossed, here, tables, scalars, off, px, confidence, sigma,
):  # fmt: skip
    """Errors of one worker in one image, and what is then reported of each joint."""
    n_joints, side = len(uv), look_of[SIDE]
    renew = math.sqrt(1.0 - keep * keep)
    turn_cos, turn_sin = math.cos(look_of[TURN]), math.sin(look_of[TURN])
    view_cos, view_sin = math.cos(look_of[VIEW]), math.sin(look_of[VIEW])
    from_left = _between(look_of[VIEW], len(tables.bias))
    from_right = _between(-look_of[VIEW], len(tables.bias))
    body[w] = keep * body[w] + renew * normals[N_NORMALS * n_joints]
    badly = _quantile(here.body, body[w])
    for j in range(n_joints):
        kind, first = tables.kind[j], N_NORMALS * j
        size[j] = keep * size[j] + renew * normals[first + 4]
        sure[j] = keep * sure[j] + renew * normals[first + 5]
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
        sight = state[j]
        scale = math.exp(here.size[sight, kind] + badly + here.spread[sight, kind] * size[j])
        low, high, part = from_left if tables.hand[j] > 0.0 else from_right
        bias, x, y = tables.bias, scale * off[j, 0], scale * off[j, 1]
        x += tables.hand[j] * _lerp(bias[low, kind, 0], bias[high, kind, 0], part)
        y += _lerp(bias[low, kind, 1], bias[high, kind, 1], part)
        length = max(math.sqrt(x * x + y * y), 1e-12)
        shrink = side * scalars.error_scale * min(1.0, scalars.max_error / length)
        px[label, 0] = uv[j, 0] + shrink * (turn_cos * x - turn_sin * y)
        px[label, 1] = uv[j, 1] + shrink * (turn_sin * x + turn_cos * y)
        follows = tables.follows[sight, kind]
        doubt = math.sqrt(1.0 - follows * follows) * sure[j] - follows * z
        logit = _quantile(here.doubt[sight, kind], doubt)
        visible = 1.0 / (1.0 + math.exp(-logit))
        if sight == OUTSIDE:
            visible = min(visible, scalars.outside_confidence)
        confidence[label] = visible
        share = error_share(visible, tables.visibility, here.sigma[kind])
        sigma[label] = scalars.stature_of_side * side * share


@kernel
def _lerp(a, b, part):
    return a + part * (b - a)


@kernel
def _quantile(known, normal):
    """Of a distribution given by its quantiles at whole standard deviations, 0 in the middle."""
    last = len(known) - 1
    place = min(max(normal + 0.5 * last, 0.0), float(last))
    low = min(int(place), last - 1)
    return _lerp(known[low], known[low + 1], place - low)


@kernel(makes_arrays=True)
def _parts(row):
    """A row of numbers as what they are."""
    return Postured(
        row[FROM[0] : FROM[1]].reshape(SHAPE[0]), row[FROM[1] : FROM[2]].reshape(SHAPE[1]),
        row[FROM[2] : FROM[3]], row[FROM[3] : FROM[4]].reshape(SHAPE[3]),
        row[FROM[4] : FROM[5]].reshape(SHAPE[4]), row[FROM[5] : FROM[6]],
        row[FROM[6] : FROM[7]].reshape(SHAPE[6]), row[FROM[7] : FROM[8]].reshape(SHAPE[7]),
        row[FROM[8] : FROM[9]], row[FROM[9] : FROM[10]].reshape(SHAPE[9]),
    )  # fmt: skip
