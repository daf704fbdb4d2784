"""Parameters of the detector's errors, fitted to renders.

They are in a small JSON file, which `python -m assets.emulator.calibrate` writes
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
"""Format of the file, and the version of its tables; files of other versions are refused."""
PACKAGED = Path(__file__).with_name("keypoints.json")
"""The calibration of the package."""
KINDS = ("nose", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
"""Kinds of joints; errors of left and right joints are mirror images."""
POSTURES = ("standing", "walking", "handling", "folded", "kneeling")
"""Postures; a body counts as each of them by a share (`outline.Posture`)."""
SIGHTS = ("seen", "hidden", "outside")
"""How a joint is seen: free, behind something, outside the image."""
N_VIEWS = 8
"""Number A of directions from which a body is seen: front, front left, left and so on."""
KNOTS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Quantiles that give the distribution of a confidence, in standard deviations."""
BODY_KNOTS = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""Quantiles that give the distribution of the factor on the errors of a whole body."""
N_POSES = 32
"""Number M of poses that stand for all poses of the data."""
N_SEEN = len(JOINTS) + 1
"""Number of possible counts of joints that are seen, from 0 to all."""
VISIBILITY: Floats = np.array([0.10, 0.35, 0.65, 0.875, 0.975])
"""(V,) reported visibilities at which the standard deviation is given."""
KIND: Ints = np.array([KINDS.index(name.rsplit("_", 1)[-1]) for name in JOINTS])
"""(J,) kind of every joint."""
HAND: Floats = np.where(np.arange(len(JOINTS)) > MIRROR, -1.0, 1.0)
"""(J,) -1 for right joints, else 1."""
INNER: Ints = np.array([0, 1, 2, 1, 2, 3, 4, 7, 8, 7, 8, 9, 10, 11, 12])
"""(J,) the next joint towards the trunk; itself for those of the trunk."""
NEXT: Ints = np.where(np.arange(len(JOINTS)) == INNER, np.minimum(MIRROR, INNER), INNER)
"""(J,) the next joint towards the trunk; for the trunk's right joints the left one."""
N_POSTURES, N_KINDS, N_SIGHTS = len(POSTURES), len(KINDS), len(SIGHTS)
"""Numbers P, K and S of postures, kinds of joints and sights."""
_N_VISIBILITIES = len(VISIBILITY)


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The parameters of the detector's errors.

    Lengths "of side" are shares of the side of the window around the worker; x is to the right in
    that window, y down. For right joints x is mirrored. The shapes are annotated (`SHAPES`).
    """

    offset_m: Annotated[Floats, (N_POSTURES, N_KINDS, 3)]
    """(P, K, 3) mean position that the detector reports, from the joint: ahead, to its own side, up
    [m]."""
    wander_m: Annotated[Floats, (N_POSTURES, N_KINDS, 3)]
    """(P, K, 3) standard deviation of that position over time [m]."""
    space_limb: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) correlation of that position with the one of the `NEXT` joint, axis by axis."""
    between_m: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) standard deviation of `offset_m` from body to body [m]."""
    poses: Annotated[Floats, (len(JOINTS), 3, N_POSES)]
    """(J, 3, M) poses that stand for those of the data, as of `outline.pose_of`."""
    near_m: Annotated[Floats, ()]
    """Distance from the nearest pose (`outline.novelty_m`) up to which a body is not new [m]."""
    novel: Annotated[Floats, (N_KINDS,)]
    """(K,) factor on the square of the distance beyond `near_m`, which is added to the standard
    deviation [1/m]."""
    tail: Annotated[Floats, (N_POSTURES,)]
    """(P,) weight of rare large errors: a normal vector n is lengthened by 1 + tail n.n / 3."""
    bias: Annotated[Floats, (N_VIEWS, N_KINDS, 2)]
    """(A, K, 2) mean error in the image by the direction of view, of side."""
    size: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS)]
    """(P, S, K) median over time of the standard deviation of each coordinate, of side."""
    spread: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS)]
    """(P, S, K) standard deviation of the logarithm of that size, joint by joint."""
    body: Annotated[Floats, (N_POSTURES, len(BODY_KNOTS))]
    """(P, Q) quantiles at `BODY_KNOTS` of the logarithm of the factor of a whole body."""
    common: Annotated[Floats, ()]
    """Share of the sizes' variance that is due to this factor; the confidence follows it."""
    shares: Annotated[Floats, (N_KINDS, 3)]
    """(K, 3) shares of the variance in a camera: constant by the view, lasting for `slow_s`, and
    new in every image; their sum is 1."""
    slow_s: Annotated[Floats, ()]
    """Time constant of lasting errors while the worker stands still [s]."""
    slow_m: Annotated[Floats, ()]
    """Distance that the joints travel until lasting errors have changed [m]."""
    limb: Annotated[Floats, (N_KINDS,)]
    """(K,) correlation with the error of the next joint towards the trunk."""
    confidence: Annotated[Floats, (N_POSTURES, N_SIGHTS, N_KINDS, len(KNOTS))]
    """(P, S, K, Z) quantiles of the reported visibility at `KNOTS`, in rising order."""
    follows: Annotated[Floats, (N_SIGHTS, N_KINDS)]
    """(S, K) correlation of the visibility with the smallness of the error."""
    swap_share: Annotated[Floats, (N_POSTURES, N_VIEWS, 2)]
    """(P, A, 2) share of the time in which left and right are exchanged: of all joints, of the legs
    alone."""
    swap_s: Annotated[Floats, (2,)]
    """(2,) time constants of the normal variables in the lower tails of which they happen [s]."""
    miss_share: Annotated[Floats, (N_POSTURES, N_SEEN)]
    """(P, 16) share of the time in which no worker is found, by the number of joints that are seen,
    0 to 15."""
    miss_s: Annotated[Floats, ()]
    """Time constant of the normal variable in the lower tail of which a miss happens [s]."""
    sigma: Annotated[Floats, (N_POSTURES, N_KINDS, _N_VISIBILITIES)]
    """(P, K, V) standard deviation that is reported, a share of the stature, at `VISIBILITY`."""


