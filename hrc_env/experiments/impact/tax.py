"""What lateness costs in metres, and what the separation tax says that it costs.

Measured in two ways, both on the truth:

* in the belief: by how much the 95th percentile of "believed gap less true gap" grows;
* in the loop: the margin that `scripted_slowed` has to add to its distances, until the same share
  of the stops that the truth calls for is missed as with eyes that are on time and no margin.

Predicted as latency x (v_h + v_r) with the nominal speed of a worker and with the speeds that
were there; and by what follows where lateness and the other errors are independent: then their
squares add up, not they themselves, and the robot's own speed does not count, as its encoders are
not late.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy import stats

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.impact.measures import NOMINAL_MPS, Row, Table
from hrc_env.experiments.impact.trial.eyes import LATE, REFERENCE, Eyes
from hrc_env.experiments.impact.trial.policies import SLOWED, Policy

N_RESAMPLES = 1000
PREDICTED = ("nominal_m", "speeds_here_m", "squares_m")
MEASURED = ("belief_m", "margin_m")


def tax_metrics(
    table: Table, metrics: Mapping[str, Metric], margins_m: tuple[float, ...]
) -> dict[str, Metric]:
    """`lateness.<eyes>.<how>`: extra metres, predicted (`PREDICTED`) and measured (`MEASURED`)."""
    found: dict[str, Metric] = {}
    if (SLOWED, REFERENCE) not in table:
        return found
    for eyes in LATE:
        if (SLOWED, eyes.name) in table:
            for how, metric in _of_eyes(eyes, table, metrics, margins_m).items():
                found[f"lateness.{eyes.name}.{how}"] = metric
    return found


def missed_share(row: Row) -> float:
    """Of the stops that the truth calls for, those that the belief does not; 0 of none."""
    return sum(row["missed_stops"]) / max(sum(row["called_stops"]), 1)


def _of_eyes(
    eyes: Eyes, table: Table, metrics: Mapping[str, Metric], margins_m: tuple[float, ...]
) -> dict[str, Metric]:
    """Extra metres of late eyes."""
    here, late = (
        {
            what: metrics[f"{SLOWED}.{name}.{what}"]
            for what in ("optimism_p50_m", "optimism_p95_m", "v_h_mps", "v_r_mps")
        }
        for name in (REFERENCE, eyes.name)
    )
    v_h, v_r = late["v_h_mps"].value, late["v_r_mps"].value
    spread = here["optimism_p95_m"].value - here["optimism_p50_m"].value
    n = here["v_h_mps"].n
    predicted = (
        eyes.latency_s * (NOMINAL_MPS + v_r),
        eyes.latency_s * (v_h + v_r),
        float(np.hypot(spread, eyes.latency_s * v_h)) - spread,
    )
    found = {
        how: Metric(value, value, value, "m", n)
        for how, value in zip(PREDICTED, predicted, strict=True)
    }
    before, after = here["optimism_p95_m"], late["optimism_p95_m"]
    found["belief_m"] = Metric(
        after.value - before.value, after.low - before.high, after.high - before.low, "m", n
    )
    rows = [table.get((Policy(SLOWED, m).label, eyes.name)) for m in (0.0, *margins_m)]
    known = [row for row in rows if row is not None]
    if len(known) == len(rows) > 1:
        found["margin_m"] = _margin(known, np.array([0.0, *margins_m]), table[SLOWED, REFERENCE])
    return found


def _margin(rows: list[Row], margins_m: Floats, reference: Row) -> Metric:
    """The margin with which no greater share of stops is missed than in the reference; the
    interval draws seeds anew, all rows together."""
    everybody = [*rows, reference]
    samples = [np.array(row[what], float) for what in ("missed_stops", "called_stops")
               for row in everybody]  # fmt: skip

    def needed(*drawn: Floats, axis: int) -> Any:
        sums = np.stack([each.sum(axis) for each in drawn])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.nan_to_num(sums[: len(everybody)] / sums[len(everybody) :])
        return _crossing(margins_m, share[:-1], share[-1])

    point = float(needed(*samples, axis=0))
    n = len(samples[0])
    if n < 2:
        return Metric(point, point, point, "m", n)
    found = stats.bootstrap(
        samples, needed, n_resamples=N_RESAMPLES, paired=True, method="percentile",
        vectorized=True, rng=np.random.default_rng(0), batch=200,
    )  # fmt: skip
    low, high = found.confidence_interval
    return Metric(point, float(low), float(high), "m", n)


def _crossing(x: Floats, y: Floats, level: Floats) -> Floats:
    """Where falling values y (n, ...) at x (n,) first come down to a level (...): between the
    two nearest linearly, the last x if they never do."""
    reached = y <= level
    first = np.where(reached.any(0), reached.argmax(0), len(x) - 1)
    before = np.maximum(first - 1, 0)
    high, low = (np.take_along_axis(y, k[None], 0)[0] for k in (before, first))
    with np.errstate(divide="ignore", invalid="ignore"):
        into = np.clip((high - level) / (high - low), 0.0, 1.0)
    into = np.where(first == before, 0.0, np.nan_to_num(into, nan=1.0))
    return x[before] + into * (x[first] - x[before])
