"""The motion benchmark: statistics of all motions of the repertoire for several workers."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.motion.report import report
from benchmarks.motion.statistics import compute_gait, compute_statistics
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, over
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.report import Metrics, Report, describe_quick_run
from hrc_env.experiments.runner import check_at_least_one, is_as_short
from hrc_env.motion import state as st
from hrc_env.motion.repertoire import SCENES, Film, make_worker, perform
from hrc_env.worker.body import Body, load_body, worker_names

DT_S = 0.01
"""Time between frames [s], which is short enough for the computation of accelerations."""


@dataclass(frozen=True, slots=True)
class MotionBench:
    """Benchmark of the motion of workers by its statistics."""

    name = "bench motion"
    depends = ("motion",)
    n_parts = 1
    n_seeds: int = 12
    """Number of films per worker and motion, alternately with the right and the left hand."""
    bodies: tuple[str, ...] = worker_names()
    """Names of the workers' bodies."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid."""
        check_at_least_one(self, "n_seeds")
        if not self.bodies:
            raise ConfigError(f"bodies must be some of {worker_names()}.")

    @property
    def seeds(self) -> list[int]:
        """Seeds of the films of each worker."""
        return list(range(self.n_seeds))

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return {"bench": asdict(self)}

    def play(self, cache: PartCache) -> dict[str, Metric]:
        """Simulate and measure all motions of the repertoire."""
        metrics: dict[str, Metric] = {}
        for scene in SCENES:
            metrics |= _measure(scene, self)
            cache.progress(1 / len(SCENES), scene)
        return metrics

    def metrics(self, played: dict[str, Metric]) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return played

    def report(self, played: dict[str, Metric], metrics: Metrics, figures: Path) -> Report:
        """Return the report, with its tables and figures."""
        seconds = [each.value for name, each in metrics.items() if name.endswith(".seconds")]
        lasting = min(seconds), max(seconds)
        short = describe_quick_run(self.n_seeds, lasting) if is_as_short(self, QUICK) else ""
        return replace(report(metrics), quick=short)


QUICK = MotionBench(n_seeds=2, bodies=("worker_1",))
"""Benchmark settings for a quick run, which computes all numbers from less data."""


def _measure(scene: str, config: MotionBench) -> dict[str, Metric]:
    """Compute the statistics of a motion from its films.

    The value of each metric is the median over bodies; its interval is the range over bodies.
    """
    by_body: list[dict[str, float]] = []
    for name in config.bodies:
        body = load_body(name)
        films = [film for seed in range(config.n_seeds) for film in _play(scene, seed, body)]
        numbers = compute_statistics(films, body)
        numbers["seconds"] = sum(film.time_s[-1] for film in films) / config.n_seeds
        if films[0].activity == st.WALK:
            gaits = [compute_gait(film) for film in films]
            numbers |= {key: float(np.median([g[key] for g in gaits])) for key in gaits[0]}
        by_body.append(numbers)
    n = config.n_seeds * len(config.bodies)
    return {
        f"{scene}.{key}": replace(over([numbers[key] for numbers in by_body], _unit(key)), n=n)
        for key in by_body[0]
    }


def _play(scene: str, seed: int, body: Body) -> Sequence[Film]:
    """Simulate a motion of the repertoire and return its films."""
    me = make_worker(body, right=seed % 2 == 0)
    return perform(SCENES[scene], me, np.random.default_rng([17, seed]), DT_S)


def _unit(key: str) -> str:
    """Derive the unit of a statistic from its name."""
    for ending, unit in (
        ("_m_s2", "m/s^2"), ("_m_s", "m/s"), ("_m", "m"), ("_deg", "deg"), ("seconds", "s"),
        ("_per_min", "1/min"),
    ):  # fmt: skip
        if key.endswith(ending):
            return unit
    return ""
