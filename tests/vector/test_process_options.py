"""What processes refuse of options reaches the user in words, and the environments go on."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from stable_baselines3.common.vec_env import VecEnv

from hrc_env import ConfigError, HRCSubprocVecEnv
from hrc_env.vector.make import PixelVectorEnv

GOAL = (0.5, 0.3, 1.1)
make = partial(gymnasium.make, "hrc_env:HRCReach-v0", perception="keypoints", n_workers=(0, 2))
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "exclude each other": ({"n_workers": 1, "bodies": ["worker_1"] * 2}, "each of 1 workers"),
    "range upside down": ({"cameras": {"n_cameras": (3, 2)}}, "(fewest, most)"),
    "amounts upside down": (
        {"faults": [{"kind": "late", "cameras": ["all"], "amount": [0.3, 0.0]}]},
        "(least, most)",
    ),
    "out of reach": ({"goal": (3, 3, 3)}, "out of reach"),
    "unknown": ({"gaol": GOAL}, "Did you mean 'goal'"),
}
pytestmark = pytest.mark.usefixtures("process")
each_refused = pytest.mark.parametrize(("options", "words"), REFUSED.values(), ids=REFUSED)


def refused(do: Callable[[], object], words: str) -> None:
    with pytest.raises(ConfigError) as error:
        do()
    assert words in str(error.value)


@pytest.fixture(scope="module")
def pixel_envs() -> Iterator[PixelVectorEnv]:
    """As of level "pixels", at another level: the same class, and no images."""
    envs = PixelVectorEnv([make] * 2, context="spawn")
    yield envs
    envs.close()


@pytest.fixture(scope="module")
def sb3_envs() -> Iterator[VecEnv]:
    envs = HRCSubprocVecEnv([make] * 2)
    yield envs
    envs.close()


@each_refused
def test_processes_of_pixels_refuse_in_words_and_go_on(
    pixel_envs: PixelVectorEnv, options: dict, words: str
) -> None:
    pixel_envs.set_options(None)
    expected, _ = pixel_envs.reset(seed=3)
    for do in (
        lambda: pixel_envs.reset(seed=0, options=options),
        lambda: pixel_envs.reset(seed=0, options={"each": [{"goal": GOAL}, options]}),
        lambda: pixel_envs.set_options(options),
        lambda: pixel_envs.set_options({"each": [{"goal": GOAL}, options]}),
        lambda: pixel_envs.set_attr("options", options),
        lambda: pixel_envs.set_attr("options", [{}, options]),
        lambda: pixel_envs.call("set_options", options),
    ):
        refused(do, words)
        assert pixel_envs.get_attr("options") == ({}, {})
        assert pixel_envs.get_attr("next_options") == ({}, {})
    refused(lambda: pixel_envs.call("set_reward", factors={"gaol": 2.0}), "'goal'")
    seen, _ = pixel_envs.reset(seed=3)
    np.testing.assert_array_equal(seen, expected)


@each_refused
def test_processes_for_sb3_refuse_in_words_and_go_on(
    sb3_envs: VecEnv, options: dict, words: str
) -> None:
    sb3_envs.seed(3)
    expected = sb3_envs.reset()
    for do in (
        lambda: sb3_envs.set_options(options),
        lambda: sb3_envs.set_options([{"goal": GOAL}, options]),
        lambda: sb3_envs.env_method("set_options", options),
        lambda: sb3_envs.env_method("set_options", options, indices=1),
        lambda: sb3_envs.set_attr("options", options),
    ):
        refused(do, words)
        assert sb3_envs.get_attr("options") == [{}, {}]
    sb3_envs.seed(3)
    np.testing.assert_array_equal(sb3_envs.reset(), expected)


@pytest.mark.filterwarnings("ignore:.*(Worker|Traceback|Raising)")
@pytest.mark.parametrize("door", ["reset", "call", "set_attr"])
def test_processes_of_gymnasium_refuse_in_words(door: str) -> None:
    """It is Gymnasium's own class, which closes a process that has raised."""
    options, words = REFUSED["out of reach"]
    envs = AsyncVectorEnv([make] * 2, context="forkserver")
    doors: dict[str, Callable[[], object]] = {
        "reset": lambda: envs.reset(seed=0, options=options),
        "call": lambda: envs.call("set_options", options),
        "set_attr": lambda: envs.set_attr("options", options),
    }
    refused(doors[door], words)
    envs.close()
