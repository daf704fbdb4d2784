"""The batch against as many single environments, bit for bit.

Gymnasium's `SyncVectorEnv` of `gymnasium.make` environments and `HRCVectorEnv` with 1, 2 and 3
threads take the same seeded actions; episodes end and begin inside, and now and then a few
environments are reset in the middle, so that they do not run in phase. Observations, rewards,
terminations, truncations and infos are compared number by number, their types and masks too.
"""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

import hrc_env  # noqa: F401  registers the ids
from hrc_env.tasks import DEFAULT

RESET_SHARE = 0.01
"""Chance that an environment is reset after a step."""


def vectors(
    num_envs: int,
    threads: Sequence[int],
    mode: AutoresetMode,
    task: str = DEFAULT,
    **kwargs: Any,
) -> list[VectorEnv]:
    """Single environments in gymnasium's vector, and the batch with each number of threads."""
    singles = gymnasium.make_vec(task, num_envs, "sync", {"autoreset_mode": mode}, **kwargs)
    batches = [
        gymnasium.make_vec(task, num_envs, num_threads=each, autoreset_mode=mode, **kwargs)
        for each in threads
    ]
    return [singles, *batches]


def compare(envs: list[VectorEnv], n_steps: int, seed: int) -> list[int]:
    """For each of the others, how many numbers differ from the first environment's."""
    rng = np.random.default_rng(seed)
    said = [env.reset(seed=seed) for env in envs]
    counts = [differences(said[0], other) for other in said[1:]]
    for _ in range(n_steps):
        actions = rng.uniform(-1, 1, envs[0].action_space.shape).astype(np.float32)
        chosen = rng.random(envs[0].num_envs) < RESET_SHARE
        said = [step(env, actions, chosen) for env in envs]
        counts = [
            count + differences(said[0], other)
            for count, other in zip(counts, said[1:], strict=True)
        ]
    return counts


def step(env: VectorEnv, actions: np.ndarray, chosen: np.ndarray) -> tuple[Any, ...]:
    """A step, and a reset of environments that are chosen or have to be reset by hand."""
    said = env.step(actions)
    if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
        chosen = chosen | said[2] | said[3]
    if chosen.any():
        return *said, *env.reset(options={"reset_mask": chosen.copy()})
    return said


def differences(a: Any, b: Any) -> int:
    """How many numbers of nested tuples, dicts and arrays differ; a missing part counts one."""
    if isinstance(a, dict) and isinstance(b, dict):
        shared = a.keys() & b.keys()
        return len(a.keys() ^ b.keys()) + sum(differences(a[key], b[key]) for key in shared)
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        return sum(differences(x, y) for x, y in zip(a, b, strict=True))
    if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
        return int(a is not b)
    if a.dtype != b.dtype or a.shape != b.shape:
        return max(a.size, b.size)
    if a.dtype == object:
        return sum(differences(x, y) for x, y in zip(a, b, strict=True))
    same = a.view(np.uint8) == b.view(np.uint8)  # bits: -0.0 is not 0.0
    return int((~same.reshape(a.size, -1).all(1)).sum())
