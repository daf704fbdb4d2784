"""Infos of many environments: one array a name, each with a mask of who has the value.

The layout is that of gymnasium's `VectorEnv._add_info`: where the mask is false the value is
zero, and a name that nobody has is left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.batching import copied, write_rows
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion.workers import Crew
from hrc_env.step import FLAGS, StepResult
from hrc_env.tracking.miscalibration import MiscalibrationFlags


@dataclass(frozen=True, slots=True)
class InfoTable:
    """Named values of B environments; NaN where an environment has no such value."""

    names: tuple[str, ...]
    values: Floats
    """(len(names), B)."""
    crew: Crew
    """Of all B; of environments that have no values yet, without meaning."""
    suspects: MiscalibrationFlags
    """Likewise."""

    def write(self, ids: Ints, outcome: StepResult) -> None:
        """Give environments `ids` the values of an outcome of them, and no more than these."""
        self.values[:, ids] = np.nan
        for name, value in outcome.info.items():
            self.values[self.names.index(name), ids] = value
        write_rows(self.crew, ids, outcome.crew)
        self.suspects.flags[ids] = outcome.suspects.flags

    def arrays(self, who: Bools) -> dict[str, Any]:
        """Values and masks for the environments `who` (B,); the others have none."""
        known = (self.values == self.values) & who
        values = np.where(known, self.values, 0.0)
        infos: dict[str, Any] = {}
        for name, value, mask, anybody in zip(
            self.names, values, known, known.any(1).tolist(), strict=True
        ):
            if anybody:
                infos[name] = value.astype(bool) if name in FLAGS else value
                infos[f"_{name}"] = mask
        if who.any():
            named = {**self.crew.arrays(who), **self.suspects.arrays(who)}
            for name, said in named.items():
                infos[name], infos[f"_{name}"] = said, who.copy()
        return infos


def table(outcome: StepResult) -> InfoTable:
    """A copy of an outcome's info as a table."""
    values = np.array(list(outcome.info.values()))
    return InfoTable(tuple(outcome.info), values, copied(outcome.crew), copied(outcome.suspects))


def blank(outcome: StepResult, batch: int) -> InfoTable:
    """A table of the names of an outcome's info in which nobody has a value."""
    names = tuple(outcome.info)
    values = np.full((len(names), batch), np.nan)
    return InfoTable(names, values, outcome.crew.blank(batch), outcome.suspects.blank(batch))
