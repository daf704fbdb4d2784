"""The input of sensors. Pipelines have no other information about the world than measurements."""

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
"""(W, C) window of each worker in each camera; None where a camera has no window."""


@dataclass(frozen=True, slots=True)
class SensorInput:
    """The scene at the moment of exposure, with one row for each of the environments `ids`."""

    ids: Ints
    """(B,) index of each row's environment in the batch."""
    qpos: Floats
    """(B, nq) generalized positions of the arm's joints [rad], fingers and loose objects, in the
    order of `Physics.qpos`."""
    motion: WorkerMotion
    """(B, W, S, ...) poses of the workers' bodies."""


@dataclass(frozen=True, slots=True)
class TrueSensorInput(SensorInput):
    """The scene with the true states of the workers, for sensors with `NEEDS_TRUTH`."""

    truth: WorkerTruth
    """(B, W, ...) true states of the workers."""
    present: Bools
    """(B, W) mask of the workers that take part in the episode."""


class Sensor(Stateful):
    """A sensor, which is the part of a pipeline that has access to the scene."""

    NEEDS_TRUTH: bool = False
    """Whether `expose` requires a `TrueSensorInput`."""
    now: SensorInput
    """The scene of the last exposure."""

    def expose(self, now: SensorInput) -> None:
        """Set the present scene, which the sensor keeps until the next exposure."""
        self.now = now

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Reset environments `ids`.

        Args:
            ids: indices of environments.
            rngs: one generator for each environment of the batch.
        """


class TrueState(Sensor):
    """An ideal sensor that measures the true state."""

    NEEDS_TRUTH = True


def require_truth(now: SensorInput) -> TrueSensorInput:
    """Return the input if it contains the truth; otherwise raise `ConfigError`."""
    if not isinstance(now, TrueSensorInput):
        raise ConfigError(f"This sensor needs a TrueSensorInput, got a {type(now).__name__}.")
    return now
