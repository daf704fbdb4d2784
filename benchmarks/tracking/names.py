"""Names of estimators and rows in the tracking benchmark, and their selection."""

from dataclasses import dataclass

from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import ENV_WINDOWS, MATCHED, SIMULATED, WINDOWS
from hrc_env.core.errors import check_names
from hrc_env.tracking.estimators import ESTIMATORS

DEFAULT = "particle"
"""Name of the default estimator of the environments."""
DLT = "dlt"
"""Name of the triangulation of each frame (DLT), which uses the true identities of detections."""
SMOOTHER = "smoother"
"""Name of the smoother, which uses the whole sequence and is not compared with the bound for
filters.
"""


@dataclass(frozen=True, slots=True)
class Selection:
    """Selection of the estimators and sequences of the benchmark."""

    estimators: tuple[str, ...] = ()
    """Names of estimators in addition to the default; all if empty."""
    sequences: tuple[str, ...] = ()
    """Names of rigs and conditions, e.g. "lab", "hard" or "lab.hard"; all if empty."""

    def check(self) -> None:
        """Raise `ConfigError` if a name is unknown; the message lists the valid names."""
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
        """Return the names of the selected causal estimators other than the default."""
        others = [*(name for name in ESTIMATORS if name != DEFAULT), DLT]
        return [name for name in others if not self.estimators or name in self.estimators]

    def names_of(self, condition: str) -> list[str]:
        """Return the names of the estimators that run on a condition; the default is the first."""
        smooths = not self.estimators or SMOOTHER in self.estimators
        last = [SMOOTHER] if smooths and condition != MATCHED else []
        return [DEFAULT, *self.rivals(), *last]

    def timed(self) -> list[str]:
        """Return the names of the estimators for which the time of an update is measured."""
        return [name for name in ESTIMATORS if name in (DEFAULT, *self.rivals())]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return the (rig, condition, window) of all table rows."""
        return [
            (rig, condition, window)
            for rig, condition in self.conditions()
            for window in (ENV_WINDOWS if rig == ENV else WINDOWS)[condition]
        ]

    def rigs_of(self, condition: str) -> list[str]:
        """Return the names of the simulated rigs for which a condition is selected."""
        return [rig for rig in RIGS if (rig, condition) in self.conditions()]


def _all_conditions() -> list[tuple[str, str]]:
    simulated = [(rig, condition) for rig in RIGS for condition in SIMULATED]
    return [*simulated, *((ENV, condition) for condition in ENV_CONDITIONS)]


EVERYTHING = Selection()
"""The selection that contains the whole benchmark."""


def rows() -> list[tuple[str, str, str]]:
    """Return the (rig, condition, window) of all table rows of the whole benchmark."""
    return EVERYTHING.rows()
