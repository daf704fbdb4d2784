"""What a shield must know of a robot, beside what its encoders say."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.typing import Floats
from hrc_env.geometry.chains import SerialChain


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A robot's geometry, what it can be asked for, and how hard it hits. Of slides all angles are
    ways, rad is m."""

    chain: SerialChain
    fastest_rad_s: Floats
    """(N,) the greatest velocity that an action asks of each joint [rad/s]."""
    slew_rad_s2: Floats
    """(N,) fastest change of each joint's commanded velocity [rad/s^2]."""
    mass_kg: float
    """Effective mass of a hit without a load: of an arm half of what moves (ISO/TS 15066, A.3), of
    a base that drives all of it [kg]."""
    load_kg: Floats
    """(O,) masses of the task's loose objects [kg]."""

    def __post_init__(self) -> None:
        for name in ("fastest_rad_s", "slew_rad_s2"):
            check_shape(name, np.shape(getattr(self, name)), (self.chain.n_joints,), "one a joint")
