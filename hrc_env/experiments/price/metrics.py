"""From sums of episodes to prices: the margin of every pair of eyes at the level, what it leaves.

All eyes of a task have the same seeds: what is said of two of them is compared draw by draw.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.evaluation.intervals import find_crossing, estimate_goal_rate, estimate_rate, estimate_ratio
from hrc_env.evaluation.sums import COST_UNIT
from hrc_env.experiments.price.episodes import CONTACTS
from hrc_env.experiments.price.eyes import ELSEWHERE, FOUR, ONE, TRUTH
from hrc_env.experiments.price.search import Tried, draws, falling
from hrc_env.experiments.report import Metrics
from hrc_env.experiments.stage import Rows

N_DRAWS = 1000
EPISODE_MIN = 10.0 / 60.0
"""Contacts are given in a thousand episodes of so many minutes, also where episodes are longer."""
PER = 1000 * EPISODE_MIN
UNIT = "per 1000 episodes of 10 s"
CONTRASTS: dict[str, tuple[str, str]] = {
    "three_cameras": (FOUR, "three_cameras"),
    "two_cameras": (FOUR, "two_cameras"),
    "one_camera": (FOUR, ONE),
    "late_120ms": (FOUR, "late_120ms"),
    "late_200ms": (FOUR, "late_200ms"),
    "telling_120ms": ("late_120ms", "late_120ms_untold"),
    "telling_200ms": ("late_200ms", "late_200ms_untold"),
    "kalman": (FOUR, "kalman"),
    "paper_restarts": (FOUR, "paper_restarts"),
    "triangulation": (FOUR, "triangulation"),
    "calibration": (FOUR, "all_turned_1deg"),
    "half_covariance": (FOUR, "half_covariance"),
    "twice_covariance": (FOUR, "twice_covariance"),
    "honesty_of_one": (ONE, "one_camera_half_covariance"),
    "truth": (TRUTH, FOUR),
    "calibration_over_accuracy": ("triangulation", "all_turned_1deg"),
}
"""Questions: the share that the first eyes keep less what the second ones do."""


@dataclass(frozen=True, slots=True)
class Row:
    """What was played with one pair of eyes."""

    searched: Mapping[float, Rows]
    """What came of each margin [m] that was tried."""
    margin_m: float
    """Where the level seemed to be [m],"""
    fresh: Rows
    """and what came of it on fresh seeds."""

    def at(self, level: float) -> Floats:
        """(1 + R, 2) margin [m] and goals a minute at a level in `UNIT`, by how seeds are drawn;
        the first of all seeds once."""
        margins_m = sorted(self.searched)

        def sums(name: str) -> Floats:
            return np.array([self.searched[m][name] for m in margins_m], float)

        def fresh(name: str) -> Floats:
            return np.array(self.fresh[name], float)

        tried = Tried(
            np.array(margins_m), sums("towards"), sums("achieved"), sums("minutes"),
            self.margin_m, fresh("towards"), fresh("achieved"), fresh("minutes"),
        )  # fmt: skip
        weights = draws(tried.events.shape[1], len(tried.fresh_events), N_DRAWS)
        return tried.at(level / PER, *weights)

    def ends_at(self, margin_m: float) -> bool:
        """Whether none that was tried lies beyond a margin."""
        return margin_m in (min(self.searched), max(self.searched))


@dataclass(frozen=True, slots=True)
class Played:
    """All episodes of the experiment."""

    table: Mapping[str, Mapping[str, Row]]
    """By task and eyes."""
    alone: Mapping[str, Rows]
    """Without a shield, by task."""
    pixels: Mapping[str, Rows]
    """The few that are played at two perception levels, by level."""


def supposed_m(tried: Mapping[float, Rows], level: float) -> float:
    """The margin [m] at which a search supposes the level, to a millimetre."""
    margins_m = sorted(tried)
    events, minutes = (
        np.array([np.sum(tried[m][name]) for m in margins_m]) for name in ("towards", "minutes")
    )
    curve = falling(events, minutes)
    return round(find_crossing(np.array(margins_m), curve, np.log(level / PER)), 3)


def metrics_of(
    table: Mapping[str, Mapping[str, Row]],
    alone: Mapping[str, Rows],
    pixels: Mapping[str, Rows],
    level: float,
) -> dict[str, Metric]:
    """By `<task>.<eyes>.<what>`, `<task>.unshielded.<what>`, `<task>.ranking`, `worth.<question>`
    and `slice.<level>.<what>`, from rows by task and eyes, unshielded episodes by task, and the
    few with the emulator and with rendered images."""
    metrics = {
        f"slice.{name}.{what}": metric
        for name, rows in pixels.items()
        for what, metric in _rates(rows).items()
    }
    for task, rows in table.items():
        found = {name: row.at(level) for name, row in rows.items()}
        most = _drawn_rate(alone[task])
        shares = {name: _ratio(drawn[:, 1], most) for name, drawn in found.items()}
        of_all = {
            f"unshielded.{what}": each for what, each in _rates(alone[task]).items()
        } | _ranking(shares, len(alone[task]["minutes"]))
        for name, row in rows.items():
            truth = shares.get(TRUTH)
            for what, metric in _of_row(row, found[name], shares[name], truth).items():
                of_all[f"{name}.{what}"] = metric
        metrics |= {f"{task}.{what}": each for what, each in of_all.items()}
        if task == next(iter(table)):
            metrics |= _worth(shares, len(alone[task]["minutes"]))
    return metrics


def _rates(rows: Rows) -> Metrics:
    """What is counted in episodes."""
    per = np.array(rows["minutes"]) / PER
    contacts = {kind: estimate_rate(rows[kind], per, UNIT) for kind in CONTACTS}
    return {
        **contacts,
        "goals_per_min": estimate_goal_rate(rows["achieved"], rows["minutes"]),
        "cost": estimate_ratio(rows["cost"], 1000 * per, f"{COST_UNIT} per episode of 10 s"),
    }


def _of_row(row: Row, drawn: Floats, share: Floats, truth: Floats | None) -> Metrics:
    """Return the numbers of one pair of eyes: draws at the level, and shares of the throughput
    of an unshielded robot and of one that is given true joints."""
    n, margin_m = len(row.fresh["minutes"]), row.margin_m
    of_truth = {} if truth is None else {"of_truth": _metric(_ratio(share, truth), "share", n)}
    return {
        "margin_m": _metric(drawn[:, 0], "m", n),
        "goals_per_min": _metric(drawn[:, 1], "1/min", n),
        "share": _metric(share, "share", n),
        **of_truth,
        "confirmed.margin_m": Metric(margin_m, margin_m, margin_m, "m", n),
        **{f"confirmed.{what}": each for what, each in _rates(row.fresh).items()},
    }


def _drawn_rate(rows: Rows) -> Floats:
    """(1 + R,) achieved a minute, over the draws of fresh seeds."""
    minutes = np.array(rows["minutes"])
    _, fresh = draws(1, len(minutes), N_DRAWS)
    return np.asarray((fresh @ np.array(rows["achieved"], float)) / (fresh @ minutes))


def _ratio(above: Floats, below: Floats) -> Floats:
    """Of each draw; NaN where nothing was achieved."""
    return np.divide(above, below, out=np.full_like(above, np.nan), where=below > 0)


def _worth(shares: Mapping[str, Floats], n: int) -> dict[str, Metric]:
    """What is lost by each of `CONTRASTS` whose eyes there are."""
    return {
        f"worth.{question}": _metric(shares[ours] - shares[theirs], "share", n)
        for question, (ours, theirs) in CONTRASTS.items()
        if ours in shares and theirs in shares
    }


def _ranking(shares: Mapping[str, Floats], n: int) -> dict[str, Metric]:
    """In which share of the draws truth keeps as much as four cameras and these as much as one."""
    if not set(ELSEWHERE) <= shares.keys():
        return {}
    truth, four, one = (shares[name] for name in ELSEWHERE)
    holds = float(((truth >= four) & (four >= one))[1:].mean())
    return {
        "ranking": Metric(holds, holds, holds, "share of draws", n),
        "lost_by_four": _metric(truth - four, "share", n),
        "lost_by_one": _metric(four - one, "share", n),
    }


def _metric(drawn: Floats, unit: str, n: int) -> Metric:
    """The first of the draws with the 95 % interval of the others; NaN where it has no value."""
    known: Any = drawn[1:][np.isfinite(drawn[1:])]
    if not (np.isfinite(drawn[0]) and known.size):
        return Metric(np.nan, np.nan, np.nan, unit, n)
    low, high = np.quantile(known, [0.025, 0.975])
    return Metric(float(drawn[0]), float(low), float(high), unit, n)
