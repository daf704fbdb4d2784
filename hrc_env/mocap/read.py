"""Any file of motion capture to a `Capture`."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.mocap.acclaim import read_acclaim
from hrc_env.mocap.bvh import read_bvh
from hrc_env.mocap.person import resampled
from hrc_env.mocap.record import FEWEST_FRAMES, Capture
from hrc_env.mocap.repair import Upward, from_origin, mended
from hrc_env.mocap.skeleton import find_joints, joints_of, rest_up
from hrc_env.motion.clip import check_rate

SUFFIXES = (".bvh", ".amc", ".npz")
CMU_HZ, LEAST_S = 120.0, 0.5
"""Rate of the CMU database's AMC files, which do not hold it; shortest clip [s]."""


class _Content(NamedTuple):
    """The content of a file, in its own frame and unit."""

    joints: Points3
    """(T, 15, 3)."""
    fps: float
    """Frames a second; NaN: not in the file."""
    landmarks: bool
    """As in `Capture`."""
    found: tuple[str, ...]
    """As in `Capture`."""
    repaired: tuple[str, ...] = ()
    """As in `Capture`."""
    rest_up: Floats | None = None
    """(3,) from hips to shoulders of the skeleton at rest, NaN if it does not stand."""


def read_recording(
    path: Path, fps: float | None = None, source_fps: float | None = None,
    skeleton: Path | None = None, allow_off_floor: bool = False,
    joints: Mapping[str, str] | None = None, up: str | None = None,
) -> Capture:  # fmt: skip
    """Read, mend and resample a recording of a person in motion.

    Args:
        path: a .bvh, .amc or .npz file (docs/people_and_scenes.md).
        fps: frames a second of the result; None: the file's.
        source_fps: the file's true rate, where it has none or a wrong one.
        skeleton: the .asf file of an .amc file; None: it is looked for beside it.
        allow_off_floor: accept people who are not on one level floor (stairs, terrain, long in the
            air) as if they were.
        joints: names in the file of joints that are not recognized, as {"left_shoulder": "lShldr"}.
        up: the file's upward axis, as "+y", where it is not recognized.

    Returns:
        The person's joints (T, 15, 3) [m], +z up, the floor at 0, and what was mended.

    Raises:
        ConfigError: it is no such file, damaged beyond repair, of another's skeleton or off the
            floor.
    """
    source = path.name
    read = _read(path, skeleton, joints)
    rate_hz, repaired = read.fps, read.repaired
    if source_fps is not None:
        rate_hz = source_fps
    elif np.isnan(rate_hz):
        rate_hz, repaired = CMU_HZ, (*repaired, f"No frame rate: taken to be {CMU_HZ:g} Hz.")
    check_rate(rate_hz, source)
    acclaim = path.suffix.lower() == ".amc"
    upward = Upward(up, read.rest_up)
    placed, notes = mended(read.joints, rate_hz, source, acclaim, allow_off_floor, upward)
    lasts_s = (len(placed) - 1) / rate_hz
    if lasts_s < LEAST_S:
        raise ConfigError(f"{source}: {lasts_s:.2f} s of motion; {LEAST_S} s is the least.")
    if fps is not None and fps != rate_hz:
        check_rate(fps, "the wished rate")
        placed = resampled(placed, rate_hz, fps)
        notes = (*notes, f"Resampled from {rate_hz:g} to {fps:g} frames a second.")
        rate_hz = fps
    return Capture(placed, rate_hz, read.landmarks, read.found, source, (*repaired, *notes))


def _read(path: Path, skeleton: Path | None, joints: Mapping[str, str] | None) -> _Content:
    """Return the content of a file."""
    if not path.is_file():
        raise ConfigError(f"{path} is no file.")
    suffix = path.suffix.lower()
    if suffix == ".npz":
        if joints:
            raise ConfigError(
                f"{path.name}: joints= is for .bvh and .amc files; an .npz file has no names."
            )
        return _Content(*_read_joints(path), True, JOINTS)
    if suffix == ".bvh":
        moving = read_bvh(path)
    elif suffix in (".amc", ".asf"):
        moving = read_acclaim(path, skeleton)
    else:
        raise ConfigError(
            f"{path.name}: expected a file that ends in {', '.join(SUFFIXES)}, got {suffix!r}."
        )
    found = find_joints(moving, path.name, joints)
    made, node = f"made from {moving.names[found.head]}", found.node
    named = tuple(moving.names[node[joint]] if joint in node else made for joint in JOINTS)
    placed, told = from_origin(joints_of(moving, found), moving.shift)
    repaired = (*moving.repaired, *found.notes, *told)
    return _Content(placed, moving.fps, False, named, repaired, rest_up(moving, found))


def _read_joints(path: Path) -> tuple[Points3, float]:
    """Joints (T, 15, 3) in any unit, missing ones NaN, and frames a second, of an npz file."""
    wanted = ("joints", "fps")
    try:
        with np.load(path, allow_pickle=False) as file:
            names = tuple(file.files)
            arrays = {name: np.asarray(file[name], float) for name in names if name in wanted}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, KeyError) as error:
        raise ConfigError(f"{path.name} is cut off or no npz file: {error}.") from None
    missing = [name for name in wanted if name not in arrays]
    if missing:
        raise ConfigError(
            f"{path.name}: expected arrays joints (T, {N_JOINTS}, 3) and fps, "
            f"found {', '.join(names) or 'none'}; missing {', '.join(missing)}."
        )
    joints, fps = arrays["joints"], arrays["fps"]
    if joints.ndim != 3 or joints.shape[1:] != (N_JOINTS, 3) or len(joints) < FEWEST_FRAMES:
        raise ConfigError(
            f"{path.name}: joints must be (T >= {FEWEST_FRAMES}, {N_JOINTS}, 3), one row each of "
            f"{', '.join(JOINTS)}; got {joints.shape}."
        )
    if fps.size != 1:
        raise ConfigError(f"{path.name}: fps must be one number, got shape {fps.shape}.")
    return np.where(np.isfinite(joints), joints, np.nan), float(fps.reshape(-1)[0])
