"""What a perception pipeline is given of the world."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi, WorkerMotion, WorkerTruth
from hrc_env.core.typing import Bools, Ints, JointAngles

Generators = list[np.random.Generator]
Windows = list[list[Roi | None]]
"""For each worker, a window for each camera; None where it did not look."""


@dataclass(frozen=True, slots=True)
class SensorInput:
    """The scene when the shutters open, to be drawn; rows are environments `ids`."""

    ids: Ints
    """(B,) environments of the batch that these rows are."""
    q: JointAngles
    """(B, N) the arm [rad]."""
    motion: WorkerMotion
    """(B, W, S, ...)."""


@dataclass(frozen=True, slots=True)
class TrueSensorInput(SensorInput):
    """The same with what no camera knows: for pipelines with `NEEDS_TRUTH` only."""

    truth: WorkerTruth
    """(B, W, ...)."""
    present: Bools
    """(B, W) who is in the episode."""


def with_truth(now: SensorInput) -> TrueSensorInput:
    """`now`, which must hold the truth."""
    if not isinstance(now, TrueSensorInput):
        raise ConfigError(f"This pipeline needs a TrueSensorInput, got a {type(now).__name__}.")
    return now
