"""What the vector environment's arguments, and those of its `reset`, mean."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from hrc_env.core.errors import ConfigError, check_names, check_shape, unknown, whole
from hrc_env.core.machine import n_cores
from hrc_env.core.typing import Bools, Ints
from hrc_env.env import ENDLESS

MAX_ENVS = 16_384
"""More would be gigabytes of filters' states, and no faster."""
ALONE = ("steps_left", "elapsed_steps")
"""Options of a reset that one environment may have of its own."""
RESET_OPTIONS = ("reset_mask", *ALONE)


def time_limit(max_episode_steps: int) -> int:
    """Steps of an episode; -1 is as good as infinitely many."""
    if max_episode_steps == -1:
        return ENDLESS
    return whole("max_episode_steps", max_episode_steps, 1, ENDLESS)


def autoreset_of(mode: str | AutoresetMode) -> AutoresetMode:
    """When environments start anew."""
    try:
        return AutoresetMode(mode)
    except ValueError as error:
        raise unknown("autoreset_mode", mode, [each.value for each in AutoresetMode]) from error


def threads_of(num_threads: int | None) -> int:
    """How many threads to use: as many as cores, unless a number was given."""
    cores = n_cores()
    if num_threads is None:
        return cores
    n_threads = whole("num_threads", num_threads, 1, MAX_ENVS)
    if n_threads > cores:
        said = f"num_threads={n_threads} on {cores} cores: results are the same, and later."
        warnings.warn(said, stacklevel=3)
    return n_threads


def seeds_of(seed: int | Sequence[int | None] | None, num_envs: int) -> list[int | None]:
    """A seed, or None, for each environment."""
    if seed is None:
        return [None] * num_envs
    if isinstance(seed, (int, np.integer)):
        seed = [int(seed) + k for k in range(num_envs)]
    given = list(seed) if isinstance(seed, Iterable) else [seed]
    valid = [each is None or (isinstance(each, (int, np.integer)) and each >= 0) for each in given]
    if len(given) != num_envs or not all(valid):
        raise ConfigError(
            f"seed must be a whole number >= 0 or a list of {num_envs} of them (None "
            f"goes on with that environment's stream), got {seed!r}."
        )
    return [None if each is None else int(each) for each in given]


def read_options(
    options: Mapping[str, Any] | None, num_envs: int, max_episode_steps: int
) -> tuple[Bools, Ints]:
    """(B,) which environments a reset is for, and steps that their episodes have behind them;
    `ConfigError` for an option that there is not, or a value that cannot work."""
    given = dict(options or {})
    for name in sorted(set(given) - set(RESET_OPTIONS)):
        raise unknown("reset option", name, RESET_OPTIONS)
    if "elapsed_steps" in given and "steps_left" in given:
        raise ConfigError("elapsed_steps and steps_left say the same: give one of them.")
    mask = _mask(given.get("reset_mask", np.ones(num_envs, bool)), num_envs)
    if "steps_left" in given:
        left = given["steps_left"]
        left = np.full(num_envs, left) if np.ndim(left) == 0 else left
        steps_left = _steps("steps_left", left, num_envs, 1, ENDLESS)
        return mask, np.maximum(max_episode_steps - steps_left, 0)
    elapsed_steps = given.get("elapsed_steps", np.zeros(num_envs, int))
    return mask, _steps("elapsed_steps", elapsed_steps, num_envs, 0, max_episode_steps - 1)


def steps_behind(options: Mapping[str, Any] | None, max_episode_steps: int) -> int:
    """Return the steps that one environment's episode has behind it, from the options of its
    reset; `ConfigError` as of `read_options`."""
    given = dict(options or {})
    check_names("reset option of one environment", given, ALONE)
    each = {name: np.array([value]) for name, value in given.items()}
    return int(read_options(each, 1, max_episode_steps)[1][0])


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


def _steps(name: str, given: Any, num_envs: int, low: int, high: int) -> Ints:
    steps = np.asarray(given)
    check_shape(name, steps.shape, (num_envs,), "one for each environment")
    is_whole = np.issubdtype(steps.dtype, np.integer)
    if not is_whole or not ((steps >= low) & (steps <= high)).all():
        raise ConfigError(
            f'options["{name}"] must be whole numbers from {low} to {high}, got {given!r}.'
        )
    return steps
