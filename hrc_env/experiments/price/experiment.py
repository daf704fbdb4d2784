"""The price study: a search for margins that give all setups the same rate of contacts."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.agents.experts import EXPERTS
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric
from hrc_env.engines.files import carried
from hrc_env.experiments.agents import check_choice
from hrc_env.experiments.cache import Part, PartCache
from hrc_env.experiments.columns import Column
from hrc_env.experiments.price import declaration
from hrc_env.experiments.price.episodes import SCRIPTED, Driver, play_episodes
from hrc_env.experiments.price.metrics import PER, Played, Row, compute_metrics, suppose_margin_m
from hrc_env.experiments.price.report import make_report
from hrc_env.experiments.price.search import run_together, search
from hrc_env.experiments.price.setups import (
    ELSEWHERE,
    FOUR,
    QUICK,
    TRUTH,
    PriceSetup,
    find_setups,
    list_default_setups,
)
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import (
    SHIELD_CHOSEN_ON,
    Conditions,
    Metrics,
    Report,
    Table,
    describe_quick_run,
    format_seeds,
)
from hrc_env.experiments.rigs import DT_S
from hrc_env.experiments.runner import check_at_least_one, override
from hrc_env.experiments.stage import PEOPLE, WORKER, Rows
from hrc_env.experiments.versions import hash_source, make_key
from hrc_env.tasks import BUILT_IN, DEFAULT
from hrc_env.tasks.task import Task, find_task
from hrc_env.tracking.estimators import find_estimator

QUICK_FRESH = 600
"""Number of new episodes that confirm a margin in the quick form."""
FIRST_SEED, FIRST_FRESH, FIRST_PIXELS = 3_000_000, 4_000_000, 5_000_000
"""First seeds of the search, of the episodes that confirm its margin, and of those with rendered
images."""
BEYOND_M = (0.05, 0.1, 0.2)
"""Distances by which a search successively extends its range if the outermost margins do not
suffice [m]."""


class Case(NamedTuple):
    """A task and the perception setup with which it is played."""

    task: str
    setup: PriceSetup


@dataclass(frozen=True, slots=True)
class Price:
    """The price study and its settings.

    Numbers of episodes refer to episodes of 10 s; if the episodes of a task are longer, fewer are
    played, with the same total duration.
    """

    name = "price"
    depends = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
    task: str = DEFAULT
    """Id of the environment."""
    others: tuple[str, ...] = ()
    """Other tasks, which are played with the setups `ELSEWHERE`."""
    setups: tuple[str, ...] = field(default_factory=list_default_setups)
    """Names of the perception setups."""
    n_seeds: int = 300
    """Number of episodes per search step."""
    n_fresh: int = 1000
    """Number of episodes on new seeds that confirm the margin of the search."""
    n_search: int = 4
    """Number of bisections in a search. Margins on either side are tried afterwards."""
    bracket_m: tuple[float, float] = (-0.4, 0.4)
    """Lowest and highest margin in the initial bracket of a search [m]."""
    level: float = 30.0
    """Contacts towards the worker in 1,000 episodes of 10 s at which setups are compared."""
    n_pixels: int = 40
    """Number of episodes that are played both with rendered images and with the emulator."""
    n_steps: int | None = None
    """Number of control steps of an episode; None: the time limit of the task."""
    driver: Driver = field(default_factory=Driver)
    """Agent that controls the robot."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        check_at_least_one(self, "n_seeds", "n_fresh", "n_search")
        find_setups(self.setups)
        if not self.setups:
            raise ConfigError(
                f"No perception setup to compare; valid are {', '.join(list_default_setups())}."
            )
        low, high = self.bracket_m
        if not (low < high and self.level > 0):
            raise ConfigError(
                "bracket_m must be (least, greatest) and level must be positive, "
                f"got {self.bracket_m} and {self.level}."
            )
        check_choice(self.driver.agent)
        for task in self.tasks:
            _check_task(task, self.driver.agent)

    @property
    def tasks(self) -> tuple[str, ...]:
        """All tasks, of which the first is played with all setups."""
        return (self.task, *self.others)

    def list_cases(self) -> Iterator[Case]:
        """Yield every task with every perception setup."""
        for name in self.tasks:
            for setup in find_setups(self.setups if name == self.task else ELSEWHERE):
                yield Case(name, setup)

    def count_steps(self, task: str) -> int:
        """Return the number of control steps of an episode of a task."""
        return self.n_steps or find_task(task).max_episode_steps

    @property
    def seeds(self) -> list[int]:
        """Seeds of the search and of the episodes that confirm its margin."""
        fresh = self.list_seeds(self.task, self.n_fresh, FIRST_FRESH)
        return self.list_seeds(self.task, self.n_seeds) + fresh

    def list_seeds(self, task: str, n: int, first: int = FIRST_SEED) -> list[int]:
        """Return the seeds of a task, one per episode.

        The episodes take as long as `n` episodes of the default task.
        """
        share = find_task(DEFAULT).max_episode_steps / find_task(task).max_episode_steps
        return [first + k for k in range(max(round(n * share), 1))]

    @property
    def n_parts(self) -> int:
        """Maximum number of parts.

        The parts are search steps, and episodes without a shield or with rendered images.
        """
        n_cases = sum(1 for _ in self.list_cases())
        n_levels = 2 if self.n_pixels and FOUR in self.setups else 0
        n_each = self.n_search + 4 + len(BEYOND_M)
        return n_cases * n_each + 1 + len(self.others) + n_levels

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" for other runs."""
        usual, seconds = Price(), self.count_steps(self.task) * DT_S
        if self.n_seeds < usual.n_seeds or self.n_fresh < QUICK_FRESH:
            return describe_quick_run(self.n_seeds, seconds)
        if self.n_fresh >= usual.n_fresh:
            return ""
        consequence = (
            f"{self.n_fresh} of them count, not {usual.n_fresh}, so intervals are wider than "
            "those of the whole run; no difference is marked"
        )
        return describe_quick_run(self.n_seeds + self.n_fresh, seconds, consequence=consequence)

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend."""
        given = {name: each for name, each in asdict(self).items() if name != "driver"}
        given |= {"people": PEOPLE, "worker": WORKER, "shield": SHIELD}
        return {**given, **self.driver.settings()}

    def play(self, cache: PartCache) -> Played:
        """Run all searches and return their results."""
        alone = cache.make_parts([_play_unshielded(self, task) for task in self.tasks])
        unshielded = dict(zip(self.tasks, alone, strict=True))
        searches = [
            search_margin(self, task, setup, unshielded[task]) for task, setup in self.list_cases()
        ]
        table: dict[str, dict[str, Row]] = {}
        rows = run_together(searches, cache.make_parts)
        for (task, setup), row in zip(self.list_cases(), rows, strict=True):
            table.setdefault(task, {})[setup.name] = row
        return Played(table, unshielded, _compare_levels(self, cache, table))

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(played, self.level)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        others = (declaration.make_tasks_table(self.tasks),) if self.others else ()
        tables = (declaration.WORTH, *others)
        conditions = self.conditions
        return (
            self.make_price_table(),
            *(replace(table, conditions=conditions) for table in tables),
        )

    @property
    def conditions(self) -> Conditions:
        """The conditions of the episodes that confirm margins."""
        scenes = dict.fromkeys(f"`{find_task(task).scene}`" for task in self.tasks)
        searched = format_seeds(self.list_seeds(self.task, self.n_seeds))
        return Conditions(
            people=f"`{PEOPLE}`", scene=" or ".join(scenes),
            perception="`keypoints`, and `truth` for true joints",
            seeds=format_seeds(self.list_seeds(self.task, self.n_fresh, FIRST_FRESH)),
            chosen_on=f"margins were chosen on {searched}; {SHIELD_CHOSEN_ON}",
            worker=WORKER,
        )  # fmt: skip

    @property
    def image_conditions(self) -> Conditions:
        """The conditions of the episodes with rendered images and of those beside them."""
        seeds = range(FIRST_PIXELS, FIRST_PIXELS + max(self.n_pixels, 1))
        return replace(self.conditions, perception="in the rows", seeds=format_seeds(seeds))

    def make_price_table(self, more: Sequence[Column] = ()) -> Table:
        """Return the table of all perception setups.

        Args:
            more: columns in addition to those of the documentation.
        """
        table = declaration.make_price_table(
            self.task, find_setups(self.setups), self.driver.words, self.n_seeds, self.level, more
        )
        return replace(table, conditions=self.conditions)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure and return the report."""
        return make_report(figures, self, played, metrics)


