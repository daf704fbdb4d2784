"""Speed and separation: the table of the open literature."""

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.safety.separation import protective_distance

TABLE_M = {
    0.00: (0.65, 0.71, 0.78, 0.90),
    0.05: (0.70, 0.76, 0.83, 0.95),
    0.10: (0.75, 0.81, 0.88, 1.00),
    0.20: (0.85, 0.91, 0.98, 1.10),
}
"""By Z_d, of robots at `SPEEDS_M_S`; v_h 1.6, T_r 0.1, T_s 0.3, C 0, Z_r 0.01."""
SPEEDS_M_S = np.array([0.0, 0.25, 0.5, 1.0])


@pytest.mark.parametrize("z_d_m", TABLE_M)
def test_the_protective_distance_is_that_of_the_table(z_d_m):
    found = protective_distance(
        SPEEDS_M_S, reaction_s=0.1, stopping_s=0.3, human_uncertainty_m=z_d_m,
        robot_uncertainty_m=0.01,
    )  # fmt: skip
    np.testing.assert_allclose(found, TABLE_M[z_d_m], atol=0.005 + 1e-9)


def test_late_eyes_cost_what_both_travel_meanwhile():
    on_time, late = (
        protective_distance(0.5, reaction_s=0.1 + late_s, stopping_s=0.3) for late_s in (0.0, 0.1)
    )
    assert late - on_time == pytest.approx(0.16 + 0.1 * 0.5)


def test_who_goes_away_is_no_nearer():
    speeds = {"reaction_s": 0.1, "stopping_s": 0.3, "intrusion_m": 0.1}
    assert protective_distance(-1.0, -2.0, **speeds) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"reaction_s": -0.1}, "reaction_s must be a number that is not negative, got -0.1"),
        ({"stopping_s": np.nan}, "stopping_s must be a number"),
        ({"human_uncertainty_m": [0.1, -0.1]}, "human_uncertainty_m must be"),
    ],
)
def test_what_cannot_be_is_said(wrong, said):
    with pytest.raises(ConfigError, match=said):
        protective_distance(0.5, **{"reaction_s": 0.1, "stopping_s": 0.3, **wrong})
