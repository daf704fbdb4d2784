"""Ways round what stands there and round other people."""

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.motion import state as st
from hrc_env.motion.floorplan import BODY_M, count_room, make_floorplan
from hrc_env.motion.paths import locate_on_path
from hrc_env.motion.points import Point
from hrc_env.motion.routes import find_route
from hrc_env.world import Grounds, Workplace

WALL = (2.0, 0.0, 0.1, 1.5, 0.0)
"""Across the straight way from (0, 0) to (4, 0)."""
NOBODY = np.zeros((0, 3))


def grounds(*blocked, places=()):
    return Grounds(
        (-1.0, 5.0), (-3.0, 3.0), np.array(blocked).reshape(-1, 5), places, (-3.0, 0.0), 0.8
    )


def way(plan, start, end, people=NOBODY, bow=0.0):
    """Points of the way every 2 cm; None where there is none."""
    row = np.zeros(1, st.WORKER)[0]
    if not find_route(Point(*start), Point(*end), bow, people, plan.grid, row):
        return None
    return np.array([locate_on_path(s, row) for s in np.arange(0.0, row["length"] + 0.02, 0.02)])


def test_a_free_way_is_nearly_straight_and_bends_as_drawn():
    plan = make_floorplan(grounds())
    lengths = []
    for bow in (-1.0, 0.0, 1.0):
        points = way(plan, (0.0, 0.0), (4.0, 0.0), bow=bow)
        assert np.sign(points[len(points) // 2, 1].round(6)) == bow
        lengths.append(0.02 * len(points))
    assert max(lengths) < 4.2


def test_a_way_round_a_wall_keeps_half_a_body_from_it_and_is_short():
    plan = make_floorplan(grounds(WALL))
    points = way(plan, (0.0, 0.0), (4.0, 0.2))
    dx, dy = np.abs(points - WALL[:2]).T - np.array(WALL[2:4])[:, None]
    away = np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0))
    assert away.min() > BODY_M - 0.04
    shortest = 2 * np.hypot(2.0, 1.5 + BODY_M)
    assert 0.02 * len(points) < 1.1 * shortest


def test_there_is_no_way_through_walls():
    closed = grounds((2.0, 0.0, 0.1, 3.0, 0.0))
    assert way(make_floorplan(closed), (0.0, 0.0), (4.0, 0.0)) is None


def test_ways_go_round_people_who_stand_there():
    plan, person = make_floorplan(grounds()), np.array([[2.0, 0.05, 0.8]])
    points = way(plan, (0.0, 0.0), (4.0, 0.0), person)
    assert np.hypot(*(points - person[0, :2]).T).min() > 0.77


@pytest.mark.parametrize("x", [2.0, 1.75])
def test_a_place_inside_a_wall_or_at_its_edge_is_refused(x):
    place = Workplace("blocked", "wall", (x, 0.0), 0.0, 1.2)
    with pytest.raises(ConfigError, match="'blocked'"):
        make_floorplan(grounds(WALL, places=(place,)))


def test_grounds_without_room_are_refused():
    with pytest.raises(ConfigError, match="no room"):
        make_floorplan(grounds((2.0, 0.0, 9.0, 9.0, 0.0)))


def test_more_workers_fit_where_there_is_more_room():
    plan = make_floorplan(grounds())
    assert count_room(plan, 1.0) > count_room(plan, 2.0) > 4
