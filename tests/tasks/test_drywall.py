"""A board against studs: pressed, screwed on by a worker or by itself, fixed, let go."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  # registers the ids
from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import make_expert
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import ObjectState
from hrc_env.motion import state as st
from hrc_env.tasks import drywall
from hrc_env.tasks.drywall import PLACE_M, SCREWS_M
from hrc_env.world import FOOT_WORLD, WorkerProgress, World

ID = "HRCDrywall-v0"
DT_S = 0.04
AT_PLACE = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
"""world_from_board where it belongs."""
TASK = drywall.Drywall()


def make(**kwargs):
    return gymnasium.make(ID, **{"perception": "none", "n_workers": 0} | kwargs)


def world(shift_m=(0.0, 0.0, 0.0), held=True, screws=0, boring=False, workers=0):
    """A board near its place, and what workers do."""
    board = ObjectState(
        (FOOT_WORLD + PLACE_M + shift_m)[None, None], AT_PLACE[None, None], np.zeros((1, 1, 3)),
        np.zeros((1, 1, 3)),
        np.array([[held]]),
    )  # fmt: skip
    robot = type("Robot", (), {"tool_world": np.zeros((1, 3))})()
    deeds = WorkerProgress(
        np.ones((1, workers), bool), np.full((1, workers), screws), np.full((1, workers), boring),
        np.zeros((1, workers), bool), np.zeros((1, workers, 3)), np.zeros((1, workers, 3)),
    )  # fmt: skip
    return World(robot, None, board, deeds)


def begun():
    """The state of an episode that begins."""
    state, rngs = TASK.make_state(1), [np.random.default_rng(0)]
    TASK.reset(state, np.array([0]), rngs, world())
    return state


def go_on(state, now, seconds=DT_S):
    for _ in range(round(seconds / DT_S)):
        step = TASK.advance(state, [None], now, DT_S)
    return step


def test_without_a_worker_screws_are_driven_while_the_board_is_pressed():
    state = begun()
    go_on(state, world(), 0.5)
    assert state["driven"][0] == 0
    assert not TASK.effects(state).push_world.any()
    go_on(state, world(), 0.3)
    assert state["boring"][0]
    push = TASK.effects(state).push_world[0, 0]
    assert 20.0 <= push[1] <= 50.0
    assert np.hypot(push[0], push[2]) == pytest.approx(0.2 * push[1])
    go_on(state, world(), 5.0)
    assert state["driven"][0] == len(SCREWS_M)
    assert TASK.effects(state).welded["board_fixed"][0]
    step = go_on(state, world(held=False))
    assert step["done"][0]
    assert TASK.info(state)["is_success"][0] == 1.0


def test_a_worker_who_is_there_drives_them():
    state = begun()
    go_on(state, world(workers=1), 6.0)
    assert state["driven"][0] == 0
    go_on(state, world(workers=1, screws=2, boring=True))
    assert state["driven"][0] == 2
    assert state["boring"][0]


@pytest.mark.parametrize(("off_m", "spoils"), [(0.004, False), (0.006, True)])
def test_a_board_that_moves_while_screws_are_driven_is_spoilt(off_m, spoils):
    state = begun()
    go_on(state, world((0.0, 0.0, off_m), screws=1, boring=True, workers=1))
    assert state["spoilt"][0] == spoils
    assert state["max_offset_m"][0] == pytest.approx(off_m)
    go_on(state, world(screws=4, workers=1))
    go_on(state, world(held=False, screws=4, workers=1))
    assert TASK.info(state)["is_success"][0] == float(not spoils)


def test_the_expert_hangs_the_board():
    env = make()
    observation, _ = env.reset(seed=0)
    agent = make_expert(env_info(env.unwrapped.simulation))
    over = False
    while not over:
        observation, _, terminated, truncated, info = env.step(agent.act(observation))
        over = terminated or truncated
    assert terminated
    assert info["is_success"]
    assert info["task/max_offset_m"] < 0.005
    for _ in range(25):  # fixed, it stays where it is
        env.unwrapped.step(np.append(np.zeros(6), -1.0).astype(np.float32))
    simulation = env.unwrapped.simulation
    at = simulation.scene.objects.poses(simulation.physics.qpos)[0, 0, :3]
    np.testing.assert_allclose(at, FOOT_WORLD + PLACE_M, atol=0.003)
    env.close()


@pytest.mark.slow
def test_the_worker_waits_for_the_board_and_halts_when_it_is_taken_away():
    env = make(perception="truth", n_workers=1)
    observation, _ = env.reset(seed=1)
    simulation = env.unwrapped.simulation
    agent, me = make_expert(env_info(simulation)), simulation.motion.workers[0, 0]
    while not simulation.task_state["pressed_s"][0] > 0.0:
        assert me["activity"] != st.SCREW
        observation, *_ = env.step(agent.act(observation))
    while not simulation.task_state["boring"][0]:
        observation, *_ = env.step(agent.act(observation))
    assert me["activity"] == st.SCREW
    for _ in range(60):  # back from the wall
        env.step(np.array([0, -0.3, 0.3, 0, 0, 0, 1.0], np.float32))
    assert not simulation.task_state["boring"][0]
    assert me["pace"] == 0.0
    env.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"robot": "ur10e_like"}, "needs a robot with a hand"),
        ({"config": {"task": {"push_n": (50.0, 20.0)}}}, "push_n"),
        ({"config": {"task": {"reward": "none"}}}, '"dense" or "sparse"'),
    ],
)
def test_what_cannot_be_is_answered_in_words(arguments, said):
    with pytest.raises(ConfigError, match=said):
        make(**arguments)
