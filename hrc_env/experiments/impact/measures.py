"""From sums of episodes to numbers with intervals: rows, and rows beside the reference."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.experiments.impact.trial.eyes import REFERENCE, Eyes, eyes_called, seeing
from hrc_env.experiments.study.counts import ERRORS_M, GAPS_M, SPEEDS_MPS, Bins
from hrc_env.experiments.study.intervals import (
    counted_quantile_over,
    iqm_over,
    mean_over,
    ratio_over,
)

Row = Mapping[str, list[Any]]
Table = Mapping[tuple[str, str], Row]
"""Rows by policy and eyes."""
NOMINAL_MPS = 1.6
"""A worker's approach where it is not measured (ISO 13855, as in Marvel and Norcross 2017,
PMC5117641; verify against the standard before certification) [m/s]."""
TAIL = 0.95
"""Errors and speeds are reported up to this share of them."""
PER = 1000
"""Missed and false stops are given per so many control steps."""
_CONTACTS = ("contacts_towards", "contacts_fleeing", "contacts_standing")
_STOPS = (
    "missed_stops", "false_stops", "called_stops", "missed_slowings", "false_slowings",
    "called_slowings", "approaches",
)  # fmt: skip
COMPARED = (
    "goals_per_min", "cost", "contacts_towards", "approaches", "missed_stops", "false_stops",
    "separation_min_m",
)  # fmt: skip
"""What is compared with the reference, episode by episode."""


def metrics_of(table: Table) -> dict[str, Metric]:
    """Everything, by `<policy>.<eyes>.<what>` and `difference.<policy>.<eyes>.<what>`."""
    metrics: dict[str, Metric] = {}
    for (policy, eyes), row in table.items():
        found = _of_row(row) | _speeds(row)
        found["tax_m"] = tax(eyes_called(eyes), _on_time(table, policy, eyes), row)
        metrics |= {f"{policy}.{eyes}.{what}": metric for what, metric in found.items()}
        if eyes != REFERENCE and (policy, REFERENCE) in table:
            for what, metric in _beside(row, table[policy, REFERENCE]).items():
                metrics[f"difference.{policy}.{eyes}.{what}"] = metric
    return metrics


def _of_row(row: Row) -> dict[str, Metric]:
    """What the episodes of a row came to."""
    steps = _steps(row)
    found = {
        "separation_min_m": iqm_over(row["separation_min_m"], "m"),
        "cost": mean_over(row["cost"], "per episode"),
        "goals_per_min": ratio_over(row["goals"], row["minutes"], "1/min"),
    }
    for name in _CONTACTS:
        found[name] = ratio_over(row[name], row["minutes"], "1/min")
    for name in _STOPS:
        found[name] = ratio_over([PER * each for each in row[name]], steps, f"per {PER} steps")
    return found


def _speeds(row: Row) -> dict[str, Metric]:
    """Errors of the belief, and how fast the two came towards each other where they were near."""
    return {
        "z_d_m": _quantile(ERRORS_M, row["error_counts"], TAIL, "m"),
        "optimism_p50_m": _quantile(GAPS_M, row["optimism_counts"], 0.5, "m"),
        "optimism_p95_m": _quantile(GAPS_M, row["optimism_counts"], TAIL, "m"),
        "v_h_mps": _quantile(SPEEDS_MPS, row["worker_speed_counts"], TAIL, "m/s"),
        "v_r_mps": _quantile(SPEEDS_MPS, row["robot_speed_counts"], TAIL, "m/s"),
    }


def _quantile(bins: Bins, counts: Sequence[Sequence[int]], q: float, unit: str) -> Metric:
    """A quantile; what lies beyond the last limit, as for a robot that knows of nobody, is it."""
    if not np.any(counts):
        return Metric(np.nan, np.nan, np.nan, unit, 0)
    return counted_quantile_over(bins, counts, q, unit)


def tax(eyes: Eyes, on_time: Row, row: Row) -> Metric:
    """The separation tax Z_d + latency x (v_h + v_r) [m].

    Z_d is that of the same eyes without lateness, so that nothing is counted twice; v_h is the
    nominal one, v_r what the robot did in this row.
    """
    error = _quantile(ERRORS_M, on_time["error_counts"], TAIL, "m")
    speed = _quantile(SPEEDS_MPS, row["robot_speed_counts"], TAIL, "m/s")

    def sum_of(part: Callable[[Metric], float]) -> float:
        return part(error) + eyes.latency_s * (NOMINAL_MPS + part(speed))

    return Metric(
        sum_of(lambda m: m.value), sum_of(lambda m: m.low), sum_of(lambda m: m.high), "m", error.n
    )


def _on_time(table: Table, policy: str, eyes: str) -> Row:
    """The row of the same eyes without lateness; its own where there is none."""
    given = eyes_called(eyes)
    if given.latency_s == 0:
        return table[policy, eyes]
    twin = seeing(given.estimator, given.n_cameras).name
    return table.get((policy, twin), table[policy, eyes])


def _beside(row: Row, reference: Row) -> dict[str, Metric]:
    """This row less the reference, on the same seeds: means of differences."""
    n = len(row["walk"])
    found = {}
    for what in COMPARED:
        ours, theirs = _per_episode(row, what), _per_episode(reference, what)[:n]
        unit = "m" if what.endswith("_m") else _UNITS[what]
        found[what] = mean_over((np.array(ours) - np.array(theirs)).tolist(), unit)
    return found


_UNITS = {
    "goals_per_min": "1/min", "contacts_towards": "1/min", "cost": "per episode",
    "missed_stops": f"per {PER} steps", "false_stops": f"per {PER} steps",
    "approaches": f"per {PER} steps",
}  # fmt: skip

_A_MINUTE = {"goals_per_min": "goals", "contacts_towards": "contacts_towards"}
"""What is counted a minute, and from which sum."""


def _per_episode(row: Row, what: str) -> Sequence[float]:
    """One number an episode."""
    if what in _A_MINUTE:
        return (np.array(row[_A_MINUTE[what]]) / np.array(row["minutes"])).tolist()
    if what in _STOPS:
        return (PER * np.array(row[what]) / np.array(_steps(row))).tolist()
    return row[what]


def _steps(row: Row) -> list[int]:
    """Control steps of every episode."""
    return [sum(counts) // N_JOINTS for counts in row["error_counts"]]
