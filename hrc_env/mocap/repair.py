"""Repair of unambiguous faults in motion-capture files; other faults raise `ConfigError`."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.footing import put_on_floor
from hrc_env.mocap.person import (
    check_person,
    find_runs,
    measure_bone,
    measure_stature,
    midpoint,
    span,
)
from hrc_env.mocap.record import Repaired

STATURES_M = (1.3, 2.2)
"""Range of plausible statures [m]."""
UNITS: dict[str, float] = {
    "metres": 1.0,
    "units of 1/0.45 inch (CMU)": 0.0254 / 0.45,
    "inches": 0.0254,
    "centimetres": 0.01,
    "millimetres": 0.001,
}
"""Units of length in files [m], of which one is inferred from the person's stature."""
LONGEST_GAP_S = 0.25
"""Maximum time for which a joint may be missing [s].

The value is an estimate, about the duration of half a step.
"""
STEADY = 0.8
"""Minimum component of the mean direction from ankles to shoulders along the upward axis."""
STRAIGHT = 0.9
"""Minimum component, along an axis, of the ankle-to-shoulder direction of a standing person."""
UPRIGHT_SHARE = 0.5
"""Minimum vertical component of the ankle-to-shoulder direction of an upright person."""
BEGIN = 5
"""Number of initial frames that are averaged; minimum number of standing or upright frames."""
ON_FLOOR = 0.15
"""Maximum ankle height of a person on the file's floor, as a fraction of stature."""
OFF_FLOOR = 0.25
"""Minimum ankle height of a person off the file's floor, as a fraction of stature."""
KNEES = 0.1
"""Maximum mean bend of straight legs at the knees, as a fraction of the length of a shank."""
JUMP = 6.0
"""Ratio of the jump after the first frame to later ones above which this frame is a rest pose."""
AFTER = 6
"""Number of later frames used for the comparison with the jump after the first frame."""
JUMP_M = 0.03
"""Minimum mean displacement of the joints after a rest pose in the first frame [m]."""
UPRIGHT = {
    "+x": about_axis("y", -np.pi / 2),
    "-x": about_axis("y", np.pi / 2),
    "+y": about_axis("x", np.pi / 2),
    "-y": about_axis("x", -np.pi / 2),
    "-z": about_axis("x", np.pi),
}
"""Rotation that aligns each axis with +z, by the name of the axis."""


class Upward(NamedTuple):
    """Information on a file's upward axis in addition to the motion."""

    given: str | None = None
    """Name of the axis, such as "+y", if it is specified explicitly."""
    at_rest: Floats | None = None
    """Unit vector (3,) from hips to shoulders in a standing rest pose; otherwise NaN."""


def repair_joints(
    joints: Points3,
    fps: float,
    source: str,
    at_zero: bool = False,
    off_floor: bool = False,
    upward: Upward | None = None,
) -> Repaired:
    """Repair joints to be complete, in metres, upright, not mirrored and on the floor.

    A rest pose at the beginning is removed.

    Args:
        joints: joints (T, 15, 3) in the frame and unit of the file; missing joints are NaN.
        fps: frame rate [Hz].
        source: name of the file, for error messages.
        at_zero: whether the file's floor is at 0 by convention, as in `footing.put_on_floor`.
        off_floor: whether to accept a person that is not on one level floor.
        upward: information on the upward axis.

    Raises:
        ConfigError: a fault cannot be repaired.
    """
    joints, gaps = fill_gaps(joints, fps, source)
    joints, unit = convert_to_metres(joints, source)
    first = skip_rest_pose(joints)
    joints, turned = turn_upright(joints[first.frame :], source, upward)
    joints, mirrored = undo_mirroring(joints, source)
    check_person(joints, source)
    joints, floor = put_on_floor(joints, fps, source, at_zero, off_floor)
    notes = (*gaps, *unit, *first.notes, *turned, *mirrored, *floor)
    return Repaired(joints, notes)


