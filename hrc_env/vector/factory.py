"""What `gymnasium.make_vec` calls: the batch, or processes for pictures."""

from functools import partial
from typing import Any

import gymnasium
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, VectorEnv

from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import task_called
from hrc_env.vector.env import HRCVectorEnv

PROCESSES_PER_CORE = 2
"""More processes that render and run networks only wait for each other."""


def make_vector(
    num_envs: int = 1, *, perception: str = "pixels", force: bool = False, **kwargs: Any
) -> VectorEnv[Any, Any, Any]:
    """A vector environment.

    Args:
        num_envs: how many environments.
        perception: "pixels" is gymnasium's `AsyncVectorEnv`, a process for each environment;
            the other levels are an `HRCVectorEnv`.
        force: allow more processes than two for each core.
        kwargs: of `HRCVectorEnv`; no `num_threads` with "pixels".

    Raises:
        ConfigError: too many processes, or arguments that cannot work.
    """
    if perception != "pixels":
        return HRCVectorEnv(num_envs, perception=perception, **kwargs)
    return _processes(num_envs, force, **kwargs)


def _processes(
    num_envs: int,
    force: bool,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    num_threads: int | None = None,
    **kwargs: Any,
) -> AsyncVectorEnv[Any, Any]:
    """A process for each environment."""
    limit = PROCESSES_PER_CORE * n_cores()
    if num_envs > limit and not force:
        raise ConfigError(
            f'num_envs={num_envs} with perception="pixels" are as many processes, each with a '
            f"renderer and a network; on {n_cores()} cores no more than {limit} make sense. "
            'Use perception="keypoints", which emulates the detector and steps thousands of '
            "environments in one process, or force=True."
        )
    if num_threads is not None:
        raise ConfigError('perception="pixels" is processes, not threads: leave out num_threads.')
    task = task_called(kwargs.pop("task", DEFAULT)).id
    make = partial(gymnasium.make, f"hrc_env:{task}", perception="pixels", **kwargs)
    return AsyncVectorEnv([make] * num_envs, context="spawn", autoreset_mode=autoreset_mode)
