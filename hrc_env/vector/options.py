"""Parsing of the arguments of the vector environment and of the options of its `reset`."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from hrc_env.core.brought import describe
from hrc_env.core.errors import (
    ConfigError,
    check_integer,
    check_names,
    check_shape,
    make_unknown_name_error,
)
from hrc_env.core.machine import n_cores
from hrc_env.core.typing import Bools, Ints
from hrc_env.env import ENDLESS
from hrc_env.reset_options import ResetOptions, named_options

MAX_ENVS = 16_384
"""Maximum number of environments. More environments need gigabytes of memory without being
faster."""
MIN_PER_THREAD = 32
"""Minimum number of environments for which a further thread saves time."""
ALONE = ("steps_left", "elapsed_steps")
"""Options of a reset that may differ between environments, in addition to the fields of
`ResetOptions`."""
ROWS = {"goal": 1, "start_q": 1, "n_workers": 0, "steps_left": 0, "elapsed_steps": 0}
"""Number of axes of one row of each option that may be an array with one row per environment."""
OF_VECTORS = ("reset_mask", "elapsed_steps", "each")
"""Reset options that only vector environments accept."""


def parse_time_limit(max_episode_steps: int) -> int:
    """Return the time limit of an episode [control steps]; -1 means no limit."""
    if max_episode_steps == -1:
        return ENDLESS
    return check_integer("max_episode_steps", max_episode_steps, 1, ENDLESS)


def parse_autoreset(mode: str | AutoresetMode) -> AutoresetMode:
    """Return the parsed mode of resets after the end of an episode."""
    try:
        return AutoresetMode(mode)
    except ValueError as error:
        raise make_unknown_name_error(
            "autoreset_mode", mode, [each.value for each in AutoresetMode]
        ) from error


def parse_threads(num_threads: int | None) -> int:
    """Return the number of threads; None means the number of cores."""
    cores = n_cores()
    if num_threads is None:
        return cores
    n_threads = check_integer("num_threads", num_threads, 1, MAX_ENVS)
    if n_threads > cores:
        warnings.warn(
            f"num_threads={n_threads} on {cores} cores: results are the same, but slower.",
            stacklevel=3,
        )
    return n_threads


def count_shards(num_envs: int, num_threads: int | None) -> int:
    """Return the number of simulations, one per thread, that share the environments.

    Every simulation runs the Python code of a step, one after the other, so that a few environments
    are faster in a single one.
    """
    return min(parse_threads(num_threads), max(num_envs // MIN_PER_THREAD, 1))


def parse_seeds(
    seed: int | Sequence[int | None] | None, num_envs: int, name: str = "seed"
) -> list[int | None]:
    """Return the seed of each environment, or None if its random stream continues.

    Args:
        seed: seed of the first environment, or a list with a seed for each.
        num_envs: number of environments.
        name: name of the argument, for the error message.
    """
    if seed is None:
        return [None] * num_envs
    if isinstance(seed, (int, np.integer)):
        seed = [int(seed) + k for k in range(num_envs)]
    given = list(seed) if isinstance(seed, Iterable) else [seed]
    valid = [each is None or (isinstance(each, (int, np.integer)) and each >= 0) for each in given]
    if len(given) != num_envs or not all(valid):
        raise ConfigError(
            f"{name} must be a whole number >= 0 or a list of {num_envs} of them (None continues "
            f"with the environment's random stream), got {seed!r}."
        )
    return [None if each is None else int(each) for each in given]


def parse_sources(ids: Any, n: int, num_envs: int) -> Ints:
    """Return indices (n,) of environments.

    Args:
        ids: indices as given by the user.
        n: required number of indices.
        num_envs: number of environments.

    Raises:
        ConfigError: the number of indices is wrong, or one of them is not valid.
    """
    try:
        given = np.asarray(ids)
    except ValueError:  # rows of different lengths
        given = np.zeros(0)
    is_whole = given.shape == (n,) and np.issubdtype(given.dtype, np.integer)
    if not is_whole or not n or not ((given >= 0) & (given < num_envs)).all():
        raise ConfigError(
            f"ids must be {n or 'one or more'} whole numbers from 0 to {num_envs - 1}, indices of "
            f"environments, got {describe(ids)}."
        )
    return given.astype(np.int64)


def parse_branch_seeds(seeds: Any, ids: Ints) -> list[int | None]:
    """Return the seed of each branch, or None for an environment that is not changed.

    Args:
        seeds: seeds as given by the user.
        ids: (B,) index of the environment that each one becomes.

    Raises:
        ConfigError: a seed is invalid, occurs twice, or is missing for a copy.
    """
    if not isinstance(seeds, Iterable):
        raise ConfigError(
            f"seeds must be a list of {len(ids)} seeds, one per environment, got {describe(seeds)}."
        )
    given = parse_seeds(list(seeds), len(ids), "seeds")
    for k, (source, seed) in enumerate(zip(ids.tolist(), given, strict=True)):
        if seed is None and source != k:
            raise ConfigError(
                f"seeds[{k}] is None, but environment {k} becomes a copy of environment {source} "
                "and must not share its random numbers: give it a seed. None is for an environment "
                "that is not changed."
            )
    used = [seed for seed in given if seed is not None]
    if twice := sorted({seed for seed in used if used.count(seed) > 1}):
        raise ConfigError(
            f"seeds must differ, so that branches are independent, got {twice[0]} more than once."
        )
    return given


@dataclass(frozen=True, slots=True, eq=False)
class ParsedOptions:
    """Parsed options of a vector environment's reset."""

    mask: Bools
    """Whether each environment is reset (B,)."""
    elapsed_steps: Ints
    """Number of steps of the time limit that have passed (B,)."""
    each: list[dict[str, Any]]
    """Options of each environment that fix parts of its episode, by name."""