SHAPES: dict[str, tuple[int, ...]] = {
    name: get_args(hint)[1]
    for name, hint in get_type_hints(Calibration, include_extras=True).items()
}
"""Shapes of the tables of a calibration by name."""
_POSITIVE = ("size", "slow_s", "slow_m", "swap_s", "miss_s", "sigma")
_SHARES = ("common", "shares", "confidence", "swap_share", "miss_share")
_CORRELATIONS = ("limb", "space_limb", "follows")
LONGEST_TAIL = 3.0
"""Greatest value of `tail`, for which a normal vector n is lengthened by 1 + n.n."""
_RENEW = "make a new one with: python -m assets.emulator.calibrate --out FILE"


def read_calibration(path: Path | str | None = None) -> Calibration:
    """Return the calibration of a file (None: the package's); `ConfigError` for a bad one."""
    return _read(PACKAGED, 0) if path is None else _read(Path(path), changed_ns(path))


def changed_ns(path: Path | str) -> int:
    """Return when a calibration file was last written [ns]; `ConfigError` if there is none."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError as error:
        raise ConfigError(
            f"The calibration file {path} cannot be read ({error.strerror}): name one that "
            f"exists, leave emulator.calibration empty for the package's own, or {_RENEW}."
        ) from error


@functools.lru_cache(maxsize=8)
def _read(path: Path, changed: int) -> Calibration:
    """Return the calibration of a file, kept until the file has changed."""
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ConfigError(f"{path} is no calibration of keypoints ({error}): {_RENEW}.") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ConfigError(f'{path} is no calibration of keypoints ("format" {FORMAT!r}): {_RENEW}.')
    if content.get("version") != VERSION:
        raise ConfigError(
            f"{path} is a calibration of version {content.get('version')!r}; this hrc_env reads "
            f"version {VERSION}: {_RENEW}."
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
    """Return a table of a file, read-only; `ConfigError` for other shapes or values."""
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
        raise ConfigError(f"{path}: table {name!r} must hold {expected}. Mend it, or {_RENEW}.")
    array.setflags(write=False)
    return array
