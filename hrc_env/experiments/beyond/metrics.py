"""From sums of episodes to numbers with intervals."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hrc_env.core.results import Metric, over
from hrc_env.experiments.beyond.trial.tally import Rows
from hrc_env.experiments.study.counts import ERRORS_M
from hrc_env.experiments.study.intervals import counted_quantile_over, ratio_over, rmse_over

QUANTILES = {"median": 0.5, "p95": 0.95}
SEEN = "seen"
Metrics = Mapping[str, Metric]


@dataclass(frozen=True, slots=True)
class Found:
    """The numbers of one study, by setting."""

    study: str
    metrics: Metrics

    def error(self, setting: str, quantile: str = "median") -> Metric:
        """Of the error of all joints [m]."""
        return self.metrics[f"error_m.{self.study}.{setting}.{quantile}"]

    def of(self, what: str, setting: str) -> Metric:
        """`rmse_m`, `coverage95`, `lost` or `update_us`."""
        return self.metrics[f"{what}.{self.study}.{setting}"]

    def has(self, what: str, setting: str) -> bool:
        """Whether there is such a number."""
        return f"{what}.{self.study}.{setting}" in self.metrics

    def mm(self, setting: str, quantile: str = "median") -> str:
        """An error in words."""
        return f"{1000 * self.error(setting, quantile).value:,.0f} mm"

    def least(self, settings: Sequence[str], quantile: str = "median") -> str:
        """Which setting has the smallest error."""
        return min(settings, key=lambda name: self.error(name, quantile).value)

    def most(self, settings: Sequence[str], quantile: str = "median") -> str:
        """Which has the greatest."""
        return max(settings, key=lambda name: self.error(name, quantile).value)


def metrics_of(study: str, rows: Mapping[str, Rows]) -> dict[str, Metric]:
    """Every number of a study, from the sums of its settings.

    What never happened has no number: joints that so many cameras see, if there were none.
    """
    metrics: dict[str, Metric] = {}
    for setting, sums in rows.items():
        metrics |= _of_joints(f"{study}.{setting}", sums)
        metrics[f"lost.{study}.{setting}"] = ratio_over(sums["lost"], sums["frames"], "share")
        if "update_us" in sums:
            metrics[f"update_us.{study}.{setting}"] = over(sums["update_us"], "us")
    for name, sums in _by_sight(rows):
        metrics |= _of_joints(f"{study}.{name}", sums)
    return metrics


def _of_joints(key: str, sums: Mapping[str, Sequence[Any]]) -> dict[str, Metric]:
    """Errors of joints and how far they are told."""
    found = {
        f"error_m.{key}.{name}": counted_quantile_over(ERRORS_M, sums["errors"], q, "m")
        for name, q in QUANTILES.items()
    }
    found[f"rmse_m.{key}"] = rmse_over(sums["squares"], sums["joints"], "m")
    found[f"coverage95.{key}"] = ratio_over(sums["inside"], sums["joints"], "share")
    return found


def _by_sight(rows: Mapping[str, Rows]) -> Iterator[tuple[str, Rows]]:
    """Settings of a scene together, by how many cameras see a joint: `<scene>_seen_<k>`.

    An episode of one setting and that of another are of the same seed: they count as one.
    """
    by_name: dict[str, dict[str, list[Any]]] = {}
    for setting, sums in rows.items():
        scene = setting.split("_")[0]
        for what, values in sums.items():
            if what.startswith(f"{SEEN}_"):
                _, k, name = what.split("_")
                together = by_name.setdefault(f"{scene}_{SEEN}_{k}", {})
                together[name] = _added(together.get(name), values)
    for name, together in sorted(by_name.items()):
        n_joints = together["joints"]
        kept = [row for row, n in enumerate(n_joints) if n]
        if kept:
            yield name, {what: [values[row] for row in kept] for what, values in together.items()}


def _added(one: Sequence[Any] | None, other: Sequence[Any]) -> list[Any]:
    """Sums of two lists of numbers, or of lists of numbers, row by row; None is nothing."""
    if one is None:
        return list(other)
    return [_sum(a, b) for a, b in zip(one, other, strict=True)]


def _sum(a: Any, b: Any) -> Any:
    if a is None or b is None:
        return b if a is None else a
    if isinstance(a, list):
        return [x + y for x, y in zip(a, b, strict=True)]
    return a + b
