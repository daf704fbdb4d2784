"""Parts of a body that cannot yield: against a table, a wall, another link of the robot."""

import numpy as np
import pytest

from hrc_env.core.typing import Vector3
from hrc_env.geometry import shapes
from hrc_env.safety.clamping import Installation, is_clamped

DOWN, RADIUS_M, GAP_M = np.array([0.0, 0.0, -1.0]), 0.05, 0.1
TABLE = shapes.shape(shapes.BOX, np.array([0.0, 0.0, 0.7]), np.eye(3), np.array([0.5, 0.3, 0.02]))[
    None
]
FLOOR = shapes.shape(shapes.PLANE, np.zeros(3), np.eye(3), np.array([np.inf, np.inf, 0.0]))[None]
NOTHING = np.zeros((0, shapes.WIDTH))


def rods(*ends):
    """(K, WIDTH) capsules of a robot 4 cm thick, far away if nothing is given."""
    table = np.empty((len(ends), shapes.WIDTH))
    shapes.set_capsules(table, 0, np.array(ends, float).reshape(-1, 2, 3), np.full(len(ends), 0.04))
    return table


def pressed(centre, direction=DOWN, obstacles=TABLE, robot=NOTHING, links=(), link=0):
    """Whether a part with its axis at a place would be clamped."""
    installation = Installation(obstacles, robot, np.array(links, np.int64))
    n = np.asarray(direction, float) / np.linalg.norm(direction)
    return is_clamped(installation, link, Vector3(*centre), n, RADIUS_M + GAP_M)


@pytest.mark.parametrize(
    ("centre", "direction", "clamped"),
    [
        ((0.0, 0.0, 0.77), DOWN, True),  # it lies on the table
        ((0.0, 0.0, 0.71), DOWN, True),  # its axis is in the table
        ((0.0, 0.0, 0.86), DOWN, True),  # 9 cm above the table
        ((0.0, 0.0, 0.88), DOWN, False),  # 11 cm
        ((0.0, 0.0, 0.77), -DOWN, False),  # it is lifted
        ((0.0, 0.0, 0.77), (1, 0, 0), False),  # it slides along the table
        ((0.6, 0.0, 0.77), DOWN, False),  # beside the table
        ((-0.6, 0.0, 0.7), (1, 0, 0), True),  # against its edge
        ((0.0, 0.0, 0.60), -DOWN, True),  # from below
    ],
)
def test_a_hand_on_a_table_is_clamped_and_in_free_air_it_is_not(centre, direction, clamped):
    assert pressed(centre, direction) == clamped


def test_against_the_floor_and_a_wall():
    assert pressed((0.0, 0.0, 0.1), obstacles=FLOOR)
    assert not pressed((0.0, 0.0, 0.4), obstacles=FLOOR)
    assert not pressed((0.0, 0.0, 0.1), (1, 0, 0), obstacles=FLOOR)


def test_between_two_links_and_not_between_parts_of_one():
    robot = rods([(-0.2, 0, 1.2), (0.2, 0, 1.2)], [(-0.2, 0, 0.9), (0.2, 0, 0.9)])
    between = {"centre": (0.0, 0.0, 1.03), "obstacles": NOTHING, "robot": robot}
    assert pressed(**between, links=(4, 2), link=4)
    assert pressed(**between, direction=-DOWN, links=(4, 2), link=2)
    assert not pressed(**between, links=(4, 4), link=4)
    assert not pressed(**between | {"centre": (0.0, 0.0, 1.2)}, links=(4, 2), link=4)
    assert not pressed(**between, direction=(0, 1, 0), links=(4, 2), link=4)