def _check_task(task: str, agent: str) -> None:
    """Raise `ConfigError` if the study cannot play a task."""
    find_task(task)
    if agent == SCRIPTED and task not in EXPERTS:
        raise ConfigError(
            f"The study needs a scripted robot, which exists only for {', '.join(EXPERTS)}, not "
            f"for {task}. Otherwise, name a custom agent: --robots MODULE:FUNCTION."
        )


def make_experiment(
    quick: bool = False,
    seeds: int | None = None,
    task: str = DEFAULT,
    setups: Sequence[str] = (),
    robots: Sequence[str] = (),
    control: str | None = None,
    trust: bool = False,
) -> Price:
    """Return the experiment for the options of the command line.

    The quick form has twelve perception setups and one task. A task other than the default is
    played with the setups `ELSEWHERE` if none are given. If an agent is given, only one task is
    played.
    """
    if len(robots) > 1:
        raise ConfigError(
            "The study compares perception setups for a single robot, got --robots "
            f"{' '.join(robots)}. Run it separately for each robot, with different folders (--out)."
        )
    driver = Driver(*robots or (SCRIPTED,), control=control, trust=trust)
    others = () if robots else tuple(each for each in BUILT_IN if each != DEFAULT)
    if task != DEFAULT:
        usual = Price(task=task, setups=ELSEWHERE, n_pixels=0, driver=driver)
        usual = override(usual, n_fresh=QUICK_FRESH if quick else None)
    elif quick:
        usual = Price(setups=QUICK, n_fresh=QUICK_FRESH, n_pixels=0, driver=driver)
    else:
        usual = Price(others=others, driver=driver)
    config = override(usual, n_seeds=seeds, setups=tuple(dict.fromkeys(setups)) or None)
    if seeds is not None:
        config = override(config, n_fresh=-(-10 * seeds // 3), n_pixels=min(seeds, config.n_pixels))
    return config


def search_margin(
    config: Price, task: str, setup: PriceSetup, alone: Rows
) -> Generator[Part, Rows, Row]:
    """Search for the margin of one perception setup, and confirm it on new seeds.

    This generator yields the required parts one after the other. The caller sends it the rows of
    each.

    Args:
        config: settings of the study.
        task: id of the environment.
        setup: the perception setup.
        alone: rows of the robot without a shield.

    Raises:
        HRCError: the workers' motion differs from that in the episodes without a shield.
    """
    tried: dict[float, Rows] = {}
    make_part = partial(_make_part, config, task, setup)

    def measure_rate(margin_m: float) -> Generator[Part, Rows, float]:
        tried[margin_m] = rows = yield make_part(config.list_seeds(task, config.n_seeds), margin_m)
        return float(PER * np.sum(rows["towards"]) / np.sum(rows["minutes"]))

    def confirm(margin_m: float) -> Generator[Part, Rows, Row]:
        fresh = yield make_part(config.list_seeds(task, config.n_fresh, FIRST_FRESH), margin_m)
        row = Row(tried, margin_m, fresh)
        check_walks(task, alone, row)
        return row

    yield from search(measure_rate, *config.bracket_m, config.level, config.n_search)
    row = yield from confirm(suppose_margin_m(tried, config.level))
    for beyond_m in BEYOND_M:  # if the new seeds put the level at an outermost margin
        end_m = float(row.evaluate(config.level)[0, 0])
        if not row.ends_at(end_m):
            return row
        yield from measure_rate(end_m + (beyond_m if end_m == max(tried) else -beyond_m))
    end_m = float(row.evaluate(config.level)[0, 0])
    # At the outermost margin, the throughput is measured, not extrapolated from another margin.
    return (yield from confirm(end_m)) if row.ends_at(end_m) else row


def _play_unshielded(config: Price, task: str) -> Part:
    """Return the part with the episodes of a robot without a shield."""
    (setup,) = find_setups([TRUTH])
    seeds = config.list_seeds(task, config.n_fresh, FIRST_FRESH)
    return _make_part(config, task, setup, seeds, 0.0, is_shielded=False)


def _compare_levels(
    config: Price, cache: PartCache, table: Mapping[str, Mapping[str, Row]]
) -> dict[str, Rows]:
    """Play the same few episodes with the emulator and with rendered images; return both."""
    if not config.n_pixels or FOUR not in table[config.task]:
        return {}
    margin_m, levels = table[config.task][FOUR].margin_m, ("keypoints", "pixels")
    (setup,) = find_setups([FOUR])
    seeds = [FIRST_PIXELS + k for k in range(config.n_pixels)]
    parts = [
        _make_part(config, config.task, _change_level(setup, each), seeds, margin_m)
        for each in levels
    ]
    return dict(zip(levels, cache.make_parts(parts), strict=True))


def _change_level(setup: PriceSetup, level: str) -> PriceSetup:
    """Return a setup with another perception level; the level is appended to the setup's name."""
    perception = override(setup.perception, level=level)
    return override(setup, name=f"{FOUR}_{level}", perception=perception)


def _make_part(
    config: Price,
    task: str,
    setup: PriceSetup,
    seeds: list[int],
    margin_m: float,
    is_shielded: bool = True,
) -> Part:
    """Return the part with the episodes of a setup with one margin."""
    played = {name: each for name, each in asdict(setup).items() if name not in ("words", "group")}
    n_steps, driver = config.count_steps(task), config.driver
    made_of = {
        "people": PEOPLE, "worker": WORKER, "task": task, "seeds": seeds, "n_steps": n_steps,
        "setup": played, "margin_m": margin_m, "shield": SHIELD if is_shielded else "",
        "estimator": hash_source(find_estimator(setup.perception.estimator).make),
        **driver.settings(),
    }  # fmt: skip
    role = {FIRST_SEED: "searched", FIRST_FRESH: "fresh", FIRST_PIXELS: "pixels"}[seeds[0]]
    suffix = f"{1e4 * margin_m:+.0f}" if is_shielded else "unshielded"
    driver = override(driver, agent=carried(driver.agent))
    make = partial(play_episodes, setup, task, n_steps, is_shielded, driver, seeds, margin_m)
    label = f"{task}.{setup.name}.{role}.{suffix}"
    return Part(label, make, make_key(made_of, config.depends), {"margin_m": margin_m})


def replay(config: Price, cache: PartCache, margins_m: Mapping[str, float]) -> None:
    """Play parts of a search separately, in any order.

    Args:
        config: settings of the study.
        cache: cache from which every part is requested.
        margins_m: margins of the parts by label (`_make_part`) [m].
    """
    parts: list[Part] = []
    for label, margin_m in margins_m.items():
        task, _, rest = label.partition(".")
        name, role, suffix = rest.rsplit(".", 2)
        seeds = {
            "searched": config.list_seeds(task, config.n_seeds),
            "fresh": config.list_seeds(task, config.n_fresh, FIRST_FRESH),
            "pixels": [FIRST_PIXELS + k for k in range(config.n_pixels)],
        }[role]
        known, level = (FOUR, name.removeprefix(f"{FOUR}_")) if role == "pixels" else (name, None)
        (setup,) = find_setups([known])
        if level is not None:
            setup = _change_level(setup, level)
        parts.append(_make_part(config, task, setup, seeds, margin_m, suffix != "unshielded"))
    cache.make_parts(parts)


def check_walks(task: str, alone: Rows, row: Row) -> None:
    """Raise `HRCError` if the workers' motion differs from that in episodes without a shield."""
    if find_task(task).signal is Task.signal and row.fresh["walk"] != alone["walk"]:
        raise HRCError(
            f"In {task} workers moved differently than near other robots, so rows cannot be "
            "compared. Delete the folder's parts and start again."
        )
