"""Who takes part in the tracking bench, and in which rows."""

from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import ENV_WINDOWS, MATCHED, SIMULATED, WINDOWS
from hrc_env.tracking.estimators import ESTIMATORS

DEFAULT = "particle"
"""The estimator that an environment has if nobody asks for another."""
DLT = "dlt"
"""Plain per-frame triangulation; where cameras do not know names, it is told them."""
SMOOTHER = "smoother"
"""What could have been known in view of the whole clip; not where the bound is a filter's."""
RIVALS = (*(name for name in ESTIMATORS if name != DEFAULT), DLT)
"""Who else there is, of those that know no more than the frames so far."""


def conditions() -> list[tuple[str, str]]:
    """(rig, condition) of everything that is run."""
    simulated = [(rig, condition) for rig in RIGS for condition in SIMULATED]
    return [*simulated, *((ENV, condition) for condition in ENV_CONDITIONS)]


def names_of(condition: str) -> list[str]:
    """Who runs on a condition, the default first."""
    return [DEFAULT, *RIVALS, *([] if condition == MATCHED else [SMOOTHER])]


def rows() -> list[tuple[str, str, str]]:
    """(rig, condition, window) of every row of the tables."""
    return [
        (rig, condition, window)
        for rig, condition in conditions()
        for window in (ENV_WINDOWS if rig == ENV else WINDOWS)[condition]
    ]
