"""Positions that the tool of a robot must reach, and a check of the arm's length."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Points3
from hrc_env.geometry.chains import SerialChain, link_frames

Triple = tuple[float, float, float]
"""A tuple of three coordinates."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ReachTarget:
    """A position that the tool point of a robot must reach."""

    name: str
    """Name of the target including its article (such as "the goal"), for error messages."""
    place_world: Triple | Points3
    """Position of the target in the world frame [m]."""
    along_world: Triple | None = None
    """Unit vector along which the tool points at the target; None if any direction is allowed."""
    within_m: float = 0.0
    """Tolerance: maximum distance from the target at which it counts as reached [m]."""


class WristReach(NamedTuple):
    """A sphere around the second joint of an arm that contains all positions of its last joint."""

    shoulder_world: Points3
    """(3,) position of the second joint in the world frame [m]."""
    radius_m: float
    """Maximum distance of the last joint from the second one [m]."""


def check_reach(task: str, robot: str, chain: SerialChain, targets: Iterable[ReachTarget]) -> None:
    """Raise an error if an arm is too short for one of the targets.

    Args:
        task: id of the task, for the error message.
        robot: name of the robot, for the error message.
        chain: geometry of the robot; robots with slides are not checked.
        targets: positions that the tool point must reach.

    Raises:
        ConfigError: a target requires a greater distance between the second and the last joint than
            the arm can reach.
    """
    if chain.slides.any():
        return
    reach = wrist_reach(chain)
    R, p = chain.link_from_tool[:3, :3], chain.link_from_tool[:3, 3]
    wrist = -R.T @ p
    for target in targets:
        at, slack_m = np.asarray(target.place_world, float), float(np.linalg.norm(wrist))
        if target.along_world is not None:
            at, slack_m = at + wrist[2] * np.array(target.along_world), float(np.hypot(*wrist[:2]))
        away_m = float(np.linalg.norm(at - reach.shoulder_world)) - slack_m - target.within_m
        if away_m > reach.radius_m:
            x, y, z = np.asarray(target.place_world, float)
            raise ConfigError(
                f"{task}: {target.name} at ({x:.2f}, {y:.2f}, {z:.2f}) m is out of reach of the "
                f"robot {robot!r}: its wrist would be {away_m:.2f} m from its shoulder, but "
                f"reaches at most {reach.radius_m:.2f} m. Move it closer to the robot, or choose a "
                "longer arm."
            )


def wrist_reach(chain: SerialChain) -> WristReach:
    """Return the reach of an arm's last joint.

    It is the maximum distance over all poses with joint angles of multiples of 90 degrees; arms of
    the usual designs reach farthest in one of these poses.
    """
    steps = 0.5 * np.pi * np.arange(-2, 3)
    between = [
        [angle for angle in steps if low <= angle <= high] or [low, high]
        for low, high in chain.range_rad[1:-1]
    ]
    poses = np.array([(0.0, *angles, 0.0) for angles in itertools.product(*between)])
    joints = link_frames(chain, poses[:, -chain.n_joints :])[..., :3, 3]
    second = min(1, chain.n_joints - 1)
    away_m = np.linalg.norm(joints[:, -1] - joints[:, second], axis=-1)
    return WristReach(joints[0, second], float(away_m.max()))
