"""Scripted reaches: times and places at which a worker reaches into the robot's workspace.

A script replaces the random choices of a worker at the robot. The worker stands between the
reaches; each of them is performed by the same planner as all other reaches (`hands.plan_reach`),
with the same trunk and arms, and its speed and place are limited to the ranges from which
`MotionConfig` samples those of other people. A target that the arm cannot reach is moved nearer, as
for other people. A script can be given, or sampled for each episode from a distribution.
"""

from dataclasses import astuple, dataclass, fields
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats

Range = tuple[float, float]
"""A range (minimum, maximum)."""

APART_S = 1.2
"""Minimum time between the starts of two reaches [s], the duration of a short reach."""
LEAD_S = 0.05
"""Time from the beginning of the activity to the start of the hand [s], as in sudden reaches."""
HOLD_S = 0.15
"""Minimum time for which a hand stays at its target [s], as in sudden reaches."""
FIRST_S = (LEAD_S, 3.0)
"""Range of the start of the first reach that is sampled [s]."""
NEXT_S = (APART_S, 3.0)
"""Range of the time from the start of a reach to that of the next one that is sampled [s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Reach:
    """A reach of one hand, that on the side of the target."""

    start_s: float
    """Time of the episode at which the hand starts to move [s]. If the previous reach has not ended
    by then, the reach is left out."""
    radius_m: float
    """Distance of the target from the robot's base axis [m]."""
    azimuth_rad: float
    """Angle about the base axis from the worker to the target [rad]; 0 for a target between the
    worker and the base."""
    z_m: float
    """Height of the target [m]."""
    peak_m_s: float
    """Peak speed of the hand [m/s]. A reach takes at least 0.3 s, and the hand returns at 1.2 m/s
    or less."""
    hold_s: float = HOLD_S
    """Time for which the hand stays at the target [s]."""


class ReachLimits(NamedTuple):
    """Ranges of the parameters of reaches, those of all people (`MotionConfig.reach_limits`)."""

    radius_m: Range
    """Distance of the target from the robot's base axis [m]."""
    azimuth_rad: Range
    """Angle about the base axis from the worker to the target [rad]."""
    z_m: Range
    """Height of the target [m]."""
    peak_m_s: Range
    """Peak speed of the hand [m/s]."""
    hold_s: Range
    """Time for which the hand stays at the target [s]."""


PARAMETERS = ("gap_s", *ReachLimits._fields)
"""Parameters of a sampled reach: the time since the start of the previous reach or, for the first
one, since the beginning of the episode [s]; then those of `ReachLimits`."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ReachDistribution:
    """Normal distributions of the parameters of reaches, from which each episode samples a script.

    Parameters are fractions of their ranges (`FIRST_S`, `NEXT_S` and `ReachLimits`), so that every
    sample is possible for other people, too. Samples below 0 or above 1 become 0 or 1.
    """

    mean: tuple[tuple[float, ...], ...]
    """Means (K, 6) of the parameters `PARAMETERS` of K reaches."""
    deviation: tuple[tuple[float, ...], ...]
    """Standard deviations (K, 6)."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if the shapes or the values are invalid."""
        for name in (each.name for each in fields(self)):
            rows = getattr(self, name)
            if not rows or any(len(row) != len(PARAMETERS) for row in rows):
                raise ConfigError(
                    f"{name} must have {len(PARAMETERS)} numbers for each reach "
                    f"({', '.join(PARAMETERS)}), got {rows}."
                )
            values = np.array(rows, float)
            if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > 1.0:
                raise ConfigError(f"{name} must be fractions from 0 to 1, got {rows}.")
        if len(self.mean) != len(self.deviation):
            raise ConfigError(
                "mean and deviation must have as many reaches, got "
                f"{len(self.mean)} and {len(self.deviation)}."
            )


Script = tuple[Reach, ...]
"""Reaches in the order of their starts."""


def check_script(script: Script, limits: ReachLimits) -> None:
    """Raise `ConfigError` unless reaches follow each other and are within the limits of people."""
    starts = [each.start_s for each in script]
    if script and starts[0] < LEAD_S:
        raise ConfigError(
            f"reaches[0].start_s must be {LEAD_S} s or more, as a worker begins the episode "
            f"standing, got {starts[0]}."
        )
    for k, (before_s, after_s) in enumerate(pairwise(starts)):
        if after_s - before_s < APART_S - 1e-9:
            raise ConfigError(
                f"reaches[{k + 1}].start_s must be {before_s + APART_S:.4g} s or more, {APART_S} s "
                f"after that of the previous reach, got {after_s}."
            )
    for k, reach in enumerate(script):
        for name, (low, high) in limits._asdict().items():
            value = getattr(reach, name)
            if not low - 1e-9 <= value <= high + 1e-9:
                raise ConfigError(
                    f"reaches[{k}].{name} must be from {low:g} to {high:g}, the range of other "
                    f"people (config.motion), got {value}."
                )


def make_script(fractions: Floats, limits: ReachLimits) -> Script:
    """Return the script that fractions (K, 6) of the ranges of `PARAMETERS` describe.

    Args:
        fractions: fractions of the ranges; values below 0 or above 1 become 0 or 1.
        limits: ranges of the parameters.
    """
    script, start_s = [], 0.0
    for k, row in enumerate(np.clip(fractions, 0.0, 1.0).tolist()):
        ranges = (NEXT_S if k else FIRST_S, *limits)
        values = [low + x * (high - low) for x, (low, high) in zip(row, ranges, strict=True)]
        start_s += values[0]
        script.append(Reach(start_s, *values[1:]))
    return tuple(script)


def measure_fractions(script: Script, limits: ReachLimits) -> Floats:
    """Return the fractions (K, 6) from which `make_script` makes a script."""
    rows, before_s = [], 0.0
    for k, reach in enumerate(script):
        start_s, *others = astuple(reach)
        ranges = (NEXT_S if k else FIRST_S, *limits)
        values = (start_s - before_s, *others)
        rows.append([
            (value - low) / (high - low) for value, (low, high) in zip(values, ranges, strict=True)
        ])  # fmt: skip
        before_s = start_s
    return np.array(rows, float).reshape(len(script), len(PARAMETERS))


def draw_script(
    distribution: ReachDistribution, limits: ReachLimits, rng: np.random.Generator
) -> Script:
    """Return a script sampled from a distribution."""
    mean, deviation = np.array(distribution.mean), np.array(distribution.deviation)
    return make_script(rng.normal(mean, deviation), limits)


def find_next_reach(script: Script, clock_s: float) -> Reach | None:
    """Return the first reach of a script that has not started at a time of the episode [s]."""
    return next((reach for reach in script if reach.start_s >= clock_s - 1e-9), None)
