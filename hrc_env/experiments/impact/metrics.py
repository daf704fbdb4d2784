"""From sums of episodes to numbers: rows, rows beside the reference, what lateness costs.

Lateness in metres is measured in two ways, both on the truth: in the belief, by how much the 95th
percentile of believed less true separation grows; in the loop, by the margin that `scripted_slowed`
has to add to its distances to miss no greater share of the stops that the truth calls for than on
time. Predicted as latency x (v_h + v_r), with a worker's nominal speed and with the speeds that
there were; and as if lateness and other errors were independent: then their squares add up, and
the robot's speed does not count, as its encoders are not late.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation import intervals
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS
from hrc_env.evaluation.intervals import compare_paired, estimate_rate, make_ratio, estimate_ratio
from hrc_env.evaluation.sums import COST_UNIT
from hrc_env.experiments.impact.policies import SLOWED, Policy
from hrc_env.experiments.report import Metrics
from hrc_env.experiments.setups import LATE, REFERENCE, PerceptionSetup, setup_called

Row = Mapping[str, list[Any]]
Played = Mapping[tuple[str, str], Row]
"""Rows by policy and setup."""
NOMINAL_MPS = 1.6
"""A worker's approach where it is not measured (ISO 13855, as in Marvel and Norcross 2017,
PMC5117641; verify against the standard before certification) [m/s]."""
CONTACTS = ("contacts_towards", "contacts_standing", "contacts_fleeing")
"""What is counted a minute and is rare."""
A_MINUTE = {"goals_per_min": "goals", **{name: name for name in CONTACTS}}
"""What is counted a minute, and from which sum."""
PER_1000 = (
    "missed_stops", "false_stops", "called_stops", "missed_slowings", "false_slowings",
    "called_slowings", "approaches",
)  # fmt: skip
"""What is counted in a thousand control steps; `called_slowings`: somebody is near."""
AN_EPISODE = dict.fromkeys(("cost", "cost_towards"), f"{COST_UNIT} per episode")
"""What is counted in an episode, and its unit."""
QUANTILES = {
    "z_d_m": (ERRORS_M, "error", 0.95, "m"),
    "optimism_p50_m": (GAPS_M, "optimism", 0.5, "m"),
    "optimism_p95_m": (GAPS_M, "optimism", 0.95, "m"),
    "v_h_mps": (SPEEDS_MPS, "worker_speed", 0.95, "m/s"),
    "v_r_mps": (SPEEDS_MPS, "robot_speed", 0.95, "m/s"),
}
COMPARED = (
    "goals_per_min", "cost", "cost_towards", "called_slowings", "separation_min_m",
    "contacts_towards", "contacts_standing", "approaches", "missed_stops", "false_stops",
)  # fmt: skip
"""What is compared with the reference, episode by episode; and Z_d."""


def metrics_of(table: Played, margins_m: Sequence[float]) -> dict[str, Metric]:
    """By `<policy>.<setup>.<what>`, `difference.<policy>.<setup>.<what>`, `p.` the same (see
    `intervals.compare_paired`) and `lateness.<setup>.<how>`."""
    metrics: dict[str, Metric] = {}
    for (policy, setup), row in table.items():
        for what, metric in _of_row(row).items():
            metrics[f"{policy}.{setup}.{what}"] = metric
        if setup != REFERENCE and (policy, REFERENCE) in table:
            metrics |= _differences(f"{policy}.{setup}", row, table[policy, REFERENCE])
    for policy, name in table:
        setup = setup_called(name)
        on_time = replace(setup, latency_s=0.0, is_told=True).name
        twin = on_time if (policy, on_time) in table else name
        z_d, v_r = metrics[f"{policy}.{twin}.z_d_m"], metrics[f"{policy}.{name}.v_r_mps"]
        metrics[f"{policy}.{name}.tax_m"] = _tax(setup.latency_s, z_d, v_r)
    if (SLOWED, REFERENCE) in table:
        for setup in LATE:
            if (SLOWED, setup.name) in table:
                for how, metric in _lateness(setup, table, metrics, margins_m).items():
                    metrics[f"lateness.{setup.name}.{how}"] = metric
    return metrics


def _differences(name: str, row: Row, reference: Row) -> Metrics:
    """A row less the reference, over the episodes of both: same seeds, same workers."""
    n, ours, theirs = len(row["walk"]), _ratios(row), _ratios(reference)
    found: dict[str, Metric] = {}
    for what in COMPARED:
        (above, below, unit), (above_1, below_1, _) = ours[what], theirs[what]
        ratio = make_ratio([*above, *above_1[:n]], [*below, *below_1[:n]])
        found |= compare_paired(f"{name}.{what}", ratio, n, unit, 2000)
        if what in CONTACTS:
            rates = estimate_rate(above, below, unit), estimate_rate(above_1[:n], below_1[:n], unit)
            found[f"difference.{name}.{what}"] = intervals.subtract_rates(*rates)
    bins, counted, q, unit = QUANTILES["z_d_m"]
    counts = [*row[f"{counted}_counts"], *reference[f"{counted}_counts"][:n]]
    both = intervals.make_binned_quantile(bins, counts, q)
    return found | compare_paired(f"{name}.z_d_m", both, n, unit, 400)


def _of_row(row: Row) -> dict[str, Metric]:
    """What the episodes of a row came to."""
    ratios = _ratios(row)
    found = {what: (estimate_rate if what in CONTACTS else estimate_ratio)(*ratios[what]) for what in ratios}
    found["goals_per_min"] = intervals.estimate_goal_rate(*ratios["goals_per_min"][:2])
    found["separation_min_m"] = intervals.estimate_iqm(row["separation_min_m"], "m")
    for what, (bins, name, q, unit) in QUANTILES.items():
        found[what] = intervals.estimate_binned_quantile(bins, row[f"{name}_counts"], q, unit)
    return found


def _ratios(row: Row) -> dict[str, tuple[Floats, Floats, str]]:
    """What is counted in each episode (n,), over what (n,), and the unit of their ratio."""
    n_steps = np.sum(row["error_counts"], axis=1) / N_JOINTS
    minutes, ones = np.array(row["minutes"]), np.ones(len(n_steps))
    found = {"separation_min_m": (np.array(row["separation_min_m"], float), ones, "m")}
    for what, unit in AN_EPISODE.items():
        found[what] = np.array(row[what], float), ones, unit
    for what, name in A_MINUTE.items():
        found[what] = np.array(row[name], float), minutes, "1/min"
    for what in PER_1000:
        found[what] = 1000.0 * np.array(row[what]), n_steps, "per 1000 steps"
    return found


def _tax(latency_s: float, z_d: Metric, v_r: Metric) -> Metric:
    """The separation tax Z_d + latency x (v_h + v_r) [m]: Z_d of the same setup on time, so that
    nothing is counted twice; v_h is nominal, v_r what the robot did."""
    value, low, high = (
        getattr(z_d, end) + latency_s * (NOMINAL_MPS + getattr(v_r, end))
        for end in ("value", "low", "high")
    )
    return Metric(value, low, high, "m", z_d.n)


def _lateness(
    setup: PerceptionSetup, table: Played, metrics: Metrics, margins_m: Sequence[float]
) -> dict[str, Metric]:
    """Extra metres of a late setup: predicted in three ways, measured in two."""
    key, reference = f"{SLOWED}.{setup.name}", f"{SLOWED}.{REFERENCE}"
    v_h, v_r = metrics[f"{key}.v_h_mps"].value, metrics[f"{key}.v_r_mps"].value
    before, after = metrics[f"{reference}.optimism_p95_m"], metrics[f"{key}.optimism_p95_m"]
    spread = before.value - metrics[f"{reference}.optimism_p50_m"].value
    predicted = {
        "nominal_m": setup.latency_s * (NOMINAL_MPS + v_r),
        "speeds_here_m": setup.latency_s * (v_h + v_r),
        "squares_m": float(np.hypot(spread, setup.latency_s * v_h)) - spread,
    }
    found = {how: Metric(m, m, m, "m", before.n) for how, m in predicted.items()}
    off = after.value - before.value, after.low - before.high, after.high - before.low
    found["belief_m"] = Metric(*off, "m", before.n)
    tried_m = np.array([0.0, *margins_m])
    rows = [table.get((Policy(SLOWED, m).label, setup.name)) for m in tried_m.tolist()]
    known = [row for row in rows if row is not None]
    if len(known) == len(rows) > 1:
        found["margin_m"] = margin_needed(known, tried_m, table[SLOWED, REFERENCE])
    return found


def margin_needed(rows: Sequence[Row], margins_m: Floats, reference: Row) -> Metric:
    """The margin with which no greater share of stops is missed than in the reference [m]."""
    missed = np.array([row["missed_stops"] for row in (*rows, reference)], float).T
    called = np.array([row["called_stops"] for row in (*rows, reference)], float).T

    def needed(weights: Ints) -> Floats:
        shares = np.nan_to_num((weights @ missed) / (weights @ called))
        return np.array([intervals.find_crossing(margins_m, share[:-1], share[-1]) for share in shares])

    return intervals.bootstrap(needed, len(missed), "m", 1000)
