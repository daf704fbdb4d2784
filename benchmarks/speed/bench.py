"""The speed benchmark, which interleaves all contenders so that noise affects them equally.

In each round, every contender runs for whole episodes; contenders at level `keypoints` run a second
time with timed parts. Resets are measured at the end of a round. Then the speed of each id is
measured in the same way. Results are medians over rounds.
"""

import math
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.common import list_endings
from benchmarks.speed.contenders import OURS, PEER, Contender, Single, Starts, Vector
from benchmarks.speed.declaration import (
    REACHER,
    SHOWN,
    SINGLE,
    TASKS,
    make_organs_table,
    make_steps_table,
)
from benchmarks.speed.organs import Organs
from benchmarks.speed.report import report
from benchmarks.speed.tasks import Tasks, shares
from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, over
from hrc_env.experiments.cache import PartCache, Progress
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.runner import check_at_least_one, is_as_short
from hrc_env.safety.shield import find_shield
from hrc_env.tasks.task import find_task

EVERY = "every"
"""Value of `task` that selects all ids."""
WATCHED = "keypoints"
"""Perception level at which the parts of a step are timed."""
_REACHERS = 64
"""Number of environments in the vector environment of Reacher."""
_MAKING = 0.1
"""Fraction of the total progress that is assigned to the creation of environments."""


Measured = defaultdict[str, list[float]]
"""Measured numbers, one per round, by "<kind>.<name>".

Configurations in names are "single" and "<num_envs>.<threads>".
"""
BY_TASK = "task_steps_per_s"
"""Kind of the numbers that are measured for each id."""


@dataclass(frozen=True, slots=True)
class SpeedBench:
    """Benchmark of the speed of environments."""

    name = "bench speed"
    depends = ("env", "tracker", "emulator", "motion")
    seeds = (0,)
    n_parts = 1
    task: str = OURS
    """Id of the environment, or "every" to measure only the speed of each id."""
    shield: str | None = None
    """Name of the shield of the environments, or None."""
    n_rounds: int = 6
    """Number of rounds."""
    least_steps: int = 4000
    """Minimum number of environment steps in a turn; it is rounded up to whole episodes."""
    n_resets: int = 25
    """Number of resets of each kind per round."""
    task_steps: int = 200
    """Number of steps per round of each id's vector environment, if `task` is the default or
    "every".
    """
    levels: tuple[str, ...] = (WATCHED, "truth", "none")
    """Perception levels of the environments."""
    sizes: tuple[int, ...] = (1, 16, 64, 256)
    """Numbers of environments in a vector environment."""
    threads: tuple[int, ...] = (1, 2)
    """Numbers of threads of a vector environment; numbers above that of its environments are
    skipped.
    """

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a value is invalid."""
        find_shield(self.shield)
        if self.task != EVERY:
            find_task(self.task)
        check_at_least_one(self, "n_rounds", "least_steps", "n_resets", "task_steps")
        if WATCHED not in self.levels:
            raise ConfigError(f"levels must contain {WATCHED!r}, got {self.levels}.")

    @property
    def quick_note(self) -> str:
        """Warning for the tables and figures of a short run, or "" if the run is long enough."""
        seconds = HRCConfig().ctrl_dt * self.least_steps
        return (
            describe_quick_run(self.n_rounds, seconds, "round") if is_as_short(self, QUICK) else ""
        )

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return {"bench": asdict(self)}

    def play(self, cache: PartCache) -> Measured:
        """Measure all rounds; no results are cached.

        Raises:
            HRCError: a function that should be timed is never called.
        """
        measured = Measured(list)
        if self.task != EVERY:
            _play_sizes(self, cache, measured)
        if self.task in (OURS, EVERY):
            _play_tasks(self, cache, measured)
        return measured

    def metrics(self, played: Measured) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return compute_metrics(played)

    @property
    def vectors(self) -> list[tuple[int, int]]:
        """Pairs (number of environments, number of threads), one for each vector environment."""
        return [(n, k) for n in self.sizes for k in self.threads if k <= n]

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables that this benchmark fills in the documentation."""
        configurations = (SINGLE, *(f"{size}.{threads}" for size, threads in self.vectors))
        return (make_steps_table(self.levels, configurations), make_organs_table(SHOWN), TASKS)

    def report(self, played: Measured, metrics: Metrics, figures: Path) -> Report:
        """Plot the figure and return the report."""
        return report(metrics, figures)


