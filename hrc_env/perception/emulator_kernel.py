"""Compiled kernels of the emulator, which process one environment after another.

The model is described in `emulator`.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records3, dtype_of
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT, MIRROR, N_JOINTS
from hrc_env.core.typing import Bools, Floats, Points2, Points3, Velocities3
from hrc_env.perception.calibration import (
    BODY_KNOTS,
    HAND,
    INNER,
    KIND,
    KNOTS,
    N_KINDS,
    N_SEEN,
    N_SIGHTS,
    N_VIEWS,
    NEXT,
    VISIBILITY,
)
from hrc_env.perception.noise import error_share
from hrc_env.perception.outline import (
    STANDING,
    Facing,
    facing,
    mix,
    posture_of,
    speed,
    view_angle,
)
from hrc_env.perception.sightlines import (
    BEHIND,
    OUTSIDE,
    SIDE,
    TURN,
    VIEW,
    WORKER_VIEW,
    ImageCamera,
    WorkerView,
    World,
    make_room,
    place_moving,
    project_worker,
    view_worker,
)

_LEFT_HIP, _RIGHT_HIP = JOINT["left_hip"], JOINT["right_hip"]
N_NORMALS = 6
"""Number of normal variables per joint and image: two for slowly varying errors, two for
independent errors, one for the errors' size and one for the confidence."""
SWAPPED, CROSSED, MISSED = range(3)
"""Kinds of mistakes of the detector: the left and right labels of all joints are swapped, those of
the legs are swapped, or the worker is not found."""
DOUBT, OVERLOOKED = range(2)
"""Columns of the quality of an image: factor on errors and standard deviations, and additional
fraction of misses."""
N_OF_BODY = 4
"""Number of normal variables per worker and image: one for the errors' size and one for each kind
of mistake."""
FOLLOWED_M = 0.5
"""Maximum distance between the hips of a track and those of a worker at which the windows of the
track show the worker [m]. It corresponds approximately to `DetectorConfig.max_hip_offset`, which is
relative to the window's side."""
FIRST_OF_LEGS = JOINT["left_knee"]
"""Index of the first of the joints that are swapped if the labels of the legs are swapped."""


class Errors:
    """The state of the errors of a worker in a camera, in standard deviations."""

    lasting: Annotated[Floats, (N_JOINTS, 2, 2)]
    """Errors that are constant over the episode, as coefficients of the cosine and the sine of the
    view; the axes are joint, x or y, and cosine or sine."""
    slow: Annotated[Floats, (N_JOINTS, 2)]
    """Slowly varying errors along x and y."""
    size: Annotated[Floats, (N_JOINTS,)]
    """Logarithm of the size of each joint's errors, without the factor on the whole body."""
    sure: Annotated[Floats, (N_JOINTS,)]
    """Part of each joint's confidence that is independent of the errors' size."""
    body: float
    """Logarithm of the factor on the errors' sizes of the whole body."""
    happening: Annotated[Floats, (3,)]
    """Normal variables that cause `SWAPPED`, `CROSSED` and `MISSED` in their lower tails."""


class PostureTables:
    """The part of a calibration that depends on the posture; see `calibration.Calibration`."""

    offset_m: Annotated[Floats, (N_KINDS, 3)]
    """Mean reported position relative to the true joint, in the directions ahead, to the joint's
    side and up [m]."""
    wander_m: Annotated[Floats, (N_KINDS, 3)]
    """Standard deviation of the reported position over time [m]."""
    tail: float
    """Weight of rare large errors (`calibration.Calibration.tail`)."""
    size: Annotated[Floats, (N_SIGHTS, N_KINDS)]
    """Logarithm of the standard deviation of each coordinate in units of the window's side."""
    spread: Annotated[Floats, (N_SIGHTS, N_KINDS)]
    """Standard deviation of `size`."""
    body: Annotated[Floats, (len(BODY_KNOTS),)]
    """Quantiles of the logarithm of the factor on the errors of the whole body."""
    confidence: Annotated[Floats, (N_SIGHTS, N_KINDS, len(KNOTS))]
    """Logits of the quantiles of the reported visibility."""
    swap_share: Annotated[Floats, (N_VIEWS, 2)]
    """Fraction of the time in which the left and right labels of all joints, and of the legs only,
    are swapped."""
    miss_share: Annotated[Floats, (N_SEEN,)]
    """Fraction of the time in which the worker is not found, by the number of visible joints."""
    sigma: Annotated[Floats, (N_KINDS, len(VISIBILITY))]
    """Reported standard deviation at `VISIBILITY`, as a fraction of the stature."""


