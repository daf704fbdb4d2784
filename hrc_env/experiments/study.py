"""Studies of whole episodes, which are declared by their rows, columns and tables.

An invalid declaration raises a `ConfigError` at once, for example if it names an unknown agent,
estimator, shield, environment, argument, statistic or baseline.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.agents.registry import find_interface
from hrc_env.core.errors import ConfigError, check_names, make_unknown_name_error
from hrc_env.core.results import Metric
from hrc_env.core.typing import Ints
from hrc_env.engines.files import carried
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.intervals import P, adjust_metrics
from hrc_env.evaluation.sums import STATISTICS
from hrc_env.experiments.agents import AgentChoice, check_choice, describe_agent, get_agent_factory
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import (
    Conditions,
    Metrics,
    Report,
    Table,
    describe_quick_run,
    format_seeds,
)
from hrc_env.experiments.rigs import DT_S
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.versions import check_subsystems, hash_source, make_key
from hrc_env.pipeline.levels import LEVELS
from hrc_env.safety.shield import SHIELDS
from hrc_env.scene.rigs import RIGS
from hrc_env.settings import resolve_settings
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import find_task
from hrc_env.tracking.estimators import ESTIMATORS

Played = Mapping[str, list[dict[str, float]]]
"""Statistics of the episodes of each row, in the order of their seeds."""
FOUR = PerceptionSetup()
"""Perception setup with four cameras without delay and detections from the emulator."""
GIVEN_BY_SETUP = ("perception", "estimator")
"""Arguments of the environment that are determined by `Row.setup`."""


class Shard(NamedTuple):
    """The episodes in one part of a row."""

    first_seed: int
    n_episodes: int


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a study, with the episodes of an agent in an environment."""

    words: str | tuple[str, ...]
    """Text cells at the beginning of the row."""
    n_episodes: int
    """Number of episodes. They use the first seeds of the study."""
    agent: AgentChoice = "scripted"
    """Agent as `hrc_env.agents.registry.make_agent` accepts it, or a function that makes one."""
    setup: PerceptionSetup = FOUR
    """Perception of the robot. Successive episodes use the setup's choices of cameras in turn."""
    env: Mapping[str, Any] = field(default_factory=dict)
    """Other arguments of the environment, as in `gymnasium.make`."""
    baseline: str | None = None
    """Name of the row with which the columns that are `is_paired` compare this row on the same
    seeds."""
    n_together: int = 250
    """Maximum number of episodes in one part, which are played as one batch."""
    is_shown: bool = True
    """Whether the row appears in the table."""
    trust: bool = False
    """Whether pickles in the agent's checkpoint may be loaded, as in `make_agent`."""

    @property
    def cells(self) -> tuple[str, ...]:
        """Text cells at the beginning of the row."""
        return (self.words,) if isinstance(self.words, str) else self.words

    @property
    def n_steps(self) -> int:
        """Maximum number of control steps in an episode."""
        asked = self.env.get("max_episode_steps")
        return asked or find_task(self.env.get("task", DEFAULT)).max_episode_steps

    def keywords(self) -> list[dict[str, Any]]:
        """Return the arguments of the environments that successive episodes use in turn.

        They include the control mode and the optional observations of a trained agent.
        """
        setup, known = self.setup, dict(self.env)
        if isinstance(self.agent, str):
            known = find_interface(self.agent).complete(known)
        known["perception"] = setup.level
        if setup.level in ("keypoints", "pixels"):
            known["estimator"] = setup.estimator
        if setup.is_plain:
            return [known]
        scene = resolve_settings(
            **{name: known[name] for name in ("task", "scene") if name in known}
        ).scene
        faults = list(known.pop("faults", ()))
        return [
            {**known, "cameras": list(turn.cameras), "faults": [*turn.faults, *faults]}
            for turn in setup.list_turns(RIGS[scene])
        ]

    def settings(self) -> dict[str, Any]:
        """Return all settings on which the episodes depend, except seeds, as JSON values."""
        settings = {
            "agent": describe_agent(self.agent),
            "setup": asdict(self.setup),
            "env": describe(self.env),
        }
        if source := hash_source(ESTIMATORS[self.setup.estimator].make):
            settings["estimator_source"] = source
        shield = self.env.get("shield")
        if isinstance(shield, str) and (source := hash_source(SHIELDS[shield])):
            settings["shield_source"] = source
        return settings

    def check(self) -> None:
        """Raise `ConfigError` if the row cannot be played."""
        for name in GIVEN_BY_SETUP:
            if name in self.env:
                raise ConfigError(f"env must leave out {name}, which comes from the row's setup.")
        if self.n_episodes < 1 or self.n_together < 1:
            raise ConfigError(
                "n_episodes and n_together must be at least 1, got "
                f"{self.n_episodes} and {self.n_together}."
            )
        check_names("perception", [self.setup.level], LEVELS)
        check_choice(self.agent)
        for keywords in self.keywords():
            keywords.pop("max_episode_steps", None)  # an argument of Gymnasium
            resolve_settings(**keywords)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """The declaration of a study: rows, columns and tables."""

    name: str
    """Name of the study in its folder and in its results."""
    title: str
    """Title of the report."""
    about: str
    """Question and method of the study."""
    depends: tuple[str, ...]
    """Subsystems on which the numbers depend (`behaviour.toml`)."""
    first_seed: int
    """Seed of the first episode of every row; it increases by one with each further episode."""
    rows: Mapping[str, Row]
    """Rows by name, in the order in which they are played and shown. Rows of policies that are not
    trained yet may be missing if `tables` are given."""
    columns: tuple[Column, ...]
    """Columns, each of which computes a statistic of every row (`hrc_env.columns`)."""
    heads: tuple[str, ...] = ("",)
    """Headings of the text cells at the beginning of rows."""
    note: str = ""
    """Text below the table, as in `Table.note`."""
    tables: tuple[Table, ...] = ()
    """Tables to show; if empty, one table of all rows and columns is shown."""
    conditions: Conditions | None = None
    """Conditions of a safety study, which the notes of its tables name together with its seeds."""
    derive: Callable[[Metrics], Metrics] | None = None
    """Function that computes further metrics from those of the columns."""
    n_quick: int = 4
    """Number of episodes per row in the quick form."""
    threads: int | None = None
    """Number of threads that the environments share; None: the number of cores."""
    is_quick: bool = False
    """Whether this study is in its quick form."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a row, a column or a table is invalid."""
        check_subsystems(self.depends)
        if not self.columns or not (self.rows or self.tables):
            raise ConfigError(f"Study {self.name!r} must have rows and columns.")
        for name, row in self.rows.items():
            try:
                row.check()
            except ConfigError as error:
                raise ConfigError(f"Row {name!r} of {self.name!r}: {error}") from error
            self._check_baseline(name, row)
        known = self._list_metrics()
        if len(set(known)) < len(known):
            twice = next(each for each in known if known.count(each) > 1)
            raise ConfigError(f"Study {self.name!r} measures {twice!r} twice.")
        for table in self.shown_tables():
            if self.derive is None:
                table.check(known)

    def _check_baseline(self, name: str, row: Row) -> None:
        """Raise `ConfigError` if the row's baseline is missing or too short."""
        paired = [column.metric.format(name) for column in self.columns if column.is_paired]
        if row.baseline is None:
            if paired:
                raise ConfigError(
                    f"Row {name!r} of {self.name!r} has no baseline, which {paired[0]!r} requires; "
                    "a row can be its own baseline."
                )
            return
        check_names(f"baseline of row {name!r}, a row,", [row.baseline], self.rows)
        if self.rows[row.baseline].n_episodes < row.n_episodes:
            raise ConfigError(
                f"Row {name!r} has {row.n_episodes} episodes, and its baseline {row.baseline!r} "
                f"must have as many; it has {self.rows[row.baseline].n_episodes}."
            )

    def _list_metrics(self) -> list[str]:
        return [c.metric.format(row) for row in self.rows for c in self.columns if c.measure]

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the row with the most episodes."""
        n_episodes = max((row.n_episodes for row in self.rows.values()), default=0)
        return range(self.first_seed, self.first_seed + n_episodes)

    @property
    def n_parts(self) -> int:
        """Number of parts of all rows."""
        return sum(len(split_row(row, self.first_seed)) for row in self.rows.values())

    @property
    def quick_note(self) -> str:
        """The warning on tables of the quick form; "" for the whole study."""
        if not (self.is_quick and self.rows):
            return ""
        seconds = DT_S * max(row.n_steps for row in self.rows.values())
        return describe_quick_run(max(row.n_episodes for row in self.rows.values()), seconds)

    def settings(self) -> dict[str, Any]:
        """Return all settings on which the numbers depend, as JSON values."""
        rows = {name: {"n_episodes": row.n_episodes, **row.settings()}
                for name, row in self.rows.items()}  # fmt: skip
        return {"first_seed": self.first_seed, "rows": rows}

    def select(self, beginnings: Sequence[str]) -> "Study":
        """Return the study with only the rows that have given name prefixes, and their baselines.

        Raises:
            ConfigError: one of the prefixes matches no row.
        """
        for each in beginnings:
            if not any(name.startswith(each) for name in self.rows):
                raise make_unknown_name_error(f"row of {self.name!r}", each, self.rows)
        kept = {name for name in self.rows if name.startswith(tuple(beginnings))}
        kept |= {baseline for name in kept if (baseline := self.rows[name].baseline) is not None}
        return replace(self, rows={name: row for name, row in self.rows.items() if name in kept})

    def shorten(self) -> "Study":
        """Return the quick form: few episodes per row, or a short one if images are rendered."""

        def shorten_row(row: Row) -> Row:
            if row.setup.level == "pixels":
                return replace(row, n_episodes=1, env={**row.env, "max_episode_steps": 10})
            return replace(row, n_episodes=min(row.n_episodes, self.n_quick))

        rows = {name: shorten_row(row) for name, row in self.rows.items()}
        return replace(self, rows=rows, is_quick=True)

    def play(self, cache: PartCache) -> Played:
        """Return the episodes of every row; compute the parts that are not in the cache."""
        shards = [(name, shard) for name, row in self.rows.items()
                  for shard in split_row(row, self.first_seed)]  # fmt: skip
        is_drawn = [self.rows[name].setup.level == "pixels" for name, _ in shards]
        parts = [self._make_part(name, shard) for name, shard in shards]
        episodes: dict[str, list[dict[str, float]]] = {name: [] for name in self.rows}
        made = cache.make_parts(parts, one_core=all(is_drawn))
        for (name, _), part in zip(shards, made, strict=True):
            episodes[name] += part["episodes"]
        return episodes

    def _make_part(self, name: str, shard: Shard) -> Part:
        row = self.rows[name]
        made_of = {
            "row": row.settings(), "first_seed": shard.first_seed, "n": shard.n_episodes,
            "statistics": STATISTICS,
        }  # fmt: skip
        sent = replace(row, agent=carried(row.agent)) if isinstance(row.agent, str) else row
        make = partial(play_shard, sent, shard.first_seed, shard.n_episodes, self.threads)
        label = f"{name.replace('/', '.')}.{shard.first_seed}"
        return Part(label, make, make_key(made_of, self.depends))

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics by name, as "ROW.NAME"."""
        metrics: dict[str, Metric] = {}
        for name, row in self.rows.items():
            own, theirs = played[name], played[row.baseline or name]
            for column in self.columns:
                beside, metric = theirs[: len(own)], column.metric.format(name)
                if column.measure is not None:
                    metrics[metric] = column.measure(own, beside)
                if column.test is not None and row.baseline != name:
                    metrics[f"{P}{metric}"] = column.test(own, beside)
        metrics |= adjust_metrics(metrics)
        return metrics if self.derive is None else {**metrics, **self.derive(metrics)}

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the report and of the documentation."""
        tables = self.tables
        if not tables:
            rows = {name: row.cells for name, row in self.rows.items() if row.is_shown}
            columns = [column for column in self.columns if column.heading]
            tables = (Table(self.name, self.title, rows, columns, self.heads, self.note),)
        if self.conditions is None:
            return tables
        conditions = self.conditions
        if self.rows:
            conditions = replace(conditions, seeds=format_seeds(self.seeds))
        return tuple(replace(table, conditions=conditions) for table in tables)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Return the tables as a report.

        Args:
            played: episodes by row.
            metrics: all metrics by name.
            figures: folder of figures, which is not used, because the report has none.
        """
        parts = [table.to_markdown(metrics) for table in self.shown_tables()]
        return Report(self.title, self.about, parts)


