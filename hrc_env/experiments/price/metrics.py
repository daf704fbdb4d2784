"""Metrics of the price study: the margin of each setup, and its throughput at that margin.

A setup's margin is the one at which its rate of contacts equals the given level. All setups of a
task have the same seeds; differences between two setups are computed for each bootstrap draw.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.evaluation.intervals import (
    MIN_SEEDS,
    P,
    adjust_metrics,
    estimate_burst_rate,
    estimate_goal_rate,
    estimate_rate,
    estimate_ratio,
    estimate_share_of,
    find_crossing,
    make_percentile_metric,
)
from hrc_env.evaluation.sums import ABOVE, COST_UNIT, INTERVENTIONS, RATED
from hrc_env.experiments.price.episodes import CONTACTS
from hrc_env.experiments.price.search import MarginSearch, draw_seeds, fit_falling_rates
from hrc_env.experiments.price.setups import ELSEWHERE, FOUR, ONE, TRUTH
from hrc_env.experiments.report import Metrics
from hrc_env.experiments.stage import Rows

N_DRAWS = 2000
"""Number of bootstrap draws. The smallest p-value of a contrast is 1 / 1000, which remains below
.05 if it is adjusted for 16 contrasts."""
EPISODE_MIN = 10.0 / 60.0
"""Duration of the episodes in `UNIT` [min], which does not depend on the task."""
PER = 1000 * EPISODE_MIN
"""Exposure to which numbers of contacts are scaled [min]."""
UNIT = "per 1000 episodes of 10 s"
"""Unit of rates of contacts."""


class Contrast(NamedTuple):
    """Two perception setups, with relative throughputs that are compared."""

    better: str
    worse: str


CONTRASTS: dict[str, Contrast] = {
    "three_cameras": Contrast(FOUR, "three_cameras"),
    "two_cameras": Contrast(FOUR, "two_cameras"),
    "one_camera": Contrast(FOUR, ONE),
    "late_120ms": Contrast(FOUR, "late_120ms"),
    "late_200ms": Contrast(FOUR, "late_200ms"),
    "telling_120ms": Contrast("late_120ms", "late_120ms_untold"),
    "telling_200ms": Contrast("late_200ms", "late_200ms_untold"),
    "kalman": Contrast(FOUR, "kalman"),
    "paper_restarts": Contrast(FOUR, "paper_restarts"),
    "triangulation": Contrast(FOUR, "triangulation"),
    "calibration": Contrast(FOUR, "all_turned_1deg"),
    "half_covariance": Contrast(FOUR, "half_covariance"),
    "twice_covariance": Contrast(FOUR, "twice_covariance"),
    "honesty_of_one": Contrast(ONE, "one_camera_half_covariance"),
    "truth": Contrast(TRUTH, FOUR),
    "calibration_over_accuracy": Contrast("triangulation", "all_turned_1deg"),
}
"""Contrasts by name. A contrast is the throughput of the better setup minus that of the worse
one."""


@dataclass(frozen=True, slots=True)
class Row:
    """The episodes of one perception setup."""

    searched: Mapping[float, Rows]
    """Sums of the episodes with each margin [m] that was tried."""
    margin_m: float
    """Margin that the search returned [m]."""
    fresh: Rows
    """Sums of episodes with that margin on new seeds."""

    def evaluate(self, level: float) -> Floats:
        """Return margin [m] and goals per minute at a level of contacts, for all draws (1 + R, 2).

        In the first draw, every seed counts once.

        Args:
            level: rate of contacts in `UNIT`.
        """
        margins_m = sorted(self.searched)

        def sums(name: str) -> Floats:
            return np.array([self.searched[m][name] for m in margins_m], float)

        def fresh(name: str) -> Floats:
            return np.array(self.fresh[name], float)

        search = MarginSearch(
            np.array(margins_m), sums("towards"), sums("achieved"), sums("minutes"),
            self.margin_m, fresh("towards"), fresh("achieved"), fresh("minutes"),
        )  # fmt: skip
        weights = draw_seeds(search.events.shape[1], len(search.fresh_events), N_DRAWS)
        return search.evaluate(level / PER, weights.search, weights.fresh)

    def ends_at(self, margin_m: float) -> bool:
        """Return whether a margin is the lowest or the highest that was tried."""
        return margin_m in (min(self.searched), max(self.searched))


@dataclass(frozen=True, slots=True)
class Played:
    """All episodes of the study."""

    table: Mapping[str, Mapping[str, Row]]
    """Rows by task and perception setup."""
    alone: Mapping[str, Rows]
    """Sums of episodes without a shield, by task."""
    pixels: Mapping[str, Rows]
    """Sums of the few episodes that are played at two perception levels, by level."""


def suppose_margin_m(tried: Mapping[float, Rows], level: float) -> float:
    """Return the margin for a level of the rate of contacts, rounded to millimetres [m]."""
    margins_m = sorted(tried)
    events, minutes = (
        np.array([np.sum(tried[m][name]) for m in margins_m]) for name in ("towards", "minutes")
    )
    curve = fit_falling_rates(events, minutes)
    return round(find_crossing(np.array(margins_m), curve, np.log(level / PER)), 3)


def compute_metrics(played: Played, level: float) -> dict[str, Metric]:
    """Return all metrics by name.

    Names are `<task>.<setup>.<metric>`, `<task>.unshielded.<metric>`, `<task>.ranking`,
    `worth.<contrast>` and `slice.<level>.<metric>`.

    Args:
        played: all episodes.
        level: rate of contacts in `UNIT` at which setups are compared.
    """
    metrics = {
        f"slice.{name}.{key}": metric
        for name, rows in played.pixels.items()
        for key, metric in _measure_rates(rows).items()
    }
    for task, rows in played.table.items():
        alone = played.alone[task]
        draws = {name: row.evaluate(level) for name, row in rows.items()}
        most, n = _draw_rates(alone), len(alone["minutes"])
        shares = {name: _divide(drawn[:, 1], most) for name, drawn in draws.items()}
        of_task = {f"unshielded.{key}": metric for key, metric in _measure_rates(alone).items()}
        of_task |= _measure_ranking(shares, n)
        for name, row in rows.items():
            truth = shares.get(TRUTH)
            for key, metric in _measure_row(row, draws[name], shares[name], truth).items():
                of_task[f"{name}.{key}"] = metric
        metrics |= {f"{task}.{key}": metric for key, metric in of_task.items()}
        if task == next(iter(played.table)):
            metrics |= _measure_contrasts(shares, n)
    return metrics | adjust_metrics(metrics)


def _measure_rates(rows: Rows) -> Metrics:
    """Return the rates of contacts and goals and the cost of episodes, with their intervals."""
    per = np.array(rows["minutes"]) / PER
    every = np.sum([rows[kind] for kind in CONTACTS], axis=0)
    contacts = {
        **{kind: estimate_rate(rows[kind], per, UNIT) for kind in CONTACTS},
        "contacts": estimate_rate(every, per, UNIT),
        "above_force_limit": estimate_share_of(rows[ABOVE], rows[RATED]),
    }
    if INTERVENTIONS in rows:
        hours = np.array(rows["minutes"]) / 60
        contacts[INTERVENTIONS] = estimate_burst_rate(rows[INTERVENTIONS], hours, "1/h")
    return {
        **contacts,
        "goals_per_min": estimate_goal_rate(rows["achieved"], rows["minutes"]),
        "cost": estimate_ratio(rows["cost"], 1000 * per, f"{COST_UNIT} per episode of 10 s"),
    }


def _measure_row(row: Row, drawn: Floats, share: Floats, truth: Floats | None) -> Metrics:
    """Return the metrics of one perception setup.

    Args:
        row: the episodes of the setup.
        drawn: margin and goals per minute (1 + R, 2) at the level.
        share: throughput (1 + R,) as a fraction of that of a robot without a shield.
        truth: the same fraction with true joints, or None if these were not played.
    """
    n, margin_m = len(row.fresh["minutes"]), row.margin_m
    of_truth = (
        {} if truth is None else {"of_truth": _make_metric(_divide(share, truth), "share", n)}
    )
    return {
        "margin_m": _make_metric(drawn[:, 0], "m", n),
        "goals_per_min": _make_metric(drawn[:, 1], "1/min", n),
        "share": _make_metric(share, "share", n),
        **of_truth,
        "confirmed.margin_m": Metric(margin_m, margin_m, margin_m, "m", 1),
        **{f"confirmed.{key}": metric for key, metric in _measure_rates(row.fresh).items()},
    }


def _draw_rates(rows: Rows) -> Floats:
    """Return the goals per minute (1 + R,) for all draws of the new seeds."""
    minutes = np.array(rows["minutes"])
    fresh = draw_seeds(1, len(minutes), N_DRAWS).fresh
    return np.asarray((fresh @ np.array(rows["achieved"], float)) / (fresh @ minutes))


def _divide(above: Floats, below: Floats) -> Floats:
    """Return the ratio for each draw, NaN if the denominator is 0."""
    return np.divide(above, below, out=np.full_like(above, np.nan), where=below > 0)


def _measure_contrasts(shares: Mapping[str, Floats], n: int) -> dict[str, Metric]:
    """Return the differences of all `CONTRASTS` that were played, and their p-values.

    A p-value is twice the fraction of bootstrap draws on the other side of zero (Davison and
    Hinkley 1997, Bootstrap Methods and their Application, ch. 4).
    """
    metrics: dict[str, Metric] = {}
    for name, pair in CONTRASTS.items():
        if pair.better in shares and pair.worse in shares:
            drawn = shares[pair.better] - shares[pair.worse]
            p = _test_difference(drawn[1:]) if n >= MIN_SEEDS else np.nan
            metrics[f"worth.{name}"] = _make_metric(drawn, "share", n)
            metrics[f"{P}worth.{name}"] = Metric(p, p, p, "p", n)
    return metrics


def _test_difference(drawn: Floats) -> float:
    """Return the two-sided p-value of a difference from its bootstrap draws (R,)."""
    known: Floats = drawn[np.isfinite(drawn)]
    if not known.size:
        return np.nan
    n_other = min(int((known <= 0).sum()), int((known >= 0).sum()))
    return min(2 * (1 + n_other) / (1 + known.size), 1.0)


def _measure_ranking(shares: Mapping[str, Floats], n: int) -> dict[str, Metric]:
    """Return the fraction of draws with the order truth, four cameras, one camera, and the losses.

    Setups are ordered by decreasing throughput. A loss is the difference between a setup and the
    next.
    """
    if not set(ELSEWHERE) <= shares.keys():
        return {}
    truth, four, one = (shares[name] for name in ELSEWHERE)
    holds = float(((truth >= four) & (four >= one))[1:].mean())
    return {
        "ranking": Metric(holds, holds, holds, "share of draws", n),
        "lost_by_four": _make_metric(truth - four, "share", n),
        "lost_by_one": _make_metric(four - one, "share", n),
    }


def _make_metric(drawn: Floats, unit: str, n: int) -> Metric:
    """Return the first draw with the 95 % interval of the others, or NaN if it is not finite."""
    known: Any = drawn[1:][np.isfinite(drawn[1:])]
    point = float(drawn[0]) if np.isfinite(drawn[0]) and known.size else np.nan
    return make_percentile_metric(point, known, unit, n)