QUICK = SpeedBench(n_rounds=1, least_steps=1000, task_steps=25)
"""Benchmark settings for a quick run, which computes all numbers from one short turn."""


UNITS = {"env_steps_per_s": "1/s", "us_per_env_step": "us", "reset_ms": "ms"}
"""Units of the measured numbers, by kind."""


@dataclass(frozen=True, slots=True)
class Turn:
    """The measurement of a contender that is repeated in each round."""

    level: str
    configuration: str
    n_threads: int
    contender: Contender
    n_episodes: int
    cost: float
    """Approximate duration of the turn, relative to other turns."""


def _play_tasks(config: SpeedBench, parts: PartCache, measured: Measured) -> None:
    """Measure the speed of the environments of all ids."""
    share = (config.task == EVERY) / config.n_rounds
    with closing(Tasks()) as tasks:
        for _ in range(config.n_rounds):
            for name, pace in tasks.run(config.task_steps).items():
                measured[f"{BY_TASK}.{name}"].append(pace)
            parts.progress(share, "every id")


def _play_sizes(config: SpeedBench, parts: PartCache, measured: Measured) -> None:
    """Measure one id in all configurations, with the parts of its steps and its resets."""
    organs = Organs()
    with ExitStack() as exits:
        turns = [*_turns(config, exits, parts.progress)]
        starts = Starts(config.task)
        exits.callback(starts.close)
        share = (1 - _MAKING) / (config.n_rounds * sum(turn.cost for turn in turns))
        for _ in range(config.n_rounds):
            for turn in turns:
                _take(turn, measured, organs)
                parts.progress(share * turn.cost, f"{turn.level} {turn.configuration}")
            organs.check_all_called()
            for name, ms in starts.run(config.n_resets).items():
                measured[f"reset_ms.{name}"].append(ms)


def _take(turn: Turn, measured: Measured, organs: Organs) -> None:
    """Run a contender; at level `WATCHED`, run it a second time with timed parts."""
    pace = turn.contender.run(turn.n_episodes)
    name = f"{turn.level}.{turn.configuration}"
    measured[f"env_steps_per_s.{name}"].append(pace.env_steps / pace.seconds)
    if turn.level == WATCHED:
        shares = organs.us_per_env_step(turn.contender, turn.n_episodes, turn.n_threads)
        for organ, us in shares.items():
            measured[f"us_per_env_step.{organ}.{turn.configuration}"].append(us)


def _turns(config: SpeedBench, exits: ExitStack, progress: Progress) -> Iterator[Turn]:
    """Yield the turns of all contenders; `exits` closes the contenders at the end."""
    known = config.vectors
    n_contenders = len(config.levels) * (1 + len(known)) + 2

    def turn(level: str, configuration: str, threads: int, contender: Contender) -> Turn:
        exits.callback(contender.close)
        progress(_MAKING / n_contenders, f"making {level} {configuration}")
        n_episodes = math.ceil(config.least_steps / contender.episode_env_steps)
        cost = n_episodes * contender.episode_env_steps / threads
        times = 2 if level == WATCHED else 0.1 if level == REACHER else 1
        return Turn(level, configuration, threads, contender, n_episodes, times * cost)

    yield turn(REACHER, SINGLE, 1, Single(PEER))
    yield turn(REACHER, f"{_REACHERS}.1", 1, Vector(PEER, _REACHERS))
    for level in config.levels:
        yield turn(level, SINGLE, 1, Single(config.task, perception=level, shield=config.shield))
        for size, threads in known:
            contender = Vector(
                config.task, size, perception=level, num_threads=threads, shield=config.shield
            )
            yield turn(level, f"{size}.{threads}", threads, contender)


def compute_metrics(measured: Measured) -> dict[str, Metric]:
    """Compute all metrics as medians over rounds, with the range over rounds as interval."""
    own = {name: values for name, values in measured.items() if not name.startswith(BY_TASK)}
    by_task = {
        name: measured[f"{BY_TASK}.{name}"] for name in list_endings(measured, f"{BY_TASK}.")
    }
    found = {name: over(values, UNITS[name.split(".")[0]]) for name, values in own.items()}
    return found | (shares(by_task) if by_task else {})
