"""What the feet of a recorded person tell of the floor: where it is, and whether they are on it."""

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, Points3, Rotations
from hrc_env.mocap.person import runs, smoothed

ANKLE_M = 0.06
"""An ankle is so much higher than the foot's tip on a foot that stands [m]; the baked bodies'."""
RESTS_M_S, SMOOTH_S, LEAST_S = 0.15, 0.05, 0.1
"""The lower foot rests while its height changes by less [m/s], smoothed over this time, for at
least that [s]; recordings whose feet slide are not refused."""
FLOOR_SHARE = 20.0
"""The floor is this percentile of the heights at which feet rest: people step up more than down."""
TILTED_RAD, EVEN_M, APART_M = (0.015, 0.07), 0.015, 1.0
"""A floor aslant by so much is levelled [rad] if feet rest so near to one plane (standard
deviation), and this far apart along its slope [m]."""
LEVEL_M, LEVEL_S = 0.08, 0.3
"""Feet that rest higher or lower than the floor by more [m], together for longer [s], stand on
something else."""
AIR_M, AIR_S, HAND_M = 0.10, 0.7, 0.1
"""A person is in the air with both feet higher than this [m] and no hand on the floor (the wrist
of a hand on the floor is lower than the third [m]); a jump lasts no longer than the second [s]."""
RUN_M_S = 2.5
"""The feet of a person faster than this hardly rest [m/s]."""
LEAST_SHARE = 0.1
"""One foot or the other rests for this share of the time at least."""
FLOOR_M, SOLE_M = (-0.03, 0.09), 0.03
"""Heights of standing feet's tips between which the file's floor is believed; on a floor that was
found [m]; the baked bodies' are 0.01 to 0.04."""
ACCEPT = "To play it all the same, as on one floor: --allow-off-floor (allow_off_floor=True)."


def grounded(
    joints: Points3, fps: float, source: str, at_zero: bool, allowed: bool
) -> tuple[Points3, tuple[str, ...]]:
    """The joints on a level floor at 0, moved only where the file's own is elsewhere; what was
    changed, a sentence each.

    `at_zero`: the file's own floor is at 0 by convention, and its skeleton comes from elsewhere.

    Raises:
        ConfigError: the feet are not on one floor, or not on the file's, and that is not `allowed`.
    """
    joints, told = level(joints, fps)
    faults, found = off_floor(joints, fps), floor_height(joints, fps)
    if not FLOOR_M[0] < found < FLOOR_M[1]:
        off = found - SOLE_M
        joints = joints - np.array([0.0, 0.0, off])
        told = (*told, f"The floor was found at {off:+.2f} m and moved to 0.")
        if off > 0.0 and _hangs(joints):
            faults = (
                *faults,
                f"Hands are above the head and feet {off:.2f} m above the file's floor (hanging?).",
            )
        if at_zero:
            faults = (
                *faults,
                f"With this skeleton, feet stand {off:+.2f} m above the file's floor; within "
                f"{SOLE_M - FLOOR_M[0]:.2f} m are expected of the person's own. Give their .asf "
                "file with --skeleton.",
            )
    if faults and not allowed:
        raise ConfigError(f"{source}: {' '.join(faults)} {ACCEPT}")
    return joints, (*told, *faults)


def _hangs(joints: Points3) -> bool:
    """Whether both hands are above the head for most of the time."""
    hands = joints[:, [JOINT["left_wrist"], JOINT["right_wrist"]], 2].min(1)
    return bool(np.median(hands - joints[:, JOINT["nose"], 2]) > 0.0)


def supports(joints: Points3, fps: float) -> tuple[Floats, Bools]:
    """(T,) height of the lower foot's tip if it is flat [m], and whether that foot rests."""
    ankles, tips = (
        [joints[:, JOINT[f"{side}_{part}"], 2] for side in ("left", "right")]
        for part in ("ankle", "foot")
    )
    height = smoothed(np.minimum(np.min(ankles, 0) - ANKLE_M, np.min(tips, 0)), SMOOTH_S * fps)
    on = np.abs(np.gradient(height, 1.0 / fps)) < RESTS_M_S
    for first, last in runs(on):
        on[first:last] = last - first >= LEAST_S * fps
    return height, on


