"""Errors of detections in the coordinates in which the emulator draws them."""

import inspect
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from assets.emulator.clips import DT_S, WARM_UP
from assets.emulator.watch import Watched
from hrc_env.core.skeleton import MIRROR
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import HAND
from hrc_env.perception.emulator_kernel import FIRST_OF_LEGS
from hrc_env.perception.outline import weigh
from hrc_env.perception.sightlines import (
    FOLDING,
    HANDLING,
    KNEELING,
    SEEN,
    SIDE,
    STEPPING,
    TURN,
    VIEW,
)

LEFT_OF_PAIR = np.flatnonzero(np.arange(len(MIRROR)) < MIRROR)
"""Left joints of the seven pairs."""
APART = 0.05
"""Least distance of a pair in the image at which left and right can be distinguished, as a share of
the window's side."""
BETTER = 0.6
"""A pair is exchanged if its error with exchanged sides is below this share of its error as it
is."""
AGREED = 0.06
"""Greatest error at which cameras agree on a joint's offset in space, as a share of the window's
side; three times as large where the body is folded."""


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of L clips of T frames in C cameras.

    Image coordinates are x to the right in the window and y down, as shares of its side.
    """

    error: Floats
    """Errors after correction of exchanged sides, (L, T, C, J, 2); NaN: not detected."""
    confidence: Floats
    """Confidences, (L, T, C, J)."""
    sight: Ints
    """Lines of sight, (L, T, C, J)."""
    view: Floats
    """Directions of view, (L, T, C) [rad]."""
    posture: Floats
    """Degree of membership of the body in each of `POSTURES`, (L, T, P)."""
    speed_m_s: Floats
    """Mean speed of the joints, (L, T)."""
    missed: Bools
    """True where the worker was not detected, (L, T, C)."""
    exchanged: Bools
    """True where left and right of all joints, or of the legs alone, are exchanged, (L, T, C,
    2)."""
    shown: Floats
    """Image of an offset in space (ahead, to the joint's own side, up) [1/m], (L, T, C, J, 2,
    3)."""
    offset_m: Floats
    """Offset in space on which at least three cameras agree, (L, T, J, 3); NaN: fewer."""
    counts: Bools
    """True while the worker was tracked, so that the windows were in place, (L, T)."""


def make_samples(clips: Sequence[Watched]) -> Samples:
    """Return the samples of clips of one length and number of cameras, without their warm-up."""
    parts = [_samples(clip) for clip in clips]
    return Samples(*(np.stack([getattr(part, f.name) for part in parts]) for f in fields(Samples)))


def _samples(clip: Watched) -> Samples:
    late = slice(WARM_UP, None)
    look_of, sight = clip.look_of[late], clip.sight[late]
    px, true_px = clip.px[late], clip.true_px[late]
    exchanged = find_exchanges(px, true_px, look_of[..., SIDE])
    px = np.where(exchanged[..., 0, None, None], px[..., MIRROR, :], px)
    legs = exchanged[..., 1, None, None] & (np.arange(px.shape[2]) >= FIRST_OF_LEGS)[:, None]
    px = np.where(legs, px[..., MIRROR, :], px)
    error = _in_window(px - true_px, look_of)
    shown = _shown(clip, late, look_of)
    offset = _agreed(error, shown, sight, look_of[:, 0, FOLDING])
    pace_m = np.linalg.norm(np.diff(clip.joints_world, axis=0), axis=-1).mean(-1)
    return Samples(
        error, clip.confidence[late], sight, look_of[..., VIEW], read_postures(clip)[late],
        pace_m[WARM_UP - 1 :] / DT_S, np.isnan(clip.px[late, :, 0, 0]), exchanged, shown,
        offset, clip.tracked[late],
    )  # fmt: skip


def read_postures(clip: Watched) -> Floats:
    """Return the degree of membership of the body in each of `POSTURES`, (T, P)."""
    look_of = clip.look_of[:, 0]
    columns = look_of[:, [FOLDING, KNEELING, HANDLING, STEPPING]].T
    shares = inspect.unwrap(weigh)(*columns)  # of arrays, not compiled
    return np.stack(shares, -1)


def _in_window(vectors: Floats, look_of: Floats) -> Floats:
    """Rotate image vectors (T, C, J, 2, ...) into the window and divide them by its side."""
    lead = (..., None) + (None,) * (vectors.ndim - 4)
    cos, sin = np.cos(look_of[..., TURN])[lead], np.sin(look_of[..., TURN])[lead]
    x, y, side = vectors[:, :, :, 0], vectors[:, :, :, 1], look_of[..., SIDE][lead]
    return np.stack([cos * x + sin * y, cos * y - sin * x], 3) / side[..., None].swapaxes(3, -1)


def find_exchanges(px: Floats, true_px: Floats, side: Floats) -> Bools:
    """Return where left and right of the whole body, and of the legs alone, are exchanged, (T, C,
    2)."""
    here = np.linalg.norm(px - true_px, axis=-1)
    other = np.linalg.norm(px[..., MIRROR, :] - true_px, axis=-1)
    apart = np.linalg.norm(true_px - true_px[..., MIRROR, :], axis=-1)
    left, right = LEFT_OF_PAIR, MIRROR[LEFT_OF_PAIR]
    better = other[..., left] + other[..., right] < BETTER * (here[..., left] + here[..., right])
    better &= apart[..., left] > APART * side[..., None]
    telling = (apart[..., left] > APART * side[..., None]).sum(-1)
    trunk, legs = left < FIRST_OF_LEGS, left >= FIRST_OF_LEGS
    whole = (better.sum(-1) >= np.maximum(0.6 * telling, 3)) & better[..., trunk].any(-1)
    return np.stack([whole, ~whole & (better[..., legs].sum(-1) >= 2)], -1)


def _shown(clip: Watched, late: slice, look_of: Floats) -> Floats:
    """Return the images of offsets in space, (T, C, J, 2, 3), as in `Samples`, for pinhole
    cameras."""
    P, joints = clip.P, clip.joints_world[late]
    slope = P[None, :, None, :2, :3] - clip.true_px[late][..., None] * P[None, :, None, 2:, :3]
    slope = slope / clip.depth_m[late][..., None, None]
    left = joints[:, 1] - joints[:, 2] + joints[:, 7] - joints[:, 8]
    left = left[:, :2] / np.linalg.norm(left[:, :2], axis=-1, keepdims=True)
    zero, one = np.zeros(len(left)), np.ones(len(left))
    ahead = np.stack([left[:, 1], -left[:, 0], zero], -1)
    own = np.stack([left[:, 0], left[:, 1], zero], -1)[:, None] * HAND[:, None]
    up = np.stack([zero, zero, one], -1)
    axes = np.stack(np.broadcast_arrays(ahead[:, None], own, up[:, None]), -1)
    return _in_window(slope @ axes[:, None], look_of)


def _agreed(error: Floats, shown: Floats, sight: Ints, fold: Floats) -> Floats:
    """Return the least-squares offset over the cameras without outliers, (T, J, 3); NaN: fewer than
    three."""
    most = AGREED * np.where(fold > 0.5, 3.0, 1.0)[:, None, None]
    good = (sight == SEEN) & (np.linalg.norm(np.nan_to_num(error, nan=9.0), axis=-1) < most)
    rows, e = shown * good[..., None, None], np.where(good[..., None], error, 0.0)
    normal = np.einsum("tcjka,tcjkb->tjab", rows, shown)
    enough = (good.sum(1) >= 3)[..., None]
    inverse = np.linalg.inv(np.where(enough[..., None], normal, np.eye(3)))
    return np.where(enough, np.einsum("tjab,tcjkb,tcjk->tja", inverse, rows, e), np.nan)
