"""What is known of the detector's errors: numbers fitted to renders, in a small JSON file, which
`python -m assets.emulator.calibrate` writes (docs/emulator.md)."""

import functools
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, MIRROR
from hrc_env.core.typing import Floats, Ints

FORMAT, VERSION = "hrc_env keypoints", 7
"""Version: what the tables mean. A file of another one is refused."""
PACKAGED = Path(__file__).with_name("keypoints.json")
KINDS = ("nose", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot")
"""Kinds of joints: left and right err alike, mirrored."""
POSTURES = ("standing", "walking", "handling", "folded", "kneeling")
"""Bodies count as each of these by a share (`outline.weigh`)."""
SIGHTS = ("seen", "hidden", "outside")
"""How a joint is seen: nothing before it, something before it, outside the image."""
N_VIEWS = 8
"""Directions from which a body is seen: front, front left, left and so on."""
KNOTS = (-2.0, -1.0, 0.0, 1.0, 2.0)
"""Quantiles that a confidence's distribution is given by, in standard deviations."""
BODY_KNOTS = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""The same of the factor that the errors of a whole body have."""
N_POSES = 32
"""Poses that stand for all that were fitted to."""
N_SEEN = len(JOINTS) + 1
"""From none to all."""
VISIBILITY: Floats = np.array([0.10, 0.35, 0.65, 0.875, 0.975])
"""Where the standard deviation is given as a function of the reported visibility."""
KIND: Ints = np.array([KINDS.index(name.rsplit("_", 1)[-1]) for name in JOINTS])
"""(J,) kind of every joint."""
HAND: Floats = np.where(np.arange(len(JOINTS)) > MIRROR, -1.0, 1.0)
"""(J,) -1 for right joints, else 1."""
INNER: Ints = np.array([0, 1, 2, 1, 2, 3, 4, 7, 8, 7, 8, 9, 10, 11, 12])
"""(J,) the next joint towards the trunk; itself for those of the trunk."""
NEXT: Ints = np.where(np.arange(len(JOINTS)) == INNER, np.minimum(MIRROR, INNER), INNER)
"""(J,) the same, and of the trunk's right joints the left one."""
_P, _K, _S, _Z = len(POSTURES), len(KINDS), len(SIGHTS), len(KNOTS)
_Q = len(BODY_KNOTS)


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The model's numbers, of the shapes `SHAPES`. Lengths "of side" are shares of the side of the
    window round the worker; x is to the right in that window, y down; of right joints x is
    mirrored. P postures, K kinds, S sights, A views, Z and Q knots, V visibilities."""

    offset_m: Floats  # where the detector means a joint to be: ahead, to its own side, up [m]
    wander_m: Floats  # how far that varies, a standard deviation [m]
    space_limb: Floats  # its correlation with what varies of the `NEXT` joint, axis by axis
    between_m: Floats  # how far `offset_m` differs from body to body, a standard deviation [m]
    poses: Floats  # that were fitted to, or near to those (`outline.pose_of`)
    near_m: Floats  # bodies that are no further from one of them are not new (`novelty_m`) [m]
    novel: (
        Floats  # times the square of how much further they are: what is added to deviations [1/m]
    )
    tail: Floats  # now and then further: a normal vector n is lengthened by 1 + tail n.n / 3
    bias: Floats  # mean error in a camera by the view, of side
    size: Floats  # median over time of the standard deviation of each coordinate, of side
    spread: Floats  # standard deviation of its logarithm, joint by joint
    body: Floats  # quantiles at `BODY_KNOTS` of the logarithm of the factor of a whole body
    common: Floats  # share of the sizes' variance that this factor is; the confidence follows it
    shares: Floats  # of a camera's variance: by the view, for `slow_s`, new in every image; sum 1
    slow_s: Floats  # for how long errors last while the worker stands still [s]
    slow_m: Floats  # how far the joints travel until they are other errors [m]
    limb: Floats  # correlation with the error of the next joint towards the trunk
    confidence: Floats  # quantiles of the reported visibility at `KNOTS`, least first
    follows: Floats  # correlation of visibility and smallness of the error
    swap_share: Floats  # of the time that left and right are exchanged: all joints, legs alone
    swap_s: Floats  # time constants of the normal variables whose lower tails these are [s]
    miss_share: Floats  # of the time that nobody is found, by how many joints are seen, 0 to 15
    miss_s: Floats  # the time constant of that [s]
    sigma: Floats  # standard deviation that is told, a share of the stature, at `VISIBILITY`


SHAPES: dict[str, tuple[int, ...]] = {
    "offset_m": (_P, _K, 3), "wander_m": (_P, _K, 3), "space_limb": (_K, 3),
    "between_m": (_K, 3), "poses": (len(JOINTS), 3, N_POSES), "near_m": (), "novel": (_K,),
    "tail": (_P,), "bias": (N_VIEWS, _K, 2),
    "size": (_P, _S, _K), "spread": (_P, _S, _K), "body": (_P, _Q),
    "common": (), "shares": (_K, 3),
    "slow_s": (), "slow_m": (), "limb": (_K,), "confidence": (_P, _S, _K, _Z), "follows": (_S, _K),
    "swap_share": (_P, N_VIEWS, 2), "swap_s": (2,), "miss_share": (_P, N_SEEN), "miss_s": (),
    "sigma": (_P, _K, len(VISIBILITY)),
}  # fmt: skip
POSTURED = (
    "offset_m", "wander_m", "tail", "size", "spread", "body", "confidence", "swap_share",
    "miss_share", "sigma",
)  # fmt: skip
"""Tables that are given for each posture."""
_POSITIVE = ("size", "slow_s", "slow_m", "swap_s", "miss_s", "sigma")
_SHARES = ("common", "shares", "confidence", "swap_share", "miss_share")
_CORRELATIONS = ("limb", "space_limb", "follows")
LONGEST_TAIL = 3.0
"""A vector of normal variables n grows by 1 + n.n then, to almost n's cube."""
_RENEW = "make a new one with: python -m assets.emulator.calibrate --out FILE"


def read_calibration(path: Path | str | None = None) -> Calibration:
    """The calibration of a file (None: the package's). Raises `ConfigError` for a bad one."""
    return _read(PACKAGED, 0) if path is None else _read(Path(path), changed_ns(path))


def changed_ns(path: Path | str) -> int:
    """When a calibration file was last written [ns]. Raises `ConfigError` if there is none."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError as error:
        raise ConfigError(
            f"The calibration file {path} cannot be read ({error.strerror}): name one that "
            f"exists, leave emulator.calibration empty for the package's own, or {_RENEW}."
        ) from error


@functools.lru_cache(maxsize=8)
def _read(path: Path, changed: int) -> Calibration:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
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
    return Calibration(**{name: _table(name, value, path) for name, value in tables.items()})


def _table(name: str, value: Any, where: Path) -> Floats:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.full(1, np.nan)
    good = array.shape == SHAPES[name] and bool(np.isfinite(array).all())
    expected = f"finite numbers of shape {SHAPES[name]}"
    for names, low, high in (
        (_POSITIVE, 1e-9, np.inf), (_SHARES, 0.0, 1.0), (_CORRELATIONS, -1.0, 1.0),
        (("tail",), 0.0, LONGEST_TAIL), (("near_m", "novel"), 0.0, np.inf),
    ):  # fmt: skip
        if good and name in names and not (low <= array.min() and array.max() <= high):
            good, expected = False, f"numbers from {low:g} to {high:g}"
    if not good:
        raise ConfigError(f"{where}: table {name!r} must hold {expected}. Mend it, or {_RENEW}.")
    array.setflags(write=False)
    return array
