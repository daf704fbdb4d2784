"""What sight costs at one rate of contacts: every pair of eyes has the margin that it needs."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

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
from hrc_env.experiments.price.eyes import (
    ELSEWHERE,
    FOUR,
    QUICK,
    TRUTH,
    Eyes,
    eyes_called,
    usual_eyes,
)
from hrc_env.experiments.price.metrics import PER, Played, Row, metrics_of, supposed_m
from hrc_env.experiments.price.report import report
from hrc_env.experiments.price.search import run_together, searched
from hrc_env.experiments.price.shield import SHIELD
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import DT_S
from hrc_env.experiments.runner import at_least_one, changed
from hrc_env.experiments.stage import PEOPLE, Rows
from hrc_env.experiments.versions import key_of, source_digest
from hrc_env.tasks import BUILT_IN, DEFAULT
from hrc_env.tasks.task import Task, find_task
from hrc_env.tracking.estimators import find_estimator

QUICK_FRESH = 600
"""Episodes that confirm a margin in the short form."""
FIRST_SEED, FIRST_FRESH, FIRST_PIXELS = 3_000_000, 4_000_000, 5_000_000
"""Of the search, of the episodes that confirm it, of those with rendered images."""
BEYOND_M = (0.05, 0.1, 0.2)
"""So much farther a search looks, one after the other, where its last margins do not suffice."""


@dataclass(frozen=True, slots=True)
class Price:
    """The experiment, and how much is played. Numbers of episodes are those of 10 s; of longer ones
    as much time."""

    name = "price"
    depends = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
    task: str = DEFAULT
    """What the robot does."""
    others: tuple[str, ...] = ()
    """Other tasks, each with the eyes `ELSEWHERE`."""
    eyes: tuple[str, ...] = field(default_factory=usual_eyes)
    """Who is compared, by name."""
    n_seeds: int = 300
    """Episodes of every step of a search."""
    n_fresh: int = 1000
    """Episodes, on other seeds, with the margin that it found."""
    n_search: int = 4
    """Halvings of the bracket in a search; then a margin on either side is tried, too."""
    bracket_m: tuple[float, float] = (-0.4, 0.4)
    """Least and greatest margin: unshielded robots need less than any, the blind more."""
    level: float = 30.0
    """Contacts towards the worker in 1,000 episodes of 10 s."""
    n_pixels: int = 40
    """Episodes with rendered images and a network, and as many with the emulator; 0: none."""
    n_steps: int | None = None
    """Control steps of an episode; None: the task's."""
    driver: Driver = field(default_factory=Driver)
    """The agent that drives the robot."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        at_least_one(self, "n_seeds", "n_fresh", "n_search")
        eyes_called(self.eyes)
        if not self.eyes:
            raise ConfigError(f"No eyes to compare; there are {', '.join(usual_eyes())}.")
        low, high = self.bracket_m
        if not (low < high and self.level > 0):
            raise ConfigError(
                "bracket_m must be (least, greatest) and level be positive, "
                f"got {self.bracket_m} and {self.level}."
            )
        check_choice(self.driver.agent)
        for task in self.tasks:
            _check_task(task, self.driver.agent)

    @property
    def tasks(self) -> tuple[str, ...]:
        """The task with all eyes, then the others."""
        return (self.task, *self.others)

    def pairs(self) -> Iterator[tuple[str, Eyes]]:
        """Every task with every pair of eyes."""
        for name in self.tasks:
            for eyes in eyes_called(self.eyes if name == self.task else ELSEWHERE):
                yield name, eyes

    def steps_of(self, task: str) -> int:
        """Control steps of an episode."""
        return self.n_steps or find_task(task).max_episode_steps

    @property
    def seeds(self) -> list[int]:
        """Of the search, and of the episodes that confirm it."""
        fresh = self.seeds_of(self.task, self.n_fresh, FIRST_FRESH)
        return self.seeds_of(self.task, self.n_seeds) + fresh

    def seeds_of(self, task: str, n: int, first: int = FIRST_SEED) -> list[int]:
        """Return one an episode: as many as last as long as `n` of the first task's."""
        share = find_task(DEFAULT).max_episode_steps / find_task(task).max_episode_steps
        return [first + k for k in range(max(round(n * share), 1))]

    @property
    def n_parts(self) -> int:
        """Steps of all searches at most, episodes without a shield and with pixels."""
        n_pairs = sum(1 for _ in self.pairs())
        n_levels = 2 if self.n_pixels and FOUR in self.eyes else 0
        n_each = self.n_search + 4 + len(BEYOND_M)
        return n_pairs * n_each + 1 + len(self.others) + n_levels

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        usual, seconds = Price(), self.steps_of(self.task) * DT_S
        if self.n_seeds < usual.n_seeds or self.n_fresh < QUICK_FRESH:
            return quick_words(self.n_seeds, seconds)
        if self.n_fresh >= usual.n_fresh:
            return ""
        why = (
            f"{self.n_fresh} of them count, not {usual.n_fresh}, so that intervals are wider than "
            "those of the whole run; nothing is marked as a difference"
        )
        return quick_words(self.n_seeds + self.n_fresh, seconds, why=why)

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        given = {name: each for name, each in asdict(self).items() if name != "driver"}
        return {"people": PEOPLE, "shield": SHIELD, **given, **self.driver.settings()}

    def play(self, cache: PartCache) -> Played:
        """Return what every search came to."""
        alone = cache.parts([_unshielded(self, task) for task in self.tasks])
        unshielded = dict(zip(self.tasks, alone, strict=True))
        searches = [
            search_margin(self, task, eyes, unshielded[task]) for task, eyes in self.pairs()
        ]
        table: dict[str, dict[str, Row]] = {}
        rows = run_together(searches, cache.parts)
        for (task, eyes), row in zip(self.pairs(), rows, strict=True):
            table.setdefault(task, {})[eyes.name] = row
        return Played(table, unshielded, _pixels(self, cache, table))

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return every number."""
        return metrics_of(played.table, played.alone, played.pixels, self.level)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        others = (declaration.elsewhere(self.tasks),) if self.others else ()
        return (self.prices(), declaration.WORTH, *others)

    def prices(self, more: Sequence[Column] = ()) -> Table:
        """Return the table of all eyes.

        Args:
            more: columns besides those of the documentation.
        """
        return declaration.prices(
            self.task, eyes_called(self.eyes), self.driver.words, self.n_seeds, self.level, more
        )

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure; return the tables beside it."""
        return report(figures, self, played, metrics)


