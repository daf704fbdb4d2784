"""Estimation of a recording's floor from the feet, and checks that the person is on it."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, Points3, Rotations
from hrc_env.mocap.person import Run, find_runs, smooth
from hrc_env.mocap.record import Repaired

ANKLE_M = 0.06
"""Height of the ankle above the tip of a standing foot in the worker models [m]."""
RESTS_M_S = 0.15
"""Vertical speed of the lower foot below which it is at rest [m/s].

Horizontal speed is ignored in order to accept recordings with sliding feet.
"""
SMOOTH_S = 0.05
"""Standard deviation of the smoothing of heights [s]."""
LEAST_S = 0.1
"""Minimum duration of the rest of a foot [s]."""
FLOOR_SHARE = 20.0
"""Percentile of the heights of feet at rest that is taken as the floor.

It is below the median because people step up more often than down.
"""
LEAST_TILT_RAD = 0.015
"""Minimum tilt of the floor that is corrected [rad]."""
MOST_TILT_RAD = 0.07
"""Maximum tilt of the floor that is corrected [rad]."""
EVEN_M = 0.015
"""Maximum standard deviation of feet at rest from a tilted plane for its correction [m]."""
APART_M = 1.0
"""Minimum extent of the feet at rest in a direction for the correction of tilt along it [m]."""
LEVEL_M = 0.08
"""Height of feet at rest relative to the floor beyond which they stand on an object [m]."""
LEVEL_S = 0.3
"""Maximum total time for which feet may rest on objects [s]."""
AIR_M = 0.10
"""Height of both feet above which a person without a hand on the floor is in the air [m]."""
AIR_S = 0.7
"""Maximum duration of a jump [s]."""
HAND_M = 0.1
"""Height of the wrist below which the hand is on the floor [m]."""
RUN_M_S = 2.5
"""Speed of a person above which it need not have a foot at rest [m/s]."""
LEAST_SHARE = 0.1
"""Minimum fraction of the time during which at least one foot must be at rest."""
FLOOR_M = (-0.03, 0.09)
"""Range of the height of the tips of standing feet for which the file's floor is accepted [m]."""
SOLE_M = 0.03
"""Assumed height of the tips of feet above the floor [m]; 0.01 to 0.04 in the worker models."""
ACCEPT = "To play it on a single floor nevertheless: --allow-off-floor (allow_off_floor=True)."


class Support(NamedTuple):
    """Motion of a person's lower foot over time."""

    height: Floats
    """Height (T,) of the foot's tip, or that of the ankle minus `ANKLE_M` if it is lower [m]."""
    rests: Bools
    """Mask (T,) of frames in which the foot is at rest."""


def put_on_floor(
    joints: Points3, fps: float, source: str, at_zero: bool, is_allowed: bool
) -> Repaired:
    """Move joints to a level floor at 0, unless the floor of the file is already there.

    Args:
        joints: joints (T, 15, 3), upright [m].
        fps: frame rate [Hz].
        source: name of the file, for error messages.
        at_zero: whether the file's floor is at 0 by convention, in which case a different height
            indicates the skeleton of another person.
        is_allowed: whether faults are accepted.

    Raises:
        ConfigError: the feet are not on one floor or not on the file's floor, and faults are not
            accepted.
    """
    joints, notes = level_floor(joints, fps)
    faults, height = describe_floor_faults(joints, fps), measure_floor_height(joints, fps)
    if not FLOOR_M[0] < height < FLOOR_M[1]:
        off = height - SOLE_M
        joints = joints - np.array([0.0, 0.0, off])
        notes = (*notes, f"The floor was found at {off:+.2f} m and moved to 0.")
        if off > 0.0 and _is_hanging(joints):
            faults = (
                *faults,
                f"Hands are above the head and feet {off:.2f} m above the file's floor (hanging?).",
            )
        if at_zero:
            faults = (
                *faults,
                f"With this skeleton, feet stand {off:+.2f} m above the file's floor; within "
                f"{SOLE_M - FLOOR_M[0]:.2f} m are expected with the skeleton of the person. Pass "
                "their .asf file with --skeleton.",
            )
    if faults and not is_allowed:
        raise ConfigError(f"{source}: {' '.join(faults)} {ACCEPT}")
    return Repaired(joints, (*notes, *faults))


def _is_hanging(joints: Points3) -> bool:
    """Return whether both hands are above the head most of the time."""
    hands = joints[:, [JOINT["left_wrist"], JOINT["right_wrist"]], 2].min(1)
    return bool(np.median(hands - joints[:, JOINT["nose"], 2]) > 0.0)


