"""Other people's code on the bench's sequences: what it is, and whether it is installed.

| peer | what is run |
|---|---|
| `aniposelib` | its optimiser of a whole clip (`optim_points`): smooth, bones of constant length |
| `particles` | its bootstrap filter, 1000 particles, one for each joint |
| `filterpy` | its unscented Kalman filter, one for each joint |

The two filters are what a user of these libraries would write: constant velocity, pixels as
measurements, and a defence against gross errors (a likelihood with outliers; a gate, and a
joint that is begun anew when the gate has shut it out). All are given every camera's pixels
of every frame and the detector's true standard deviation. None can say which side is which.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec

from hrc_env.core.typing import Floats, Points2, Points3

INSTALL = 'pip install -c constraints.txt -e ".[peers]"'


@dataclass(frozen=True, slots=True)
class Peer:
    """Somebody else's estimator."""

    module: str
    """What must be importable."""
    home: str
    """The module of this package that calls it."""

    @property
    def installed(self) -> bool:
        """Whether it can be run here."""
        return find_spec(self.module) is not None

    @property
    def follow(self) -> Callable[[Floats, Points2, int], Points3]:
        """Joints (T, J, 3) [m] from P (C, 3, 4), px (T, C, J, 2) with NaN, and a seed."""
        return import_module(self.home).follow


PEERS: dict[str, Peer] = {
    name: Peer(name, f"benchmarks.tracking.baselines.{name}")
    for name in ("aniposelib", "particles", "filterpy")
}


def missing_sentence(names: list[str]) -> str:
    """Which peers are missing, and how to get them."""
    if not names:
        return "All peers are installed."
    return f"Not installed, so not run: {', '.join(names)}. Get them with: {INSTALL}"
