"""What a task puts into a scene: MJCF, what can be held together, where people work at it."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.records import Workplace


@dataclass(frozen=True, slots=True)
class Weld:
    """Two sites that can be held together, as wide as they are apart; off at first."""

    name: str
    sites: tuple[str, str]
    """By their names in the scene: "robot/...", "task/...", "worker_1/..."."""
    solref: tuple[float, float] = (0.02, 1.0)
    """How stiff it is, as MuJoCo has it."""
    turns: bool = True
    """Whether it holds their turns, too."""


@dataclass(frozen=True, slots=True)
class Things:
    """What a task puts into a scene, from the middle of the robot's foot on [m]."""

    mjcf: str = ""
    """Bodies of boxes, loose with a free joint and contype 16, fixed with contype 1."""
    welds: tuple[Weld, ...] = ()
    places: tuple[Workplace, ...] = ()
    """Where workers work at them; kind "task"."""


FOOT_WORLD = np.array([-0.75, 0.0, 0.75])
"""The foot of robots that do not drive, in every scene [m]."""
NOTHING = Things()
