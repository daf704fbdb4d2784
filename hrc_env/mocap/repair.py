"""What goes wrong in files of motion capture, mended where it can be told, refused where not."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.footing import grounded
from hrc_env.mocap.person import across, check_person, length, middle, runs, stature

STATURES_M = (1.3, 2.2)
"""Statures of people who are believed [m]."""
UNITS: dict[str, float] = {
    "metres": 1.0, "units of 1/0.45 inch (CMU)": 0.0254 / 0.45, "inches": 0.0254,
    "centimetres": 0.01, "millimetres": 0.001,
}  # fmt: skip
"""Units that files are in [m]; the person's stature tells which."""
LONGEST_GAP_S = 0.25
"""Longest time that a joint may be missing [s]: about half a step; judgement."""
STEADY = 0.8
"""Least share of one axis in the mean direction from ankles to shoulders."""
STRAIGHT, UPRIGHT_SHARE, BEGIN = 0.9, 0.5, 5
"""A person stands along an axis, or is upright, if the direction from ankles to shoulders has a
greater component along it; for at least this number of consecutive frames."""
ON_FLOOR, OFF_FLOOR = 0.15, 0.25
"""Heights of ankles above the file's floor, as shares of stature: at most the first if the person
stands on it, at least the second if not."""
KNEES = 0.1
"""Legs bent by less than this share of a shank, on the mean, are straight."""
JUMP, AFTER, JUMP_M = 6.0, 6, 0.03
"""A first frame is another pose if the jump from it is so many times those up to frame AFTER, and
joints move this much on the mean [m]."""
UPRIGHT = {
    "+x": about_axis("y", -np.pi / 2), "-x": about_axis("y", np.pi / 2),
    "+y": about_axis("x", np.pi / 2), "-y": about_axis("x", -np.pi / 2),
    "-z": about_axis("x", np.pi),
}  # fmt: skip
"""Rotations that take an axis to +z."""
Mended = tuple[Points3, tuple[str, ...]]
"""Joints (T, 15, 3), and a sentence for each thing that was changed."""


class Upward(NamedTuple):
    """Sources of the upward axis of a file beside the motion itself."""

    given: str | None = None
    """Its name, such as "+y", if it is given explicitly."""
    at_rest: Floats | None = None
    """(3,) unit vector from hips to shoulders of a skeleton at rest that stands; NaN: does not."""


def mended(
    joints: Points3, fps: float, source: str, at_zero: bool = False, off_floor: bool = False,
    upward: Upward | None = None,
) -> Mended:  # fmt: skip
    """Whole, in metres, upright, not mirrored, without a rest pose, on the floor: see `grounded`
    for `at_zero`, and for what is refused unless it may be `off_floor`."""
    joints, gaps = fill_gaps(joints, fps, source)
    joints, unit = in_metres(joints, source)
    first, rest = without_rest_pose(joints)
    joints, turned = z_up(joints[first:], source, upward)
    joints, mirrored = unmirrored(joints, source)
    check_person(joints, source)
    joints, floor = grounded(joints, fps, source, at_zero, off_floor)
    return joints, (*gaps, *unit, *rest, *turned, *mirrored, *floor)


def from_origin(joints: Points3, shift: Points3) -> Mended:
    """Return the joints displaced by `shift` (T, 3) if only then the feet are on a floor at 0.

    Joints and shift are in the frame and unit of the file.
    """
    way = middle(joints, "shoulder") - middle(joints, "ankle")
    axis = int(np.argmax(np.abs(np.nanmean(way, axis=0))))
    ankles = [JOINT["left_ankle"], JOINT["right_ankle"]]
    off, shifted = (
        abs(np.nanmedian(np.min(np.abs(each[:, ankles, axis]), axis=1))) / stature(joints)
        for each in (joints, joints + shift[:, None])
    )
    if off < OFF_FLOOR or shifted > ON_FLOOR:
        return joints, ()
    return joints + shift[:, None], ("Places were added to OFFSET: so the feet are on the floor.",)


def fill_gaps(joints: Points3, fps: float, source: str) -> Mended:
    """Joints that are missing (NaN) for a short time, on straight lines."""
    filled, told = joints.copy(), []
    for j, joint in enumerate(JOINTS):
        known: Bools = ~np.isnan(joints[:, j].sum(-1))
        gaps = runs(~known)
        if not gaps:
            continue
        first, last = max(gaps, key=lambda gap: gap[1] - gap[0])
        if (last - first) / fps > LONGEST_GAP_S:
            raise ConfigError(
                f"{source}: {joint} is missing for {(last - first) / fps:.2f} s from frame "
                f"{first}; gaps of up to {LONGEST_GAP_S} s are filled. Cut the clip there."
            )
        at = np.flatnonzero(known)
        for i in range(3):
            filled[:, j, i] = np.interp(np.arange(len(joints)), at, joints[at, j, i])
        told.append(f"{joint} ({np.sum(~known)} frames)")
    return filled, (f"Missing joints were filled in: {', '.join(told)}.",) if told else ()


