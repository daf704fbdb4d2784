"""Floor on which undetected people may be, and people beyond the slots for workers."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, Points3

POSSIBLE, PROBABLY_EMPTY, EMPTY = 0, 1, 2
"""States of a piece of floor: a person may be there, one camera alone has seen it empty, or several
cameras have."""
STATURE_M = 1.8
"""Height of the space above a piece of floor that a person may take up [m]."""
WALKING_M_S = 1.6
"""Speed at which people walk towards a robot, by ISO 13855 [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """Which cameras of a rig would detect a person on each piece of the floor."""

    floor_world: Points3
    """(N, 3) centres of pieces all over the walkable floor [m]."""
    piece_m: float
    """Distance of a piece's centre from its corners [m]."""
    group: Ints
    """(N,) the row of `cameras` that belongs to each piece."""
    cameras: Bools
    """(G, C) the sets of cameras that occur."""


MOST_OTHERS = 4
"""Number of people beyond the workers' slots that are remembered."""


@dataclass(frozen=True, slots=True)
class Others:
    """Detected people beyond the workers' slots."""

    hips_world: Points3
    """(B, N, 3) where they were [m]; NaN where there are fewer."""
    age_s: Floats
    """(B, N) time since they were detected [s]; infinite where there are fewer."""

    @property
    def any(self) -> Bools:
        """(B,) whether there are more people than slots."""
        return np.asarray(np.isfinite(self.age_s).any(-1))


def no_others(batch: int) -> Others:
    """Return the record of no more people than slots."""
    return Others(np.full((batch, MOST_OTHERS, 3), np.nan), np.full((batch, MOST_OTHERS), np.inf))


@dataclass(frozen=True, slots=True)
class Vacancy:
    """The state of the floor for workers' slots without a track."""

    coverage: Coverage
    level: Ints
    """(B, W, G) `POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY`, by groups of a `Coverage`."""
    age_s: Floats
    """(B, W) age of the oldest look behind these states [s]."""
    others: Others
    """The detected people beyond the slots."""
