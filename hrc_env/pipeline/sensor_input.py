"""What sensors are shown of the world: of it, pipelines know no more than what these measure."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi, WorkerMotion, WorkerTruth
from hrc_env.core.typing import Bools, Floats, Ints

Generators = list[np.random.Generator]
Windows = list[list[Roi | None]]
"""For each worker, a window for each camera; None where it did not look."""


@dataclass(frozen=True, slots=True)
class SensorInput:
    """The scene when the shutters open, to be drawn; rows are environments `ids`."""

    ids: Ints
    """(B,) environments of the batch that these rows are."""
    qpos: Floats
    """(B, nq) the arm [rad], then its fingers and what is loose, as `Physics.qpos` has them."""
    motion: WorkerMotion
    """(B, W, S, ...)."""


@dataclass(frozen=True, slots=True)
class TrueSensorInput(SensorInput):
    """The same with what no camera knows: for sensors with `NEEDS_TRUTH` only."""

    truth: WorkerTruth
    """(B, W, ...)."""
    present: Bools
    """(B, W) who is in the episode."""


class Sensor(Stateful):
    """The one part of a pipeline that is shown the world."""

    NEEDS_TRUTH: bool = False
    """Whether `expose` is to be given a `TrueSensorInput`."""
    now: SensorInput

    def expose(self, now: SensorInput) -> None:
        """The shutters open before `now`, which is kept until the next time."""
        self.now = now

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Begin environments `ids` anew; there is a generator for each of the batch."""


class TrueState(Sensor):
    """The sensor that there is not: it knows where everybody is."""

    NEEDS_TRUTH = True


def with_truth(now: SensorInput) -> TrueSensorInput:
    """`now`, which must hold the truth."""
    if not isinstance(now, TrueSensorInput):
        raise ConfigError(f"This sensor needs a TrueSensorInput, got a {type(now).__name__}.")
    return now