def in_metres(joints: Points3, source: str) -> Mended:
    """The joints in metres, by the person's stature."""
    tall = stature(joints)
    for name, unit_m in UNITS.items():
        if STATURES_M[0] < tall * unit_m < STATURES_M[1]:
            told = f"Lengths are taken to be in {name}: the person is {tall * unit_m:.2f} m tall."
            return joints * unit_m, (told,) if unit_m != 1.0 else ()
    raise ConfigError(
        f"{source}: a person {tall:.4g} tall in the file's unit; expected "
        f"{STATURES_M[0]:g} to {STATURES_M[1]:g} m, in one of: {', '.join(UNITS)}."
    )


def z_up(joints: Points3, source: str, upward: Upward | None = None) -> Mended:
    """The joints turned so that the person stands along +z."""
    given, at_rest = upward or Upward()
    name = _upward_axis(joints, source, at_rest) if given is None else given
    name = name if name[:1] in ("+", "-") else f"+{name}"
    if name not in (*UPRIGHT, "+z"):
        valid = ", ".join(("+z", *UPRIGHT))
        raise ConfigError(f"{source}: the upward axis must be one of {valid}, got {name!r}.")
    if name == "+z":
        return joints, ()
    return joints @ UPRIGHT[name].T, (f"The file's {name} axis is up.",)


def _upward_axis(joints: Points3, source: str, at_rest: Floats | None) -> str:
    """Return the name of the upward axis: that of the skeleton at rest if the person stands along
    it at some time (as before a fall), else the mean direction of the body, else the first one."""
    way = middle(joints, "shoulder") - middle(joints, "ankle")
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    mean, begin = np.nanmean(way, axis=0), np.nanmean(way[:BEGIN], axis=0)
    if at_rest is not None and np.max(np.abs(at_rest)) > STRAIGHT:
        axis = _axis_along(at_rest)
        stands = runs(way @ _unit(axis) > STRAIGHT)
        if any(last - first >= BEGIN for first, last in stands):
            return axis
    if np.max(np.abs(mean)) >= STEADY:
        return _axis_along(mean)
    if np.max(np.abs(begin)) >= STRAIGHT:
        return _axis_along(begin)
    raise ConfigError(
        f"{source}: which axis is up? From ankles to shoulders the person points to "
        f"{np.round(mean, 2).tolist()} on the mean; at least {STEADY} along one axis is "
        "expected, as of somebody who is mostly on their feet. If you know it: --up=+y (up='+y')."
    )


def _axis_along(way: Floats) -> str:
    """Name of the axis that a vector (3,) is nearest to."""
    axis = int(np.argmax(np.abs(way)))
    return ("+" if way[axis] > 0.0 else "-") + "xyz"[axis]


def _unit(axis: str) -> Floats:
    """(3,) the unit vector of a name such as "-y"."""
    return np.eye(3)["xyz".index(axis[1])] * (1.0 if axis[0] == "+" else -1.0)


def unmirrored(joints: Points3, source: str) -> Mended:
    """The joints of a person, where two axes (or left and right) had been exchanged."""
    feet, knees = _forwards(joints)
    if feet > 0.0 and knees > -KNEES:
        return joints, ()
    if feet < 0.0 and knees < KNEES:
        told = "The person was their own mirror image (two axes exchanged); mirrored back."
        return joints * np.array([1.0, -1.0, 1.0]), (told,)
    raise ConfigError(
        f"{source}: feet point {'for' if feet > 0 else 'back'}ward, but knees bend "
        f"{'for' if knees > 0 else 'back'}ward: left and right are exchanged in some joints only. "
        "Exchange them in shoulders, hips, knees, ankles and feet alike."
    )


def _forwards(joints: Points3) -> tuple[float, float]:
    """How far feet point, and knees bend, to where left-hand and up say that forward is, in shares
    of the bones: positive for a person, negative for their mirror image. Only upright frames count;
    if there are hardly any, the trunk's axis stands for up."""
    way = middle(joints, "shoulder") - middle(joints, "ankle")
    upright = way[:, 2] > UPRIGHT_SHARE * np.linalg.norm(way, axis=-1)
    up: Floats = np.array([0.0, 0.0, 1.0])
    if upright.sum() >= BEGIN:
        joints = joints[upright]
    else:
        up = middle(joints, "shoulder") - middle(joints, "hip")
    ahead = np.cross(across(joints, "hip") + across(joints, "shoulder"), up)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    foot = middle(joints, "foot") - middle(joints, "ankle")
    feet = (foot * ahead).sum(-1) / np.linalg.norm(foot, axis=-1)
    bent = middle(joints, "knee") - 0.5 * (middle(joints, "hip") + middle(joints, "ankle"))
    knees = (bent * ahead).sum(-1) / length(joints, "knee", "ankle")
    return float(np.nanmedian(feet)), float(np.nanmean(knees))


def without_rest_pose(joints: Points3) -> tuple[int, tuple[str, ...]]:
    """How many frames at the beginning are a rest pose (a T, mostly) and no motion: 0 or 1."""
    shape = joints - joints[:, [JOINT["left_hip"]]]
    jumps = np.linalg.norm(np.diff(shape, axis=0), axis=-1).mean(-1)
    if jumps[0] > max(JUMP_M, JUMP * jumps[1:AFTER].max(initial=0.0)):
        return 1, ("The first frame is another pose than the motion (a T-pose?): left out.",)
    return 0, ()