def add_shift(joints: Points3, shift: Points3) -> Repaired:
    """Displace joints by `shift` (T, 3) if this is required for feet on a floor at 0.

    Joints and shift are in the frame and unit of the file.
    """
    way = midpoint(joints, "shoulder") - midpoint(joints, "ankle")
    axis = int(np.argmax(np.abs(np.nanmean(way, axis=0))))
    ankles = [JOINT["left_ankle"], JOINT["right_ankle"]]
    off, shifted = (
        abs(np.nanmedian(np.min(np.abs(points[:, ankles, axis]), axis=1))) / measure_stature(joints)
        for points in (joints, joints + shift[:, None])
    )
    if off < OFF_FLOOR or shifted > ON_FLOOR:
        return Repaired(joints, ())
    note = "Positions were added to OFFSET, which places the feet on the floor."
    return Repaired(joints + shift[:, None], (note,))


def fill_gaps(joints: Points3, fps: float, source: str) -> Repaired:
    """Fill short gaps (NaN) in joints by linear interpolation."""
    filled, names = joints.copy(), list[str]()
    for j, joint in enumerate(JOINTS):
        known: Bools = ~np.isnan(joints[:, j].sum(-1))
        gaps = find_runs(~known)
        if not gaps:
            continue
        first, end = max(gaps, key=lambda gap: gap.end - gap.first)
        if (end - first) / fps > LONGEST_GAP_S:
            raise ConfigError(
                f"{source}: {joint} is missing for {(end - first) / fps:.2f} s from frame {first}; "
                f"only gaps of up to {LONGEST_GAP_S} s are filled. Split the clip there."
            )
        at = np.flatnonzero(known)
        for i in range(3):
            filled[:, j, i] = np.interp(np.arange(len(joints)), at, joints[at, j, i])
        names.append(f"{joint} ({np.sum(~known)} frames)")
    note = f"Missing joints were interpolated: {', '.join(names)}."
    return Repaired(filled, (note,) if names else ())


def convert_to_metres(joints: Points3, source: str) -> Repaired:
    """Convert joints to metres; the unit is inferred from the person's stature."""
    tall = measure_stature(joints)
    for name, unit_m in UNITS.items():
        if STATURES_M[0] < tall * unit_m < STATURES_M[1]:
            note = f"Lengths are interpreted as {name}: the person is {tall * unit_m:.2f} m tall."
            return Repaired(joints * unit_m, (note,) if unit_m != 1.0 else ())
    raise ConfigError(
        f"{source}: a person {tall:.4g} tall in the file's unit; expected "
        f"{STATURES_M[0]:g} to {STATURES_M[1]:g} m, in one of: {', '.join(UNITS)}."
    )


def turn_upright(joints: Points3, source: str, upward: Upward | None = None) -> Repaired:
    """Rotate joints to let the person stand along +z."""
    given, at_rest = upward or Upward()
    name = _find_upward_axis(joints, source, at_rest) if given is None else given
    name = name if name[:1] in ("+", "-") else f"+{name}"
    if name not in (*UPRIGHT, "+z"):
        valid = ", ".join(("+z", *UPRIGHT))
        raise ConfigError(f"{source}: the upward axis must be one of {valid}, got {name!r}.")
    if name == "+z":
        return Repaired(joints, ())
    return Repaired(joints @ UPRIGHT[name].T, (f"The file's {name} axis is up.",))


def _find_upward_axis(joints: Points3, source: str, at_rest: Floats | None) -> str:
    """Return the name of the upward axis.

    It is the axis of the rest pose if the person stands along it in some frames (as before a fall).
    Otherwise it is the axis nearest to the direction of the body, averaged over all frames or over
    the first frames.
    """
    way = midpoint(joints, "shoulder") - midpoint(joints, "ankle")
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    mean, begin = np.nanmean(way, axis=0), np.nanmean(way[:BEGIN], axis=0)
    if at_rest is not None and np.max(np.abs(at_rest)) > STRAIGHT:
        axis = _name_axis(at_rest)
        stands = find_runs(way @ _make_unit_vector(axis) > STRAIGHT)
        if any(end - first >= BEGIN for first, end in stands):
            return axis
    if np.max(np.abs(mean)) >= STEADY:
        return _name_axis(mean)
    if np.max(np.abs(begin)) >= STRAIGHT:
        return _name_axis(begin)
    raise ConfigError(
        f"{source}: the upward axis is unclear. The mean direction from ankles to shoulders is "
        f"{np.round(mean, 2).tolist()}; a component of at least {STEADY} along one axis is "
        "expected of a person who mostly stands. If you know the axis: --up=+y (up='+y')."
    )


