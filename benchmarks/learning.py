"""Training of the policies that studies evaluate, by `python -m hrc_env train`, and their summary.

The policies are stored in the folder of the study.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hrc_env.core.results import Metric
from hrc_env.evaluation import intervals
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import (
    interventions,
    mean,
    per_minute,
    rate,
    share_above_force_limit,
)
from hrc_env.experiments.report import Metrics


@dataclass(frozen=True, slots=True)
class Training:
    """A run of `python -m hrc_env train`."""

    folder: Path
    """Folder of this run, with a name that contains the options."""
    options: Mapping[str, Any]
    """Options of the command by name, without `--`."""

    @property
    def policy(self) -> Path:
        """Path of the checkpoint, which may not exist yet."""
        return self.folder / "policy.zip"

    @property
    def is_finished(self) -> bool:
        """Whether the policy was trained and evaluated."""
        return (self.folder / "score.json").exists()

    @property
    def score(self) -> dict[str, Any]:
        """Score that `train` wrote at the end of the run."""
        return json.loads((self.folder / "score.json").read_text())

    def run(self) -> None:
        """Train the policy or continue its training; do nothing if the run is finished."""
        if self.is_finished:
            return
        place = {"resume" if self.policy.exists() else "out": self.folder}
        given = {**place, "episodes": 1, **self.options}
        if self.policy.exists():  # the checkpoint contains its task
            given.pop("task", None)
        words = [
            word
            for name, value in given.items()
            for word in (f"--{name}", *map(str, value if isinstance(value, tuple) else (value,)))
        ]
        print(f"Training: {self.folder}", flush=True)
        path = os.pathsep.join(filter(None, sys.path))
        subprocess.run(
            [sys.executable, "-m", "hrc_env", "train", "--no-film", *words],
            env={**os.environ, "PYTHONPATH": path}, check=True,
        )  # fmt: skip


SAFETY_OF_POLICY = (
    per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
    mean("cost", "cost", "cost_per_episode"),
    rate("contacts_towards", "contacts towards [1/h]", "towards_per_hour", "hour"),
    share_above_force_limit(),
    interventions(),
    rate("contacts_towards", name="towards"),
    rate("contacts", name="contacts_per_episode"),
    mean("seconds", name="seconds"),
)
"""Columns that `summarize_runs` summarizes over the policies of a learner."""
AVERAGED = ("goals_per_minute", "cost_per_episode", "interventions_per_hour")
"""Metrics of `SAFETY_OF_POLICY` of which the interquartile mean over policies is computed."""


def summarize_runs(metrics: Metrics, rows: Mapping[str, list[str]]) -> dict[str, Metric]:
    """Summarize the metrics of `SAFETY_OF_POLICY` over the policies of each learner.

    Goals, cost and interventions are interquartile means over policies with stratified bootstrap
    intervals (`intervals.estimate_run_iqm`). Contacts of all policies are counted together, with
    exact intervals.

    Args:
        metrics: metrics of the rows, as "ROW.NAME".
        rows: names of the rows of a learner's policies, by the name of the learner.

    Returns:
        Metrics as "LEARNER.NAME"; learners without rows are left out.
    """
    summary: dict[str, Metric] = {}
    for learner, names in rows.items():
        if not names:
            continue
        for name in AVERAGED:
            of_runs = [metrics[f"{row}.{name}"] for row in names]
            iqm = intervals.estimate_run_iqm([[each.value for each in of_runs]], of_runs[0].unit)
            summary[f"{learner}.{name}"] = iqm
        towards = [metrics[f"{row}.towards"] for row in names]
        seconds = [metrics[f"{row}.seconds"] for row in names]
        hours = [each.n * each.value / 3600 for each in seconds]
        summary[f"{learner}.towards"] = pool_rates(towards)
        summary[f"{learner}.towards_per_hour"] = intervals.estimate_rate(
            [_count(each) for each in towards], hours, "1/h"
        )
        shares = [metrics[f"{row}.above_force_limit"] for row in names]
        known = [each for each in shares if each.n]
        summary[f"{learner}.above_force_limit"] = intervals.estimate_share_of(
            [_count(each) for each in known], [each.n for each in known]
        )
    return summary


def pool_rates(rates: Sequence[Metric]) -> Metric:
    """Return the rate of events per episode of several policies together, with its exact interval.

    Args:
        rates: rate per episode of each policy; `Metric.n` is the number of its episodes.
    """
    n_episodes = [each.n for each in rates]
    pooled = intervals.estimate_rate([_count(each) for each in rates], n_episodes, rates[0].unit)
    return replace(pooled, n=sum(n_episodes))


def _count(metric: Metric) -> int:
    """Return the number of events of a rate per observation, or of a fraction."""
    return round(metric.value * metric.n)
