"""Metrics of the price study: rates of contacts and throughput of settings, and the best of them.

All settings have the same seeds. The throughput is the number of goals per minute, divided by that
of an unshielded robot with true joints on the same seeds. Rates of contacts have exact intervals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation.intervals import (
    P,
    Statistic,
    adjust_metrics,
    bootstrap,
    compare_paired,
    estimate_burst_rate,
    estimate_goal_rate,
    estimate_rate,
    estimate_ratio,
    estimate_share_of,
)
from hrc_env.evaluation.sums import ABOVE, COST_UNIT, INTERVENTIONS, RATED
from hrc_env.experiments.price.episodes import CONTACTS
from hrc_env.experiments.price.halving import Best, Tally, find_best
from hrc_env.experiments.price.setups import FOUR, ONE, TRUE_CAPSULES, TRUTH
from hrc_env.experiments.report import Metrics
from hrc_env.experiments.stage import Rows

UNIT = "1/h"
"""Unit of rates of contacts."""
CHOOSING = "choosing."
"""Prefix of the names of metrics on the choosing seeds."""
NO_SETTING = "none"
"""Name in place of a setting if no setting meets a level."""
EPISODE_MIN = 10.0 / 60.0
"""Duration to which costs refer [min], which does not depend on the task."""


class Contrast(NamedTuple):
    """Two perception setups, the throughputs of which are compared at each level."""

    better: str
    worse: str


CONTRASTS: dict[str, Contrast] = {
    "body": Contrast(TRUE_CAPSULES, TRUTH),
    "sight": Contrast(TRUTH, FOUR),
    "body_and_sight": Contrast(TRUE_CAPSULES, FOUR),
    "two_cameras": Contrast(FOUR, "two_cameras"),
    "one_camera": Contrast(FOUR, ONE),
    "second_camera": Contrast("two_cameras", ONE),
    "warm_up": Contrast(ONE, "one_alone"),
    "late_200ms": Contrast(FOUR, "late_200ms"),
    "late_120ms_untold": Contrast(FOUR, "late_120ms_untold"),
}
"""Contrasts by name. A contrast is the throughput of the better setup minus that of the worse
one."""


@dataclass(frozen=True, slots=True)
class Played:
    """All episodes of the study."""

    choosing: Mapping[str, Mapping[str, Rows]]
    """Sums of the episodes on the choosing seeds, by perception setup and setting."""
    proof: Mapping[str, Mapping[str, Rows]]
    """Sums of the episodes on the proof seeds of the settings that were kept."""
    reference: Rows
    """Sums of the episodes of an unshielded robot with true joints on the proof seeds."""


def tally(rows: Rows) -> Tally:
    """Return the contacts towards a worker and the goals of episodes."""
    minutes = float(np.sum(rows["minutes"]))
    contacts = round(float(np.sum(rows["towards"])))
    return Tally(contacts, minutes / 60, float(np.sum(rows["achieved"])) / minutes)


def name_level(level_per_hour: float) -> str:
    """Return the name of a level in names of metrics."""
    return f"at_{level_per_hour:g}"


def find_bests(played: Played, level_per_hour: float) -> dict[str, Best]:
    """Return the best setting of every perception setup at one level [1/h]."""
    bests: dict[str, Best] = {}
    for setup, rows in played.proof.items():
        chosen = {name: tally(each) for name, each in played.choosing[setup].items()}
        proved = {name: tally(each) for name, each in rows.items()}
        bests[setup] = find_best(chosen, proved, level_per_hour)
    return bests


def compute_metrics(played: Played, levels_per_hour: Sequence[float]) -> dict[str, Metric]:
    """Return all metrics by name.

    Names are `unshielded.<metric>`, `choosing.<setup>.<setting>.<metric>`,
    `<setup>.<setting>.<metric>`, `at_<level>.<setup>.<setting>.<status>.<metric>` for the best
    setting at each level, and `worth.at_<level>.<contrast>`.

    Args:
        played: all episodes.
        levels_per_hour: levels of the rate of contacts [1/h].
    """
    metrics = {f"unshielded.{name}": each for name, each in _measure(played.reference).items()}
    for setup, settings in played.choosing.items():
        for setting, rows in settings.items():
            for name, each in _measure(rows).items():
                metrics[f"{CHOOSING}{setup}.{setting}.{name}"] = each
    proved = {
        (setup, setting): {**_measure(rows), "share": _measure_share(rows, played.reference)}
        for setup, settings in played.proof.items()
        for setting, rows in settings.items()
    }
    for (setup, setting), measured in proved.items():
        metrics |= {f"{setup}.{setting}.{name}": each for name, each in measured.items()}
    n = len(played.reference["minutes"])
    for level_per_hour in levels_per_hour:
        level, bests = name_level(level_per_hour), find_bests(played, level_per_hour)
        for setup, (setting, status) in ((s, (b.setting, b.status)) for s, b in bests.items()):
            row = f"{level}.{setup}.{setting or NO_SETTING}.{status}."
            unknown = {"share": Metric(np.nan, np.nan, np.nan, "share", n)}
            measured = proved[setup, setting] if setting else unknown
            metrics |= {f"{row}{name}": each for name, each in measured.items()}
        metrics |= _compare(played, bests, level)
    return metrics | adjust_metrics(metrics)


def _measure(rows: Rows) -> Metrics:
    """Return the rates of contacts and goals and the cost of episodes, with their intervals."""
    hours = np.array(rows["minutes"], float) / 60
    every = np.sum([rows[kind] for kind in CONTACTS], axis=0)
    measured = {
        **{kind: estimate_rate(rows[kind], hours, UNIT) for kind in CONTACTS},
        "contacts": estimate_rate(every, hours, UNIT),
        "severe": estimate_rate(rows[ABOVE], hours, UNIT),
        "above_force_limit": estimate_share_of(rows[ABOVE], rows[RATED]),
        "goals_per_min": estimate_goal_rate(rows["achieved"], rows["minutes"]),
        "cost": estimate_ratio(
            rows["cost"], 60 * hours / EPISODE_MIN, f"{COST_UNIT} per episode of 10 s"
        ),
    }
    if INTERVENTIONS in rows:
        measured[INTERVENTIONS] = estimate_burst_rate(rows[INTERVENTIONS], hours, UNIT)
    return measured


def _measure_share(rows: Rows, reference: Rows) -> Metric:
    """Return the throughput of episodes as a share of that of others with the same seeds."""
    return bootstrap(_make_share([rows], reference), len(rows["minutes"]), "share")


def _make_share(compared: Sequence[Rows], reference: Rows) -> Statistic:
    """Return the throughput of a row, divided by that of a reference, for weights of its seeds.

    Args:
        compared: one or two rows (n,) with the same seeds; the weights (R, n or 2n) select between
            the two.
        reference: the reference (n,) with the same seeds.
    """
    achieved, minutes = (
        np.concatenate([np.array(rows[name], float) for rows in compared])
        for name in ("achieved", "minutes")
    )
    others = [
        np.tile(np.array(reference[n], float), len(compared)) for n in ("achieved", "minutes")
    ]

    def share(weights: Ints) -> Floats:
        theirs = (weights @ others[0]) / (weights @ others[1])
        ours = (weights @ achieved) / (weights @ minutes)
        return np.divide(ours, theirs, out=np.full_like(ours, np.nan), where=theirs > 0)

    return share


def _compare(played: Played, bests: Mapping[str, Best], level: str) -> Metrics:
    """Return the contrasts at a level, and their p-values.

    Both setups must have a setting at the level.
    """
    metrics: Metrics = {}
    for name, pair in CONTRASTS.items():
        settings = [bests[each].setting if each in bests else None for each in pair]
        if settings[0] is None or settings[1] is None:
            continue
        rows = [played.proof[s][c] for s, c in zip(pair, settings, strict=True) if c is not None]
        share, n = _make_share(rows, played.reference), len(played.reference["minutes"])
        compared = compare_paired(name, share, n, "share")
        metrics[f"worth.{level}.{name}"] = compared[f"difference.{name}"]
        metrics[f"{P}worth.{level}.{name}"] = compared[f"{P}{name}"]
    return metrics
