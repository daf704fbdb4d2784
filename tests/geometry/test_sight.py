"""Lines of sight: a shape hides what lies behind it, and only that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.shapes import BOX, CAPSULE, CYLINDER, PLANE, WIDTH, absent_shape, shape
from hrc_env.geometry.sight import Surroundings, find_hidden, no_surroundings

UPRIGHT = np.eye(3)
EMPTY = (np.zeros((1, 0, WIDTH)), np.zeros((1, 0, 2, 3)), np.zeros(0))
EYE = np.array([[3.0, 0.0, 1.0]])
SOLIDS = {
    "box": shape(BOX, np.array([0.0, 0, 1]), UPRIGHT, np.array([0.1, 0.2, 0.5])),
    "cylinder": shape(CYLINDER, np.array([0.0, 0, 1]), UPRIGHT, np.array([0.2, 0.5, 0])),
    "capsule": shape(CAPSULE, np.array([0.0, 0, 1]), UPRIGHT, np.array([0.2, 0.3, 0])),
    "ball": shape(CAPSULE, np.array([0.0, 0, 1]), UPRIGHT, np.array([0.3, 0.0, 0])),
    "plane": shape(
        PLANE, np.array([0.0, 0, 1]), np.eye(3)[[2, 0, 1]], np.array([0.2, np.inf, 0])
    ),
}  # fmt: skip


def room(*rows):
    return Surroundings(np.array(rows), *EMPTY)


def sees(solid, point, eye=EYE):
    return not find_hidden(room(SOLIDS[solid]), eye, np.array([[point]], float))[0, 0, 0]


@pytest.mark.parametrize("solid", SOLIDS)
def test_a_solid_hides_what_is_behind_it_and_nothing_else(solid):
    assert not sees(solid, (-1, 0, 1))
    assert sees(solid, (1, 0, 1))
    assert sees(solid, (-1, 2, 1))
    assert sees(solid, (-1, 0, 1), eye=np.array([[0.0, 3.0, 3.0]]))
    assert sees(solid, (5, 0, 1))


@pytest.mark.parametrize("solid", SOLIDS)
def test_a_point_that_touches_a_solid_is_not_hidden_by_it(solid):
    assert sees(solid, (-0.02 if solid == "plane" else 0.27, 0, 1))


@pytest.mark.parametrize("solid", [name for name in SOLIDS if name != "plane"])
def test_from_inside_a_solid_only_what_is_inside_is_seen(solid):
    inside = np.array([[0.02, 0.0, 1.0]])
    assert not sees(solid, (1, 0, 1), inside)
    assert sees(solid, (0.05, 0.01, 1.05), inside)


def test_a_plane_is_seen_through_from_behind():
    assert sees("plane", (3, 0, 1), eye=np.array([[-3.0, 0.0, 1.0]]))


def test_a_free_line_of_sight_is_free():
    points = np.random.default_rng(0).uniform(-2, 2, (2, 15, 3))
    assert not find_hidden(no_surroundings(2), np.zeros((4, 3)), points).any()
    assert find_hidden(no_surroundings(2), np.zeros((4, 3)), points[:, :0]).shape == (2, 4, 0)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_points_are_hidden_or_not_whatever_else_is_looked_at(seed):
    """Shapes are sorted out for a whole group of points; alone a point asks all that are near."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform(-2, 2, (1, 20, 1, 3)) + rng.uniform(-0.5, 0.5, (1, 20, 2, 3))
    around = Surroundings(
        np.array(list(SOLIDS.values())),
        np.zeros((len(ends), 0, WIDTH)),
        ends,
        rng.uniform(0.05, 0.3, 20),
    )
    eyes = rng.uniform(-3, 3, (3, 3))
    points = rng.uniform(-2, 2, 3) + rng.uniform(-0.8, 0.8, (1, 15, 3))
    alone = [find_hidden(around, eyes, points[:, j : j + 1]) for j in range(15)]
    np.testing.assert_array_equal(find_hidden(around, eyes, points), np.concatenate(alone, -1))


def test_points_of_another_number_of_environments_are_refused():
    with pytest.raises(ConfigError, match="points_world must have shape"):
        find_hidden(no_surroundings(2), EYE, np.zeros((3, 15, 3)))


@pytest.mark.parametrize("solid", SOLIDS)
def test_what_is_carried_hides_as_what_stands(solid):
    carried = Surroundings(np.zeros((0, WIDTH)), SOLIDS[solid][None, None], *EMPTY[1:])
    points = np.random.default_rng(2).uniform((-4, -1, 0), (-0.5, 1, 2), (1, 40, 3))
    behind = find_hidden(room(SOLIDS[solid]), EYE, points)
    assert 0 < behind.sum() < behind.size
    np.testing.assert_array_equal(find_hidden(carried, EYE, points), behind)


def test_a_shape_that_is_absent_hides_nothing():
    gone = Surroundings(absent_shape()[None], absent_shape()[None, None], *EMPTY[1:])
    points = np.random.default_rng(3).uniform(-3, 3, (1, 60, 3))
    assert not find_hidden(gone, EYE, points).any()
