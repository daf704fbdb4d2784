"""Patches of floor where undetected people may be, and people in excess of the workers' slots."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, Points3

POSSIBLE, PROBABLY_EMPTY, EMPTY = 0, 1, 2
"""States of a patch of floor: a person may be there, one camera has observed that it is empty, or
several cameras have."""
STATURE_M = 1.8
"""Height of the space above a patch of floor that a person may occupy [m]."""
WALKING_M_S = 1.6
"""Speed at which people walk towards a robot, according to ISO 13855 [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """Cameras of a rig that would detect a person on each patch of the floor."""

    floor_world: Points3
    """Centres of the patches that cover the walkable floor (N, 3) [m]."""
    piece_m: float
    """Distance from the centre of a patch to its corners [m]."""
    group: Ints
    """Index of the row of `cameras` that applies to each patch (N,)."""
    cameras: Bools
    """Set of cameras that see the patches of each group, as masks (G, C)."""


MOST_OTHERS = 4
"""Maximum number of people in excess of the workers' slots that are stored."""


@dataclass(frozen=True, slots=True)
class Others:
    """Detected people in excess of the workers' slots."""

    hips_world: Points3
    """Last detected hip positions of the people (B, N, 3) [m]; NaN in unused rows."""
    age_s: Floats
    """Time since the people were last detected (B, N) [s]; infinite in unused rows."""

    @property
    def any(self) -> Bools:
        """Whether there are more people than slots (B,)."""
        return np.asarray(np.isfinite(self.age_s).any(-1))


def no_others(batch: int) -> Others:
    """Return a record without any people in excess of the slots."""
    return Others(np.full((batch, MOST_OTHERS, 3), np.nan), np.full((batch, MOST_OTHERS), np.inf))


@dataclass(frozen=True, slots=True)
class Vacancy:
    """State of the floor with respect to the workers' slots without a track."""

    coverage: Coverage
    level: Ints
    """State of each group of patches of a `Coverage` (B, W, G): `POSSIBLE`, `PROBABLY_EMPTY` or
    `EMPTY`."""
    age_s: Floats
    """Age of the oldest frame on which `level` is based (B, W) [s]."""
    others: Others
    """Detected people in excess of the slots."""
