"""Grounds tell truly where a worker can stand: free of furniture, inside the walkable area."""

import numpy as np
import pytest

from hrc_env.motion.generator import OPEN_FLOOR
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.places import SCENES, find_footprints
from hrc_env.world import WORKPLACE_KINDS

BODY_M = 0.2
"""Half the depth of a person [m]."""


def distance_to_blocked(grounds, xy):
    """(N,) from a point to each footprint [m], 0 inside."""
    x, y, half_length, half_width, yaw = grounds.blocked.T
    dx, dy = xy[0] - x, xy[1] - y
    along, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    beyond = np.maximum(np.abs([along, aside]) - [half_length, half_width], 0.0)
    return np.hypot(*beyond)


@pytest.mark.parametrize("clutter", [True, False])
@pytest.mark.parametrize("name", SCENES)
def test_every_workplace_can_be_stood_at(name, clutter):
    grounds = build(SceneConfig(clutter=clutter), name).grounds
    for place in grounds.places:
        assert place.kind in WORKPLACE_KINDS
        for value, (low, high) in zip(
            place.xy_m, (grounds.walkable_x_m, grounds.walkable_y_m), strict=True
        ):
            assert low <= value <= high, place
        assert distance_to_blocked(grounds, place.xy_m).min(initial=9.0) > BODY_M, place
        away = np.subtract(place.xy_m, grounds.robot_xy_m)
        assert np.hypot(*away) > grounds.robot_clearance_m, place


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_has_work_of_every_kind(name):
    places = build(SceneConfig(), name).grounds.places
    assert {place.kind for place in places} == set(WORKPLACE_KINDS) - {"task"}
    assert len({place.name for place in places}) == len(places)


def test_the_laboratory_is_the_one_that_the_worker_knows():
    grounds, floor = build().grounds, OPEN_FLOOR
    assert (grounds.walkable_x_m, grounds.walkable_y_m) == (floor.walkable_x_m, floor.walkable_y_m)
    assert grounds.robot_xy_m == floor.robot_xy_m
    assert grounds.robot_clearance_m == floor.robot_clearance_m


def test_without_clutter_nothing_blocks_the_way():
    assert len(build(SceneConfig(clutter=False)).grounds.blocked) == 0


def test_a_footprint_is_where_its_box_stands():
    scene = build()
    cart = scene.model.geom("tool_cart").id
    near = find_footprints(scene.obstacles, scene.grounds.robot_xy_m)
    row = near[np.argmin(np.hypot(*(near[:, :2] - scene.model.geom_pos[cart, :2]).T))]
    np.testing.assert_allclose(row, [-2.42, -2.02, 0.33, 0.22, 0.12], atol=1e-9)
