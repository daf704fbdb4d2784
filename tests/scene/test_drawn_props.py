"""Props are drawn where hands hold them and nowhere else; physics does not know them."""

import copy
import itertools

import mujoco
import numpy as np
import pytest

from hrc_env.core.records import Held
from hrc_env.scene.build import build, drawing_model, find_visuals
from hrc_env.scene.primitives import DECORATION
from hrc_env.scene.worker_visuals import PARKED_M, show_props
from hrc_env.worker.props import BOUNDS_M, PROP_NAMES

SCENE = build(n_workers=2)


@pytest.fixture
def drawn():
    model = copy.copy(drawing_model(SCENE))
    return model, mujoco.MjData(model)


def drawn_rows():
    """(n,) mocap rows of all things."""
    rows = find_visuals(SCENE).props
    return np.sort(rows[rows >= 0])


def test_physics_has_the_workers_bodies_only():
    assert SCENE.model.nmocap == SCENE.worker_mocap.size
    assert drawn_rows().min() == SCENE.model.nmocap


def test_what_is_not_held_is_under_the_floor(drawn):
    model, data = drawn
    rows = drawn_rows()
    np.testing.assert_allclose(data.mocap_pos[rows], [PARKED_M] * rows.size)
    nothing = Held(np.zeros(2, int), np.ones((2, 3)), np.ones((2, 4)))
    show_props(model, data, find_visuals(SCENE).props, nothing)
    assert (data.mocap_pos[rows][:, 2] < -10).all()


def test_what_is_held_is_where_the_record_says_and_is_put_away_after(drawn):
    model, data = drawn
    rows, quaternion = find_visuals(SCENE).props, np.array([[1.0, 0, 0, 0], [0, 0, 0, 1.0]])
    kinds = np.array([PROP_NAMES.index("saw"), PROP_NAMES.index("box")])
    show_props(model, data, rows, Held(kinds, np.array([[1.0, 2, 3], [4, 5, 6]]), quaternion))
    assert (data.mocap_pos[drawn_rows()][:, 2] > 0).sum() == 2
    seen = model.geom_bodyid[model.geom_group == DECORATION]
    assert {model.body(body).name for body in seen} >= {"worker_1/saw", "worker_1/box"}
    assert "worker_2/saw" not in {model.body(body).name for body in seen}
    np.testing.assert_array_equal(data.mocap_pos[rows[0, kinds[1] - 1]], [4, 5, 6])
    np.testing.assert_array_equal(data.mocap_quat[rows[0, kinds[1] - 1]], quaternion[1])
    show_props(model, data, rows, None)
    assert (data.mocap_pos[drawn_rows()][:, 2] < 0).all()


def test_all_that_lies_about_is_drawn_beside_what_everybody_holds(drawn):
    """Two workers, each with a box, while both boxes of the laboratory lie there: four of them."""
    model, data = drawn
    box, places = PROP_NAMES.index("box"), np.arange(12.0).reshape(4, 3)
    boxes = Held(np.full(4, box), places, np.tile([1.0, 0, 0, 0], (4, 1)))
    show_props(model, data, find_visuals(SCENE).props, boxes)
    shown = data.mocap_pos[drawn_rows()]
    np.testing.assert_array_equal(shown[shown[:, 2] > 0], places)


def outermost(model, geom):
    """(n, 3) points of a geom that reach as far as it does, its own frame [m]."""
    mesh = model.geom_dataid[geom]
    if mesh >= 0:
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return model.mesh_vert[first : first + count]
    centre, half = np.split(model.geom_aabb[geom], 2)
    return centre + half * np.array(list(itertools.product((-1, 1), repeat=3)))


@pytest.mark.parametrize("name", PROP_NAMES[1:])
def test_a_prop_looks_as_large_as_it_is(drawn, name):
    """The drawn geoms fill the box round the shapes that hide: within 5 cm on every side."""
    model, _ = drawn
    body = model.body(f"worker_1/{name}")
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    for geom in range(body.geomadr[0], body.geomadr[0] + body.geomnum[0]):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        corners = model.geom_pos[geom] + outermost(model, geom) @ turn.reshape(3, 3).T
        lowest = np.minimum(lowest, corners.min(0))
        highest = np.maximum(highest, corners.max(0))
    expected = BOUNDS_M[PROP_NAMES.index(name)]
    np.testing.assert_allclose([lowest, highest], expected, atol=0.05)