def floor_height(joints: Points3, fps: float) -> float:
    """Height of the tips of feet that stand on the floor [m]; of the lowest, where none rests."""
    height, rests = supports(joints, fps)
    return float(
        np.percentile(height[rests], FLOOR_SHARE) if rests.any() else np.percentile(height, 5.0)
    )


def level(joints: Points3, fps: float) -> tuple[Points3, tuple[str, ...]]:
    """The joints turned so that a floor which is slightly aslant is level."""
    height, rests = supports(joints, fps)
    points = np.column_stack([joints[rests, JOINT["left_hip"], :2], height[rests]])
    if len(points) < 3:
        return joints, ()
    points -= points.mean(0)
    axes = np.linalg.svd(points[:, :2], full_matrices=False)[2]
    wide = axes[np.ptp(points[:, :2] @ axes.T, axis=0) > APART_M]
    slope = np.linalg.lstsq(points[:, :2] @ wide.T, points[:, 2], rcond=None)[0] @ wide
    angle, left = float(np.arctan(np.linalg.norm(slope))), points[:, 2] - points[:, :2] @ slope
    if not TILTED_RAD[0] < angle < TILTED_RAD[1] or left.std() > EVEN_M:
        return joints, ()
    told = f"The floor was aslant by {np.degrees(angle):.1f} degrees and has been levelled."
    return joints @ _levelling(slope).T, (told,)


def _levelling(slope: Floats) -> Rotations:
    """(3, 3) the smallest rotation of a plane z = slope . (x, y) to z = 0."""
    up = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    x, y, z = up
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + z)


def off_floor(joints: Points3, fps: float) -> tuple[str, ...]:
    """What the feet of a person do who is not on one level floor, a sentence each."""
    height, rests = supports(joints, fps)
    height = height - floor_height(joints, fps)
    told = []
    elsewhere = rests & (np.abs(height) > LEVEL_M)
    if elsewhere.sum() > LEVEL_S * fps:
        low, high = np.percentile(height[rests], (2, 98))
        told.append(
            f"Feet rest at heights from {low:+.2f} to {high:+.2f} m (stairs, terrain, a seat?); "
            f"within {LEVEL_M} m of one floor are expected."
        )
    hands = joints[:, [JOINT["left_wrist"], JOINT["right_wrist"]], 2].min(1) - HAND_M
    off = np.minimum(height, hands - floor_height(joints, fps)) > AIR_M
    first, last = max(runs(off), key=lambda run: run[1] - run[0], default=(0, 0))
    if (last - first) / fps > AIR_S and not told:
        told.append(
            f"Both feet are more than {AIR_M} m above the floor for {(last - first) / fps:.1f} s "
            f"from {first / fps:.1f} s on (hanging, thrown up?); at most {AIR_S} s are expected."
        )
    if rests.mean() < LEAST_SHARE and not _runs(joints, height, fps):
        told.append(
            f"One foot or the other rests for {100 * rests.mean():.0f} % of the time; at least "
            f"{100 * LEAST_SHARE:.0f} % are expected of who goes on a floor."
        )
    return tuple(told)


def _runs(joints: Points3, height: Floats, fps: float) -> bool:
    """Return whether the person runs: fast, with a foot near the floor every AIR_S at least."""
    hip = joints[:, JOINT["left_hip"], :2]
    speed_m_s = np.median(np.linalg.norm(np.diff(hip, axis=0), axis=-1)) * fps
    aloft = max((last - first for first, last in runs(height > LEVEL_M)), default=0)
    return bool(speed_m_s > RUN_M_S and aloft / fps < AIR_S)
