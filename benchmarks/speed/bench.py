"""The speed bench: everybody takes turns, so that a noisy machine slows all of them alike.

A round runs every contender for whole episodes, those at level `keypoints` once more with the
stopwatch round their organs, and resets; then every id has a turn. Medians over rounds count.
"""

import math
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.common import keys
from benchmarks.speed.contenders import OURS, PEER, Contender, Single, Starts, Vector
from benchmarks.speed.declaration import REACHER, SHOWN, SINGLE, TASKS, organs_of, steps_of
from benchmarks.speed.organs import Organs
from benchmarks.speed.report import report
from benchmarks.speed.tasks import Tasks, shares
from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, over
from hrc_env.experiments.cache import PartCache, Progress
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.runner import at_least_one, is_as_short
from hrc_env.safety.shield import find_shield
from hrc_env.tasks.task import find_task

EVERY = "every"
"""In place of an id: all of them."""
WATCHED = "keypoints"
"""The level whose organs are timed."""
_REACHERS = 64
"""How many Reachers are one vector."""
_MAKING = 0.1
"""The share of the progress that goes to making environments."""


Measured = defaultdict[str, list[float]]
"""One number a round, by "<kind>.<name>"; configurations: "single" and "<num_envs>.<threads>"."""
BY_TASK = "task_steps_per_s"
"""The kind of the ids' numbers."""


@dataclass(frozen=True, slots=True)
class SpeedBench:
    """The experiment, and how much is run."""

    name = "bench speed"
    depends = ("env", "tracker", "emulator", "motion")
    seeds = (0,)
    n_parts = 1
    task: str = OURS
    """Which environment, by its id; "every": the speed of each, and nothing else."""
    shield: str | None = None
    """What may change its commands, by its name."""
    n_rounds: int = 6
    """How often everybody has a turn."""
    least_steps: int = 4000
    """Environment steps of a turn, at least; whole episodes are run."""
    n_resets: int = 25
    """Resets of each kind in a round."""
    task_steps: int = 200
    """Steps of each id's vector in a round; none if `task` is another one than the first."""
    levels: tuple[str, ...] = (WATCHED, "truth", "none")
    """Perception levels."""
    sizes: tuple[int, ...] = (1, 16, 64, 256)
    """Numbers of environments."""
    threads: tuple[int, ...] = (1, 2)
    """Numbers of threads; more than there are environments are left out."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        find_shield(self.shield)
        if self.task != EVERY:
            find_task(self.task)
        at_least_one(self, "n_rounds", "least_steps", "n_resets", "task_steps")
        if WATCHED not in self.levels:
            raise ConfigError(f"levels must have {WATCHED!r} in them, got {self.levels}.")

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        seconds = HRCConfig().ctrl_dt * self.least_steps
        return quick_words(self.n_rounds, seconds, "round") if is_as_short(self, QUICK) else ""

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        return {"bench": asdict(self)}

    def play(self, cache: PartCache) -> Measured:
        """Return the numbers of all rounds; nothing is kept between runs.

        Raises:
            HRCError: an organ's function is no longer called, so that its time would be missed.
        """
        measured = Measured(list)
        if self.task != EVERY:
            _play_sizes(self, cache, measured)
        if self.task in (OURS, EVERY):
            _play_tasks(self, cache, measured)
        return measured

    def metrics(self, played: Measured) -> dict[str, Metric]:
        """Return every number."""
        return metrics_of(played)

    @property
    def vectors(self) -> list[tuple[int, int]]:
        """Numbers of environments and of threads of every vector."""
        return [(n, k) for n in self.sizes for k in self.threads if k <= n]

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        configurations = (SINGLE, *(f"{size}.{threads}" for size, threads in self.vectors))
        return (steps_of(self.levels, configurations), organs_of(SHOWN), TASKS)

    def report(self, played: Measured, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure; return the tables beside it."""
        return report(metrics, figures)


QUICK = SpeedBench(n_rounds=1, least_steps=1000, task_steps=25)
"""Every number, from one short turn."""


UNITS = {"env_steps_per_s": "1/s", "us_per_env_step": "us", "reset_ms": "ms"}
"""By kind."""


@dataclass(frozen=True, slots=True)
class Turn:
    """What somebody does in each round."""

    level: str
    configuration: str
    n_threads: int
    contender: Contender
    n_episodes: int
    cost: float
    """What share of a round it takes, roughly and in any unit."""


def _play_tasks(config: SpeedBench, parts: PartCache, measured: Measured) -> None:
    """Every id."""
    share = (config.task == EVERY) / config.n_rounds
    with closing(Tasks()) as tasks:
        for _ in range(config.n_rounds):
            for name, pace in tasks.run(config.task_steps).items():
                measured[f"{BY_TASK}.{name}"].append(pace)
            parts.progress(share, "every id")


def _play_sizes(config: SpeedBench, parts: PartCache, measured: Measured) -> None:
    """One id in all sizes, organs, resets."""
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
    """Run as it is; then, where organs are timed, with the stopwatch round them."""
    pace = turn.contender.run(turn.n_episodes)
    name = f"{turn.level}.{turn.configuration}"
    measured[f"env_steps_per_s.{name}"].append(pace.env_steps / pace.seconds)
    if turn.level == WATCHED:
        shares = organs.us_per_env_step(turn.contender, turn.n_episodes, turn.n_threads)
        for organ, us in shares.items():
            measured[f"us_per_env_step.{organ}.{turn.configuration}"].append(us)


def _turns(config: SpeedBench, exits: ExitStack, progress: Progress) -> Iterator[Turn]:
    """Make everybody, ready to run, to be closed in the end."""
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


def metrics_of(measured: Measured) -> dict[str, Metric]:
    """Medians over rounds with smallest and largest."""
    own = {name: values for name, values in measured.items() if not name.startswith(BY_TASK)}
    by_task = {name: measured[f"{BY_TASK}.{name}"] for name in keys(measured, f"{BY_TASK}.")}
    found = {name: over(values, UNITS[name.split(".")[0]]) for name, values in own.items()}
    return found | (shares(by_task) if by_task else {})