def find_support(joints: Points3, fps: float) -> Support:
    """Return the height of the lower foot, and whether it is at rest, for each frame."""
    ankles, tips = (
        [joints[:, JOINT[f"{side}_{part}"], 2] for side in ("left", "right")]
        for part in ("ankle", "foot")
    )
    height = smooth(np.minimum(np.min(ankles, 0) - ANKLE_M, np.min(tips, 0)), SMOOTH_S * fps)
    rests = np.abs(np.gradient(height, 1.0 / fps)) < RESTS_M_S
    for first, end in find_runs(rests):
        rests[first:end] = end - first >= LEAST_S * fps
    return Support(height, rests)


def measure_floor_height(joints: Points3, fps: float) -> float:
    """Return the height of the tips of feet at rest [m], or of the lowest feet if none is at rest.

    The result is a percentile over time.
    """
    height, rests = find_support(joints, fps)
    return float(
        np.percentile(height[rests], FLOOR_SHARE) if rests.any() else np.percentile(height, 5.0)
    )


def level_floor(joints: Points3, fps: float) -> Repaired:
    """Rotate joints to level a slightly tilted floor."""
    height, rests = find_support(joints, fps)
    points = np.column_stack([joints[rests, JOINT["left_hip"], :2], height[rests]])
    if len(points) < 3:
        return Repaired(joints, ())
    points -= points.mean(0)
    axes = np.linalg.svd(points[:, :2], full_matrices=False)[2]
    wide = axes[np.ptp(points[:, :2] @ axes.T, axis=0) > APART_M]
    slope = np.linalg.lstsq(points[:, :2] @ wide.T, points[:, 2], rcond=None)[0] @ wide
    angle, left = float(np.arctan(np.linalg.norm(slope))), points[:, 2] - points[:, :2] @ slope
    if not LEAST_TILT_RAD < angle < MOST_TILT_RAD or left.std() > EVEN_M:
        return Repaired(joints, ())
    note = f"The floor was tilted by {np.degrees(angle):.1f} degrees and has been levelled."
    return Repaired(joints @ _make_levelling(slope).T, (note,))


def _make_levelling(slope: Floats) -> Rotations:
    """Return the smallest rotation (3, 3) of the plane z = slope . (x, y) to z = 0."""
    up = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + slope @ slope)
    x, y, z = up
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + z)


def describe_floor_faults(joints: Points3, fps: float) -> tuple[str, ...]:
    """Return sentences on the faults by which the feet are not on one level floor."""
    height, rests = find_support(joints, fps)
    height = height - measure_floor_height(joints, fps)
    faults = []
    elsewhere = rests & (np.abs(height) > LEVEL_M)
    if elsewhere.sum() > LEVEL_S * fps:
        low, high = np.percentile(height[rests], (2, 98))
        faults.append(
            f"Feet rest at heights from {low:+.2f} to {high:+.2f} m (stairs, terrain, a seat?); "
            f"heights within {LEVEL_M} m of a single floor are expected."
        )
    hands = joints[:, [JOINT["left_wrist"], JOINT["right_wrist"]], 2].min(1) - HAND_M
    off = np.minimum(height, hands - measure_floor_height(joints, fps)) > AIR_M
    first, end = max(find_runs(off), key=lambda run: run.end - run.first, default=Run(0, 0))
    if (end - first) / fps > AIR_S and not faults:
        faults.append(
            f"Both feet are more than {AIR_M} m above the floor for {(end - first) / fps:.1f} s, "
            f"beginning at {first / fps:.1f} s (hanging, thrown up?); at most {AIR_S} s are "
            "expected."
        )
    if rests.mean() < LEAST_SHARE and not _is_running(joints, height, fps):
        faults.append(
            f"At least one foot rests for {100 * rests.mean():.0f} % of the time; at least "
            f"{100 * LEAST_SHARE:.0f} % are expected of a person on a floor."
        )
    return tuple(faults)


def _is_running(joints: Points3, height: Floats, fps: float) -> bool:
    """Return whether the person is running.

    A running person is fast, and has a foot near the floor at least once per `AIR_S`.
    """
    hip = joints[:, JOINT["left_hip"], :2]
    speed_m_s = np.median(np.linalg.norm(np.diff(hip, axis=0), axis=-1)) * fps
    aloft = max((end - first for first, end in find_runs(height > LEVEL_M)), default=0)
    return bool(speed_m_s > RUN_M_S and aloft / fps < AIR_S)
