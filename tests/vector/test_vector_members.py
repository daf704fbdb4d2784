"""What Gymnasium's vector of single environments has beside steps: attributes, calls, pictures."""

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError
from hrc_env.vector.env import HRCVectorEnv

SMALL = {"width": 64, "height": 48}


def pair(autoreset_mode: str = "NextStep", num_envs: int = 2, **kwargs):
    """Ours, and Gymnasium's of the same single environments; both after a reset."""
    made = {"num_envs": num_envs, "perception": "truth", "max_episode_steps": 3, **kwargs}
    ours = gymnasium.make_vec("HRCReach-v0", autoreset_mode=autoreset_mode, **made)
    theirs = gymnasium.make_vec(
        "HRCReach-v0",
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": autoreset_mode},
        **made,
    )
    for envs in (ours, theirs):
        envs.reset(seed=1)
    return ours, theirs


def same(a, b) -> bool:
    """Whether nested tuples and lists of arrays are equal, with their types."""
    if isinstance(a, list | tuple):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    return a.dtype == b.dtype and np.array_equal(a, b)


@pytest.mark.parametrize("mode", ["rgb_array_list", "depth_array_list"])
@pytest.mark.parametrize("autoreset_mode", ["NextStep", "SameStep", "Disabled"])
def test_lists_of_pictures_are_those_of_single_environments(mode, autoreset_mode):
    """Over the end of an episode, whose pictures go with it."""
    ours, theirs = pair(autoreset_mode, render_mode=mode, **SMALL)
    assert ours.render_mode == theirs.render_mode == mode
    assert ours.metadata == theirs.metadata
    rng, lengths = np.random.default_rng(0), []
    for step in range(5):
        action = rng.uniform(-1, 1, (2, 6)).astype(np.float32)
        truncated, _ = (envs.step(action)[3] for envs in (ours, theirs))
        if autoreset_mode == "Disabled" and truncated.any():
            for envs in (ours, theirs):
                envs.reset(options={"reset_mask": truncated.copy()})
        if step % 2:
            mine = ours.render()
            assert same(mine, theirs.render())
            lengths.append(len(mine[0]))
    assert lengths[0] == 3
    rest = ours.call("render")
    assert len(rest[1]) > 0
    assert same(rest, theirs.render())
    ours.close(), theirs.close()


def test_calls_and_attributes_are_those_of_single_environments():
    ours, theirs = pair(num_envs=3, max_episode_steps=250)
    for name in ("render_mode", "np_random_seed", "observation_space", "action_space", "config"):
        assert ours.get_attr(name) == theirs.get_attr(name)
    for envs in (ours, theirs):
        envs.set_attr("tag", [1, 2, 3])
        assert envs.get_attr("tag") == (1, 2, 3)
        envs.set_attr("tag", 7)
        assert envs.call("tag") == (7, 7, 7)
    mine, other = (envs.call("reset", seed=4) for envs in (ours, theirs))
    for (seen, info), (expected, told) in zip(mine, other, strict=True):
        np.testing.assert_array_equal(seen, expected)
        assert info == told
    with pytest.raises(ConfigError, match="one entry per environment"):
        ours.set_attr("tag", [1, 2])
    with pytest.raises(ConfigError, match=r"settings are fixed at creation"):
        ours.set_attr("config", None)
    with pytest.raises(ConfigError, match=r"Unknown attribute of a single environment"):
        ours.get_attr("max_episode_step")
    ours.call("close")
    assert ours.closed


@pytest.mark.parametrize("ask", ["render", "mosaic"])
def test_pictures_of_a_closed_environment_are_refused_in_words(ask):
    one = gymnasium.make("HRCReach-v0", perception="none", render_mode="rgb_array").unwrapped
    many = HRCVectorEnv(2, perception="none", render_mode="rgb_array")
    for env in (one, many):
        env.reset()
        env.close()
    for call in (getattr(one, ask), lambda: many.call(ask)):
        with pytest.raises(ConfigError, match="This environment is closed; make a new one"):
            call()


def test_a_window_is_gymnasiums_round_all_of_them():
    envs = gymnasium.make_vec("HRCReach-v0", num_envs=2, perception="none", render_mode="human")
    assert envs.render_mode == "human"
    assert isinstance(envs.unwrapped, HRCVectorEnv)
    assert envs.unwrapped.render_mode == "rgb_array"
    with pytest.raises(ConfigError, match="rgb_array_list"):
        HRCVectorEnv(2, perception="none", render_mode="rgb_list")
