"""Options of the vector environment's reset."""

import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.vector.env import HRCVectorEnv

STAND = np.zeros((3, 6), np.float32)


def test_elapsed_steps_bring_the_first_time_limit_nearer_and_no_later_one():
    env = HRCVectorEnv(
        3, perception="none", max_episode_steps=4, autoreset_mode="SameStep", num_threads=1
    )
    env.reset(seed=0, options={"elapsed_steps": np.array([0, 2, 3])})
    ends = np.array([env.step(STAND)[3] for _ in range(9)])
    assert [np.flatnonzero(column).tolist() for column in ends.T] == [[3, 7], [1, 5], [0, 4, 8]]


def test_elapsed_steps_are_those_of_the_environments_that_start():
    env = HRCVectorEnv(
        3, perception="none", max_episode_steps=9, autoreset_mode="Disabled", num_threads=1
    )
    env.reset(seed=0)
    chosen = {"reset_mask": np.array([False, True, False]), "elapsed_steps": np.array([8, 8, 8])}
    env.reset(options=chosen)
    np.testing.assert_array_equal(env.step(STAND)[3], [False, True, False])


@pytest.mark.parametrize("steps_left", [2, np.array([2, 9, 1])])
def test_steps_left_bring_the_end_of_the_first_episode_nearer_and_no_later_one(steps_left):
    env = HRCVectorEnv(
        3, perception="none", max_episode_steps=4, autoreset_mode="SameStep", num_threads=1
    )
    env.reset(seed=0, options={"steps_left": steps_left})
    ends = np.array([env.step(STAND)[3] for _ in range(7)])
    first = np.minimum(np.broadcast_to(steps_left, 3), 4)
    for column, left in zip(ends.T, first, strict=True):
        assert np.flatnonzero(column)[:2].tolist() == [left - 1, left + 3][: column.sum()]


def test_without_a_time_limit_steps_left_are_all_there_is():
    env = HRCVectorEnv(
        3, perception="none", max_episode_steps=-1, autoreset_mode="SameStep", num_threads=1
    )
    env.reset(seed=0, options={"steps_left": 2})
    assert [env.step(STAND)[3].all() for _ in range(3)] == [False, True, False]


def test_options_that_cannot_work_say_so():
    env = HRCVectorEnv(3, perception="none", max_episode_steps=5, num_threads=1)
    bad = (
        ({"elapsed": 1}, r"Did you mean 'elapsed_steps'\?"),
        ({"elapsed_steps": np.array([0, 1])}, r"shape \(3,\)"),
        ({"elapsed_steps": np.array([0, 1, 5])}, "from 0 to 4"),
        ({"elapsed_steps": np.array([-1, 1, 2])}, "from 0 to 4"),
        ({"elapsed_steps": np.array([0.5, 1, 2])}, "whole numbers"),
        ({"steps_left": 0}, "from 1 to"),
        ({"steps_left": np.array([1.5, 1, 1])}, "whole numbers"),
        ({"steps_left": 1, "elapsed_steps": np.array([0, 0, 0])}, "give only one of them"),
        ({"reset_mask": [True, True, True]}, "NumPy array of bool"),
        ({"reset_mask": np.zeros(3, bool)}, "True for at least one"),
    )
    for options, said in bad:
        with pytest.raises(ConfigError, match=said):
            env.reset(options=options)
