"""Infos of many environments: one array a name, each with a mask of who has the value.

The layout is that of gymnasium's `VectorEnv._add_info`. Names are the same in every step; where the
mask is false an environment has no info now, and the value is zero.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.infos import matching, published, worded
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env_config import EnvConfig
from hrc_env.infos import words_of
from hrc_env.settings import settle
from hrc_env.simulation import Simulation
from hrc_env.step_result import StepResult


@dataclass(frozen=True, slots=True)
class InfoTable:
    """Named values of B environments."""

    values: dict[str, Floats]
    """(B,) numbers by name; NaN where an environment has no such value."""

    def write(self, ids: Ints | slice, result: StepResult) -> None:
        """Give environments `ids` the values of a result of them."""
        for name, values in result.info.items():
            self.values[name][ids] = values

    def arrays(self, who: Bools) -> dict[str, Any]:
        """Values and masks for the environments `who` (B,); the others have none."""
        infos: dict[str, Any] = {}
        for name, values in published(self.values).items():
            infos[name] = np.where(who, values, np.zeros_like(values))
            infos[f"_{name}"] = who.copy()
        return infos


def table(result: StepResult, ids: Ints | slice, batch: int) -> InfoTable:
    """The info of a result of environments `ids` as a table; the others have no values."""
    made = InfoTable({name: _unknown(batch, values) for name, values in result.info.items()})
    made.write(ids, result)
    return made


def _unknown(batch: int, values: Any) -> Any:
    """Return (B,) entries of the type of `values`, NaN if that has one."""
    return np.full(batch, np.nan if values.dtype.kind == "f" else -1, values.dtype)


def chosen_infos(patterns: str | Sequence[str], arguments: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of infos that patterns choose, before an environment is played.

    Args:
        patterns: names, or patterns of names: "safety/*".
        arguments: of `HRCVectorEnv`, whose infos they are; a small environment of them is asked.

    Raises:
        ConfigError: a pattern that no name matches, or that is no text.
    """
    if not isinstance(patterns, str) and not patterns:
        return ()
    own = {each.name for each in fields(EnvConfig)} - {"render_mode", "width", "height"}
    given = {name: value for name, value in arguments.items() if name in own}
    with warnings.catch_warnings():  # the environment itself says what there is to say
        warnings.simplefilter("ignore")
        small = Simulation(1, settle(**{"perception": "keypoints", **given}))
    try:
        first = small.reset(np.arange(1), [np.random.default_rng(0)])
    finally:
        small.close()
    return matching(patterns, list(first.info_of(0)))


def words_of_infos(
    infos: Mapping[str, Any], num_envs: int, bodies: tuple[str, ...]
) -> dict[str, NDArray[np.object_]]:
    """Return in words what infos of a batch say.

    Args:
        infos: arrays (num_envs,) by name.
        num_envs: number of environments.
        bodies: names of the workers' bodies.

    Returns:
        (num_envs,) tuples of words by name.
    """
    words = words_of(bodies)
    numbers = {name: infos[name] for name in infos if not name.startswith(("_", "final_"))}
    said = [
        worded({name: values[b] for name, values in numbers.items()}, words)
        for b in range(num_envs)
    ]
    return {name: np.fromiter((each[name] for each in said), object) for name in said[0]}