class Settings:
    """The emulator's settings, and the part of the calibration that is independent of posture."""

    space_limb: Annotated[Floats, (N_KINDS, 3)]
    """Correlation of the reported position in space with that of the joint given by `NEXT`."""
    bias: Annotated[Floats, (N_VIEWS, N_KINDS, 2)]
    """Mean error in the image for each viewing direction, as a fraction of the window's side."""
    limb: Annotated[Floats, (N_KINDS,)]
    """Correlation of a joint's error with that of the next joint towards the trunk."""
    follows: Annotated[Floats, (N_SIGHTS, N_KINDS)]
    """Correlation of the reported visibility with the negative size of the error."""
    shares: Annotated[Floats, (N_KINDS, 3)]
    """Square roots of the fractions of the variance that are constant, slowly varying and
    independent."""
    at_rest: float
    """Time between images, as a fraction of the time constant of slowly varying errors for a worker
    at rest."""
    per_speed: float
    """Increase of `at_rest` with the worker's speed [s/m]."""
    common: float
    """Square root of the fraction of the sizes' variance that is due to the factor on the whole
    body."""
    own: float
    """Square root of the remaining fraction of the sizes' variance."""
    keep: Annotated[Floats, (3,)]
    """Coefficients of the autoregressive processes of `SWAPPED`, `CROSSED` and `MISSED`."""
    error_scale: float
    """Factor on all position errors."""
    max_error: float
    """Maximum error in the image, as a fraction of the window's side."""
    min_joints: float
    """Minimum number of visible joints for a worker to be found."""
    outside_confidence: float
    """Maximum reported visibility of joints outside the image."""
    stature_of_side: float
    """Stature of an upright worker, as a fraction of the window's side."""


ERRORS = dtype_of(Errors)
"""The dtype of `Errors`."""
POSTURE = dtype_of(PostureTables)
"""The dtype of `PostureTables`. It consists of floats only, so that a row can be viewed as an array
of N numbers."""
SETTINGS = dtype_of(Settings)
"""The dtype of `Settings`."""


class Tables(NamedTuple):
    """A calibration in the format of the kernels."""

    postures: Floats
    """(P, N) tables for each posture; a row contains the numbers of a `PostureTables`."""
    settings: Records1[Settings]
    """(1,) settings and tables that do not depend on the posture."""


class Report(NamedTuple):
    """Reported keypoints, the output of the kernels."""

    px: Points2
    """(B, C, W, J, 2) pixels; NaN where there is no measurement."""
    confidence: Floats
    """(B, C, W, J) visibilities in [0, 1]; 0 where there is no measurement."""
    sigma_px: Floats
    """(B, C, W, J) standard deviation of each coordinate [px]."""


class Expected(NamedTuple):
    """Prediction of the tracker in the format of the kernels."""

    joints: Points3
    """(B, W, J, 3) positions of the joints [m]."""
    velocity: Velocities3
    """(B, W, J, 3) velocities of the joints [m/s]."""
    tracked: Bools
    """(B, W) mask of the worker slots with a track."""


class Mistakes(NamedTuple):
    """The detector's mistakes about a worker in an image."""

    is_swapped: bool
    """Whether the left and right labels of all joints are swapped."""
    is_crossed: bool
    """Whether the left and right labels of the legs are swapped."""
    is_found: bool
    """Whether the worker is found."""


class Between(NamedTuple):
    """A position between two entries of a table, for interpolation."""

    low: int
    """Index of the entry before the position."""
    high: int
    """Index of the entry after the position."""
    part: float
    """Distance from the entry `low`, as a fraction of the distance between both entries."""


