"""Where a task has tools get to, and whether an arm can; told before anything is simulated."""

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats, Points3
from hrc_env.geometry.chains import SerialChain, forward

Triple = tuple[float, float, float]


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ReachTarget:
    """A place that the tool point has to get to."""

    name: str
    """What is there, with its article."""
    place_world: Triple | Points3
    """[m]"""
    along_world: Triple | None = None
    """Which way the tool points there, a unit vector; None: any way."""
    within_m: float = 0.0
    """It will do to be so near to it [m]."""


def check_reach(who: str, robot: str, chain: SerialChain, targets: Iterable[ReachTarget]) -> None:
    """Raise `ConfigError` for a place that an arm is too short for: its last joint would have to be
    farther from its second one than it ever is."""
    if chain.slides.any():
        return
    shoulder_world, most_m = wrist_reach(chain)
    R, p = chain.link_from_tool[:3, :3], chain.link_from_tool[:3, 3]
    wrist = -R.T @ p
    for target in targets:
        at, slack_m = np.asarray(target.place_world, float), float(np.linalg.norm(wrist))
        if target.along_world is not None:
            at, slack_m = at + wrist[2] * np.array(target.along_world), float(np.hypot(*wrist[:2]))
        away_m = float(np.linalg.norm(at - shoulder_world)) - slack_m - target.within_m
        if away_m > most_m:
            x, y, z = np.asarray(target.place_world, float)
            raise ConfigError(
                f"{who}: {target.name} at ({x:.2f}, {y:.2f}, {z:.2f}) m is out of reach of "
                f"the robot {robot!r}, whose wrist would be {away_m:.2f} m from its shoulder "
                f"and can be {most_m:.2f} m away at most. Put it nearer to the robot, or choose a "
                "longer arm."
            )


def wrist_reach(chain: SerialChain) -> tuple[Floats, float]:
    """Where an arm's second joint is (3,), and how far from it the last one can be [m]: at most, of
    all poses whose joints are at right angles, among which arms of the usual kinds are longest."""
    steps = 0.5 * np.pi * np.arange(-2, 3)
    between = [
        [angle for angle in steps if low <= angle <= high] or [low, high]
        for low, high in chain.range_rad[1:-1]
    ]
    poses = np.array([(0.0, *angles, 0.0) for angles in itertools.product(*between)])
    joints = forward(chain, poses[:, -chain.n_joints :])[..., :3, 3]
    second = min(1, chain.n_joints - 1)
    away_m = np.linalg.norm(joints[:, -1] - joints[:, second], axis=-1)
    return joints[0, second], float(away_m.max())
