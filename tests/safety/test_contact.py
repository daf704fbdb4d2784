"""Power and force: the table by region of the body."""

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.enclosure import CAPSULES
from hrc_env.safety.contact import (
    CAPSULE_REGIONS,
    REGIONS,
    clamping_force,
    contact_force,
    effective_mass,
    find_permitted_speeds,
    find_region,
    make_contact_limits,
    permitted_contact_speed,
)

UR5E_KG = 17.0
TABLE = {
    "skull and forehead": (130, 0, 150, 4.4, 0.0),
    "face": (65, 0, 75, 4.4, 0.0),
    "neck": (150, 300, 50, 1.2, 1.31),
    "back and shoulders": (210, 420, 35, 40, 0.85),
    "chest": (140, 280, 25, 40, 0.67),
    "abdomen": (110, 220, 10, 40, 0.83),
    "pelvis": (180, 360, 25, 40, 0.86),
    "upper arm and elbow": (150, 300, 30, 3, 1.16),
    "lower arm and wrist": (160, 320, 40, 2, 1.26),
    "hand and fingers": (140, 280, 75, 0.6, 1.37),
    "thigh and knee": (220, 440, 50, 75, 0.71),
    "lower leg": (130, 260, 60, 75, 0.38),
}
"""Forces clamped and hit [N], stiffness [N/mm], mass [kg], greatest speed of a UR5e [m/s]."""


@pytest.mark.parametrize("name", TABLE)
def test_a_region_is_that_of_the_table(name):
    region, (clamped_n, hit_n, stiffness_n_mm, mass_kg, speed_m_s) = (
        find_region(name),
        TABLE[name],
    )
    assert (region.quasi_static_n, region.transient_n) == (clamped_n, hit_n)
    assert (region.stiffness_n_m, region.mass_kg) == (1e3 * stiffness_n_mm, mass_kg)
    speed = permitted_contact_speed(name, effective_mass(UR5E_KG))
    assert speed == pytest.approx(speed_m_s, abs=0.005 + 1e-9)


def test_no_region_is_left_out():
    assert REGIONS.keys() == TABLE.keys()
    assert set(CAPSULES) == CAPSULE_REGIONS.keys()
    assert set(CAPSULE_REGIONS.values()) <= REGIONS.keys()


def test_a_hit_at_the_permitted_speed_is_the_permitted_force():
    mass_kg = effective_mass(UR5E_KG, np.array([0.0, 5.0]))
    speed = permitted_contact_speed("chest", mass_kg)
    np.testing.assert_allclose(contact_force("chest", speed, mass_kg), 280.0)
    assert speed[1] < speed[0]


@pytest.mark.parametrize("name", CAPSULES)
def test_the_speeds_that_a_shield_permits_are_those_of_the_limits(name):
    region, limits = REGIONS[CAPSULE_REGIONS[name]], make_contact_limits(CAPSULES)
    speeds = find_permitted_speeds(limits, CAPSULES.index(name), 1.0 / 6.0)
    assert speeds.free_m_s == pytest.approx(permitted_contact_speed(region.name, 6.0))
    if not region.is_touched:
        assert speeds == (0.0, 0.0)
        return
    force_n = clamping_force(region.name, speeds.clamping_m_s, 6.0)
    assert force_n == pytest.approx(region.quasi_static_n)
    assert 0.0 < speeds.clamping_m_s < 0.5 * speeds.free_m_s


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: find_region("cheast"), "Did you mean 'chest'"),
        (lambda: effective_mass(-1.0), "moving_kg must be positive"),
        (lambda: effective_mass(1.0, -1.0), "load_kg not be negative"),
        (lambda: contact_force("chest", 1.0, 0.0), "robot_kg must be a positive mass"),
        (lambda: clamping_force("chest", 1.0, -1.0), "robot_kg must be a positive mass"),
    ],
)
def test_what_cannot_be_is_said(ask, said):
    with pytest.raises(ConfigError, match=said):
        ask()
