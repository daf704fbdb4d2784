"""Who takes part in the tracking bench, and in which rows."""

from benchmarks.tracking.own import OWN, OWN_CONDITIONS
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import (
    BOUNDED,
    LATE,
    OWN_WINDOWS,
    SIMULATED,
    WINDOWS,
)
from hrc_env.tracking.estimators import ESTIMATORS

DEFAULT = "particle"
"""The estimator that an environment has if nobody asks for another."""
DLT = "dlt"
"""Plain per-frame triangulation; where cameras do not know names, it is told them."""
FULL_STATE = "full_state"
"""The filter that knows the matched sequences' model; runs on these only."""
SMOOTHER = "smoother"
"""What could have been known in view of the whole clip; not where the bound is a filter's."""
UNBUFFERED = f"{DEFAULT}_unbuffered"
"""The default without a memory for late frames; runs on these only."""
RIVALS = (*(name for name in ESTIMATORS if name != DEFAULT), DLT)
"""Who else there is, of those that know no more than the frames so far."""


def conditions_of(rig: str) -> tuple[str, ...]:
    """What happens on a rig."""
    return OWN_CONDITIONS if rig == OWN else (*SIMULATED, *BOUNDED)


def windows_of(rig: str, condition: str) -> tuple[str, ...]:
    """The rows that a condition gives."""
    return tuple((OWN_WINDOWS if rig == OWN else WINDOWS)[condition])


def names_of(rig: str, condition: str) -> list[str]:
    """Who runs on a rig and a condition, the default first."""
    if condition in BOUNDED:
        return [DEFAULT, *RIVALS, FULL_STATE]
    return [DEFAULT, *RIVALS, SMOOTHER, *([UNBUFFERED] if condition == LATE else [])]


def cells() -> list[tuple[str, str, str]]:
    """(rig, condition, name) of everything that is run."""
    return [
        (rig, condition, name)
        for rig in (*RIGS, OWN)
        for condition in conditions_of(rig)
        for name in names_of(rig, condition)
    ]


def rows() -> list[tuple[str, str, str]]:
    """(rig, condition, window) of every row of the tables."""
    return [
        (rig, condition, window)
        for rig in (*RIGS, OWN)
        for condition in conditions_of(rig)
        for window in windows_of(rig, condition)
    ]
