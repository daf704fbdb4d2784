"""Pieces from a table into a rack: laid out, placed, counted, paid for."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  # registers the ids
from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import make_expert
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import ObjectState
from hrc_env.motion import generator
from hrc_env.tasks import pick_place
from hrc_env.tasks.pick_place import PickPlaceConfig
from hrc_env.worker.body import SEGMENT
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import FOOT_WORLD

ID = "HRCPickPlace-v0"
HANDS = [SEGMENT["left_hand"], SEGMENT["right_hand"]]


def make(**kwargs):
    return gymnasium.make(ID, **{"perception": "none", "n_workers": 0} | kwargs)


def placed_pieces():
    """(1, 3) pieces that rest in their places."""
    at, turn = np.zeros((1, 3, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (1, 3, 1))
    at[:] = pick_place.PLACES_WORLD
    return ObjectState(at, turn, np.zeros((1, 3, 3)), np.zeros((1, 3, 3)), np.zeros((1, 3), bool))


def test_a_piece_counts_when_it_rests_in_its_place_and_is_let_go():
    config = PickPlaceConfig()
    assert pick_place.is_in_place(placed_pieces(), config).all()
    half = np.radians(4.0) / 2
    for change, counts in (
        (
            lambda it: it.position_world.__setitem__((0, 1, 0), it.position_world[0, 1, 0] + 0.011),
            0,
        ),
        (
            lambda it: it.position_world.__setitem__((0, 1, 0), it.position_world[0, 1, 0] + 0.009),
            1,
        ),
        (lambda it: it.quaternion_wxyz.__setitem__((0, 1), [np.cos(half), 0, 0, np.sin(half)]), 1),
        (
            lambda it: it.quaternion_wxyz.__setitem__(
                (0, 1), [np.cos(2 * half), 0, 0, np.sin(2 * half)]
            ),
            0,
        ),
        (lambda it: it.quaternion_wxyz.__setitem__((0, 1), [0, 0, 0, 1]), 1),
        (lambda it: it.velocity_world.__setitem__((0, 1, 2), 0.05), 0),
        (lambda it: it.held.__setitem__((0, 1), True), 0),
    ):
        pieces = placed_pieces()
        change(pieces)
        assert pick_place.is_in_place(pieces, config)[0].tolist() == [True, bool(counts), True]


def test_pieces_rest_on_the_table_and_are_laid_out_by_the_seed():
    env = make()
    places = []
    for seed in (0, 0, 1):
        env.reset(seed=seed)
        start = env.unwrapped.simulation.scene.objects.poses(
            env.unwrapped.simulation.physics.qpos
        ).copy()
        for _ in range(25):
            env.step(np.append(np.zeros(6), -1.0).astype(np.float32))
        end = env.unwrapped.simulation.scene.objects.poses(env.unwrapped.simulation.physics.qpos)
        np.testing.assert_allclose(end, start, atol=2e-3)
        places.append(start)
    assert np.array_equal(places[0], places[1])
    assert not np.array_equal(places[0], places[2])
    env.close()


def test_the_expert_lays_all_pieces_into_the_rack():
    env = make()
    observation, _ = env.reset(seed=3)
    agent = make_expert(env_info(env.unwrapped.simulation))
    total, over = 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = env.step(agent.act(observation))
        total += reward
        over = terminated or truncated
    assert terminated
    assert info["is_success"]
    assert info["task/studs_placed"] == 3.0
    assert total > 30.0
    env.close()


@pytest.mark.slow
def test_the_robot_knows_where_pieces_are_to_the_stated_noise():
    env = make(config={"objects": {"noise_m": 0.01, "noise_rad": 0.0}})
    env.reset(seed=0)
    simulation = env.unwrapped.simulation
    off = []
    for _ in range(100):
        env.step(np.append(np.zeros(6), -1.0).astype(np.float32))
        true = simulation.scene.objects.poses(simulation.physics.qpos)[..., :3]
        off.append(simulation.measured.position_world - true)
    assert np.std(off) == pytest.approx(0.01, rel=0.1)
    env.close()


def test_many_are_so_many_single_ones():
    vector = gymnasium.make_vec(ID, 3, perception="truth", num_threads=2)
    seen, _ = vector.reset(seed=5)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (30, 3, 7)).astype(np.float32)
    rows = [[seen]]
    for action in actions:
        rows.append(list(vector.step(action)[:2]))
    for k in range(3):
        env = gymnasium.make(ID, perception="truth")
        alone, _ = env.reset(seed=5 + k)
        np.testing.assert_array_equal(alone, rows[0][0][k])
        for action, (observation, reward) in zip(actions[:, k], rows[1:], strict=True):
            alone, paid, *_ = env.step(action)
            np.testing.assert_array_equal(alone, observation[k])
            assert paid == reward[k]
        env.close()
    vector.close()


def test_sparse_reward_pays_for_placed_pieces_only():
    env = make(config={"task": {"reward": "sparse"}})
    env.reset(seed=0)
    for _ in range(10):
        *_, info = env.step(env.action_space.sample())
        assert info["reward/progress"] == 0.0
    env.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"robot": "ur10e_like"}, "needs a robot with a hand.*ur10e_gripper"),
        ({"config": {"task": {"reward": "shaped"}}}, '"dense" or "sparse"'),
        ({"config": {"task": {"tolerance_m": 0.0}}}, "tolerance_m"),
        ({"config": {"objects": {"noise_m": -1.0}}}, "noise_m"),
    ],
)
def test_what_cannot_be_is_answered_in_words(arguments, said):
    with pytest.raises(ConfigError, match=said):
        make(**arguments)


def test_an_action_without_an_entry_for_the_hand_is_refused():
    env = make()
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"\(7,\)"):
        env.step(np.zeros(6, np.float32))
    env.close()


def studs_of(simulation):
    """(n, 3) the pieces that the worker has or has not yet taken [m]."""
    held = generator.current(simulation.motion).held
    return held.position_world[0][held.kind[0] == PROP_NAMES.index("stud")]


def test_the_worker_takes_pieces_from_the_robots_table_and_lays_them_down_elsewhere():
    env = make(perception="none", n_workers=1)
    env.reset(seed=5)
    simulation, still = env.unwrapped.simulation, np.append(np.zeros(6), -1.0).astype(np.float32)
    ahead_m, aside_m = pick_place.STACK.xy_m
    stack = FOOT_WORLD[:2] + np.array([ahead_m - 0.43, aside_m])
    nearest_m = np.inf
    for _ in range(700):
        env.step(still)
        assert len(studs_of(simulation)) == 4
        tips = generator.current(simulation.motion).position_world[0, 0, HANDS]
        nearest_m = min(nearest_m, np.linalg.norm(tips[:, :2] - stack, axis=1).min())
    left = np.linalg.norm(studs_of(simulation)[:, :2] - stack, axis=1) < 0.1
    assert nearest_m < 0.2
    assert left.sum() in (1, 2)
    on_bench = np.abs(studs_of(simulation)[:, 2] - 0.75) < 0.1
    assert (on_bench & ~left).any()
    env.close()


def test_the_workers_walk_depends_on_what_the_robot_does_not_on_who_looks():
    walks = []
    for perception in ("truth", "keypoints"):
        env = make(perception=perception, n_workers=1)
        env.reset(seed=6)
        rng, walk = np.random.default_rng(0), []
        for _ in range(60):
            env.step(rng.uniform(-1.0, 1.0, 7).astype(np.float32))
            walk.append(generator.current(env.unwrapped.simulation.motion).position_world.copy())
        walks.append(np.array(walk))
        env.close()
    np.testing.assert_array_equal(*walks)


@pytest.mark.parametrize("task", [ID, "HRCPickPlaceGoal-v0"])
def test_who_works_otherwise_takes_none(task):
    """Another mix of work, as docs/workers_and_scenes.md has it."""
    motion = {"jobs": "framing", "near_probability": 1.0, "near_radius_m": (1.0, 1.35)}
    env = gymnasium.make(task, perception="none", n_workers=1, config={"motion": motion})
    env.reset(seed=1)
    simulation = env.unwrapped.simulation
    before = studs_of(simulation)
    for _ in range(100):
        env.step(env.action_space.sample() * 0)
    np.testing.assert_array_equal(studs_of(simulation), before)
    env.close()
