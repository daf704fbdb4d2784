"""The input of sensors; pipelines know no more of the world than their measurements of it."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi, WorkerMotion, WorkerTruth
from hrc_env.core.typing import Bools, Floats, Ints

Generators: TypeAlias = list[np.random.Generator]
"""One random generator for each environment."""
Windows: TypeAlias = list[list[Roi | None]]
"""(W, C) window of each worker in each camera; None where there is none."""


@dataclass(frozen=True, slots=True)
class SensorInput:
    """The scene at the moment at which the shutters open; rows are environments `ids`."""

    ids: Ints
    """(B,) index of each row's environment in the batch."""
    qpos: Floats
    """(B, nq) joints of the arm [rad], then fingers and loose objects, as in `Physics.qpos`."""
    motion: WorkerMotion
    """(B, W, S, ...) bodies of the workers."""


@dataclass(frozen=True, slots=True)
class TrueSensorInput(SensorInput):
    """The scene with the truth about the workers, for sensors with `NEEDS_TRUTH` only."""

    truth: WorkerTruth
    """(B, W, ...) the workers."""
    present: Bools
    """(B, W) whether each worker is in the episode."""


class Sensor(Stateful):
    """The part of a pipeline that receives the scene."""

    NEEDS_TRUTH: bool = False
    """Whether `expose` takes a `TrueSensorInput`."""
    now: SensorInput
    """The scene of the last exposure."""

    def expose(self, now: SensorInput) -> None:
        """Take in the scene, which is kept until the next exposure."""
        self.now = now

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Begin environments `ids` anew.

        Args:
            ids: indices of environments.
            rngs: one generator for each environment of the batch.
        """


class TrueState(Sensor):
    """An ideal sensor, which knows the truth."""

    NEEDS_TRUTH = True


def require_truth(now: SensorInput) -> TrueSensorInput:
    """Return an input with the truth; `ConfigError` for one without."""
    if not isinstance(now, TrueSensorInput):
        raise ConfigError(f"This sensor needs a TrueSensorInput, got a {type(now).__name__}.")
    return now
