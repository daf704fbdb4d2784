"""Ways over the floor, straight and round corners."""

import math

import numpy as np
import pytest
from recorded import begin, standing, started, watched

from hrc_env.motion import state as st
from hrc_env.motion.paths import average_heading, lay_path, locate_on_path
from hrc_env.motion.points import Point
from hrc_env.motion.walk import brake, plan_walk
from hrc_env.worker.body import SEGMENT

CORNERS = np.array([[2.0, 0.0, 0.6], [2.0, 2.0, 0.6], [4.0, 2.0, 0.3]])
END = Point(4.0, 4.0)


def laid(via=CORNERS, end=END):
    me = np.zeros(1, st.WORKER)[0]
    lay_path(Point(0.0, 0.0), via, Point(*end), me)
    return me


def test_metres_along_a_path_are_metres():
    me = laid()
    s = np.linspace(0.0, me["length"], 4001)
    points = np.array([locate_on_path(each, me) for each in s])
    np.testing.assert_allclose(points[0], (0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(points[-1], END, atol=1e-9)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(steps, s[1], rtol=1e-4)
    cut = (2 * 0.6 + 2 * 0.6 + 2 * 0.3) - (0.6 + 0.6 + 0.3) * math.pi / 2
    assert me["length"] == pytest.approx(8.0 - cut)
    assert me["sharpest"] == pytest.approx(1 / 0.3)


def test_who_walks_round_a_corner_turns_smoothly_and_in_time():
    me = laid(np.array([[2.0, 0.0, 0.5]]), (2.0, 3.0))
    yaw = np.array([average_heading(s, me) for s in np.arange(0.0, me["length"], 0.01)])
    assert yaw[0] == pytest.approx(0.0)
    assert yaw[-1] == pytest.approx(math.pi / 2)
    assert (np.diff(yaw) >= -1e-12).all()
    assert np.abs(np.diff(yaw, 2)).max() < 1.1e-4 / (2 * 0.3) / 0.5  # its rate has no jump


def test_corners_too_near_each_other_share_the_way_between_them():
    me = laid(np.array([[0.3, 0.0, 9.0], [0.3, 0.3, 9.0], [0.6, 0.3, 9.0]]), (0.6, 0.6))
    points = np.array([locate_on_path(s, me) for s in np.linspace(0, me["length"], 200)])
    np.testing.assert_allclose(points[-1], (0.6, 0.6), atol=1e-9)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 0.01


@pytest.mark.parametrize("when_s", [0.1, 1.0, 2.0, 3.3])
def test_a_walker_who_brakes_stands_soon_and_never_jumps(when_s):
    state, rngs = started(1)
    me = standing(state)
    lay_path(Point(0.0, 0.0), np.array([[2.5, 0.0, 0.8]]), Point(2.5, 4.0), me)
    begin(me, st.WALK, plan_walk(0.0, 1.2, me))
    before = watched(state, rngs, 0.01, round(when_s / 0.01))
    me["duration_s"] = brake(when_s, me)
    assert me["duration_s"] < max(when_s, 1.5) + 2.6
    after = watched(state, rngs, 0.01, int((me["duration_s"] - when_s) / 0.01) - 1)
    position = np.concatenate([before.position_world[0], after.position_world[0]])[:, 0]
    assert np.linalg.norm(np.diff(position, axis=0), axis=-1).max() < 0.055
    last = position[-1]
    assert np.linalg.norm(last[0, :2] - (me["end_x"], me["end_y"])) < 0.05
    feet = last[[SEGMENT["left_foot"], SEGMENT["right_foot"]]]
    assert np.linalg.norm(feet[0, :2] - feet[1, :2]) < 0.3  # beside each other
    assert np.abs(after.velocity_world[0, -1]).max() < 0.2
