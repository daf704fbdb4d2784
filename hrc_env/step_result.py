"""Result of a step or a reset: observation, reward, termination, and infos by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import Info, InfoDict, publish
from hrc_env.core.typing import Bools, Floats

Observation = NDArray[np.float32] | dict[str, NDArray[Any]]
"""Type of observations: an array (B, n) of float32, or a dictionary of arrays if there are also
goals or images (uint8)."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """Result of a step or a reset, with a row for each environment."""

    observation: Observation
    """(B, n) observations, or a dictionary of arrays (B, ...)."""
    reward: Floats
    """(B,) rewards of the step."""
    terminated: Bools
    """Mask (B,) of the environments in which the episode has terminated."""
    info: Info
    """Entries of the info: arrays (B,) by name."""

    def info_of(self, b: int) -> InfoDict:
        """Return the info of one environment with NumPy scalars as values."""
        return InfoDict({name: value[b] for name, value in publish(self.info).items()})


def check_keys(keys: list[str], info: Info) -> Info:
    """Check that an info has the same names as the first one, and return it.

    Args:
        keys: names of the first info; an empty list is filled with the names of this one.
        info: the info.

    Raises:
        ConfigError: the names differ, for example because a shield or a task returns varying names.
    """
    if not keys:
        keys.extend(info)
    if list(info) != keys and info.keys() != set(keys):
        came, gone = sorted(info.keys() - set(keys)), sorted(set(keys) - info.keys())
        raise ConfigError(
            "Infos must have the same keys at every reset and step: a shield and a task must "
            f"return the same names each time. New: {', '.join(came) or 'none'}; missing: "
            f"{', '.join(gone) or 'none'}. Use NaN for missing numbers."
        )
    return info


def concatenate_results(results: Sequence[StepResult]) -> StepResult:
    """Concatenate the results of consecutive ranges of a batch."""
    if len(results) == 1:
        return results[0]
    names = results[0].info
    return StepResult(
        observation=_concatenate([result.observation for result in results]),
        reward=np.concatenate([result.reward for result in results]),
        terminated=np.concatenate([result.terminated for result in results]),
        info={name: np.concatenate([result.info[name] for result in results]) for name in names},
    )


def _concatenate(parts: Sequence[Any]) -> Observation:
    """Concatenate the observations of consecutive ranges of a batch."""
    if not isinstance(parts[0], dict):
        return np.concatenate(parts)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
