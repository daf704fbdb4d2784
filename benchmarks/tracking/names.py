"""Names of estimators and rows in the tracking benchmark, and their selection."""

from dataclasses import dataclass

from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import ENV_WINDOWS, MATCHED, SIMULATED, WINDOWS
from hrc_env.core.errors import check_names
from hrc_env.tracking.estimators import ESTIMATORS

DEFAULT = "particle"
"""Name of the default estimator of an environment."""
DLT = "dlt"
"""Name of plain triangulation of each frame, with known identities of detections."""
SMOOTHER = "smoother"
"""Name of the smoother, which uses the whole clip and is not compared with the bound of filters."""


@dataclass(frozen=True, slots=True)
class Selection:
    """The part of the benchmark that is run."""

    estimators: tuple[str, ...] = ()
    """Names of estimators besides the default; all if empty."""
    sequences: tuple[str, ...] = ()
    """Names of rigs and conditions, e.g. "lab", "hard" or "lab.hard"; all if empty."""

    def check(self) -> None:
        """Raise `ConfigError` if a name is unknown, with the valid names."""
        check_names("estimator", self.estimators, [*ESTIMATORS, DLT, SMOOTHER])
        pairs = _all_conditions()
        known = [*RIGS, ENV, *dict.fromkeys(name for _, name in pairs), *map(".".join, pairs)]
        check_names("sequences", self.sequences, known)

    def conditions(self) -> list[tuple[str, str]]:
        """Return the selected pairs (rig, condition)."""
        return [
            (rig, condition)
            for rig, condition in _all_conditions()
            if not self.sequences
            or {rig, condition, f"{rig}.{condition}"} & {*self.sequences}
        ]  # fmt: skip

    def rivals(self) -> list[str]:
        """Return the selected causal estimators other than the default."""
        others = [*(name for name in ESTIMATORS if name != DEFAULT), DLT]
        return [name for name in others if not self.estimators or name in self.estimators]

    def names_of(self, condition: str) -> list[str]:
        """Return the estimators that run on a condition, beginning with the default."""
        smooths = not self.estimators or SMOOTHER in self.estimators
        last = [SMOOTHER] if smooths and condition != MATCHED else []
        return [DEFAULT, *self.rivals(), *last]

    def timed(self) -> list[str]:
        """Return the estimators for which updates are timed."""
        return [name for name in ESTIMATORS if name in (DEFAULT, *self.rivals())]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return (rig, condition, window) of every row of the tables."""
        return [
            (rig, condition, window)
            for rig, condition in self.conditions()
            for window in (ENV_WINDOWS if rig == ENV else WINDOWS)[condition]
        ]

    def rigs_of(self, condition: str) -> list[str]:
        """Return the simulated rigs for which a condition is selected."""
        return [rig for rig in RIGS if (rig, condition) in self.conditions()]


def _all_conditions() -> list[tuple[str, str]]:
    simulated = [(rig, condition) for rig in RIGS for condition in SIMULATED]
    return [*simulated, *((ENV, condition) for condition in ENV_CONDITIONS)]


EVERYTHING = Selection()
"""Selection of the whole benchmark."""


def rows() -> list[tuple[str, str, str]]:
    """Return (rig, condition, window) of every row of the whole benchmark."""
    return EVERYTHING.rows()
