"""What `reset(options=...)` of the vector environment understands."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hrc_env.errors import ConfigError, check_shape, unknown
from hrc_env.typing import Bools, Ints

RESET_OPTIONS = ("reset_mask", "elapsed_steps")


def read_options(
    options: Mapping[str, Any] | None, num_envs: int, max_episode_steps: int
) -> tuple[Bools, Ints]:
    """Which environments a reset is for, and steps that their episodes have behind them: (B,).

    Raises:
        ConfigError: an option that there is not, or a value that cannot work.
    """
    given = dict(options or {})
    for name in sorted(set(given) - set(RESET_OPTIONS)):
        raise unknown("reset option", name, RESET_OPTIONS)
    mask = _mask(given.get("reset_mask", np.ones(num_envs, bool)), num_envs)
    elapsed_steps = given.get("elapsed_steps", np.zeros(num_envs, int))
    return mask, _elapsed(elapsed_steps, num_envs, max_episode_steps)


def _mask(mask: Any, num_envs: int) -> Bools:
    if not isinstance(mask, np.ndarray) or mask.dtype != bool:
        raise ConfigError(
            'options["reset_mask"] must be a NumPy array of bool, one for each environment, '
            f"got {mask!r}; terminations | truncations is one."
        )
    check_shape("reset_mask", mask.shape, (num_envs,), "one for each environment")
    if not mask.any():
        raise ConfigError('options["reset_mask"] must be True somewhere: nobody would start.')
    return mask


def _elapsed(elapsed_steps: Any, num_envs: int, max_episode_steps: int) -> Ints:
    steps = np.asarray(elapsed_steps)
    check_shape("elapsed_steps", steps.shape, (num_envs,), "one for each environment")
    whole = np.issubdtype(steps.dtype, np.integer)
    if not whole or not ((steps >= 0) & (steps < max_episode_steps)).all():
        raise ConfigError(
            'options["elapsed_steps"] must be whole numbers from 0 to '
            f"{max_episode_steps - 1}, got {elapsed_steps!r}."
        )
    return steps
