"""Metrics of the impact study: rows, differences from the reference, and the cost of latency.

The loss of separation due to latency is measured in two ways, both relative to the ground truth:

- in the belief, as the increase of the 95th percentile of the estimated minus the true separation;
- in closed loop, as the margin that `scripted_slowed` must add to its limits to reach the fraction
  of missed stops without latency.

It is predicted as latency x (v_h + v_r), with either the nominal speed of a worker or measured
speeds. A third prediction assumes that the effect of latency is independent of other errors: their
squares add up, and the robot's speed has no effect, because the robot's encoders have no latency.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation import intervals
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS, Bins
from hrc_env.evaluation.intervals import (
    compare_paired,
    estimate_clustered_share,
    estimate_rate,
    estimate_ratio,
    make_ratio,
)
from hrc_env.evaluation.sums import ABOVE, COST_UNIT, INTERVENTIONS, RATED
from hrc_env.experiments.impact.policies import SLOWED, Policy
from hrc_env.experiments.report import Metrics
from hrc_env.experiments.setups import LATE, REFERENCE, PerceptionSetup, find_setup

Row = Mapping[str, list[Any]]
"""Sums by name, one value per episode."""
Played = Mapping[tuple[str, str], Row]
"""Rows by policy and setup."""
NOMINAL_MPS = 1.6
"""Nominal speed of a worker's approach [m/s]. Source: ISO 13855, as in Marvel and Norcross 2017,
PMC5117641; verify it against the standard before certification."""
CONTACTS = ("contacts_towards", "contacts_standing", "contacts_fleeing")
"""Rare events that are counted per minute."""
A_MINUTE = {"goals_per_min": "goals", **{name: name for name in CONTACTS}}
"""Metrics per minute, with the names of the sums that are divided by the duration."""
SEVERE, ALL_CONTACTS = "above_force_limit", "contacts"
"""Metrics: fraction of contacts with a force above the limit of the touched region, and contacts of
all kinds per minute."""
PER_1000 = (
    "missed_stops", "false_stops", "called_stops", "missed_slowings", "false_slowings",
    "called_slowings", "approaches",
)  # fmt: skip
"""Sums that are reported per 1,000 control steps; `called_slowings` counts steps near the
worker."""
PER_1000_UNIT = "per 1000 steps"
AN_EPISODE = dict.fromkeys(("cost", "cost_towards"), f"{COST_UNIT} per episode")
"""Sums that are averaged over episodes, with their units."""


class Quantile(NamedTuple):
    """A metric that is a quantile of a histogram."""

    bins: Bins
    counts: str
    """Name of the sum with the histogram, without "_counts"."""
    q: float
    unit: str


QUANTILES = {
    "z_d_m": Quantile(ERRORS_M, "error", 0.95, "m"),
    "optimism_p50_m": Quantile(GAPS_M, "optimism", 0.5, "m"),
    "optimism_p95_m": Quantile(GAPS_M, "optimism", 0.95, "m"),
    "v_h_mps": Quantile(SPEEDS_MPS, "worker_speed", 0.95, "m/s"),
    "v_r_mps": Quantile(SPEEDS_MPS, "robot_speed", 0.95, "m/s"),
}
COMPARED = (
    "goals_per_min", "cost", "cost_towards", "called_slowings", "separation_min_m",
    "contacts_towards", "contacts_standing", "approaches", "missed_stops", "false_stops",
)  # fmt: skip
"""Metrics that, like Z_d, are compared with the reference episode by episode."""


class Ratio(NamedTuple):
    """A metric that is the ratio of two sums over episodes."""

    numerator: Floats
    """Numerators (n,), one per episode."""
    denominator: Floats
    """Denominators (n,), one per episode."""
    unit: str


def compute_metrics(table: Played, margins_m: Sequence[float]) -> dict[str, Metric]:
    """Return all metrics by name.

    Names are `<policy>.<setup>.<metric>`, the same with the prefixes `difference.` and `p.` (see
    `intervals.compare_paired`), and `lateness.<setup>.<way>`.

    Args:
        table: the rows.
        margins_m: margins that were compared [m].
    """
    metrics: dict[str, Metric] = {}
    for (policy, setup), row in table.items():
        for name, metric in _measure_row(row).items():
            metrics[f"{policy}.{setup}.{name}"] = metric
        if setup != REFERENCE and (policy, REFERENCE) in table:
            metrics |= _compare_rows(f"{policy}.{setup}", row, table[policy, REFERENCE])
    for policy, name in table:
        setup = find_setup(name)
        on_time = replace(setup, latency_s=0.0, is_told=True).name
        twin = on_time if (policy, on_time) in table else name
        z_d, v_r = metrics[f"{policy}.{twin}.z_d_m"], metrics[f"{policy}.{name}.v_r_mps"]
        metrics[f"{policy}.{name}.tax_m"] = _compute_tax(setup.latency_s, z_d, v_r)
    if (SLOWED, REFERENCE) in table:
        for setup in LATE:
            if (SLOWED, setup.name) in table:
                for how, metric in _measure_lateness(setup, table, metrics, margins_m).items():
                    metrics[f"lateness.{setup.name}.{how}"] = metric
    return metrics | intervals.adjust_metrics(metrics)


def _compare_rows(name: str, row: Row, reference: Row) -> Metrics:
    """Return differences from the reference over the seeds that both rows have."""
    n, ours, theirs = len(row["walk"]), _compute_ratios(row), _compute_ratios(reference)
    metrics: dict[str, Metric] = {}
    for key in COMPARED:
        a, b = ours[key], theirs[key]
        b = Ratio(b.numerator[:n], b.denominator[:n], b.unit)
        ratio = make_ratio([*a.numerator, *b.numerator], [*a.denominator, *b.denominator])
        metrics |= compare_paired(f"{name}.{key}", ratio, n, a.unit, 2000)
        if key in CONTACTS:
            rates = (estimate_rate(r.numerator, r.denominator, a.unit) for r in (a, b))
            metrics[f"difference.{name}.{key}"] = intervals.subtract_rates(*rates)
    z_d = QUANTILES["z_d_m"]
    counts = [*row[f"{z_d.counts}_counts"], *reference[f"{z_d.counts}_counts"][:n]]
    both = intervals.make_binned_quantile(z_d.bins, counts, z_d.q)
    return metrics | compare_paired(f"{name}.z_d_m", both, n, z_d.unit, 400)


def _measure_row(row: Row) -> dict[str, Metric]:
    """Return the metrics of a row's episodes."""
    ratios = _compute_ratios(row)
    metrics = {
        key: (estimate_rate if key in CONTACTS else estimate_ratio)(*ratio)
        for key, ratio in ratios.items()
        if key not in PER_1000
    }
    for key in PER_1000:
        n_steps = ratios[key].denominator
        metrics[key] = estimate_clustered_share(row[key], n_steps, PER_1000_UNIT, 1000.0)
    contacts, minutes = np.sum([row[kind] for kind in CONTACTS], axis=0), np.array(row["minutes"])
    metrics[ALL_CONTACTS] = estimate_rate(contacts, minutes, "1/min")
    metrics[SEVERE] = intervals.estimate_share_of(row[ABOVE], row[RATED])
    if INTERVENTIONS in row:
        metrics[INTERVENTIONS] = intervals.estimate_burst_rate(
            row[INTERVENTIONS], minutes / 60, "1/h"
        )
    goals = ratios["goals_per_min"]
    metrics["goals_per_min"] = intervals.estimate_goal_rate(goals.numerator, goals.denominator)
    metrics["separation_min_m"] = intervals.estimate_iqm(row["separation_min_m"], "m")
    for key, (bins, name, q, unit) in QUANTILES.items():
        counts = row[f"{name}_counts"]
        metrics[key] = intervals.estimate_binned_quantile(bins, counts, q, unit)
    return metrics


