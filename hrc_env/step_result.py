"""What a step or a reset gives: observation, reward, end, and infos by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import Info, published
from hrc_env.core.typing import Bools, Floats

Observation = NDArray[np.float32] | dict[str, NDArray[Any]]
"""(B, n) float32; or by name, where goals (`hrc_env.tasks.goal`) or images (uint8) stand beside."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step or a reset gives, per environment."""

    observation: Observation
    reward: Floats
    """(B,)."""
    terminated: Bools
    """(B,)."""
    info: Info

    def info_of(self, b: int) -> dict[str, Any]:
        """Return the info of one environment, as NumPy scalars."""
        return {name: value[b] for name, value in published(self.info).items()}


def agreed(keys: list[str], info: Info) -> Info:
    """Return an info with the `keys` of the first one, which fills the list; `ConfigError` for
    another, as of a shield or a task whose names come and go."""
    if not keys:
        keys.extend(info)
    if list(info) != keys and info.keys() != set(keys):
        came, gone = sorted(info.keys() - set(keys)), sorted(set(keys) - info.keys())
        raise ConfigError(
            "Infos must have the same keys at every reset and step: what a shield says, and a "
            f"task's info, under the same names each time. New: {', '.join(came) or 'none'}; "
            f"missing: {', '.join(gone) or 'none'}. Give NaN where there is no number."
        )
    return info


def joined(results: Sequence[StepResult]) -> StepResult:
    """Results of ranges of a batch, one after the other."""
    if len(results) == 1:
        return results[0]
    parts = zip(*((r.observation, r.reward, r.terminated) for r in results), strict=True)
    info = {name: np.concatenate([each.info[name] for each in results]) for name in results[0].info}
    observations, *others = parts
    reward, terminated = map(np.concatenate, others)
    return StepResult(_joined(observations), reward, terminated, info)


def _joined(parts: Sequence[Any]) -> Any:
    """Observations one after the other."""
    if not isinstance(parts[0], dict):
        return np.concatenate(parts)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
