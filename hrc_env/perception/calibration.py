"""Parameters of the detector's errors, fitted to detections in rendered images.

They are stored in a JSON file, which is written by `python -m assets.emulator.calibrate`
(docs/emulator.md).
"""

import functools
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, MIRROR
from hrc_env.core.typing import Floats, Ints

FORMAT, VERSION = "hrc_env keypoints", 7
"""Name of the file format, and version of its tables. Files of other versions are rejected."""
PACKAGED = Path(__file__).with_name("keypoints.json")
"""Path of the calibration that is part of the package."""
KINDS = ("nose", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
"""Kinds of joints. The errors of left and right joints are mirror images."""
POSTURES = ("standing", "walking", "handling", "folded", "kneeling")
"""Names of the postures. The posture of a body is a mixture of them (`outline.Posture`)."""
SIGHTS = ("seen", "hidden", "outside")
"""Values of the visibility of a joint in an image: seen, occluded, or outside the image."""
N_VIEWS = 8
"""Number A of viewing directions of a body: front, front left, left, and so on around the body."""
KNOTS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Standard normal deviates at which the quantiles of a confidence are given."""
BODY_KNOTS = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""Standard normal deviates at which the quantiles of the factor on a body's errors are given."""
N_POSES = 32
"""Number M of poses that represent all poses in the data."""
N_SEEN = len(JOINTS) + 1
"""Number of possible values of the number of visible joints, from 0 to all joints."""
VISIBILITY: Floats = np.array([0.10, 0.35, 0.65, 0.875, 0.975])
"""(V,) reported visibilities at which the standard deviation is given."""
KIND: Ints = np.array([KINDS.index(name.rsplit("_", 1)[-1]) for name in JOINTS])
"""(J,) kind of each joint, as an index into `KINDS`."""
HAND: Floats = np.where(np.arange(len(JOINTS)) > MIRROR, -1.0, 1.0)
"""(J,) sign by which errors are mirrored: -1 for right joints, 1 for all others."""
INNER: Ints = np.array([0, 1, 2, 1, 2, 3, 4, 7, 8, 7, 8, 9, 10, 11, 12])
"""(J,) index of the next joint towards the trunk; for joints of the trunk, their index itself."""
NEXT: Ints = np.where(np.arange(len(JOINTS)) == INNER, np.minimum(MIRROR, INNER), INNER)
"""(J,) index as in `INNER`, but that of the left joint for right joints of the trunk."""
N_POSTURES, N_KINDS, N_SIGHTS = len(POSTURES), len(KINDS), len(SIGHTS)
"""Numbers P of postures, K of kinds of joints and S of visibilities."""
_N_VISIBILITIES = len(VISIBILITY)


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The parameters of the detector's errors.

    Errors in the image are in units of the side of the window around the worker [sides]; x points
    to the right in that window, and y points down. For right joints, x is mirrored. The shapes of
    the tables are given by the annotations (`SHAPES`).
    """

    offset_m: Annotated[Floats, (N_POSTURES, N_KINDS, 3)]
    """(P, K, 3) mean reported position relative to the true joint, in the directions ahead, to the
    joint's side of the body, and up [m]."""
    wander_m: Annotated[Floats, (N_POSTURES, N_KINDS, 3)]
    """(P, K, 3) standard deviation of the reported position over time [m]."""
    space_limb: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) correlation of the reported position with that of the joint given by `NEXT`, per
    axis."""
    between_m: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) standard deviation of `offset_m` between bodies [m]."""
    poses: Annotated[Floats, (len(JOINTS), 3, N_POSES)]
    """(J, 3, M) poses that represent those in the data, in the coordinates of `outline.pose_of`."""
    near_m: Annotated[Floats, ()]
    """Distance from the nearest of `poses` (`outline.novelty_m`) up to which a pose counts as known
    [m]."""
    novel: Annotated[Floats, (N_KINDS,)]
    """(K,) factor on the squared distance beyond `near_m`; the product is added to the standard
    deviation [1/m]."""
    tail: Annotated[Floats, (N_POSTURES,)]
    """(P,) weight of rare large errors: a normal vector n is multiplied by 1 + tail n.n / 3."""
    bias: Annotated[Floats, (N_VIEWS, N_KINDS, 2)]
    """(A, K, 2) mean error in the image for each viewing direction [sides]."""
    size: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS)]
    """(P, S, K) median over time of the standard deviation of each coordinate [sides]."""
    spread: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS)]
    """(P, S, K) standard deviation of the logarithm of `size` for each joint."""
    body: Annotated[Floats, (N_POSTURES, len(BODY_KNOTS))]
    """(P, Q) quantiles at `BODY_KNOTS` of the logarithm of a factor on the errors of all joints."""
    common: Annotated[Floats, ()]
    """Fraction of the variance of the errors' sizes that is due to the factor `body`. Confidences
    are correlated with this part."""
    shares: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) fractions of the variance in a camera that are constant for a view, decay with
    `slow_s`, and are independent in every image. Their sum is 1."""
    slow_s: Annotated[Floats, ()]
    """Time constant of slowly varying errors while the worker stands still [s]."""
    slow_m: Annotated[Floats, ()]
    """Distance constant of slowly varying errors: path of the joints over which they decay to 1/e
    [m]."""
    limb: Annotated[Floats, (N_KINDS,)]
    """(K,) correlation of a joint's error with that of the next joint towards the trunk."""
    confidence: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS, len(KNOTS))]
    """(P, S, K, Z) quantiles of the reported visibility at `KNOTS`, in ascending order."""
    follows: Annotated[Floats, (N_SIGHTS, N_KINDS)]
    """(S, K) correlation of the reported visibility with the negative size of the error."""
    swap_share: Annotated[Floats, (N_POSTURES, N_VIEWS, 2)]
    """(P, A, 2) fraction of the time in which the left and right labels of all joints, and of the
    legs only, are swapped."""
    swap_s: Annotated[Floats, (2,)]
    """(2,) time constants of the normal variables that cause swaps in their lower tails [s]."""
    miss_share: Annotated[Floats, (N_POSTURES, N_SEEN)]
    """(P, 16) fraction of the time in which a worker is not found, by the number of visible joints
    from 0 to 15."""
    miss_s: Annotated[Floats, ()]
    """Time constant of the normal variable that causes misses in its lower tail [s]."""
    sigma: Annotated[Floats, (N_POSTURES, N_KINDS, _N_VISIBILITIES)]
    """(P, K, V) reported standard deviation at `VISIBILITY`, as a fraction of the stature."""


