"""Constant properties of a robot that shields need, in addition to the measured joint state."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.typing import Floats
from hrc_env.geometry.chains import SerialChain


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A robot's geometry, the limits of its commands and its effective mass.

    Units are given for hinges; for slides, replace rad by m.
    """

    chain: SerialChain
    """Kinematics and collision capsules of the links."""
    fastest_rad_s: Floats
    """(N,) maximum velocity that an action can command for each joint [rad/s]."""
    slew_rad_s2: Floats
    """(N,) maximum rate of change of each joint's commanded velocity [rad/s^2]."""
    mass_kg: float
    """Effective mass in a collision without a load [kg]: half the moving mass of an arm (ISO/TS
    15066, A.3), or the total mass of a mobile base."""
    load_kg: Floats
    """(O,) mass of each loose object of the task [kg]."""

    def __post_init__(self) -> None:
        for name in ("fastest_rad_s", "slew_rad_s2"):
            check_shape(
                name, np.shape(getattr(self, name)), (self.chain.n_joints,), "one entry per joint"
            )
