"""Infos of many environments: an array for each name, with a mask of the environments with a value.

The layout is that of gymnasium's `VectorEnv._add_info`. The names are the same in every step. If an
environment has no info in a step, its mask is False and its value is 0.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.infos import InfoDict, match_keys, name_indices, publish
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env_config import EnvConfig
from hrc_env.infos import words_of
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.step_result import StepResult


@dataclass(frozen=True, slots=True)
class InfoTable:
    """Infos of B environments, by name."""

    values: dict[str, Floats]
    """Numbers (B,) by name; NaN for an environment without a value."""

    def write(self, ids: Ints | slice, result: StepResult) -> None:
        """Write the infos of a result to the rows of environments `ids`."""
        for name, values in result.info.items():
            self.values[name][ids] = values

    def arrays(self, mask: Bools) -> InfoDict:
        """Return values and masks by name. Only the environments in the mask (B,) have values."""
        infos, is_whole = InfoDict(), bool(mask.all())
        for name, values in publish(self.values).items():
            infos[name] = (
                values.copy() if is_whole else np.where(mask, values, np.zeros_like(values))
            )
            infos[f"_{name}"] = mask.copy()
        return infos


def make_table(result: StepResult, ids: Ints | slice, batch: int) -> InfoTable:
    """Return a table of all environments that contains the infos of some of them.

    Args:
        result: result of environments `ids`.
        ids: indices of the environments in the result.
        batch: number of all environments, B.
    """
    if len(result.reward) == batch:
        return InfoTable({name: np.array(values) for name, values in result.info.items()})
    table = InfoTable({name: _fill(batch, values) for name, values in result.info.items()})
    table.write(ids, result)
    return table


def _fill(batch: int, values: NDArray[Any]) -> NDArray[Any]:
    """Return an array (B,) of missing values (NaN, or -1 for integers) of the dtype of `values`."""
    return np.full(batch, np.nan if values.dtype.kind == "f" else -1, values.dtype)


def choose_infos(patterns: str | Sequence[str], arguments: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of infos that match patterns.

    The available names are found by making a small vector environment with the given arguments.

    Args:
        patterns: names, or patterns of names such as "safety/*".
        arguments: arguments of `HRCVectorEnv`.

    Raises:
        ConfigError: no name matches a pattern, or a pattern is not a string.
    """
    if not isinstance(patterns, str) and not patterns:
        return ()
    known = {each.name for each in fields(EnvConfig)} - {"render_mode", "width", "height"}
    given = {name: value for name, value in arguments.items() if name in known}
    with warnings.catch_warnings():  # the environment itself repeats them
        warnings.simplefilter("ignore")
        small = Simulation(1, resolve_settings(**{"perception": "keypoints", **given}))
    try:
        first = small.reset(np.arange(1), [np.random.default_rng(0)])
    finally:
        small.close()
    return match_keys(patterns, list(first.info_of(0)))


def words_of_infos(
    infos: Mapping[str, Any], num_envs: int, bodies: tuple[str, ...]
) -> dict[str, NDArray[np.object_]]:
    """Convert indices in the infos of a batch to names.

    Args:
        infos: arrays (num_envs,) by name.
        num_envs: number of environments.
        bodies: names of the workers' bodies.

    Returns:
        Arrays (num_envs,) of tuples of names, by the key of the info.
    """
    words = words_of(bodies)
    numbers = {name: infos[name] for name in infos if not name.startswith(("_", "final_"))}
    worded_infos = [
        name_indices({name: values[b] for name, values in numbers.items()}, words)
        for b in range(num_envs)
    ]
    return {
        name: np.fromiter((each[name] for each in worded_infos), object) for name in worded_infos[0]
    }