SHAPES: dict[str, tuple[int, ...]] = {
    name: get_args(hint)[1]
    for name, hint in get_type_hints(Calibration, include_extras=True).items()
}
"""Shapes of the tables of a calibration, by name."""
_POSITIVE = ("size", "slow_s", "slow_m", "swap_s", "miss_s", "sigma")
_SHARES = ("common", "shares", "confidence", "swap_share", "miss_share")
_CORRELATIONS = ("limb", "space_limb", "follows")
LONGEST_TAIL = 3.0
"""Maximum value of `tail`, at which a normal vector n is multiplied by 1 + n.n."""
_RENEW = "create a new one with: python -m assets.emulator.calibrate --out FILE"


def read_calibration(path: Path | str | None = None) -> Calibration:
    """Read a calibration file (default: the package's); raise `ConfigError` if it is invalid."""
    return _read(PACKAGED, 0) if path is None else _read(Path(path), changed_ns(path))


def changed_ns(path: Path | str) -> int:
    """Return the modification time of a calibration file [ns]; raise `ConfigError` without one."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError as error:
        raise ConfigError(
            f"The calibration file {path} cannot be read ({error.strerror}): choose an existing "
            f"file, leave emulator.calibration empty for the one of the package, or {_RENEW}."
        ) from error


@functools.lru_cache(maxsize=8)
def _read(path: Path, changed: int) -> Calibration:
    """Read a calibration file, and cache the result until the file changes."""
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ConfigError(
            f"{path} is not a calibration of keypoints ({error}): {_RENEW}."
        ) from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ConfigError(
            f'{path} is not a calibration of keypoints ("format" {FORMAT!r}): {_RENEW}.'
        )
    if content.get("version") != VERSION:
        raise ConfigError(
            f"{path} is a calibration of version {content.get('version')!r}, but this version of "
            f"hrc_env reads version {VERSION}: {_RENEW}."
        )
    tables = content.get("tables")
    given = set(tables) if isinstance(tables, dict) else set()
    if not isinstance(tables, dict) or given != set(SHAPES):
        raise ConfigError(
            f"{path} must have the tables {', '.join(SHAPES)}; missing: "
            f"{', '.join(sorted(set(SHAPES) - given)) or 'none'}; unknown: "
            f"{', '.join(sorted(given - set(SHAPES))) or 'none'}. Or {_RENEW}."
        )
    return Calibration(**{name: _parse_table(name, value, path) for name, value in tables.items()})


def _parse_table(name: str, value: Any, path: Path) -> Floats:
    """Return a table of a file as a read-only array; raise `ConfigError` if it is invalid."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.full(1, np.nan)
    good = array.shape == SHAPES[name] and bool(np.isfinite(array).all())
    expected = f"finite numbers of shape {SHAPES[name]}"
    for names, low, high in (
        (_POSITIVE, 1e-9, np.inf),
        (_SHARES, 0.0, 1.0),
        (_CORRELATIONS, -1.0, 1.0),
        (("tail",), 0.0, LONGEST_TAIL),
        (("near_m", "novel"), 0.0, np.inf),
    ):
        if good and name in names and not (low <= array.min() and array.max() <= high):
            good, expected = False, f"numbers from {low:g} to {high:g}"
    if not good:
        raise ConfigError(f"{path}: table {name!r} must hold {expected}. Correct it, or {_RENEW}.")
    array.setflags(write=False)
    return array
