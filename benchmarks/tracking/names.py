"""The participants of the tracking benchmark, and their rows."""

from dataclasses import dataclass

from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import ENV_WINDOWS, MATCHED, SIMULATED, WINDOWS
from hrc_env.core.errors import check_names
from hrc_env.tracking.estimators import ESTIMATORS

DEFAULT = "particle"
"""Default estimator of an environment."""
DLT = "dlt"
"""Plain triangulation per frame; it knows which person a detection belongs to."""
SMOOTHER = "smoother"
"""The smoother, which uses the whole clip; it is not compared with the filter's bound."""


@dataclass(frozen=True, slots=True)
class Selection:
    """The part of the benchmark that is run."""

    estimators: tuple[str, ...] = ()
    """Estimators besides the default; empty: all."""
    sequences: tuple[str, ...] = ()
    """Rigs and conditions: "lab", "hard" or "lab.hard"; empty: all."""

    def check(self) -> None:
        """Raise `ConfigError` for unknown names, with the valid ones."""
        check_names("estimator", self.estimators, [*ESTIMATORS, DLT, SMOOTHER])
        pairs = _all_conditions()
        known = [*RIGS, ENV, *dict.fromkeys(name for _, name in pairs), *map(".".join, pairs)]
        check_names("sequences", self.sequences, known)

    def conditions(self) -> list[tuple[str, str]]:
        """Return (rig, condition) of everything that is run."""
        return [
            (rig, condition)
            for rig, condition in _all_conditions()
            if not self.sequences
            or {rig, condition, f"{rig}.{condition}"} & {*self.sequences}
        ]  # fmt: skip

    def rivals(self) -> list[str]:
        """Return the other estimators that use only the frames up to now."""
        others = [*(name for name in ESTIMATORS if name != DEFAULT), DLT]
        return [name for name in others if not self.estimators or name in self.estimators]

    def names_of(self, condition: str) -> list[str]:
        """Return the estimators that run on a condition, the default first."""
        smooths = not self.estimators or SMOOTHER in self.estimators
        last = [SMOOTHER] if smooths and condition != MATCHED else []
        return [DEFAULT, *self.rivals(), *last]

    def timed(self) -> list[str]:
        """Return the estimators that are timed."""
        return [name for name in ESTIMATORS if name in (DEFAULT, *self.rivals())]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return (rig, condition, window) of every row of the tables."""
        return [
            (rig, condition, window)
            for rig, condition in self.conditions()
            for window in (ENV_WINDOWS if rig == ENV else WINDOWS)[condition]
        ]

    def rigs_of(self, condition: str) -> list[str]:
        """Return the simulated rigs on which a condition is run."""
        return [rig for rig in RIGS if (rig, condition) in self.conditions()]


def _all_conditions() -> list[tuple[str, str]]:
    simulated = [(rig, condition) for rig in RIGS for condition in SIMULATED]
    return [*simulated, *((ENV, condition) for condition in ENV_CONDITIONS)]


EVERYTHING = Selection()
"""The whole benchmark."""


def rows() -> list[tuple[str, str, str]]:
    """Return (rig, condition, window) of every row of the whole benchmark."""
    return EVERYTHING.rows()