def split_row(row: Row, first_seed: int) -> list[Shard]:
    """Return the parts of a row; each has at most `Row.n_together` episodes."""
    return [
        Shard(first_seed + k, min(row.n_together, row.n_episodes - k))
        for k in range(0, row.n_episodes, row.n_together)
    ]


def play_shard(
    row: Row, first_seed: int, n_episodes: int, threads: int | None, tick: PartProgress
) -> dict[str, Any]:
    """Play the episodes of a part, with one block of episodes for each turn of the row's cameras.

    Args:
        row: the row.
        first_seed: seed of the first episode.
        n_episodes: number of episodes.
        threads: number of threads that environments share; None: the number of cores.
        tick: callback that receives the increase of the completed fraction.
    """
    make, episodes = get_agent_factory(row.agent, row.trust), list[dict[str, float]]()
    turns = row.keywords()
    blocks: list[Ints] = np.array_split(np.arange(n_episodes), len(turns))
    for ids, keywords in zip(blocks, turns, strict=True):
        if not len(ids):
            continue
        if row.setup.level != "pixels":
            keywords["num_threads"] = threads
        share = partial(lambda of, done: tick(done * of), len(ids) / n_episodes)
        episodes += play_episodes(make, len(ids), first_seed + int(ids[0]), tick=share, **keywords)
    return {"episodes": episodes}


def describe(value: Any) -> Any:
    """Convert a value to JSON; a function becomes its name and the digest of its source file."""
    if isinstance(value, Mapping):
        return {str(name): describe(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [describe(each) for each in value]
    if is_dataclass(value) and not isinstance(value, type):
        return describe(asdict(value))
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if callable(value):
        name = getattr(value, "__qualname__", type(value).__qualname__)
        return {"function": name, "source": hash_source(value)}
    return value
