"""Constant properties of a robot that shields need, in addition to the measured joint state."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import check_shape
from hrc_env.core.typing import Floats, Ints, Transforms
from hrc_env.geometry.chains import SerialChain
from hrc_env.geometry.inertia import LinkInertias, find_mass_matrices
from hrc_env.geometry.shapes import WIDTH


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """A robot's geometry, the limits of its commands, its masses and its fixed surroundings.

    Units are given for hinges; for slides, replace rad by m.
    """

    chain: SerialChain
    """Kinematics and collision capsules of the links."""
    fastest_rad_s: Floats
    """(N,) maximum velocity that an action can command for each joint [rad/s]."""
    slew_rad_s2: Floats
    """(N,) maximum rate of change of each joint's commanded velocity [rad/s^2]."""
    mass_kg: float
    """Effective mass in a collision without a load [kg] by the standard's rule, for any point and
    pose: half the moving mass of an arm (ISO/TS 15066, A.3), or the total mass of a mobile base.
    Built-in shields and infos use `inertias` instead."""
    load_kg: Floats
    """(O,) mass of each loose object of the task [kg]."""
    inertias: LinkInertias
    """Masses and inertias of the links."""
    obstacles: Floats
    """(G, `geometry.shapes.WIDTH`) fixed shapes of the scene, such as floor, walls and tables."""

    def __post_init__(self) -> None:
        for name in ("fastest_rad_s", "slew_rad_s2"):
            check_shape(
                name, np.shape(getattr(self, name)), (self.chain.n_joints,), "one entry per joint"
            )
        n = self.chain.n_joints
        check_shape("inertias.mass_kg", np.shape(self.inertias.mass_kg), (n,), "one per link")
        shape = np.shape(self.obstacles)
        check_shape("obstacles", shape, (*shape[:1], WIDTH), "one row per shape")

    def list_capsule_links(self, n_capsules: int) -> Ints:
        """Return the index of the link (K,) that carries each of a robot's capsules.

        The capsules of loads, which follow those of the links, are carried by the last link.

        Args:
            n_capsules: number K of capsules, including loads.
        """
        links = self.chain.capsule_link
        return np.append(links, np.full(n_capsules - len(links), self.chain.n_joints - 1))

    def invert_mass_matrices(self, frames: Transforms, load_kg: Floats) -> Floats:
        """Return the inverse mass matrices (B, N, N) of robots.

        Args:
            frames: (B, N, 4, 4) poses of the links in the world.
            load_kg: (B,) mass of the load at the tool point [kg].
        """
        matrices = find_mass_matrices(self.chain, self.inertias, frames, load_kg)
        return np.asarray(np.linalg.inv(matrices), float)
