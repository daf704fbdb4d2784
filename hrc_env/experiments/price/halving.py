"""Successive halving: which settings are played on, and which is the best at a rate of contacts.

Two sets of seeds are used. On the choosing seeds, all settings are played; at each level, a setting
has the score

    goals per minute * P(the level is shown to be met on the proof seeds),

where P is predicted from the number of contacts (Poisson counts, with Jeffreys' prior on their
rate). The levels keep settings in turns, beginning with the strictest: each keeps the one with the
highest score at this level that is not yet kept; with equal scores, the one with fewer contacts, or
else with more goals.

The kept settings are played on the proof seeds. There, they are examined one after the other, in
the order of their rates on the choosing seeds: a level is shown to be met if the upper end of the
exact 95 % interval of the rate does not exceed it, and the examination ends with the first setting
for which it is not. This order is fixed before the proof seeds are played, so that the probability
of any false claim is at most 2.5 % per perception setup and level, although several settings are
examined (fixed sequence testing; Angelopoulos et al. 2021, Learn then test, arXiv:2110.01052). Of
the settings that are shown to meet the level, the best is the one with the most goals on the
choosing seeds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy import stats

from hrc_env.core.errors import ConfigError
from hrc_env.evaluation.intervals import estimate_rate


class Status(StrEnum):
    """Whether the best setting meets a level of the rate of contacts."""

    SHOWN = "shown"
    """The upper end of the exact interval does not exceed the level."""
    ESTIMATED = "estimated"
    """The estimate does not exceed the level, but the interval does."""
    MISSED = "missed"
    """No setting was found with an estimate up to the level."""


@dataclass(frozen=True, slots=True)
class Tally:
    """Contacts and goals of a setting on some seeds."""

    contacts: int
    """Number of contacts towards a worker."""
    hours: float
    """Duration of all episodes [h]."""
    goals_per_min: float
    """Goals per minute."""

    def __post_init__(self) -> None:
        if not (self.contacts >= 0 and self.hours > 0):
            raise ConfigError(
                "A tally must have contacts of at least 0 in a positive time, got "
                f"{self.contacts} in {self.hours} h."
            )

    @property
    def rate_per_hour(self) -> float:
        """Estimated rate of contacts [1/h]."""
        return self.contacts / self.hours

    @property
    def max_rate_per_hour(self) -> float:
        """Upper end of the exact 95 % interval of the rate [1/h]."""
        return estimate_rate([self.contacts], self.hours).high

    def predict_success(self, level_per_hour: float, proof_hours: float) -> float:
        """Return the probability that a level is shown to be met on the proof seeds.

        Args:
            level_per_hour: level of the rate of contacts [1/h].
            proof_hours: duration of the episodes on the proof seeds [h].
        """
        most = count_permitted(level_per_hour, proof_hours)
        share = self.hours / (self.hours + proof_hours)
        return float(stats.nbinom.cdf(most, self.contacts + 0.5, share))


def count_permitted(level_per_hour: float, hours: float) -> int:
    """Return the largest number of contacts with which a level is shown to be met; -1 if none is.

    Args:
        level_per_hour: level of the rate of contacts [1/h].
        hours: duration of the episodes [h].
    """
    counts = np.arange(np.ceil(level_per_hour * hours) + 1)
    return int((stats.gamma.ppf(0.975, counts + 1) <= level_per_hour * hours).sum()) - 1


@dataclass(frozen=True, slots=True)
class Best:
    """The best setting of a perception setup at one level."""

    setting: str | None
    """Name of the setting; None if the level is missed."""
    status: Status
    """Whether the setting meets the level."""


def keep_settings(
    chosen: Mapping[str, Tally],
    levels_per_hour: Sequence[float],
    n_kept: int,
    proof_hours: float,
) -> tuple[str, ...]:
    """Return the settings that are played on the proof seeds.

    Args:
        chosen: tallies of all settings on the choosing seeds, by name.
        levels_per_hour: levels of the rate of contacts [1/h].
        n_kept: number of settings to keep.
        proof_hours: duration of the episodes of a setting on the proof seeds [h].
    """
    levels, kept = sorted(levels_per_hour), list[str]()

    def rank(name: str) -> tuple[float, float, float]:
        tally, level = chosen[name], levels[len(kept) % len(levels)]
        score = tally.goals_per_min * tally.predict_success(level, proof_hours)
        return score, -tally.rate_per_hour, tally.goals_per_min

    while len(kept) < min(n_kept, len(chosen)):
        kept.append(max((name for name in chosen if name not in kept), key=rank))
    return tuple(kept)


def find_best(
    chosen: Mapping[str, Tally], proved: Mapping[str, Tally], level_per_hour: float
) -> Best:
    """Return the best of the settings that were played on the proof seeds, at one level.

    Args:
        chosen: tallies on the choosing seeds, by name; they determine order and preference.
        proved: tallies on the proof seeds of the settings that were kept.
        level_per_hour: level of the rate of contacts [1/h].
    """

    def prefer(name: str) -> float:
        return chosen[name].goals_per_min

    order = sorted(proved, key=lambda name: (chosen[name].rate_per_hour, prefer(name)))
    passes = [proved[name].max_rate_per_hour <= level_per_hour for name in order]
    n_shown = int(np.argmin([*passes, False]))
    if shown := order[:n_shown]:
        return Best(max(shown, key=prefer), Status.SHOWN)
    estimated = [name for name in order if proved[name].rate_per_hour <= level_per_hour]
    if estimated:
        return Best(max(estimated, key=prefer), Status.ESTIMATED)
    return Best(None, Status.MISSED)
