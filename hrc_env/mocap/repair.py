"""What goes wrong in files of motion capture, mended where it can be told, refused where not."""

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.core.typing import Bools, Points3
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


def mended(
    joints: Points3, fps: float, source: str, at_zero: bool = False, off_floor: bool = False
) -> Mended:
    """Whole, in metres, upright, not mirrored, without a rest pose, on the floor: see `grounded`
    for `at_zero`, and for what is refused unless it may be `off_floor`."""
    joints, gaps = fill_gaps(joints, fps, source)
    joints, unit = in_metres(joints, source)
    first, rest = without_rest_pose(joints)
    joints, turned = z_up(joints[first:], source)
    joints, mirrored = unmirrored(joints, source)
    check_person(joints, source)
    joints, floor = grounded(joints, fps, source, at_zero, off_floor)
    return joints, (*gaps, *unit, *rest, *turned, *mirrored, *floor)


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


def z_up(joints: Points3, source: str) -> Mended:
    """The joints turned so that the person stands along +z."""
    way = middle(joints, "shoulder") - middle(joints, "ankle")
    up = np.nanmean(way / np.linalg.norm(way, axis=-1, keepdims=True), axis=0)
    axis = int(np.argmax(np.abs(up)))
    if abs(up[axis]) < STEADY:
        raise ConfigError(
            f"{source}: which axis is up? From ankles to shoulders the person points to "
            f"{np.round(up, 2).tolist()} on the mean; at least {STEADY} along one axis is "
            "expected, as of somebody who is mostly on their feet."
        )
    name = ("+" if up[axis] > 0.0 else "-") + "xyz"[axis]
    if name == "+z":
        return joints, ()
    return joints @ UPRIGHT[name].T, (f"The file's {name} axis is up.",)


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
    of the bones: positive for a person, negative for their mirror image."""
    ahead = np.cross(across(joints, "hip") + across(joints, "shoulder"), np.array([0.0, 0.0, 1.0]))
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
