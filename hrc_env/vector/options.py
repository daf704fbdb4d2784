"""What the vector environment's arguments, and those of its `reset`, mean."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from hrc_env.core.errors import ConfigError, check_names, check_shape, unknown, whole
from hrc_env.core.machine import n_cores
from hrc_env.core.typing import Bools, Ints
from hrc_env.env import ENDLESS
from hrc_env.reset_options import ResetOptions, named_options

MAX_ENVS = 16_384
"""More would be gigabytes of filters' states, and no faster."""
ALONE = ("steps_left", "elapsed_steps")
"""Options of a reset that one environment may have of its own."""
ROWS = {"goal": 1, "start_q": 1, "n_workers": 0, "steps_left": 0, "elapsed_steps": 0}
"""Options of which an array may hold one an environment, and axes of one alone."""
OF_VECTORS = ("reset_mask", "elapsed_steps", "each")
"""Options of a reset that vector environments take besides."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """The options of a vector environment's reset, read."""

    mask: Bools
    """(B,) which environments it is for."""
    elapsed_steps: Ints
    """(B,) steps that their episodes have behind them."""
    each: list[dict[str, Any]]
    """The fixed parts of each episode, by name."""


def read_options(
    options: Mapping[str, Any] | ResetOptions | None, num_envs: int, max_episode_steps: int
) -> Asked:
    """Return a reset's options, read; `ConfigError` for an option that there is not, or a value
    that cannot work."""
    given = named_options(options, *OF_VECTORS)
    mask = _mask(given.pop("reset_mask", np.ones(num_envs, bool)), num_envs)
    steps = {name: given.pop(name) for name in ALONE if name in given}
    elapsed_steps = _elapsed(steps, num_envs, max_episode_steps)
    each = options_of_each(given, num_envs, *ALONE)
    for k, of_one in enumerate(each):
        own = {name: of_one[name] for name in ALONE if name in of_one}
        if own:
            of_one = each[k] = {name: of_one[name] for name in of_one if name not in own}
            elapsed_steps[k] = steps_behind(own, max_episode_steps)
    return Asked(mask, elapsed_steps, each)


def options_of_each(
    options: Mapping[str, Any] | ResetOptions | None, num_envs: int, *more: str
) -> list[dict[str, Any]]:
    """Return each environment's options, by name, from one value for all, arrays with a row for
    each, and the list "each"; what all share is one dictionary.

    Raises:
        ConfigError: an unknown name, a list of another length, or an option that is given twice.
            `more` are names that are valid within "each" besides.
    """
    given = named_options(options, "each", *more)
    lists = given.pop("each", None)
    if lists is not None and not (isinstance(lists, list | tuple) and len(lists) == num_envs):
        raise ConfigError(
            f'options["each"] must be a list of {num_envs} mappings (or None), one for each '
            f"environment, got {lists!r}."
        )
    by_row = {name: value for name, value in given.items() if _has_rows(name, value, num_envs)}
    shared = {name: value for name, value in given.items() if name not in by_row}
    if lists is None and not by_row:
        return [shared] * num_envs
    every = []
    for k, own in enumerate(lists or [None] * num_envs):
        own = named_options(own, *more)
        for name in own:
            if name in given:
                raise ConfigError(
                    f'The option {name!r} is given for all environments and in options["each"]'
                    f"[{k}], too: give it once."
                )
        every.append({**shared, **{name: value[k] for name, value in by_row.items()}, **own})
    return every


def _has_rows(name: str, value: Any, num_envs: int) -> bool:
    """Whether a value holds one an environment; `ConfigError` for another number of them."""
    try:
        lead = np.shape(value)[:1]
        has_rows = np.ndim(value) == ROWS.get(name, np.inf) + 1
    except ValueError:  # rows of different lengths
        return False
    if has_rows:
        check_shape(f'options["{name}"]', lead, (num_envs,), "a row for each environment")
    return has_rows


def steps_behind(options: Mapping[str, Any] | None, max_episode_steps: int) -> int:
    """Return the steps that one environment's episode has behind it, from its "steps_left" or
    "elapsed_steps"; `ConfigError` as of `read_options`."""
    given = dict(options or {})
    check_names("reset option of one environment", given, ALONE)
    each = {name: np.array([value]) for name, value in given.items()}
    return int(_elapsed(each, 1, max_episode_steps)[0])


def _elapsed(steps: Mapping[str, Any], num_envs: int, max_episode_steps: int) -> Ints:
    if "elapsed_steps" in steps and "steps_left" in steps:
        raise ConfigError("elapsed_steps and steps_left say the same: give one of them.")
    if "steps_left" in steps:
        left = steps["steps_left"]
        left = np.full(num_envs, left) if np.ndim(left) == 0 else left
        steps_left = _steps("steps_left", left, num_envs, 1, ENDLESS)
        return np.maximum(max_episode_steps - steps_left, 0)
    elapsed_steps = steps.get("elapsed_steps", np.zeros(num_envs, int))
    return _steps("elapsed_steps", elapsed_steps, num_envs, 0, max_episode_steps - 1).copy()


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
