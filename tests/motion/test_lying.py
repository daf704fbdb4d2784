"""Loads lie somewhere before they are taken up and after they are laid down."""

import copy
from collections import Counter

import mujoco
import numpy as np
import pytest

from hrc_env.core.batching import copy_arrays
from hrc_env.core.errors import ConfigError
from hrc_env.motion import generator, lying
from hrc_env.motion import state as st
from hrc_env.motion.activities.going import CART_AHEAD_M
from hrc_env.motion.points import Place
from hrc_env.motion.schedule import WORK, Job
from hrc_env.scene.build import build, drawing_model
from hrc_env.scene.worker_visuals import PARKED_M
from hrc_env.worker.body import load_body
from hrc_env.worker.props import BOUNDS_M, PROP_NAMES
from hrc_env.world import Workplace

BOARD, BOX, STUD = map(PROP_NAMES.index, ("board", "box", "stud"))
PILE = Workplace("pile", "pile", (1.4, 0.9), 0.6, 0.4, loads=("box", "box"))
SPOT = lying.get_place(PILE)


def started(batch, n_workers=1, seed=0, grounds=None, **settings):
    """Workers who never go to the robot, on the laboratory's floor."""
    config = generator.MotionConfig(**({"near_probability": 0.0} | settings))
    grounds = grounds or build().grounds
    state = generator.make_state(batch, n_workers, load_body(), config, grounds)
    rngs = [np.random.default_rng([seed, b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    return state, rngs


def loads_of(motion, b):
    """Kinds (n,) and places (n, 3) of the loads in an environment, held or lying."""
    is_load = np.isin(motion.held.kind[b], (BOARD, BOX, STUD, PROP_NAMES.index("cart")))
    return motion.held.kind[b][is_load], motion.held.position_world[b][is_load]


@pytest.mark.parametrize(("scene", "n_workers"), [("lab", 2), ("site", 3)])
def test_no_load_appears_vanishes_or_jumps(scene, n_workers):
    state, rngs = started(4, n_workers, 3, build(name=scene).grounds)
    before, taken = [loads_of(generator.current(state), b) for b in range(4)], 0
    for _ in range(1000):
        _, motion = generator.advance(state, rngs, 0.04, 1)
        taken += (state.workers["activity"] == st.PICK_UP).sum()
        for b in range(4):
            kinds, places = loads_of(motion, b)
            assert Counter(kinds.tolist()) == Counter(before[b][0].tolist())
            for kind, place in zip(kinds, places, strict=True):
                same = before[b][1][before[b][0] == kind]
                assert np.linalg.norm(same - place, axis=1).min() < 0.1
            before[b] = kinds, places
    assert taken > 100


@pytest.mark.parametrize("scene", ["lab", "site"])
def test_what_lies_there_at_first_rests_on_what_is_drawn(scene):
    """Rays straight down from below each lowest load: what they meet is there, and not above."""
    place = build(name=scene, n_workers=1)
    model = copy.copy(drawing_model(place))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    groups, geom = np.array([1, 1, 0, 0, 0, 0], np.uint8), np.zeros(1, np.int32)
    down = np.array([0.0, 0.0, -1.0])
    rows = lying.make_loads(place.grounds.places, WORK["framing"])
    assert len(rows) > 4
    for row in rows:
        if (
            rows["pose"][lying._find_overlapping(int(row["shown"][0]), row["pose"], rows), 2].min()
            < (row["pose"][2])
        ):
            continue
        (low, high), yaw = BOUNDS_M[int(row["shown"][0])], row["pose"][3]
        cos, sin, gaps_m = np.cos(yaw), np.sin(yaw), []
        for ahead in np.linspace(0.1, 0.9, 3):
            for aside in np.linspace(0.02, 0.98, 25):
                x, y = low[:2] + np.array([ahead, aside]) * (high - low)[:2]
                above = np.array([cos * x - sin * y, sin * x + cos * y, low[2] + 0.1])
                spot = row["pose"][:3] + above
                way = mujoco.mj_ray(model, data, spot, down, groups, 1, -1, geom)
                gaps_m.append(way - 0.1)
        assert -0.011 < min(gaps_m) < 0.01, (row["pose"], min(gaps_m))
    assert data.mocap_pos[-1, 2] == PARKED_M[2]  # nothing of it is in the way of the rays


@pytest.mark.parametrize("scene", ["lab", "site"])
def test_carts_stand_where_hands_take_them(scene):
    carts = [place for place in build(name=scene).grounds.places if place.kind == "cart"]
    assert {place.ahead_m for place in carts} == {CART_AHEAD_M}


def test_loads_lie_on_each_other_and_the_uppermost_is_taken_first():
    rows = lying.make_loads((PILE,), ())
    np.testing.assert_allclose(rows["pose"][:, 2], [0.55, 0.85])
    assert lying.find_uncovered(rows).tolist() == [False, True]
    third = lying.find_rest_pose(BOX, "pile", SPOT, PILE.ahead_m, rows)
    assert third[2] == pytest.approx(1.15)
    assert list(lying.list_stands(rows, BOX, "pile")) == [SPOT]
    assert not list(lying.list_stands(rows, BOX, "bench"))
    assert not list(lying.list_stands(rows, BOARD, "pile"))
    lying.remove_load(rows, 1)
    assert lying.find_uncovered(rows).tolist() == [True, False]


def test_boards_are_put_flat_to_a_wall_below_each_other_and_stand_elsewhere_on_the_floor():
    spot = Place(0.0, 0.0, 0.0, 1.4)
    rows = np.zeros(2, lying.LOAD)
    first = lying.find_rest_pose(BOARD, "wall", spot, 0.65, rows)
    np.testing.assert_allclose(first, [0.631, 0.0, 1.2, 0.0, np.pi / 2, 0.0])
    rows["shown"][0, 0], rows["pose"][0] = BOARD, first
    second = lying.find_rest_pose(BOARD, "wall", spot, 0.65, rows)
    assert second[2] == pytest.approx(1.2 - 0.089)
    assert lying.find_rest_pose(BOX, "", spot, 0.43, rows[1:])[2] == pytest.approx(0.15)


def test_loads_beside_each_other_do_not_lie_on_each_other_however_they_are_turned():
    rows = np.zeros(1, lying.LOAD)
    rows["shown"][0, 0], rows["pose"][0] = BOARD, (0.0, 0.0, 0.7, 0.5 * np.pi, 0.0, 0.0)
    over = np.array([1.0, 0.0, 0.0, 0.6, 0.0, 0.0])
    assert lying._find_overlapping(BOX, over, rows).all()
    assert not lying._find_overlapping(
        BOX, over + np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0]), rows
    ).any()


def test_what_lies_about_does_not_depend_on_other_environments_and_comes_back_with_the_state():
    many, few = (started(n, 3, 3, build(name="site").grounds) for n in (3, 1))
    at_first = many[0].loads.copy()
    for _ in range(500):
        for state, rngs in (many, few):
            generator.advance(state, rngs, 0.04, 1)
    np.testing.assert_array_equal(many[0].loads[:1], few[0].loads)
    state, rngs = copy_arrays(few[0]), copy_arrays(few[1])
    for _ in range(500):
        later = [generator.advance(*each, 0.04, 1)[1].held for each in (few, (state, rngs))]
        np.testing.assert_array_equal(later[0].position_world, later[1].position_world)
    assert (state.loads["pose"] != at_first["pose"][:1]).any()


def test_an_episode_begins_with_whole_piles_a_little_off_their_places():
    state, rngs = started(2, seed=7)
    first = state.loads.copy()
    for _ in range(800):
        generator.advance(state, rngs, 0.04, 1)
    generator.reset(state, np.array([1]), rngs)
    kinds = state.loads["shown"][1, :, 0]
    assert sorted(kinds) == sorted(first["shown"][1, :, 0])
    moved = state.loads["pose"][1, : len(state.mind.loads)] - state.mind.loads["pose"]
    assert 0.0 < np.abs(moved[:, :2]).max() <= lying.MOVED_M


def test_where_a_job_takes_up_what_no_place_has_one_lies_at_the_first():
    jobs = (Job("work", "reach", "robot"), Job("lift it", "pick up", "floor", prop="board"))
    places = (Workplace("here", "floor", (1.0, 0.0), 0.0, 0.0), PILE)
    rows = lying.make_loads(places, jobs)
    assert rows["shown"][:, 0].tolist() == [BOARD, BOX, BOX]


def test_who_is_to_pick_up_where_nothing_lies_looks_round_and_who_brings_wheels_leaves_them():
    jobs = (
        Job("work", "reach", "robot", (("look for it", 1.0),)),
        Job("look for it", "pick up", "here", (("bring it", 1.0),), 0.0, "board"),
        Job("bring it", "look round", "open", (("work", 1.0),), 0.0, "wheelbarrow", "push"),
    )
    settings = {"jobs": jobs, "near_probability": 1.0, "dwell_s": (60.0, 60.0)}
    state, rngs = started(2, 1, 1, generator.OPEN_FLOOR, **settings)
    doing, n_there = set(), []
    for _ in range(1500):
        _, motion = generator.advance(state, rngs, 0.04, 1)
        doing |= set(generator.activity(state).ravel().tolist())
        n_there.append((motion.held.kind == PROP_NAMES.index("wheelbarrow")).sum(1))
    assert st.PUSH in doing
    assert st.PICK_UP not in doing
    assert (np.diff(n_there, axis=0) >= 0).all()
    assert np.max(n_there) == 1


def test_a_load_that_there_is_not_is_refused_with_those_there_are():
    place = Workplace("pile", "pile", (1.4, 0.9), 0.6, 0.4, loads=("piano",))
    with pytest.raises(ConfigError, match=r"load at 'pile'.*piano.*box"):
        lying.make_loads((place,), ())


def test_hands_wait_to_set_out_for_a_load_while_the_robot_is_near_it():
    state, _ = started(1)
    me = state.workers[0, 0]
    me["activity"], me["time_s"], me["duration_s"], me["pace"] = st.PICK_UP, 0.0, 9.0, 1.0
    me["out_at"], me["out_s"], me["raise_s"] = 0.1, 1.0, 1.0
    me["planned_reaction"], me["tool_pose"][:3] = st.NO_REACTION, (0.5, 0.0, 0.8)
    motion = generator.current(state)
    near, far = np.full((1, 2, 3), (0.5, 0.2, 0.8)), np.full((1, 2, 3), (0.5, 0.9, 0.8))
    for robot, time_s, wished in ((near, 0.0, 0.0), (far, 0.0, 1.0), (near, 0.9, 1.0)):
        me["time_s"] = time_s
        generator.watch(state, robot, motion, 0.04)
        assert me["wanted_pace"] == wished
