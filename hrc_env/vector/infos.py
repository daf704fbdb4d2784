"""Infos of many environments: one array a name, each with a mask of who has the value.

The layout is that of gymnasium's `VectorEnv._add_info`: where the mask is false the value is
zero or None, and a name that nobody has is left out.
"""

from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.step import FLAGS, StepResult


@dataclass(frozen=True, slots=True)
class InfoTable:
    """Named values of B environments."""

    names: tuple[str, ...]
    values: Floats
    """(len(names), B) numbers; NaN where an environment has no such value."""
    words: dict[str, NDArray[np.object_]]
    """(B,) tuples of words by name; of environments that have no values yet, None."""

    def write(self, ids: Ints | slice, result: StepResult) -> None:
        """Give environments `ids` the values of a result of them, and no more than these."""
        absent = np.full(len(result.reward), np.nan)
        self.values[:, ids] = [result.info.get(name, absent) for name in self.names]
        for name, said in self.words.items():
            said[ids] = result.info[name]

    def arrays(self, who: Bools) -> dict[str, Any]:
        """Values and masks for the environments `who` (B,); the others have none."""
        known = (self.values == self.values) & who
        values = np.where(known, self.values, 0.0)
        infos: dict[str, Any] = {}
        somebody = known.any(axis=1).tolist()
        for name, value, mask in compress(zip(self.names, values, known, strict=True), somebody):
            infos[name] = value.astype(bool) if name in FLAGS else value
            infos[f"_{name}"] = mask
        if who.any():
            for name, said in self.words.items():
                infos[name], infos[f"_{name}"] = np.full(len(who), None, object), who.copy()
                infos[name][who] = said[who]
        return infos


def table(result: StepResult, ids: Ints | slice, batch: int) -> InfoTable:
    """The info of a result of environments `ids` as a table; the others have no values."""
    info = result.info
    words = {name: np.full(batch, None) for name, value in info.items() if value.dtype == object}
    numbers = tuple(name for name in info if name not in words)
    made = InfoTable(numbers, np.full((len(numbers), batch), np.nan), words)
    made.write(ids, result)
    return made
