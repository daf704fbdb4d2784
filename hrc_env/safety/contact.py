"""Power and force limiting: contact limits for each region of the body.

The limits are those of ISO/TS 15066:2016, Annex A, Tables A.2 and A.3 (now in ISO 10218-2:2025), as
cited in open literature. Verify them against the standard before certification. Contact pressure,
which depends on the shape of edges, is not modelled.

The model (A.3.6) consists of two masses and the spring of the body region: F = v sqrt(mu k) with 1
/ mu = 1 / m_H + 1 / m_R, at the relative speed v. In a transient contact the region recoils. If the
robot clamps it against something, it cannot: then mu = m_R, v is the speed of the robot alone, and
the limit is that of a quasi-static contact, half of the transient one. Only the first impact is
modelled, not the force of a robot that keeps pressing.

Shields and incidents take m_R from the robot's mass matrix (`geometry.inertia`). For a fixed-base
robot, the standard has a rule without pose and direction (`effective_mass`): m_R = M / 2
+ m_L, with the mass M of its moving parts and that of its load.

`BodyRegion.min_gap_m` is the gap that avoids the crushing of a part of the body (ISO 13854:2017,
Table 1, as cited in open literature).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.kernels import kernel
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
    min_gap_m: float
    """Gap to something fixed behind the region below which the region can be clamped [m]."""
    is_touched: bool = True
    """Whether contact with the region is permitted; False for the head."""

    @property
    def transient_n(self) -> float:
        """Maximum force of a transient contact [N]: twice the quasi-static one; 0 for the head."""
        return 2.0 * self.quasi_static_n * self.is_touched


REGIONS: dict[str, BodyRegion] = {
    region.name: region
    for region in (
        BodyRegion("skull and forehead", 130, 150e3, 4.4, 0.3, False),
        BodyRegion("face", 65, 75e3, 4.4, 0.3, False),
        BodyRegion("neck", 150, 50e3, 1.2, 0.5),
        BodyRegion("back and shoulders", 210, 35e3, 40, 0.5),
        BodyRegion("chest", 140, 25e3, 40, 0.5),
        BodyRegion("abdomen", 110, 10e3, 40, 0.5),
        BodyRegion("pelvis", 180, 25e3, 40, 0.5),
        BodyRegion("upper arm and elbow", 150, 30e3, 3, 0.12),
        BodyRegion("lower arm and wrist", 160, 40e3, 2, 0.12),
        BodyRegion("hand and fingers", 140, 75e3, 0.6, 0.1),
        BodyRegion("thigh and knee", 220, 50e3, 75, 0.18),
        BodyRegion("lower leg", 130, 60e3, 75, 0.18),
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


class ContactLimits(NamedTuple):
    """Limits and mechanical properties of the capsules of a body, for compiled kernels."""

    transient_n: Floats
    """Maximum force of a transient contact (S,) [N]; 0 for the head."""
    quasi_static_n: Floats
    """Maximum force of a quasi-static contact (S,) [N]; 0 for the head."""
    stiffness_n_m: Floats
    """Spring constant (S,) [N/m]."""
    mobility: Floats
    """Inverse of the effective mass (S,) [1/kg]."""
    min_gap_m: Floats
    """Gap below which the capsule can be clamped (S,) [m]."""


class PermittedSpeeds(NamedTuple):
    """Speeds of a contact that a region of the body tolerates."""

    free_m_s: float
    """Maximum relative speed of a transient contact [m/s]."""
    clamping_m_s: float
    """Maximum speed of a robot that clamps the region [m/s]."""


def make_contact_limits(capsule_names: Sequence[str]) -> ContactLimits:
    """Return the limits of the capsules of a body with these names."""
    regions = [REGIONS[CAPSULE_REGIONS[name]] for name in capsule_names]
    return ContactLimits(
        np.array([region.transient_n for region in regions], float),
        np.array([region.quasi_static_n * region.is_touched for region in regions], float),
        np.array([region.stiffness_n_m for region in regions], float),
        np.array([1.0 / region.mass_kg for region in regions]),
        np.array([region.min_gap_m for region in regions]),
    )


@kernel
def find_permitted_speeds(limits: ContactLimits, s: int, mobility: float) -> PermittedSpeeds:
    """Return the speeds of a contact with a capsule of a body that its region tolerates.

    Both are 0 if no contact is permitted.

    Args:
        limits: limits of the capsules.
        s: index of the capsule.
        mobility: inverse of the effective mass of the robot [1/kg].
    """
    stiffness = limits.stiffness_n_m[s]
    free = math.sqrt((limits.mobility[s] + mobility) / stiffness)
    clamping = math.sqrt(mobility / stiffness)
    return PermittedSpeeds(limits.transient_n[s] * free, limits.quasi_static_n[s] * clamping)


def effective_mass(moving_kg: ArrayLike, load_kg: ArrayLike = 0.0) -> Floats:
    """Return the effective mass m_R of a fixed-base robot by the standard's rule [kg].

    It is half its moving mass plus its load.

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


def clamping_force(region: str, robot_m_s: ArrayLike, robot_kg: ArrayLike) -> Floats:
    """Return the force of the impact of a robot that clamps a region, F = v sqrt(m_R k) [N].

    Args:
        region: name of the region of the body.
        robot_m_s: speed of the robot [m/s].
        robot_kg: effective mass of the robot [kg].

    Raises:
        ConfigError: no region has this name, or a mass is not positive.
    """
    stiffness_n_m = find_region(region).stiffness_n_m
    return np.asarray(robot_m_s, float) * np.sqrt(stiffness_n_m * _check_mass(robot_kg))


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
    return np.sqrt(region.stiffness_n_m / (1.0 / region.mass_kg + 1.0 / _check_mass(robot_kg)))


def _check_mass(robot_kg: ArrayLike) -> Floats:
    """Return masses as an array; raise `ConfigError` if one is not positive."""
    mass_kg = np.asarray(robot_kg, float)
    if not (mass_kg > 0.0).all():
        raise ConfigError(f"robot_kg must be a positive mass [kg], got {robot_kg}.")
    return mass_kg
