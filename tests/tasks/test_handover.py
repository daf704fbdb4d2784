"""A tool is brought to a hand, taken, let go; gently."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  # registers the ids
from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import make_expert
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import ObjectState
from hrc_env.tasks import handover
from hrc_env.tasks.handover import (
    BAR_KG,
    CLOSES_S,
    GRAVITY_M_S2,
    HANDLE_UP_M,
)
from hrc_env.world import WorkerProgress, World

ID = "HRCHandover-v0"
DT_S = 0.04
AT = np.array([0.0, 0.0, 1.2])
TASK = handover.Handover()


def make(**kwargs):
    return gymnasium.make(ID, **{"perception": "truth"} | kwargs)


def world(gap_m=0.0, speed_m_s=0.0, held=True, takes=True, away_m=0.0):
    """An upright tool, and a hand beside its handle."""
    still = np.zeros((1, 1, 3))
    tool = ObjectState(
        AT[None, None], np.array([1.0, 0, 0, 0])[None, None], still, still, np.array([[held]])
    )
    grip = AT + np.array([0.0, gap_m, HANDLE_UP_M])
    deeds = WorkerProgress(
        np.ones((1, 1), bool), np.zeros((1, 1), int), np.zeros((1, 1), bool),
        np.array([[takes]]), grip[None, None], np.array([[[speed_m_s, 0.0, 0.0]]]),
    )  # fmt: skip
    robot = type("Robot", (), {"tool_world": (AT - np.array([0.0, away_m, 0.08]))[None]})()
    return World(robot, None, tool, deeds)


def begun():
    state, rngs = TASK.make_state(1), [np.random.default_rng(0)]
    TASK.reset(state, np.array([0]), rngs, world())
    return state


def go_on(state, now, seconds):
    for _ in range(round(seconds / DT_S)):
        step = TASK.advance(state, [None], now, DT_S)
    return step


@pytest.mark.parametrize(
    ("now", "closes"),
    [
        (world(0.01), True),
        (world(0.03), False),
        (world(0.01, speed_m_s=0.3), False),
        (world(0.01, takes=False), False),
    ],
)
def test_a_hand_closes_that_has_been_at_the_handle_calmly(now, closes):
    state = begun()
    go_on(state, now, CLOSES_S - DT_S)
    assert not state["taken"][0]
    go_on(state, now, 2 * DT_S)
    assert state["taken"][0] == closes
    assert TASK.signal(state).stage[0] == (2 if closes else 1)


def test_the_hand_takes_the_weight_over_and_pulls_like_a_spring():
    state = begun()
    go_on(state, world(), 1.0)
    push = TASK.effects(state).push_world[0, 0]
    np.testing.assert_allclose(push[:3], [0.0, 0.0, BAR_KG * GRAVITY_M_S2], atol=1e-9)
    np.testing.assert_allclose(push[3:], 0.0, atol=1e-9)
    go_on(state, world(0.10), DT_S)
    assert TASK.effects(state).push_world[0, 0, 1] == pytest.approx(10.0)
    assert state["max_hand_force_n"][0] == pytest.approx(np.hypot(10.0, BAR_KG * GRAVITY_M_S2))


def test_it_is_handed_over_when_the_fingers_have_let_go_and_gone():
    state = begun()
    go_on(state, world(), 1.0)
    go_on(state, world(held=False, away_m=0.05), 1.0)
    assert not state["done"][0]
    step = go_on(state, world(held=False, away_m=0.3), 0.32)
    assert state["done"][0]
    assert step["done"][0]


def test_a_pull_that_is_not_gentle_is_no_success():
    state = begun()
    go_on(state, world(), 1.0)
    state["max_hand_force_n"] = 61.0
    go_on(state, world(held=False, away_m=0.3), 1.0)
    assert not state["done"][0]


def test_the_expert_hands_the_tool_over():
    env = make()
    observation, _ = env.reset(seed=1)
    agent, contacts, over = make_expert(env_info(env.unwrapped.simulation)), 0.0, False
    while not over:
        observation, _, terminated, truncated, info = env.step(agent.act(observation))
        contacts += info["cost_contact"]
        over = terminated or truncated
    assert terminated
    assert info["is_success"]
    assert 0.0 < info["task/max_hand_force_n"] < 60.0
    assert contacts == 0.0
    env.close()


def test_nobody_comes_for_a_tool_that_stands_in_its_stand():
    env = make()
    env.reset(seed=0)
    for _ in range(50):
        *_, info = env.step(np.append(np.zeros(6), -1.0).astype(np.float32))
        assert env.unwrapped.words(info)["worker/activity"] == ("stand",)
    at = env.unwrapped.simulation.scene.objects.poses(env.unwrapped.simulation.physics.qpos)
    np.testing.assert_allclose(at[0, 0, :3], [-0.45, -0.62, 0.85], atol=2e-3)
    env.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"robot": "ur10e_like"}, "needs a robot with a hand"),
        ({"config": {"task": {"gentle_n": 0.0}}}, "gentle_n"),
        ({"config": {"task": {"reward": "none"}}}, '"dense" or "sparse"'),
    ],
)
def test_what_cannot_be_is_answered_in_words(arguments, said):
    with pytest.raises(ConfigError, match=said):
        make(**arguments)
