"""What tasks put beside the robot is where their rules say: MJCF and constants agree."""

import mujoco
import numpy as np
import pytest

from hrc_env.tasks import drywall, handover, pick_place


def compiled(task):
    """The task's MJCF on its own, its origin the middle of the robot's foot."""
    return mujoco.MjModel.from_xml_string(task.make_scene().mjcf)


@pytest.fixture(scope="module")
def drywall_model():
    return compiled(drywall.Drywall())


@pytest.fixture(scope="module")
def handover_model():
    return compiled(handover.Handover())


@pytest.fixture(scope="module")
def pick_place_model():
    return compiled(pick_place.PickPlace())


def loose(model, name):
    """Edges [m], mass [kg] and place [m] of a body whose first geom is a box."""
    body = model.body(name)
    return 2 * model.geom_size[body.geomadr[0]], body.mass[0], body.pos


def top_m(model, name):
    geom = model.geom(name)
    return geom.pos[2] + geom.size[2]


def test_the_board_is_of_its_size_and_lies_on_the_stack(drywall_model):
    edges, mass, at = loose(drywall_model, "board")
    np.testing.assert_allclose(edges, drywall.BOARD_M)
    np.testing.assert_allclose(at, drywall.STACK_M)
    assert mass == pytest.approx(drywall.BOARD_KG)
    under = drywall.STACK_M[2] - drywall.BOARD_M[2] / 2
    assert top_m(drywall_model, "stack") == pytest.approx(under)
    cups = drywall_model.site("board_cups").pos
    np.testing.assert_allclose(cups, [*drywall.CUPS_M, drywall.BOARD_M[2] / 2])


def test_the_board_belongs_before_the_studs(drywall_model):
    place, turn = drywall_model.site("place"), np.zeros(9)
    mujoco.mju_quat2Mat(turn, place.quat)
    np.testing.assert_allclose(place.pos, drywall.PLACE_M)
    np.testing.assert_allclose(turn.reshape(3, 3), drywall.R_PLACE, atol=1e-12)
    for name in ("stud_1", "stud_2", "stud_3", "studs"):
        stud = drywall_model.geom(name)
        assert stud.pos[1] - stud.size[1] == pytest.approx(drywall.WALL_Y_M), name


def test_screws_go_into_the_near_stud(drywall_model):
    stud = drywall_model.geom("stud_3")
    assert stud.pos[0] == pytest.approx(drywall.NEAR_STUD_M)
    along, up = np.transpose(drywall.SCREWS_M)
    assert (np.abs(along - stud.pos[0]) < stud.size[0]).all()
    assert (np.abs(up - stud.pos[2]) < stud.size[2]).all()


def test_the_tool_is_of_its_size_and_stands_on_its_stand(handover_model):
    edges, mass, at = loose(handover_model, "tool")
    np.testing.assert_allclose(edges, handover.BAR_M)
    np.testing.assert_allclose(at - [0, 0, handover.BAR_M[2] / 2], handover.STAND_M)
    assert mass == pytest.approx(handover.BAR_KG)
    assert top_m(handover_model, "stand") == pytest.approx(handover.STAND_M[2])
    handle = handover_model.geom_pos[handover_model.body("tool").geomadr[0] + 1]
    np.testing.assert_allclose(handle, [0, 0, handover.HANDLE_UP_M], atol=1e-12)


def test_pieces_are_of_their_size_and_lie_in_a_row_on_the_table(pick_place_model):
    x, y = pick_place.ROW_AT_M
    for k in range(pick_place.STUDS):
        edges, mass, at = loose(pick_place_model, f"stud_{k + 1}")
        np.testing.assert_allclose(edges, pick_place.STUD_M)
        resting = pick_place.SURFACE_M + pick_place.STUD_M[2] / 2
        np.testing.assert_allclose(at, [x + pick_place.ROW_M * (k - 1), y, resting])
        assert mass == pytest.approx(pick_place.STUD_KG)


def test_table_rack_and_trestle_are_as_high_as_pieces_lie(pick_place_model):
    for name in ("table", "trestle", "bearer_left", "bearer_right"):
        assert top_m(pick_place_model, name) == pytest.approx(pick_place.SURFACE_M), name


def test_places_of_pieces_are_across_the_bearers_of_the_rack(pick_place_model):
    left, right = (pick_place_model.geom(f"bearer_{side}") for side in ("left", "right"))
    for x, y, _ in pick_place.PLACES_M:
        assert abs(x - left.pos[0]) < left.size[0]
        assert y == pytest.approx((left.pos[1] + right.pos[1]) / 2)


def test_the_worker_reaches_over_the_table_and_the_trestle(pick_place_model):
    for name, place in (("table", pick_place.STACK), ("trestle", pick_place.TRESTLE)):
        board, ahead = pick_place_model.geom(name), np.cos(place.yaw_rad) * place.ahead_m
        away = np.abs(np.add(place.xy_m, (ahead, 0.0)) - board.pos[:2])
        assert (away < board.size[:2]).all(), name
