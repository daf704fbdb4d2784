"""The emulator's inner loop: one environment after the other."""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT, MIRROR, N_JOINTS
from hrc_env.core.typing import Bools, Floats
from hrc_env.perception.calibration import (
    HAND,
    INNER,
    KIND,
    N_VIEWS,
    NEXT,
    POSTURED,
    SHAPES,
    VISIBILITY,
)
from hrc_env.perception.noise import STANDING, error_share
from hrc_env.perception.outline import facing, mix, posture_of, seen_from, speed
from hrc_env.perception.sightlines import (
    BEHIND,
    JOINTS_SEEN,
    OUTSIDE,
    SIDE,
    TURN,
    VIEW,
    fill,
    frame,
    occluders_of,
    see,
)

N_NORMALS = 6
"""Normal variables of a joint in an image: two of lasting errors, two of new ones, size, doubt."""
SWAPPED, CROSSED, MISSED = range(3)
"""What may happen: left and right of all joints exchanged, of the legs alone, nobody found."""
DOUBT, OVERLOOKED = range(2)
"""Numbers of a dim picture: factor on errors and deviations, additional share of misses."""
N_OF_BODY = 4
"""Normal variables of a worker in an image: one for the errors' size, one for each happening."""
FOLLOWED_M = 0.5
"""A track whose hips are nearer than this to a worker's [m] has its windows round them: about
`DetectorConfig.max_offset` of a window's side."""
FIRST_OF_LEGS = JOINT["left_knee"]
"""From this joint on left and right are exchanged where the legs are."""
ERRORS = np.dtype(
    [
        ("lasting", "f8", (N_JOINTS, 2, 2)),  # of an episode: of cosine and sine of the view; x, y
        ("slow", "f8", (N_JOINTS, 2)),  # what lasts for a while, along x and y
        ("size", "f8", (N_JOINTS,)),  # logarithm of the errors' size: a joint's own part
        ("sure", "f8", (N_JOINTS,)),  # the confidence, as far as it does not follow the size
        ("body", "f8"),  # the whole body's factor on the errors' size
        ("happening", "f8", (3,)),  # the lower, the sooner `SWAPPED`, `CROSSED`, `MISSED`
    ],
    align=True,
)
"""What the errors of a worker in a camera remember from image to image, in standard deviations."""
POSTURE = np.dtype([(name, "f8", SHAPES[name][1:]) for name in POSTURED])
"""What a calibration says of a posture; of `size` the logarithm, of `confidence` the logit."""
SETTINGS = np.dtype(
    [
        *((name, "f8", SHAPES[name]) for name in ("space_limb", "bias", "limb", "follows")),
        ("shares", "f8", SHAPES["shares"]),  # roots
        ("at_rest", "f8"),  # share of a time constant that an image is, while the worker stands
        ("per_speed", "f8"),  # how much more for every m/s
        ("common", "f8"),  # root of the share of the sizes' variance that is the whole body's
        ("own", "f8"),  # root of the rest
        ("keep", "f8", (3,)),  # of `SWAPPED`, `CROSSED`, `MISSED`: first-order autoregression
        ("error_scale", "f8"),
        ("max_error", "f8"),  # share of the window's side
        ("min_joints", "f8"),
        ("outside_confidence", "f8"),
        ("stature_of_side", "f8"),
    ],
    align=True,
)
"""What does not depend on the posture."""


class Report(NamedTuple):
    """The keypoints that are written."""

    px: Floats  # (B, C, W, J, 2)
    confidence: Floats  # (B, C, W, J)
    sigma_px: Floats  # (B, C, W, J)


class Expected(NamedTuple):
    """What the tracker predicts."""

    joints: Floats  # (B, W, J, 3) [m]
    velocity: Floats  # (B, W, J, 3) [m/s]
    tracked: Bools  # (B, W)


