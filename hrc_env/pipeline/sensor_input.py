"""What the senses are given of the world."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.records import Roi, WorkerMotion, WorkerTruth
from hrc_env.core.typing import Bools, Ints, JointAngles

Generators = list[np.random.Generator]
Windows = list[list[Roi | None]]
"""For each worker, a window for each camera; None where it did not look."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The scene when the shutters open; rows are environments `ids`."""

    ids: Ints
    """(B,) environments of the batch that these rows are."""
    q: JointAngles
    """(B, N) the arm [rad]."""
    motion: WorkerMotion
    """(B, W, S, ...)."""
    truth: WorkerTruth
    """(B, W, ...): for the emulator and the level `truth`, and for nobody else."""
    present: Bools
    """(B, W) who is in the episode: for the level `truth`, and for nobody else."""
