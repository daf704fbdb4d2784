"""Which cameras find people on which of the floor, and what cameras see in common."""

import numpy as np
import pytest

from hrc_env.geometry.cameras import pinhole
from hrc_env.geometry.shapes import WIDTH
from hrc_env.scene.build import build
from hrc_env.scene.places import is_within
from hrc_env.scene.rigs import (
    LEAST_SEEN,
    PIECE_M,
    common_views,
    coverage,
    coverage_of,
    find_visible,
)

NOTHING = np.zeros((0, WIDTH))


def camera(name, eye, target, hfov_deg=60.0):
    return pinhole(name, np.array(eye), np.array(target), hfov_deg, 1920, 1080)


@pytest.mark.parametrize("scene", ["lab", "site"])
def test_pieces_lie_all_over_the_free_floor_and_each_has_the_cameras_that_see_it(scene):
    made_scene = build(name=scene)
    found, grounds = coverage(made_scene), made_scene.grounds
    assert not is_within(found.floor_world, grounds.blocked).any()
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    rng = np.random.default_rng(1)
    free = np.stack([rng.uniform(x0, x1, 500), rng.uniform(y0, y1, 500), np.zeros(500)], 1)
    away_m = np.linalg.norm(free[:, None] - found.floor_world, axis=-1).min(1)
    outside = is_within(free, grounds.blocked)
    outside |= np.linalg.norm(free[:, :2] - grounds.robot_xy_m, axis=1) < grounds.robot_clearance_m
    assert away_m[~outside].max() < 2.5 * PIECE_M
    for k in rng.integers(len(found.group), size=20):
        finds = np.zeros(len(made_scene.cameras), int)
        for height_m in (0.2, 0.6, 1.0, 1.4, 1.8):
            aside = [(0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)]
            points = found.floor_world[k] + [(*each, height_m) for each in aside]
            finds += find_visible(made_scene.cameras, made_scene.obstacles, points).any(1)
        np.testing.assert_array_equal(found.cameras[found.group[k]], finds >= LEAST_SEEN)
    several = found.cameras.sum(1)[found.group] >= 2
    assert several.mean() > (0.99 if scene == "site" else 0.999)


def test_a_camera_finds_people_on_floor_that_it_looks_at():
    eye = (0.0, -3.0, 1.2)
    ahead, behind = camera("ahead", eye, (0.0, 0.0, 1.0)), camera("behind", eye, (0.0, -6.0, 1.0))
    floor = np.array([(0.0, 1.0, 0.0), (0.0, -7.0, 0.0), (6.0, -3.0, 0.0)])
    found = coverage_of((ahead, behind), NOTHING, floor)
    assert found.cameras[found.group].tolist() == [[True, False], [False, True], [False, False]]


def test_cameras_that_look_at_the_same_have_it_in_common_and_others_have_nothing():
    there = (0.0, 0.0, 1.0)
    eyes = {"a": (3.0, 0.0, 2.0), "b": (-3.0, 0.0, 2.0), "c": (0.0, 3.0, 2.0)}
    rig = [camera(name, eye, there) for name, eye in eyes.items()]
    away = camera("away", (3.0, 0.0, 2.0), (9.0, 0.0, 1.0))
    assert [True, True, True] in common_views(tuple(rig)).cameras.tolist()
    assert (common_views(tuple(rig)).cameras.sum(1) > 1).all()
    assert common_views((rig[0], away)).cameras.tolist() == [[False, False]]
    assert common_views((rig[0],)).cameras.tolist() == [[False]]
    assert not common_views((*rig[:2], away)).cameras[:, [0, 2]].all(1).any()
