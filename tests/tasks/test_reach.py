"""Goals one after another: reached, missed, replaced."""

from types import SimpleNamespace

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.tasks import reach
from hrc_env.world import World

TASK = reach.Reach()
CONFIG = TASK.config


def tools_at(tool_world):
    return World(SimpleNamespace(tool_world=tool_world))


EVERYONE = np.array([0, 1])


def two_environments():
    state = TASK.make_state(2)
    rngs = [np.random.default_rng(seed) for seed in (1, 2)]
    TASK.reset(state, EVERYONE, rngs, tools_at(np.zeros((2, 3))))
    return state, rngs


def test_goals_lie_in_the_stated_volume():
    state, rngs = two_environments()
    for _ in range(200):
        TASK.reset(state, EVERYONE, rngs, tools_at(np.zeros((2, 3))))
        offset = state["goal_world"][:, :2] - CONFIG.base_xy_world
        distance, azimuth = np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])
        assert ((distance >= 0.5) & (distance <= 0.95)).all()
        assert (np.abs(azimuth) <= 1.2).all()
        assert ((state["goal_world"][:, 2] >= 0.8) & (state["goal_world"][:, 2] <= 1.45)).all()


def test_a_goal_that_is_touched_counts_and_is_replaced():
    state, rngs = two_environments()
    old = state["goal_world"].copy()
    tools = np.array([old[0] + [0.03, 0, 0], np.zeros(3)])
    step = TASK.advance(state, rngs, tools_at(tools), 0.04)
    assert step["reached"].tolist() == [True, False]
    assert state["n_reached"].tolist() == [1, 0]
    assert (state["goal_world"][0] != old[0]).any()
    np.testing.assert_array_equal(state["goal_world"][1], old[1])


def test_progress_is_by_how_much_the_tool_came_nearer():
    state, rngs = two_environments()
    before = np.linalg.norm(state["goal_world"], axis=1)
    tools = 0.25 * state["goal_world"]
    step = TASK.advance(state, rngs, tools_at(tools), 0.04)
    np.testing.assert_allclose(step["progress_m"], 0.25 * before)


def test_a_goal_is_missed_after_its_time_and_not_a_step_earlier():
    state, rngs = two_environments()
    missed = [
        TASK.advance(state, rngs, tools_at(np.zeros((2, 3))), 0.04)["missed"] for _ in range(100)
    ]
    assert [bool(each[0]) for each in missed] == [False] * 99 + [True]
    assert state["n_missed"].tolist() == [1, 1]
    assert not TASK.info(state)["is_success"].any()


def test_an_environment_draws_from_its_own_stream_only():
    both, _ = two_environments()
    alone = TASK.make_state(1)
    TASK.reset(alone, np.array([0]), [np.random.default_rng(2)], tools_at(np.zeros((1, 3))))
    np.testing.assert_array_equal(alone["goal_world"][0], both["goal_world"][1])


def test_an_empty_range_is_refused():
    with pytest.raises(ConfigError, match=r"height_m must be \(low, high\)"):
        reach.ReachConfig(height_m=(1.0, 1.0))
