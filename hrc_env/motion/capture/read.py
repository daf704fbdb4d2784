"""Any file of motion capture to a `Capture`."""

from pathlib import Path

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Points3
from hrc_env.motion.capture import repair
from hrc_env.motion.capture.acclaim import read_acclaim
from hrc_env.motion.capture.bvh import read_bvh
from hrc_env.motion.capture.face import joints_of
from hrc_env.motion.capture.markers import read_joints
from hrc_env.motion.capture.names import find_joints
from hrc_env.motion.capture.person import check_person
from hrc_env.motion.capture.record import Capture, check_rate
from hrc_env.motion.capture.series import resampled

SUFFIXES = (".bvh", ".amc", ".npz")
CMU_HZ = 120.0
"""AMC files hold no frame rate; those of the CMU database are of 120 Hz."""
LEAST_S = 0.5
"""Shortest clip [s]."""


def read_capture(
    path: Path,
    fps: float | None = None,
    source_fps: float | None = None,
    skeleton: Path | None = None,
) -> Capture:
    """Read, mend and resample a recording.

    Args:
        path: a .bvh, .amc or .npz file.
        fps: rate of the result; None keeps the file's.
        source_fps: the file's own rate, where it has none or a wrong one.
        skeleton: the .asf file of an .amc file; None looks beside it.

    Raises:
        ConfigError: not a person in motion, or damaged beyond repair; says what.
    """
    source = path.name
    joints, rate_hz, landmarks, found, repaired = _read(path, skeleton)
    if source_fps is not None:
        rate_hz = source_fps
    elif np.isnan(rate_hz):
        rate_hz, repaired = CMU_HZ, (*repaired, f"No frame rate: taken to be {CMU_HZ:g} Hz.")
    check_rate(rate_hz, source)
    joints, notes = _mended(joints, rate_hz, source)
    if (len(joints) - 1) / rate_hz < LEAST_S:
        raise ConfigError(
            f"{source}: {(len(joints) - 1) / rate_hz:.2f} s of motion; {LEAST_S} s is the least."
        )
    if fps is not None and fps != rate_hz:
        check_rate(fps, "the wished rate")
        joints = resampled(joints, rate_hz, fps)
        notes = (*notes, f"Resampled from {rate_hz:g} to {fps:g} frames a second.")
        rate_hz = fps
    return Capture(joints, rate_hz, landmarks, found, source, (*repaired, *notes))


def _read(
    path: Path, skeleton: Path | None
) -> tuple[Points3, float, bool, tuple[str, ...], tuple[str, ...]]:
    """Joints as the file has them, its rate, their meaning, their names, and what was mended."""
    if not path.is_file():
        raise ConfigError(f"{path} is no file.")
    suffix = path.suffix.lower()
    if suffix == ".npz":
        joints, rate_hz = read_joints(path)
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


def _mended(joints: Points3, fps: float, source: str) -> tuple[Points3, tuple[str, ...]]:
    """Whole, in metres, upright, not mirrored, without a rest pose, on the floor."""
    joints, gaps = repair.fill_gaps(joints, fps, source)
    joints, unit = repair.in_metres(joints, source)
    first, rest = repair.without_rest_pose(joints)
    joints, turned = repair.z_up(joints[first:], source)
    joints, mirrored = repair.unmirrored(joints, source)
    joints, floor = repair.on_floor(joints)
    check_person(joints, source)
    return joints, (*gaps, *unit, *rest, *turned, *mirrored, *floor)