@kernel(makes_arrays=True)
def emulate_batch(
    errors: Records3[Errors],
    wander: Floats,
    normals: Floats,
    world: World,
    expected: Expected,
    rig: Records1[ImageCamera],
    quality: Floats,
    tables: Tables,
    report: Report,
) -> None:
    """Advance the errors by one image, and compute the keypoints.

    Args:
        errors: (B, C, W) state of the errors in each camera, which is changed.
        wander: (B, W, J, 3) state of the errors that all cameras have in common, which is changed.
        normals: (B, N) standard normal numbers: first for bodies, then for images.
        world: workers and surroundings.
        expected: prediction of the tracker.
        rig: (C,) cameras.
        quality: (B, C, 2) quality of the images: `DOUBT` and `OVERLOOKED`.
        tables: the calibration.
        report: output: the keypoints.
    """
    batch, n_cameras, n_workers = errors.shape
    occluders, views = make_room(world), np.empty(2, WORKER_VIEW)
    mixed, meant, off = np.zeros(2, POSTURE), np.zeros((N_JOINTS, 3)), np.zeros((N_JOINTS, 2))
    numbers, n_image = mixed.view(np.float64).reshape(2, -1), N_NORMALS * N_JOINTS + N_OF_BODY
    for b in range(batch):
        place_moving(occluders.table, world, b)
        for w in range(n_workers):
            joints, here, common = world.joints[b, w], mixed[0], tables.settings[0]
            keep = math.exp(-common.at_rest - common.per_speed * speed(world.velocity[b, w]))
            front = facing(joints)
            mix(posture_of(joints, world.velocity[b, w]), tables.postures, numbers[0])
            track = _find_track(joints, expected.joints[b], expected.tracked[b])
            posture = STANDING
            if track >= 0:
                posture = posture_of(expected.joints[b, track], expected.velocity[b, track])
            mix(posture, tables.postures, numbers[1])
            drawn = normals[b, 3 * N_JOINTS * w :]
            _advance_wander(wander[b, w], drawn, joints, front, keep, here, common, meant)
            for c in range(n_cameras):
                view, state = views[0], errors[b, c, w]
                n_seen = view_worker(rig[c], joints, meant, occluders, view)
                view.look[VIEW] = view_angle(joints, front, rig[c].eye)
                first = 3 * N_JOINTS * n_workers + (c * n_workers + w) * n_image
                drawn = normals[b, first : first + n_image]
                missed = quality[b, c, OVERLOOKED]
                mistakes = _draw_mistakes(
                    state, drawn, n_seen, view.look[VIEW], here, common, missed
                )
                _advance_errors(state, drawn, keep, view.look[VIEW], common, off)
                factor = quality[b, c, DOUBT]
                px, confidence = report.px[b, c, w], report.confidence[b, c, w]
                _write_keypoints(px, confidence, state, view, off, here, common, mistakes, factor)
                side = view.look[SIDE]  # a search finds the window around the worker's image
                if track >= 0:
                    side = project_worker(
                        rig[c], expected.joints[b, track], views[1].uv, views[1].depth
                    ).side_px
                stature_px = common.stature_of_side * side * factor
                _write_sigma(confidence, stature_px, mixed[1], report.sigma_px[b, c, w])


@kernel
def _find_track(joints: Points3, expected: Points3, tracked: Bools) -> int:
    """Return the index of the track with image windows that show a worker, or -1 if there is none.

    The returned track has the predicted mid-hip nearest to that of the worker, at a distance below
    `FOLLOWED_M`, because the detector searches for a person in windows around the predicted body.

    Args:
        joints: (J, 3) true joints of the worker in the world frame [m].
        expected: (W, J, 3) joints predicted by the tracker, in the world frame [m].
        tracked: (W,) mask of the slots with a track.
    """
    nearest_m, track = FOLLOWED_M, -1
    for w in range(len(tracked)):
        squared_m2 = 0.0
        for i in range(3):
            hips = joints[_LEFT_HIP, i] + joints[_RIGHT_HIP, i]
            twice_m = hips - expected[w, _LEFT_HIP, i] - expected[w, _RIGHT_HIP, i]
            squared_m2 += 0.25 * twice_m * twice_m  # of the middles, which are half of the sums
        if tracked[w] and squared_m2 < nearest_m * nearest_m:
            nearest_m, track = math.sqrt(squared_m2), w
    return track


@kernel
def _write_sigma(
    confidence: Floats, stature_px: float, expected: PostureTables, sigma: Floats
) -> None:
    """Compute the standard deviations that the detector reports.

    They depend on the confidence, the stature and the expected posture, which are available to the
    detector.

    Args:
        confidence: (J,) reported visibilities.
        stature_px: stature in the worker's window [px].
        expected: tables of the expected posture.
        sigma: (J,) output: the standard deviations [px].
    """
    for j in range(N_JOINTS):
        sigma[j] = stature_px * error_share(confidence[j], VISIBILITY, expected.sigma[KIND[j]])


