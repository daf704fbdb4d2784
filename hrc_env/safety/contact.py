"""Power and force limiting: what a touch may be like, by the region of the body that is touched.

ISO/TS 15066:2016, Annex A, Tables A.2 and A.3 (now in ISO 10218-2:2025), as open literature has
them. Verify against the standard before certification. Forces, not pressures: these hang on edges.

Model (A.3.6): two masses and the region's spring, F = v sqrt(mu k), 1 / mu = 1 / m_H + 1 / m_R. Of
a robot that is bolted down m_R = M / 2 + m_L: half of its moving parts, and its load.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.typing import Floats


@dataclass(frozen=True, slots=True)
class BodyRegion:
    """What a region of the body bears, and how it gives."""

    name: str
    quasi_static_n: float
    """Force at which it may be clamped [N]."""
    stiffness_n_m: float
    """Its spring [N/m]."""
    mass_kg: float
    """Its effective mass [kg]."""
    is_touched: bool = True
    """Whether it may be hit at all; the head never."""

    @property
    def transient_n(self) -> float:
        """Greatest force of a hit it can give way to [N]: twice as much, or none."""
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
"""By name."""
SEGMENT_REGIONS: tuple[str, ...] = (
    "skull and forehead", "chest", "back and shoulders", "pelvis",
    *2 * ("upper arm and elbow",), *2 * ("lower arm and wrist",), *2 * ("thigh and knee",),
    *4 * ("lower leg",), *2 * ("hand and fingers",),
)  # fmt: skip
"""Of each segment of an estimated body (`core.skeleton.SEGMENT_RADIUS_M`); of several regions the
one that bears least."""


def region_called(name: str) -> BodyRegion:
    """A region by its name, or a `ConfigError`."""
    if name not in REGIONS:
        raise unknown("region of the body", name, REGIONS)
    return REGIONS[name]


def effective_mass(moving_kg: Any, load_kg: Any = 0.0) -> Floats:
    """m_R [kg] of a robot that is bolted down: half of its moving parts, and its load."""
    moving, load = np.asarray(moving_kg, float), np.asarray(load_kg, float)
    if not ((moving > 0.0).all() and (load >= 0.0).all()):
        raise ConfigError(
            "moving_kg must be positive and load_kg not be negative, "
            f"got {moving_kg} and {load_kg} kg."
        )
    return 0.5 * moving + load


def contact_force(region: str, relative_m_s: Any, robot_kg: Any) -> Floats:
    """F = v sqrt(mu k) [N] of a hit at a relative speed [m/s] by an effective mass [kg]."""
    return np.asarray(relative_m_s, float) * _impedance(region_called(region), robot_kg)


def permitted_contact_speed(region: str, robot_kg: Any) -> Floats:
    """v = F_max / sqrt(mu k) [m/s]: the greatest relative speed of a hit by an effective mass [kg]
    that the region bears; 0 where it may not be hit."""
    found = region_called(region)
    return found.transient_n / _impedance(found, robot_kg)


def _impedance(region: BodyRegion, robot_kg: Any) -> Floats:
    """sqrt(mu k) [Ns/m]."""
    mass_kg = np.asarray(robot_kg, float)
    if not (mass_kg > 0.0).all():
        raise ConfigError(f"robot_kg must be a positive mass [kg], got {robot_kg}.")
    return np.sqrt(region.stiffness_n_m / (1.0 / region.mass_kg + 1.0 / mass_kg))
