"""Any file of motion capture to a `Capture`."""

import zipfile
from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Points3
from hrc_env.mocap.acclaim import read_acclaim
from hrc_env.mocap.bvh import read_bvh
from hrc_env.mocap.person import resampled
from hrc_env.mocap.record import FEWEST_FRAMES, Capture
from hrc_env.mocap.repair import mended
from hrc_env.mocap.skeleton import find_joints, joints_of
from hrc_env.motion.clip import check_rate

SUFFIXES = (".bvh", ".amc", ".npz")
CMU_HZ, LEAST_S = 120.0, 0.5
"""Rate of the CMU database's AMC files, which do not hold it; shortest clip [s]."""


def read_capture(
    path: Path, fps: float | None = None, source_fps: float | None = None,
    skeleton: Path | None = None, allow_off_floor: bool = False,
) -> Capture:  # fmt: skip
    """Read, mend and resample a recording: a .bvh, .amc or .npz file of a person in motion.

    `fps` is the result's rate (None: the file's), `source_fps` the file's own, where it has none or
    a wrong one; `skeleton` the .asf file of an .amc file (None: looked for beside it). Who is not
    on one level floor (stairs, terrain, long in the air) is refused, or accepted as if they were.

    Raises:
        ConfigError: it is no such file, damaged beyond repair, of another's skeleton or off the
            floor.
    """
    source = path.name
    joints, rate_hz, landmarks, found, repaired = _read(path, skeleton)
    if source_fps is not None:
        rate_hz = source_fps
    elif np.isnan(rate_hz):
        rate_hz, repaired = CMU_HZ, (*repaired, f"No frame rate: taken to be {CMU_HZ:g} Hz.")
    check_rate(rate_hz, source)
    acclaim = path.suffix.lower() == ".amc"
    joints, notes = mended(joints, rate_hz, source, acclaim, allow_off_floor)
    lasts_s = (len(joints) - 1) / rate_hz
    if lasts_s < LEAST_S:
        raise ConfigError(f"{source}: {lasts_s:.2f} s of motion; {LEAST_S} s is the least.")
    if fps is not None and fps != rate_hz:
        check_rate(fps, "the wished rate")
        joints = resampled(joints, rate_hz, fps)
        notes = (*notes, f"Resampled from {rate_hz:g} to {fps:g} frames a second.")
        rate_hz = fps
    return Capture(joints, rate_hz, landmarks, found, source, (*repaired, *notes))


def _read(
    path: Path, skeleton: Path | None
) -> tuple[Points3, float, bool, tuple[str, ...], tuple[str, ...]]:
    """Joints, frame rate, `Capture.landmarks`, `.found` and `.repaired`, as the file has them."""
    if not path.is_file():
        raise ConfigError(f"{path} is no file.")
    suffix = path.suffix.lower()
    if suffix == ".npz":
        joints, rate_hz = _read_joints(path)
        return joints, rate_hz, True, JOINTS, ()
    if suffix == ".bvh":
        moving = read_bvh(path)
    elif suffix in (".amc", ".asf"):
        moving = read_acclaim(path, skeleton)
    else:
        raise ConfigError(
            f"{path.name}: expected a file that ends in {', '.join(SUFFIXES)}, got {suffix!r}."
        )
    found, head = find_joints(moving.names, path.name)
    made = f"made from {moving.names[head]}"
    named = tuple(moving.names[found[joint]] if joint in found else made for joint in JOINTS)
    return joints_of(moving, found, head), moving.fps, False, named, moving.repaired


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