@kernel
def _advance_wander(
    wander: Floats,
    normals: Floats,
    joints: Points3,
    front: Facing,
    keep: float,
    posture: PostureTables,
    shared: Settings,
    meant: Points3,
) -> None:
    """Advance the errors common to all cameras, and compute the joints with these errors.

    Each joint has an error of unit variance along three axes of the body: ahead, to the joint's
    side, and up. It is a mixture of the error of the next joint towards the trunk (e_parent) and an
    individual error w, which is a first-order autoregressive process:

        w = keep w + sqrt(1 - keep^2) n,    e = r e_parent + sqrt(1 - r^2) w
        displacement = offset + deviation (1 + tail |e|^2 / 3) e

    with n from `normals`, and the correlation r, offset, deviation and tail from the calibration.

    Args:
        wander: (J, 3) individual errors w in standard deviations, changed in place.
        normals: (3 J or more,) standard normal numbers.
        joints: (J, 3) true joints in the world frame [m].
        front: horizontal unit vector towards the front of the body in the world frame.
        keep: coefficient of the autoregression, 0 to 1.
        posture: tables of the worker's posture.
        shared: tables that do not depend on the posture.
        meant: (J, 3) receives the joints with errors in the world frame [m]; it must not be the
            array `joints`.
    """
    renew, error_scale = math.sqrt(1.0 - keep * keep), shared.error_scale
    errors = meant  # the array holds the errors e first, and then the joints
    for j in range(len(joints)):
        parent: int = NEXT[j]  # before joint j in the order of joints; j itself without a parent
        for i in range(3):
            wander[j, i] = keep * wander[j, i] + renew * normals[3 * j + i]
            correlation = shared.space_limb[KIND[j], i] if parent != j else 0.0
            own_share = math.sqrt(1.0 - correlation * correlation)
            errors[j, i] = correlation * errors[parent, i] + own_share * wander[j, i]
    tail = posture.tail / 3.0  # the mean of |e|^2 is 3
    for j in range(len(joints)):
        kind, error = KIND[j], errors[j]
        offset_m, deviation_m = posture.offset_m[kind], posture.wander_m[kind]
        squared = error[0] * error[0] + error[1] * error[1] + error[2] * error[2]
        tail_factor = 1.0 + tail * squared
        ahead_m = offset_m[0] + deviation_m[0] * tail_factor * error[0]
        left_m = HAND[j] * (offset_m[1] + deviation_m[1] * tail_factor * error[1])
        up_m = offset_m[2] + deviation_m[2] * tail_factor * error[2]
        meant[j, 0] = joints[j, 0] + error_scale * (front.x * ahead_m - front.y * left_m)
        meant[j, 1] = joints[j, 1] + error_scale * (front.y * ahead_m + front.x * left_m)
        meant[j, 2] = joints[j, 2] + error_scale * up_m


@kernel
def _draw_mistakes(
    state: Errors,
    normals: Floats,
    n_seen: int,
    view: float,
    here: PostureTables,
    common: Settings,
    overlooked: float,
) -> Mistakes:
    """Sample the detector's mistakes about a worker in an image.

    A mistake occurs while a slowly varying normal variable is in its lower tail. The probability of
    the tail is the fraction of the time in which the mistake occurs.

    Args:
        state: state of the errors, which is changed.
        normals: (`N_NORMALS` J + `N_OF_BODY`,) standard normal numbers of the image.
        n_seen: number of visible joints.
        view: direction from which the camera sees the body [rad].
        here: tables of the worker's posture.
        common: tables that do not depend on the posture.
        overlooked: additional fraction of misses.
    """
    at = _between_views(view)
    share = here.swap_share
    swap = _lerp(share[at.low, 0], share[at.high, 0], at.part)
    cross = _lerp(share[at.low, 1], share[at.high, 1], at.part)
    is_swapped = _advance_mistake(state, SWAPPED, normals, common.keep) < swap
    is_crossed = _advance_mistake(state, CROSSED, normals, common.keep) < cross
    miss = here.miss_share[n_seen]
    miss += overlooked * (1.0 - miss)
    is_missed = _advance_mistake(state, MISSED, normals, common.keep) < miss
    return Mistakes(is_swapped, is_crossed, n_seen >= common.min_joints and not is_missed)


@kernel
def _advance_mistake(state: Errors, which: int, normals: Floats, keeps: Floats) -> float:
    """Advance the normal variable of a mistake, and return the cumulative probability at it."""
    keep, normal = keeps[which], normals[N_NORMALS * N_JOINTS + 1 + which]
    state.happening[which] = keep * state.happening[which] + math.sqrt(1.0 - keep * keep) * normal
    return 0.5 * math.erfc(-state.happening[which] / math.sqrt(2.0))


@kernel
def _between_views(angle: float) -> Between:
    """Return the position of an angle [rad] between the `N_VIEWS` directions around the body."""
    place = angle * N_VIEWS / (2.0 * math.pi)
    low = math.floor(place)
    return Between(int(low) % N_VIEWS, (int(low) + 1) % N_VIEWS, place - low)