def _check_task(task: str, agent: str) -> None:
    """Raise `ConfigError` for a task that the study cannot play."""
    find_task(task)
    if agent == SCRIPTED and task not in EXPERTS:
        raise ConfigError(
            f"The price is that of a scripted robot, and there is none for {task}; there is for "
            f"{', '.join(EXPERTS)}. Or name an agent of your own: --robots MODULE:FUNCTION."
        )


def make_experiment(
    quick: bool = False,
    seeds: int | None = None,
    task: str = DEFAULT,
    eyes: Sequence[str] = (),
    robots: Sequence[str] = (),
    control: str | None = None,
    trust: bool = False,
) -> Price:
    """The settings that the command line asks for. Quick: twelve pairs of eyes, the first task. Of
    another task than the first three pairs of eyes, if none are named. With an agent that is named
    only the one task is played."""
    if len(robots) > 1:
        raise ConfigError(
            f"The price is that of one robot, got --robots {' '.join(robots)}. Call it once for "
            "each, with a folder of its own (--out)."
        )
    driver = Driver(*robots or (SCRIPTED,), control=control, trust=trust)
    others = () if robots else tuple(each for each in BUILT_IN if each != DEFAULT)
    if task != DEFAULT:
        usual = Price(task=task, eyes=ELSEWHERE, n_pixels=0, driver=driver)
        usual = changed(usual, n_fresh=QUICK_FRESH if quick else None)
    elif quick:
        usual = Price(eyes=QUICK, n_fresh=QUICK_FRESH, n_pixels=0, driver=driver)
    else:
        usual = Price(others=others, driver=driver)
    config = changed(usual, n_seeds=seeds, eyes=tuple(dict.fromkeys(eyes)) or None)
    if seeds is not None:
        config = changed(config, n_fresh=-(-10 * seeds // 3), n_pixels=min(seeds, config.n_pixels))
    return config


def search_margin(config: Price, task: str, eyes: Eyes, alone: Rows) -> Generator[Part, Rows, Row]:
    """Search the margin of one pair of eyes, and play on with it.

    Yields the parts that it needs, one after the other, and is sent the rows of each.

    Args:
        config: the settings of the study.
        task: the environment's id.
        eyes: whose margin is sought.
        alone: the rows of the unshielded robot.

    Raises:
        HRCError: workers walked otherwise than beside the unshielded robot.
    """
    tried: dict[float, Rows] = {}
    part = partial(_part, config, task, eyes)

    def rate(margin_m: float) -> Generator[Part, Rows, float]:
        tried[margin_m] = rows = yield part(config.seeds_of(task, config.n_seeds), margin_m)
        return float(PER * np.sum(rows["towards"]) / np.sum(rows["minutes"]))

    def confirmed(margin_m: float) -> Generator[Part, Rows, Row]:
        fresh = yield part(config.seeds_of(task, config.n_fresh, FIRST_FRESH), margin_m)
        row = Row(tried, margin_m, fresh)
        check_walks(task, alone, row)
        return row

    yield from searched(rate, *config.bracket_m, config.level, config.n_search)
    row = yield from confirmed(supposed_m(tried, config.level))
    for beyond_m in BEYOND_M:  # where fresh seeds say so
        end_m = float(row.at(config.level)[0, 0])
        if not row.ends_at(end_m):
            return row
        yield from rate(end_m + (beyond_m if end_m == max(tried) else -beyond_m))
    end_m = float(row.at(config.level)[0, 0])
    # At the last margin of all, throughput is played, not derived from far away.
    return (yield from confirmed(end_m)) if row.ends_at(end_m) else row


def _unshielded(config: Price, task: str) -> Part:
    """Return the episodes without a shield."""
    (eyes,) = eyes_called([TRUTH])
    seeds = config.seeds_of(task, config.n_fresh, FIRST_FRESH)
    return _part(config, task, eyes, seeds, 0.0, is_shielded=False)


def _pixels(config: Price, cache: PartCache, table: Any) -> dict[str, Rows]:
    """The same few episodes with the emulator and with rendered images, with one margin."""
    if not config.n_pixels or FOUR not in table[config.task]:
        return {}
    margin_m, levels = table[config.task][FOUR].margin_m, ("keypoints", "pixels")
    (eyes,) = eyes_called([FOUR])
    seeds = [FIRST_PIXELS + k for k in range(config.n_pixels)]
    parts = [_part(config, config.task, _at_level(eyes, each), seeds, margin_m) for each in levels]
    return dict(zip(levels, cache.parts(parts), strict=True))


def _at_level(eyes: Eyes, level: str) -> Eyes:
    """Return eyes that look at a perception level, named after it."""
    setup = changed(eyes.setup, level=level)
    return changed(eyes, name=f"{FOUR}_{level}", setup=setup)


def _part(
    config: Price,
    task: str,
    eyes: Eyes,
    seeds: list[int],
    margin_m: float,
    is_shielded: bool = True,
) -> Part:
    """Return the episodes with one margin."""
    sight = {name: each for name, each in asdict(eyes).items() if name not in ("words", "group")}
    n_steps, driver = config.steps_of(task), config.driver
    made_of = {
        "people": PEOPLE, "task": task, "seeds": seeds, "n_steps": n_steps,
        "eyes": sight, "margin_m": margin_m, "shield": SHIELD if is_shielded else "",
        "estimator": source_digest(find_estimator(eyes.setup.estimator).make),
        **driver.settings(),
    }  # fmt: skip
    which = {FIRST_SEED: "searched", FIRST_FRESH: "fresh", FIRST_PIXELS: "pixels"}[seeds[0]]
    kept = f"{1e4 * margin_m:+.0f}" if is_shielded else "unshielded"
    driver = changed(driver, agent=carried(driver.agent))
    make = partial(play_episodes, eyes, task, n_steps, is_shielded, driver, seeds, margin_m)
    label = f"{task}.{eyes.name}.{which}.{kept}"
    return Part(label, make, key_of(made_of, config.depends), {"margin_m": margin_m})


def replay(config: Price, cache: PartCache, margins_m: Mapping[str, float]) -> None:
    """Play parts of a search by themselves, not in the order in which it came to them.

    Args:
        config: the settings of the study that they are of.
        cache: is asked for every part.
        margins_m: the margin of each, by its label (`_part`).
    """
    parts: list[Part] = []
    for label, margin_m in margins_m.items():
        task, _, rest = label.partition(".")
        name, which, kept = rest.rsplit(".", 2)
        seeds = {
            "searched": config.seeds_of(task, config.n_seeds),
            "fresh": config.seeds_of(task, config.n_fresh, FIRST_FRESH),
            "pixels": [FIRST_PIXELS + k for k in range(config.n_pixels)],
        }[which]
        known, level = (FOUR, name.removeprefix(f"{FOUR}_")) if which == "pixels" else (name, None)
        (eyes,) = eyes_called([known])
        if level is not None:
            eyes = _at_level(eyes, level)
        parts.append(_part(config, task, eyes, seeds, margin_m, kept != "unshielded"))
    cache.parts(parts)


def check_walks(task: str, alone: Rows, row: Row) -> None:
    """Raise unless workers walked as beside the unshielded robot, where nobody waits for it."""
    if find_task(task).signal is Task.signal and row.fresh["walk"] != alone["walk"]:
        raise HRCError(
            f"In {task} workers walked otherwise than beside other robots: nothing can be "
            "compared. Delete the folder's parts and start again."
        )
