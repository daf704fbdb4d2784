"""Random actions for a long time: every number is one, and the memory does not grow."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from figures import Figure

import hrc_env  # noqa: F401  registers the ids
from benchmarks.common import make_exact
from hrc_env.core.typing import Bools
from hrc_env.safety.incidents import SUMMARY
from hrc_env.vector.env import HRCVectorEnv

N_READINGS, WARM_UP = 40, 10
"""How often a run reads the memory, and from which reading on it must not grow."""
NOT_WHEN_LOST = "tracking/mpjpe_m"
"""Not measured where a worker is there who has no track."""
SOMETIMES = (
    "tracking/mpjpe_by_identity_m",
    *(f"safety/{name}" for name in SUMMARY.names or ()
      if not name.startswith("contacts_") and name != "near_misses"),
)  # fmt: skip
"""Absent before anybody was matched; where nobody is near, or no contact begins."""


def soak(n_steps: int, num_envs: int, **kwargs: Any) -> tuple[int, list[float]]:
    """Return the number of values that are none or lack, and the memory over time [MiB]."""
    env, rng = HRCVectorEnv(num_envs, **kwargs), np.random.default_rng(0)
    n_calls, n_wrong, resident_mib = n_steps // num_envs, 0, list[float]()
    env.reset(seed=0)
    ended = np.zeros(num_envs, bool)
    for call in range(1, n_calls + 1):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, infos = env.step(action)
        n_wrong += count_not_finite(observation) + count_not_finite(reward)
        n_wrong += count_lacking(infos, ~ended)
        ended = terminated | truncated
        if call % max(n_calls // N_READINGS, 1) == 0:
            resident_mib.append(read_memory())
    env.close()
    return n_wrong, resident_mib


def count_not_finite(values: Any) -> int:
    return int(np.size(values) - np.isfinite(values).sum())


def count_lacking(infos: Mapping[str, Any], stepped: Bools) -> int:
    """Return the number of infos that are no numbers, or that an environment which `stepped` lacks
    without reason."""
    count = 0
    for name in infos:
        if not name.startswith("_"):
            known = infos[f"_{name}"]
            count += count_not_finite(infos[name][known].astype(float))
            wanted = stepped & (infos["tracking/lost"] == 0) if name == NOT_WHEN_LOST else stepped
            count += int((wanted & ~known).sum()) if name not in SOMETIMES else 0
    return count


def read_memory() -> float:
    """Return the memory that this process holds now [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("n_workers", [1, 2])
def test_every_number_is_one_also_of_several_workers(n_workers):
    n_wrong, resident_mib = soak(1200, 4, perception="truth", n_workers=n_workers)
    assert n_wrong == 0
    assert min(resident_mib) > 50


@pytest.mark.filterwarnings("error")
def test_every_number_of_a_single_environment_is_one():
    env, rng = gymnasium.make("HRCReach-v0", perception="truth"), np.random.default_rng(0)
    env.reset(seed=0)
    ended = False
    while not ended:
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        numbers = np.array([reward, *info.values()], float)
        assert count_not_finite(observation) + count_not_finite(numbers) == 0
    env.close()


@pytest.mark.long
@pytest.mark.filterwarnings("error")
def test_a_long_run_has_numbers_only_and_takes_no_more_memory(figures):
    n_wrong, resident_mib = soak(640_000, 64, perception="keypoints")
    warm = resident_mib[WARM_UP:]
    figures.hold(
        Figure("soak: values that are no numbers", make_exact(n_wrong, "1"), most=0),
        Figure("soak: growth of memory", make_exact(max(warm) / warm[0] - 1, "share"), most=0.05),
    )


def test_what_is_no_number_and_what_is_lacking_is_counted():
    everyone, lost = np.ones(3, bool), np.array([0.0, 1.0, 0.0])
    infos = {
        "cost": np.array([0.0, np.nan, np.inf]),
        "_cost": everyone,
        "tracking/lost": lost,
        "_tracking/lost": everyone,
        "tracking/mpjpe_m": np.zeros(3),
        "_tracking/mpjpe_m": np.array([True, False, False]),
    }
    assert count_lacking(infos, everyone) == 3
    assert count_lacking(infos, np.array([True, True, False])) == 2
