"""Power and force limiting: contact limits for each region of the body.

The limits are those of ISO/TS 15066:2016, Annex A, Tables A.2 and A.3 (now in ISO 10218-2:2025), as
cited in open literature. Verify them against the standard before certification. Contact pressure,
which depends on the shape of edges, is not modelled.

The model (A.3.6) consists of two masses and the spring of the body region: F = v sqrt(mu k) with 1
/ mu = 1 / m_H + 1 / m_R. For a fixed-base robot, m_R = M / 2 + m_L is half the mass of its moving
parts plus its load.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.typing import Floats


@dataclass(frozen=True, slots=True)
class BodyRegion:
    """Limits and mechanical properties of a region of the body."""

    name: str
    """Name of the region."""
    quasi_static_n: float
    """Maximum permitted clamping force [N]."""
    stiffness_n_m: float
    """Spring constant of the region [N/m]."""
    mass_kg: float
    """Effective mass of the region [kg]."""
    is_touched: bool = True
    """Whether contact with the region is permitted; False for the head."""

    @property
    def transient_n(self) -> float:
        """Maximum force of a transient contact [N]: twice the quasi-static one; 0 for the head."""
        return 2.0 * self.quasi_static_n * self.is_touched


REGIONS: dict[str, BodyRegion] = {
    region.name: region
    for region in (
        BodyRegion("skull and forehead", 130, 150e3, 4.4, False),
        BodyRegion("face", 65, 75e3, 4.4, False),
        BodyRegion("neck", 150, 50e3, 1.2),
        BodyRegion("back and shoulders", 210, 35e3, 40),
        BodyRegion("chest", 140, 25e3, 40),
        BodyRegion("abdomen", 110, 10e3, 40),
        BodyRegion("pelvis", 180, 25e3, 40),
        BodyRegion("upper arm and elbow", 150, 30e3, 3),
        BodyRegion("lower arm and wrist", 160, 40e3, 2),
        BodyRegion("hand and fingers", 140, 75e3, 0.6),
        BodyRegion("thigh and knee", 220, 50e3, 75),
        BodyRegion("lower leg", 130, 60e3, 75),
    )
}
"""Regions of the body, by name."""
_SIDED = {
    "shoulder": "back and shoulders",
    "upper_arm": "upper arm and elbow",
    "forearm": "lower arm and wrist",
    "thigh": "thigh and knee",
    "shank": "lower leg",
    "foot": "lower leg",
    "hand": "hand and fingers",
}
CAPSULE_REGIONS: dict[str, str] = {
    "head": "skull and forehead",
    "neck": "neck",
    "chest": "chest",
    "torso": "chest",
    "abdomen": "abdomen",
    "pelvis": "pelvis",
    **{f"{side}_{part}": region for part, region in _SIDED.items() for side in ("left", "right")},
}
"""Region of the body to which each capsule belongs, by the name of the capsule
(`worker.body.Body.capsule_names`)."""


def find_region(name: str) -> BodyRegion:
    """Return the region of the body with a given name; raise `ConfigError` if there is none."""
    if name not in REGIONS:
        raise make_unknown_name_error("region of the body", name, REGIONS)
    return REGIONS[name]


def effective_mass(moving_kg: ArrayLike, load_kg: ArrayLike = 0.0) -> Floats:
    """Return the effective mass m_R of a fixed-base robot [kg]: half its moving mass plus its load.

    Args:
        moving_kg: mass of the robot's moving parts [kg].
        load_kg: mass of its load [kg].

    Raises:
        ConfigError: a mass is negative, or the moving mass is zero.
    """
    moving, load = np.asarray(moving_kg, float), np.asarray(load_kg, float)
    if not ((moving > 0.0).all() and (load >= 0.0).all()):
        raise ConfigError(
            "moving_kg must be positive and load_kg not be negative, "
            f"got {moving_kg} and {load_kg} kg."
        )
    return 0.5 * moving + load


def contact_force(region: str, relative_m_s: ArrayLike, robot_kg: ArrayLike) -> Floats:
    """Return the force of a transient contact, F = v sqrt(mu k) [N].

    Args:
        region: name of the region of the body.
        relative_m_s: relative speed of robot and body [m/s].
        robot_kg: effective mass of the robot [kg].

    Raises:
        ConfigError: no region has this name, or a mass is not positive.
    """
    return np.asarray(relative_m_s, float) * _impedance(find_region(region), robot_kg)


def permitted_contact_speed(region: str, robot_kg: ArrayLike) -> Floats:
    """Return the maximum relative speed of a transient contact, v = F_max / sqrt(mu k) [m/s].

    It is 0 if no contact with the region is permitted.

    Args:
        region: name of the region of the body.
        robot_kg: effective mass of the robot [kg].

    Raises:
        ConfigError: no region has this name, or a mass is not positive.
    """
    body_region = find_region(region)
    return body_region.transient_n / _impedance(body_region, robot_kg)


def _impedance(region: BodyRegion, robot_kg: ArrayLike) -> Floats:
    """Return sqrt(mu k), the ratio of contact force to relative speed [Ns/m]."""
    mass_kg = np.asarray(robot_kg, float)
    if not (mass_kg > 0.0).all():
        raise ConfigError(f"robot_kg must be a positive mass [kg], got {robot_kg}.")
    return np.sqrt(region.stiffness_n_m / (1.0 / region.mass_kg + 1.0 / mass_kg))
