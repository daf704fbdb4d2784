"""The speed bench: everybody takes turns, so that a noisy machine slows all of them alike.

A round runs every contender for whole episodes, those at level `keypoints` once more with the
stopwatch round their organs, and resets. Medians over rounds count.
"""

import math
import os
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.speed.contenders import OURS, PEER, Contender, Single, Vector
from benchmarks.speed.measured import (
    REACHER,
    SINGLE,
    Measured,
    metrics_of,
)
from benchmarks.speed.organs import Organs
from benchmarks.speed.report import write_report
from benchmarks.speed.starts import Starts
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.study.cache import Progress

WATCHED = "keypoints"
"""The level whose organs are timed."""
_PEERS = 64
"""How many Reachers are one vector."""
_MAKING = 0.1
"""The share of the progress that goes to making environments."""


@dataclass(frozen=True, slots=True)
class SpeedBenchConfig:
    """How much is run."""

    n_rounds: int = 7
    """How often everybody has a turn."""
    least_steps: int = 4000
    """Environment steps of a turn, at least; whole episodes are run."""
    n_resets: int = 25
    """Resets of each kind in a round."""
    levels: tuple[str, ...] = (WATCHED, "truth", "none")
    """Perception levels."""
    sizes: tuple[int, ...] = (1, 16, 64, 256)
    """Numbers of environments."""
    threads: tuple[int, ...] = (1, 2)
    """Numbers of threads; more than there are environments are left out."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        for name in ("n_rounds", "least_steps", "n_resets"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)}.")
        if WATCHED not in self.levels:
            raise ConfigError(f"levels must have {WATCHED!r} in them, got {self.levels}.")


QUICK = SpeedBenchConfig(n_rounds=1, least_steps=1000)
"""Every number, from one short turn."""


@dataclass(frozen=True, slots=True)
class Turn:
    """What somebody does in each round."""

    level: str
    configuration: str
    """"single" or "<num_envs>.<threads>"."""
    n_threads: int
    contender: Contender
    n_episodes: int
    cost: float
    """What share of a round it takes, roughly and in any unit."""

    @property
    def is_watched(self) -> bool:
        """Whether its organs are timed."""
        return self.level == WATCHED


def run(config: SpeedBenchConfig, out: Path, say: Progress) -> dict[str, Metric]:
    """Measure; writes results.json, speed.md and organs.png into `out`.

    Args:
        config: how much.
        out: a folder.
        say: hears of the progress: shares that sum to 1.

    Raises:
        HRCError: an organ's function is no longer called, so that its time would be missed.
    """
    load_before = load_average()
    with ExitStack() as closing:
        turns = [*_turns(config, closing, say)]
        starts = Starts()
        closing.callback(starts.close)
        measured, organs = Measured(), Organs()
        share = (1 - _MAKING) / (config.n_rounds * sum(turn.cost for turn in turns))
        for _ in range(config.n_rounds):
            for turn in turns:
                _take(turn, measured, organs)
                say(share * turn.cost, f"{turn.level} {turn.configuration}")
            organs.check_all_called()
            for name, ms in starts.run(config.n_resets).items():
                measured.reset_ms.setdefault(name, []).append(ms)
    metrics = metrics_of(measured)
    settings = {"bench": asdict(config), "load_before": load_before}
    write_results(out / "results.json", settings, [0], metrics)
    write_report(out, metrics, load_before)
    return metrics


def load_average() -> float | None:
    """How many others want to run, over the last minute; None where nobody knows."""
    return round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None


def _take(turn: Turn, measured: Measured, organs: Organs) -> None:
    """Run as it is; then, where organs are timed, with the stopwatch round them."""
    pace = turn.contender.run(turn.n_episodes)
    name = f"{turn.level}.{turn.configuration}"
    measured.env_steps_per_s.setdefault(name, []).append(pace.env_steps / pace.seconds)
    if turn.is_watched:
        shares = organs.us_per_env_step(turn.contender, turn.n_episodes, turn.n_threads)
        for organ, us in shares.items():
            name = f"{organ}.{turn.configuration}"
            measured.us_per_env_step.setdefault(name, []).append(us)


def _turns(config: SpeedBenchConfig, closing: ExitStack, say: Progress) -> Iterator[Turn]:
    """Make everybody, ready to run, to be closed in the end."""
    known = [
        (size, threads) for size in config.sizes for threads in config.threads if threads <= size
    ]
    n_contenders = len(config.levels) * (1 + len(known)) + 2

    def turn(level: str, configuration: str, threads: int, contender: Contender) -> Turn:
        closing.callback(contender.close)
        say(_MAKING / n_contenders, f"making {level} {configuration}")
        n_episodes = math.ceil(config.least_steps / contender.episode_env_steps)
        cost = n_episodes * contender.episode_env_steps / threads
        times = 2 if level == WATCHED else 0.1 if level == REACHER else 1
        return Turn(level, configuration, threads, contender, n_episodes, times * cost)

    yield turn(REACHER, SINGLE, 1, Single(PEER))
    yield turn(REACHER, f"{_PEERS}.1", 1, Vector(PEER, _PEERS))
    for level in config.levels:
        yield turn(level, SINGLE, 1, Single(OURS, perception=level))
        for size, threads in known:
            contender = Vector(OURS, size, perception=level, num_threads=threads)
            yield turn(level, f"{size}.{threads}", threads, contender)