def _compute_ratios(row: Row) -> dict[str, Ratio]:
    """Return the ratios of a row by metric."""
    n_steps = np.sum(row["error_counts"], axis=1) / N_JOINTS
    minutes, ones = np.array(row["minutes"]), np.ones(len(n_steps))
    ratios = {"separation_min_m": Ratio(np.array(row["separation_min_m"], float), ones, "m")}
    for key, unit in AN_EPISODE.items():
        ratios[key] = Ratio(np.array(row[key], float), ones, unit)
    for key, name in A_MINUTE.items():
        ratios[key] = Ratio(np.array(row[name], float), minutes, "1/min")
    for key in PER_1000:
        ratios[key] = Ratio(1000.0 * np.array(row[key]), n_steps, PER_1000_UNIT)
    return ratios


def _compute_tax(latency_s: float, z_d: Metric, v_r: Metric) -> Metric:
    """Return the separation Z_d + latency x (v_h + v_r) that perception requires [m].

    Z_d is the 95th percentile of the position errors in the same setup without latency, so that
    latency is not counted twice; v_h is the worker's nominal speed, and v_r the robot's measured
    speed.
    """
    value, low, high = (
        getattr(z_d, end) + latency_s * (NOMINAL_MPS + getattr(v_r, end))
        for end in ("value", "low", "high")
    )
    return Metric(value, low, high, "m", z_d.n)


def _measure_lateness(
    setup: PerceptionSetup, table: Played, metrics: Metrics, margins_m: Sequence[float]
) -> dict[str, Metric]:
    """Return the separation lost to latency [m], as predicted in three ways and measured in two."""
    key, reference = f"{SLOWED}.{setup.name}", f"{SLOWED}.{REFERENCE}"
    v_h, v_r = metrics[f"{key}.v_h_mps"].value, metrics[f"{key}.v_r_mps"].value
    before, after = metrics[f"{reference}.optimism_p95_m"], metrics[f"{key}.optimism_p95_m"]
    spread = before.value - metrics[f"{reference}.optimism_p50_m"].value
    predicted = {
        "nominal_m": setup.latency_s * (NOMINAL_MPS + v_r),
        "speeds_here_m": setup.latency_s * (v_h + v_r),
        "squares_m": float(np.hypot(spread, setup.latency_s * v_h)) - spread,
    }
    results = {key: Metric(m, m, m, "m", before.n) for key, m in predicted.items()}
    off = after.value - before.value, after.low - before.high, after.high - before.low
    results["belief_m"] = Metric(*off, "m", before.n)
    tried_m = np.array([0.0, *margins_m])
    rows = [table.get((Policy(SLOWED, m).label, setup.name)) for m in tried_m.tolist()]
    known = [row for row in rows if row is not None]
    if len(known) == len(rows) > 1:
        results["margin_m"] = find_margin(known, tried_m, table[SLOWED, REFERENCE])
    return results


def find_margin(rows: Sequence[Row], margins_m: Floats, reference: Row) -> Metric:
    """Return the margin at which the fraction of missed stops falls to that of the reference [m].

    Args:
        rows: rows of one setup, one per margin.
        margins_m: the margins (M,) [m].
        reference: row of the reference setup.
    """
    missed = np.array([row["missed_stops"] for row in (*rows, reference)], float).T
    called = np.array([row["called_stops"] for row in (*rows, reference)], float).T

    def find(weights: Ints) -> Floats:
        shares = np.nan_to_num((weights @ missed) / (weights @ called))
        return np.array(
            [intervals.find_crossing(margins_m, share[:-1], share[-1]) for share in shares]
        )

    return intervals.bootstrap(find, len(missed), "m", 1000)
