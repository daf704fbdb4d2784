"""Reader of motion-capture files of any supported format."""

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
from hrc_env.mocap.person import resample
from hrc_env.mocap.record import FEWEST_FRAMES, Capture
from hrc_env.mocap.repair import Upward, add_shift, repair_joints
from hrc_env.mocap.skeleton import extract_joints, find_joints, find_rest_up
from hrc_env.motion.clip import check_rate

SUFFIXES = (".bvh", ".amc", ".npz")
CMU_HZ = 120.0
"""Frame rate of the AMC files of the CMU database, which do not contain it [Hz]."""
LEAST_S = 0.5
"""Minimum duration of a clip [s]."""


class _Content(NamedTuple):
    """Content of a file, in the frame and unit of the file."""

    joints: Points3
    """Joints (T, 15, 3); missing joints are NaN."""
    fps: float
    """Frame rate [Hz]; NaN if it is not in the file."""
    are_landmarks: bool
    """Whether the joints are BlazePose landmarks, as in `Capture`."""
    node_names: tuple[str, ...]
    """Names (15,) of the joints in the file."""
    notes: tuple[str, ...] = ()
    """Descriptions of the guesses and repairs, one sentence each."""
    rest_up: Floats | None = None
    """Unit vector (3,) from hips to shoulders in a standing rest pose; otherwise NaN."""


def read_recording(
    path: Path,
    fps: float | None = None,
    source_fps: float | None = None,
    skeleton: Path | None = None,
    allow_off_floor: bool = False,
    joints: Mapping[str, str] | None = None,
    up: str | None = None,
) -> Capture:
    """Read, repair and resample a recording of a person in motion.

    Args:
        path: a .bvh, .amc or .npz file (docs/motion_capture.md).
        fps: frame rate of the result [Hz]; None for the frame rate of the file.
        source_fps: true frame rate of the file [Hz], if that in the file is missing or wrong.
        skeleton: the .asf file of an .amc file; None to search for it in the same folder.
        allow_off_floor: whether a person that is not on one level floor (stairs, terrain, long
            jumps) is accepted and treated as if it were on a level floor.
        joints: names of the nodes of joints that are not recognized automatically, such as
            {"left_shoulder": "lShldr"}.
        up: upward axis of the file, such as "+y", if it is not recognized automatically.

    Returns:
        The person's joints (T, 15, 3) [m], with +z up and the floor at 0, and notes on repairs.

    Raises:
        ConfigError: the file has an unknown format, is damaged beyond repair or belongs to another
            skeleton, or the person is not on the floor.
    """
    source = path.name
    read = _read(path, skeleton, joints)
    rate_hz, notes = read.fps, read.notes
    if source_fps is not None:
        rate_hz = source_fps
    elif np.isnan(rate_hz):
        rate_hz, notes = CMU_HZ, (*notes, f"No frame rate is given: assumed {CMU_HZ:g} Hz.")
    check_rate(rate_hz, source)
    acclaim = path.suffix.lower() == ".amc"
    upward = Upward(up, read.rest_up)
    placed, repairs = repair_joints(read.joints, rate_hz, source, acclaim, allow_off_floor, upward)
    duration_s = (len(placed) - 1) / rate_hz
    if duration_s < LEAST_S:
        raise ConfigError(
            f"{source}: {duration_s:.2f} s of motion; at least {LEAST_S} s are required."
        )
    if fps is not None and fps != rate_hz:
        check_rate(fps, "the requested rate")
        placed = resample(placed, rate_hz, fps)
        repairs = (*repairs, f"Resampled from {rate_hz:g} to {fps:g} frames per second.")
        rate_hz = fps
    return Capture(placed, rate_hz, read.are_landmarks, read.node_names, source, (*notes, *repairs))


def _read(path: Path, skeleton: Path | None, joints: Mapping[str, str] | None) -> _Content:
    """Read the content of a file of any supported format."""
    if not path.is_file():
        raise ConfigError(f"{path} is not a file.")
    suffix = path.suffix.lower()
    if suffix == ".npz":
        if joints:
            raise ConfigError(
                f"{path.name}: joints= requires a .bvh or .amc file; an .npz file has no joint "
                "names."
            )
        read = _read_joints(path)
        return _Content(read.joints, read.fps, True, JOINTS)
    if suffix == ".bvh":
        moving = read_bvh(path)
    elif suffix in (".amc", ".asf"):
        moving = read_acclaim(path, skeleton)
    else:
        raise ConfigError(
            f"{path.name}: expected a file that ends in {', '.join(SUFFIXES)}, got {suffix!r}."
        )
    nodes = find_joints(moving, path.name, joints)
    made, node = f"made from {moving.names[nodes.head]}", nodes.node
    named = tuple(moving.names[node[joint]] if joint in node else made for joint in JOINTS)
    placed, shifted = add_shift(extract_joints(moving, nodes), moving.shift)
    notes = (*moving.notes, *nodes.notes, *shifted)
    return _Content(placed, moving.fps, False, named, notes, find_rest_up(moving, nodes))


class _Joints(NamedTuple):
    """Content of an .npz file with joints."""

    joints: Points3
    """Joints (T, 15, 3) in any unit; missing joints are NaN."""
    fps: float
    """Frame rate [Hz]."""


def _read_joints(path: Path) -> _Joints:
    """Read the joints and frame rate in an .npz file."""
    wanted = ("joints", "fps")
    try:
        with np.load(path, allow_pickle=False) as file:
            names = tuple(file.files)
            arrays = {name: np.asarray(file[name], float) for name in names if name in wanted}
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, KeyError) as error:
        raise ConfigError(f"{path.name} is truncated or not an npz file: {error}.") from None
    missing = [name for name in wanted if name not in arrays]
    if missing:
        raise ConfigError(
            f"{path.name}: expected arrays joints (T, {N_JOINTS}, 3) and fps, "
            f"found {', '.join(names) or 'none'}; missing {', '.join(missing)}."
        )
    joints, fps = arrays["joints"], arrays["fps"]
    if joints.ndim != 3 or joints.shape[1:] != (N_JOINTS, 3) or len(joints) < FEWEST_FRAMES:
        raise ConfigError(
            f"{path.name}: joints must be (T >= {FEWEST_FRAMES}, {N_JOINTS}, 3), with one row for "
            f"each of {', '.join(JOINTS)}; got {joints.shape}."
        )
    if fps.size != 1:
        raise ConfigError(f"{path.name}: fps must be one number, got shape {fps.shape}.")
    return _Joints(np.where(np.isfinite(joints), joints, np.nan), float(fps.reshape(-1)[0]))