def read_options(
    options: Mapping[str, Any] | ResetOptions | None, num_envs: int, max_episode_steps: int
) -> ParsedOptions:
    """Return the parsed options of a reset.

    Args:
        options: options as a record or a mapping.
        num_envs: number of environments.
        max_episode_steps: time limit of episodes [control steps].

    Raises:
        ConfigError: an option is unknown or invalid.
    """
    given = named_options(options, *OF_VECTORS)
    mask = _mask(given.pop("reset_mask", np.ones(num_envs, bool)), num_envs)
    steps = {name: given.pop(name) for name in ALONE if name in given}
    elapsed_steps = _elapsed(steps, num_envs, max_episode_steps)
    each = split_options(given, num_envs, *ALONE)
    for k, of_env in enumerate(each):
        own_steps = {name: of_env[name] for name in ALONE if name in of_env}
        if own_steps:
            each[k] = {name: of_env[name] for name in of_env if name not in own_steps}
            elapsed_steps[k] = count_elapsed_steps(own_steps, max_episode_steps)
    return ParsedOptions(mask, elapsed_steps, each)


def split_options(
    options: Mapping[str, Any] | ResetOptions | None, num_envs: int, *more: str
) -> list[dict[str, Any]]:
    """Return the options of each environment by name.

    The options are combined from values for all environments, arrays with one row per environment,
    and the list "each". If the options of all environments are equal, they share one dictionary.

    Args:
        options: options as a record or a mapping.
        num_envs: number of environments.
        more: additional names that are valid within "each".

    Raises:
        ConfigError: a name is unknown, a list has the wrong length, or an option is given twice.
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
    every: list[dict[str, Any]] = []
    for k, of_env in enumerate(lists or [None] * num_envs):
        own_options = named_options(of_env, *more)
        for name in own_options:
            if name in given:
                raise ConfigError(
                    f"The option {name!r} is given both for all environments and in "
                    f'options["each"][{k}]: give it only once.'
                )
        rows = {name: value[k] for name, value in by_row.items()}
        every.append({**shared, **rows, **own_options})
    return every


def _has_rows(name: str, value: Any, num_envs: int) -> bool:
    """Return whether an option is an array with one row per environment.

    Raises:
        ConfigError: the number of rows is wrong.
    """
    try:
        lead = np.shape(value)[:1]
        has_rows = np.ndim(value) == ROWS.get(name, np.inf) + 1
    except ValueError:  # rows of different lengths
        return False
    if has_rows:
        check_shape(f'options["{name}"]', lead, (num_envs,), "one row per environment")
    return has_rows


def count_elapsed_steps(options: Mapping[str, Any] | None, max_episode_steps: int) -> int:
    """Return the number of elapsed steps of the time limit of a single environment.

    Args:
        options: "steps_left" or "elapsed_steps" of the environment.
        max_episode_steps: time limit of the environment [control steps].

    Raises:
        ConfigError: an option is unknown or invalid.
    """
    given = dict(options or {})
    check_names("reset option of one environment", given, ALONE)
    each = {name: np.array([value]) for name, value in given.items()}
    return int(_elapsed(each, 1, max_episode_steps)[0])


def _elapsed(steps: Mapping[str, Any], num_envs: int, max_episode_steps: int) -> Ints:
    """Return the number of elapsed steps (B,) from the option "steps_left" or "elapsed_steps"."""
    if "elapsed_steps" in steps and "steps_left" in steps:
        raise ConfigError("elapsed_steps and steps_left are equivalent: give only one of them.")
    if "steps_left" in steps:
        left = steps["steps_left"]
        left = np.full(num_envs, left) if np.ndim(left) == 0 else left
        steps_left = _steps("steps_left", left, num_envs, 1, ENDLESS)
        return np.maximum(max_episode_steps - steps_left, 0)
    elapsed_steps = steps.get("elapsed_steps", np.zeros(num_envs, int))
    return _steps("elapsed_steps", elapsed_steps, num_envs, 0, max_episode_steps - 1).copy()


def _mask(mask: Any, num_envs: int) -> Bools:
    """Return a mask (B,) of the environments to reset, or raise `ConfigError` if it is invalid."""
    if not isinstance(mask, np.ndarray) or mask.dtype != bool:
        raise ConfigError(
            'options["reset_mask"] must be a NumPy array of bool, one for each environment, such '
            f"as terminations | truncations; got {mask!r}."
        )
    check_shape("reset_mask", mask.shape, (num_envs,), "one for each environment")
    if not mask.any():
        raise ConfigError('options["reset_mask"] must be True for at least one environment.')
    return mask


def _steps(name: str, value: Any, num_envs: int, low: int, high: int) -> Ints:
    """Return numbers of steps (B,), or raise `ConfigError` if any is not from `low` to `high`."""
    steps = np.asarray(value)
    check_shape(name, steps.shape, (num_envs,), "one for each environment")
    is_whole = np.issubdtype(steps.dtype, np.integer)
    if not is_whole or not ((steps >= low) & (steps <= high)).all():
        raise ConfigError(
            f'options["{name}"] must be whole numbers from {low} to {high}, got {value!r}.'
        )
    return steps