def _name_axis(way: Floats) -> str:
    """Return the name of the axis nearest to a vector (3,)."""
    axis = int(np.argmax(np.abs(way)))
    return ("+" if way[axis] > 0.0 else "-") + "xyz"[axis]


def _make_unit_vector(axis: str) -> Floats:
    """Return the unit vector (3,) of an axis with a name such as "-y"."""
    return np.eye(3)["xyz".index(axis[1])] * (1.0 if axis[0] == "+" else -1.0)


def undo_mirroring(joints: Points3, source: str) -> Repaired:
    """Undo a swap of two axes, or of left and right, in joints."""
    feet, knees = _measure_forward(joints)
    if feet > 0.0 and knees > -KNEES:
        return Repaired(joints, ())
    if feet < 0.0 and knees < KNEES:
        note = "The person was mirrored (two axes are swapped); this was corrected."
        return Repaired(joints * np.array([1.0, -1.0, 1.0]), (note,))
    raise ConfigError(
        f"{source}: feet point {'for' if feet > 0 else 'back'}ward, but knees bend "
        f"{'for' if knees > 0 else 'back'}ward: left and right are swapped in only some joints. "
        "Swap them consistently in shoulders, hips, knees, ankles and feet."
    )


class _Forward(NamedTuple):
    """Forward components of feet and knees, negative for the mirror image of a person."""

    feet: float
    """Median forward component of the feet, as a fraction of their length."""
    knees: float
    """Mean forward bend of the knees, as a fraction of the length of a shank."""


def _measure_forward(joints: Points3) -> _Forward:
    """Return the forward components of feet and knees, with forward inferred from left and up.

    Only upright frames are used. With fewer than `BEGIN` such frames, all frames are used and the
    trunk's axis replaces the upward axis.
    """
    way = midpoint(joints, "shoulder") - midpoint(joints, "ankle")
    upright = way[:, 2] > UPRIGHT_SHARE * np.linalg.norm(way, axis=-1)
    up: Floats = np.array([0.0, 0.0, 1.0])
    if upright.sum() >= BEGIN:
        joints = joints[upright]
    else:
        up = midpoint(joints, "shoulder") - midpoint(joints, "hip")
    ahead = np.cross(span(joints, "hip") + span(joints, "shoulder"), up)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    foot = midpoint(joints, "foot") - midpoint(joints, "ankle")
    feet = (foot * ahead).sum(-1) / np.linalg.norm(foot, axis=-1)
    bent = midpoint(joints, "knee") - 0.5 * (midpoint(joints, "hip") + midpoint(joints, "ankle"))
    knees = (bent * ahead).sum(-1) / measure_bone(joints, "knee", "ankle")
    return _Forward(float(np.nanmedian(feet)), float(np.nanmean(knees)))


class FirstFrame(NamedTuple):
    """First frame of the motion in a recording."""

    frame: int
    """Index of the first frame of the motion."""
    notes: tuple[str, ...]
    """Description of the removal of a frame, if one is removed."""


def skip_rest_pose(joints: Points3) -> FirstFrame:
    """Return the first frame of the motion: 1 if frame 0 is a rest pose (T-pose), otherwise 0."""
    shape = joints - joints[:, [JOINT["left_hip"]]]
    jumps = np.linalg.norm(np.diff(shape, axis=0), axis=-1).mean(-1)
    if jumps[0] > max(JUMP_M, JUMP * jumps[1:AFTER].max(initial=0.0)):
        note = "The first frame shows a different pose from the motion (a T-pose?) and is left out."
        return FirstFrame(1, (note,))
    return FirstFrame(0, ())
