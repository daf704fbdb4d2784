"""The motion bench: every scene of the repertoire, played by several workers, and measured."""

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from benchmarks.motion.report import report
from benchmarks.motion.statistics import gait_of, statistics_of
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, over
from hrc_env.experiments.study.cache import PartCache
from hrc_env.experiments.study.runner import Study, at_least_one
from hrc_env.motion import state as st
from hrc_env.motion.generator import MotionConfig, advance, make_state, reset
from hrc_env.motion.repertoire import REPERTOIRE, Film, alone, perform
from hrc_env.worker.body import Body, load_body, worker_names

DT_S = 0.01
"""Between the frames of a film [s]: fast enough for accelerations."""
BATCH, STEPS, POSES = 64, 60, 5
"""Environments, control steps and poses a step with which a frame's cost is taken, 40 ms a step."""


@dataclass(frozen=True, slots=True)
class MotionBenchConfig:
    """How much is played."""

    n_seeds: int = 12
    """How often each worker plays a scene; right-handed and left-handed in turn."""
    bodies: tuple[str, ...] = worker_names()
    """Whose bodies."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        at_least_one(self, "n_seeds")
        if not self.bodies:
            raise ConfigError(f"bodies must name some of {worker_names()}.")


QUICK = MotionBenchConfig(n_seeds=2, bodies=("worker_1",))
"""Every number, from little."""


def play(config: MotionBenchConfig, parts: PartCache) -> dict[str, Metric]:
    """Play and measure every scene."""
    metrics: dict[str, Metric] = {}
    share = 1 / (len(REPERTOIRE) + 1)
    for scene in REPERTOIRE:
        metrics |= _measure(scene, config)
        parts.progress(share, scene)
    metrics["us_per_control_step"] = _cost_us(load_body(config.bodies[0]))
    parts.progress(share, "cost of a frame")
    return metrics


def _measure(scene: str, config: MotionBenchConfig) -> dict[str, Metric]:
    """A scene's statistics: the median over its films, the smallest and the largest body's."""
    by_body: list[dict[str, float]] = []
    for name in config.bodies:
        body = load_body(name)
        films, us = [], []
        list(_play(scene, 0, body))  # compiled
        for seed in range(config.n_seeds):
            started = time.thread_time()
            played = list(_play(scene, seed, body))
            frames = sum(len(film.time_s) for film in played)
            us.append(1e6 * (time.thread_time() - started) / frames)
            films += played
        numbers = statistics_of(films, body)
        numbers["seconds"] = sum(film.time_s[-1] for film in films) / config.n_seeds
        numbers["us_per_frame"] = float(np.median(us))
        if films[0].activity == st.WALK:
            gaits = [gait_of(film) for film in films]
            numbers |= {key: float(np.median([g[key] for g in gaits])) for key in gaits[0]}
        by_body.append(numbers)
    n = config.n_seeds * len(config.bodies)
    return {
        f"{scene}.{key}": replace(over([numbers[key] for numbers in by_body], _unit(key)), n=n)
        for key in by_body[0]
    }


def _play(scene: str, seed: int, body: Body) -> Iterator[Film]:
    """A scene's films."""
    me = alone(body, right=seed % 2 == 0)
    yield from perform(REPERTOIRE[scene], me, np.random.default_rng([17, seed]), DT_S)


def _unit(key: str) -> str:
    """Of a statistic, from its name."""
    for ending, unit in (
        ("_m_s2", "m/s^2"), ("_m_s", "m/s"), ("_m", "m"), ("_deg", "deg"), ("seconds", "s"),
        ("_per_min", "1/min"), ("us_per_frame", "us"),
    ):  # fmt: skip
        if key.endswith(ending):
            return unit
    return ""


def _cost_us(body: Body) -> Metric:
    """Microseconds of an environment's control step: poses, velocities and planning [us]."""
    state = make_state(BATCH, 1, body, MotionConfig())
    rngs = [np.random.default_rng([29, b]) for b in range(BATCH)]
    reset(state, np.arange(BATCH), rngs)
    advance(state, rngs, 0.04 / POSES, POSES)
    found = []
    for _ in range(STEPS):
        started = time.thread_time()
        advance(state, rngs, 0.04 / POSES, POSES)
        found.append(1e6 * (time.thread_time() - started) / BATCH)
    return over(found, "us")


MOTION = Study(
    name="bench motion",
    modules=("benchmarks.motion.statistics",),
    settings=lambda config: {"bench": asdict(config)},
    seeds=lambda config: list(range(config.n_seeds)),
    n_parts=lambda _: 1,
    play=play,
    metrics=lambda _, played: played,
    report=lambda _, played, metrics, figures: report(metrics),
)
