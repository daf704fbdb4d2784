"""Which cameras are thought to be somewhere else than told, by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Bools

MISCALIBRATED = "perception/miscalibrated"
"""Names of cameras that contradict the others as if they had been moved, turned or zoomed."""


@dataclass(frozen=True, slots=True)
class MiscalibrationFlags:
    """The cameras of B environments."""

    cameras: tuple[str, ...]
    """Names of C cameras; none at levels that have none."""
    flags: Bools
    """(B, C) which are suspected."""

    def info_of(self, b: int) -> dict[str, Any]:
        """What the info of environment b says; nothing where there are no cameras."""
        return {MISCALIBRATED: self._named(b)} if self.cameras else {}

    def arrays(self, who: Bools) -> dict[str, NDArray[np.object_]]:
        """The same of environments `who` (B,), an array (B,); the others have None."""
        if not self.cameras:
            return {}
        said = np.full(len(who), None, object)
        said[who] = NOBODY
        for b in np.flatnonzero(who & self.flags.any(1)).tolist():
            said[b] = self._named(b)
        return {MISCALIBRATED: said}

    def blank(self, batch: int) -> "MiscalibrationFlags":
        """Rows for `batch` environments, to be written."""
        return MiscalibrationFlags(self.cameras, np.zeros((batch, len(self.cameras)), np.bool_))

    def _named(self, b: int) -> tuple[str, ...]:
        flags = self.flags[b]
        if not flags.any():
            return ()
        return tuple(self.cameras[c] for c in np.flatnonzero(flags).tolist())


def joined(suspects: Sequence[MiscalibrationFlags]) -> MiscalibrationFlags:
    """Those of ranges of a batch, one after the other."""
    return MiscalibrationFlags(
        suspects[0].cameras, np.concatenate([each.flags for each in suspects])
    )


def _nobody() -> NDArray[np.object_]:
    """An empty tuple as an array without axes: it fills others."""
    nobody = np.empty((), object)
    nobody[()] = ()
    return nobody


NOBODY = _nobody()