@kernel(makes_arrays=True)
def emulate_batch(errors, wander, normals, world, expected, rig, dim, calibration, report):
    """Advance errors (B, C, W; `ERRORS`) and wander (B, W, J, 3; the same in every camera) by one
    image, and write a `Report`.

    normals (B, N) are of bodies, then of images; world is a `World`, expected an `Expected`, rig
    (C,) `CAMERA`, dim (B, C, 2) `DOUBT` and `OVERLOOKED` of pictures, calibration a pair: (P, N)
    the numbers of a `POSTURE` each, (1,) `SETTINGS`.
    """
    batch, n_cameras, n_workers = errors.shape
    postures, settings = calibration
    occluders, room = occluders_of(world), np.empty(2, JOINTS_SEEN)
    mixed, meant, off = np.zeros(2, POSTURE), np.zeros((N_JOINTS, 3)), np.zeros((N_JOINTS, 2))
    numbers, n_image = mixed.view(np.float64).reshape(2, -1), N_NORMALS * N_JOINTS + N_OF_BODY
    for b in range(batch):
        fill(occluders.table, world, b)
        for w in range(n_workers):
            joints, here, common = world.joints[b, w], mixed[0], settings[0]
            keep = math.exp(-common.at_rest - common.per_speed * speed(world.velocity[b, w]))
            front = facing(joints)
            mix(posture_of(joints, world.velocity[b, w]), postures, numbers[0])
            track = _track_of(joints, expected.joints[b], expected.tracked[b])
            posture = STANDING
            if track >= 0:
                posture = posture_of(expected.joints[b, track], expected.velocity[b, track])
            mix(posture, postures, numbers[1])
            drawn = normals[b, 3 * N_JOINTS * w :]
            _wander(wander[b, w], drawn, joints, front, keep, here, common, meant)
            for c in range(n_cameras):
                seen, mine = room[0], errors[b, c, w]
                n_seen = see(rig[c], joints, meant, occluders, seen)
                seen.look[VIEW] = seen_from(joints, front[0], front[1], rig[c].eye)
                first = 3 * N_JOINTS * n_workers + (c * n_workers + w) * n_image
                drawn = normals[b, first : first + n_image]
                happens = _happen(mine, drawn, n_seen, seen.look, here, common, dim[b, c])
                _errors(mine, drawn, keep, seen.look, common, off)
                factor = dim[b, c, DOUBT]
                _write(report, (b, c, w), mine, seen, off, here, common, happens, factor)
                side = seen.look[SIDE]  # a search's window is round whom the image shows
                if track >= 0:
                    side, _ = frame(rig[c], expected.joints[b, track], room[1].uv, room[1].depth)
                stature_px = common.stature_of_side * side * factor
                _say(report.confidence[b, c, w], stature_px, mixed[1], report.sigma_px[b, c, w])


@kernel
def _track_of(joints, expected, tracked):
    """The track (W) whose windows show a worker (J, 3): the nearest by the hips; -1: none."""
    nearest, track = FOLLOWED_M, -1
    for t in range(len(tracked)):
        squared = 0.0
        for i in range(3):
            off = joints[7, i] + joints[8, i] - expected[t, 7, i] - expected[t, 8, i]
            squared += 0.25 * off * off
        if tracked[t] and squared < nearest * nearest:
            nearest, track = math.sqrt(squared), t
    return track


@kernel
def _say(confidence, stature_px, expected, sigma):
    """Write sigma (J,) as the detector does: what it knows is the confidence (J,), the stature in
    its window [px] and the posture that is expected."""
    for j in range(N_JOINTS):
        sigma[j] = stature_px * error_share(confidence[j], VISIBILITY, expected.sigma[KIND[j]])


@kernel
def _wander(wander, normals, joints, front, keep, here, common, meant):
    """Write where in space the detector means the joints to be, whatever the camera."""
    renew, scale = math.sqrt(1.0 - keep * keep), common.error_scale
    tail = here.tail / 3.0
    for j in range(len(joints)):
        before = NEXT[j]
        for i in range(3):
            wander[j, i] = keep * wander[j, i] + renew * normals[3 * j + i]
            limb = common.space_limb[KIND[j], i] if before != j else 0.0
            meant[j, i] = limb * meant[before, i] + math.sqrt(1.0 - limb * limb) * wander[j, i]
    for j in range(len(joints)):
        kind, n = KIND[j], meant[j]
        offset, spread = here.offset_m[kind], here.wander_m[kind]
        far = 1.0 + tail * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        ahead = offset[0] + spread[0] * far * n[0]
        left = HAND[j] * (offset[1] + spread[1] * far * n[1])
        up = offset[2] + spread[2] * far * n[2]
        meant[j, 0] = joints[j, 0] + scale * (front[0] * ahead - front[1] * left)
        meant[j, 1] = joints[j, 1] + scale * (front[1] * ahead + front[0] * left)
        meant[j, 2] = joints[j, 2] + scale * up


