"""Infos of many environments: one array a name, each with a mask of who has the value.

The layout is that of gymnasium's `VectorEnv._add_info`: where the mask is false the value is
zero, and a name that nobody has is left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.simulation import FLAGS, Info
from hrc_env.typing import Bools, Floats, Ints


@dataclass(frozen=True, slots=True)
class InfoTable:
    """Named values of B environments; NaN where an environment has no such value."""

    names: tuple[str, ...]
    values: Floats
    """(len(names), B)."""

    def write(self, ids: Ints, info: Info) -> None:
        """Give environments `ids` other values, (len(ids),) a name, and no more than these."""
        self.values[:, ids] = np.nan
        for name, value in info.items():
            self.values[self.names.index(name), ids] = value

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
        return infos


def table(info: Info) -> InfoTable:
    """A copy of an info as a table."""
    return InfoTable(tuple(info), np.array(list(info.values())))


def blank(info: Info, batch: int) -> InfoTable:
    """A table of the names of an info in which nobody has a value."""
    return InfoTable(tuple(info), np.full((len(info), batch), np.nan))