@kernel
def _advance_errors(
    state: Errors, normals: Floats, keep: float, view: float, common: Settings, off: Floats
) -> None:
    """Advance the errors of a worker in an image.

    Args:
        state: state of the errors, which is changed.
        normals: (`N_NORMALS` J + `N_OF_BODY`,) standard normal numbers of the image.
        keep: coefficient of the autoregressive processes.
        view: direction from which the camera sees the body [rad].
        common: tables that do not depend on the posture.
        off: (J, 2) output: the errors, in units of their size.
    """
    renew = math.sqrt(1.0 - keep * keep)
    view_cos, view_sin = math.cos(view), math.sin(view)
    state.body = keep * state.body + renew * normals[N_NORMALS * N_JOINTS]
    for j in range(N_JOINTS):
        kind, first = KIND[j], N_NORMALS * j
        state.size[j] = keep * state.size[j] + renew * normals[first + 4]
        state.sure[j] = keep * state.sure[j] + renew * normals[first + 5]
        for i in range(2):
            state.slow[j, i] = keep * state.slow[j, i] + renew * normals[first + i]
            stays = view_cos * state.lasting[j, i, 0] + view_sin * state.lasting[j, i, 1]
            own = common.shares[kind, 0] * stays + common.shares[kind, 1] * state.slow[j, i]
            own += common.shares[kind, 2] * normals[first + 2 + i]
            limb = common.limb[kind]
            off[j, i] = limb * off[INNER[j], i] + math.sqrt(1.0 - limb * limb) * own


@kernel
def _write_keypoints(
    px: Points2,
    confidence: Floats,
    state: Errors,
    view: WorkerView,
    off: Floats,
    here: PostureTables,
    common: Settings,
    mistakes: Mistakes,
    factor: float,
) -> None:
    """Compute the reported pixels and confidences of a worker in an image.

    Args:
        px: (J, 2) output: the pixels [px].
        confidence: (J,) output: the confidences.
        state: state of the errors.
        view: view of the worker in the camera.
        off: (J, 2) errors in units of their size.
        here: tables of the worker's posture.
        common: tables that do not depend on the posture.
        mistakes: mistakes of the detector.
        factor: factor on the errors due to the quality of the image.
    """
    side, badly = view.look[SIDE], _quantile(here.body, state.body)
    turn_cos, turn_sin = math.cos(view.look[TURN]), math.sin(view.look[TURN])
    from_left = _between_views(view.look[VIEW])
    from_right = _between_views(-view.look[VIEW])
    for j in range(N_JOINTS):
        kind, sight = KIND[j], view.sight[j]
        is_exchanged = mistakes.is_swapped != (mistakes.is_crossed and j >= FIRST_OF_LEGS)
        label = MIRROR[j] if is_exchanged else j
        if not mistakes.is_found or sight == BEHIND:
            px[label, 0] = px[label, 1] = np.nan
            confidence[label] = 0.0
            continue
        z = common.common * state.body + common.own * state.size[j]
        spread = here.spread[sight, kind] * state.size[j]
        scale = math.exp(here.size[sight, kind] + badly + spread)
        at = from_left if HAND[j] > 0.0 else from_right
        bias, x, y = common.bias, scale * off[j, 0], scale * off[j, 1]
        x += HAND[j] * _lerp(bias[at.low, kind, 0], bias[at.high, kind, 0], at.part)
        y += _lerp(bias[at.low, kind, 1], bias[at.high, kind, 1], at.part)
        length = max(math.sqrt(x * x + y * y), 1e-12)
        shrink = side * common.error_scale * min(factor, common.max_error / length)
        px[label, 0] = view.uv[j, 0] + shrink * (turn_cos * x - turn_sin * y)
        px[label, 1] = view.uv[j, 1] + shrink * (turn_sin * x + turn_cos * y)
        follows = common.follows[sight, kind]
        doubt = math.sqrt(1.0 - follows * follows) * state.sure[j] - follows * z
        logit = _quantile(here.confidence[sight, kind], doubt)
        visible = 1.0 / (1.0 + math.exp(-logit))
        if sight == OUTSIDE:
            visible = min(visible, common.outside_confidence)
        confidence[label] = visible


@kernel
def _lerp(a: float, b: float, part: float) -> float:
    """Interpolate linearly between `a` (`part` 0) and `b` (`part` 1)."""
    return a + part * (b - a)


@kernel
def _quantile(known: Floats, normal: float) -> float:
    """Return the quantile of a distribution at a standard normal deviate.

    The distribution is given by its quantiles at integer deviates, with 0 in the middle.
    """
    last = len(known) - 1
    place = min(max(normal + 0.5 * last, 0.0), float(last))
    low = min(int(place), last - 1)
    return _lerp(known[low], known[low + 1], place - low)