@kernel
def _happen(mine, normals, n_seen, look_of, here, common, dim):
    """Whether left and right of all joints and of the legs are exchanged, and the worker is found;
    each happens while a slow normal variable is in its lower tail, as large as its share of time.
    """
    low, high, part = _between(look_of[VIEW], N_VIEWS)
    share = here.swap_share
    swap = _lerp(share[low, 0], share[high, 0], part)
    cross = _lerp(share[low, 1], share[high, 1], part)
    swapped = _goes_on(mine, SWAPPED, normals, common.keep) < swap
    crossed = _goes_on(mine, CROSSED, normals, common.keep) < cross
    miss = here.miss_share[n_seen]
    miss += dim[OVERLOOKED] * (1.0 - miss)
    missed = _goes_on(mine, MISSED, normals, common.keep) < miss
    return swapped, crossed, n_seen >= common.min_joints and not missed


@kernel
def _goes_on(mine, which, normals, keeps):
    """Advance a normal variable; the share of its distribution that is below it."""
    keep, normal = keeps[which], normals[N_NORMALS * N_JOINTS + 1 + which]
    mine.happening[which] = keep * mine.happening[which] + math.sqrt(1.0 - keep * keep) * normal
    return 0.5 * math.erfc(-mine.happening[which] / math.sqrt(2.0))


@kernel
def _between(angle, n):
    """Of n directions round the circle those beside an angle [rad], and how far it is between."""
    place = angle * n / (2.0 * math.pi)
    low = math.floor(place)
    return int(low) % n, (int(low) + 1) % n, place - low


@kernel
def _errors(mine, normals, keep, look_of, common, off):
    """Advance the errors of one worker in one image; write how far joints are off, of `size`."""
    renew = math.sqrt(1.0 - keep * keep)
    view_cos, view_sin = math.cos(look_of[VIEW]), math.sin(look_of[VIEW])
    mine.body = keep * mine.body + renew * normals[N_NORMALS * N_JOINTS]
    for j in range(N_JOINTS):
        kind, first = KIND[j], N_NORMALS * j
        mine.size[j] = keep * mine.size[j] + renew * normals[first + 4]
        mine.sure[j] = keep * mine.sure[j] + renew * normals[first + 5]
        for i in range(2):
            mine.slow[j, i] = keep * mine.slow[j, i] + renew * normals[first + i]
            stays = view_cos * mine.lasting[j, i, 0] + view_sin * mine.lasting[j, i, 1]
            own = common.shares[kind, 0] * stays + common.shares[kind, 1] * mine.slow[j, i]
            own += common.shares[kind, 2] * normals[first + 2 + i]
            limb = common.limb[kind]
            off[j, i] = limb * off[INNER[j], i] + math.sqrt(1.0 - limb * limb) * own


@kernel
def _write(report, at, mine, seen, off, here, common, happens, factor):
    """What is reported of each joint of the worker in the image `at` (b, c, w)."""
    px, confidence = report.px[at], report.confidence[at]
    swapped, crossed, found = happens
    side, badly = seen.look[SIDE], _quantile(here.body, mine.body)
    turn_cos, turn_sin = math.cos(seen.look[TURN]), math.sin(seen.look[TURN])
    from_left = _between(seen.look[VIEW], N_VIEWS)
    from_right = _between(-seen.look[VIEW], N_VIEWS)
    for j in range(N_JOINTS):
        kind, sight = KIND[j], seen.sight[j]
        label = MIRROR[j] if swapped != (crossed and j >= FIRST_OF_LEGS) else j
        if not found or sight == BEHIND:
            px[label, 0] = px[label, 1] = np.nan
            confidence[label] = 0.0
            continue
        z = common.common * mine.body + common.own * mine.size[j]
        spread = here.spread[sight, kind] * mine.size[j]
        scale = math.exp(here.size[sight, kind] + badly + spread)
        low, high, part = from_left if HAND[j] > 0.0 else from_right
        bias, x, y = common.bias, scale * off[j, 0], scale * off[j, 1]
        x += HAND[j] * _lerp(bias[low, kind, 0], bias[high, kind, 0], part)
        y += _lerp(bias[low, kind, 1], bias[high, kind, 1], part)
        length = max(math.sqrt(x * x + y * y), 1e-12)
        shrink = side * common.error_scale * min(factor, common.max_error / length)
        px[label, 0] = seen.uv[j, 0] + shrink * (turn_cos * x - turn_sin * y)
        px[label, 1] = seen.uv[j, 1] + shrink * (turn_sin * x + turn_cos * y)
        follows = common.follows[sight, kind]
        doubt = math.sqrt(1.0 - follows * follows) * mine.sure[j] - follows * z
        logit = _quantile(here.confidence[sight, kind], doubt)
        visible = 1.0 / (1.0 + math.exp(-logit))
        if sight == OUTSIDE:
            visible = min(visible, common.outside_confidence)
        confidence[label] = visible


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
