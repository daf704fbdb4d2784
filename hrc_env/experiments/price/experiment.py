"""The price study: settings of the shield by successive halving, for each perception setup."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from hrc_env.agents.experts import EXPERTS
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric
from hrc_env.engines.files import carried
from hrc_env.experiments.agents import check_choice
from hrc_env.experiments.cache import Part, PartCache
from hrc_env.experiments.price import declaration
from hrc_env.experiments.price.episodes import SCRIPTED, Driver, play_episodes
from hrc_env.experiments.price.halving import keep_settings
from hrc_env.experiments.price.metrics import Played, compute_metrics, tally
from hrc_env.experiments.price.report import make_report
from hrc_env.experiments.price.settings import UNSHIELDED, Setting, list_settings
from hrc_env.experiments.price.setups import (
    QUICK,
    TRUTH,
    PriceSetup,
    find_setups,
    list_default_setups,
)
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
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import Task, find_task
from hrc_env.tracking.estimators import find_estimator

CHOOSING_SEED, PROOF_SEED = 18_000_000, 19_000_000
"""First seeds of the episodes on which settings are chosen, and of those that prove them."""
QUICK_SEEDS = 18_900_000, 19_900_000
"""The same for the quick form, so that a preview does not use any seed of the whole study."""
CHOOSING, PROOF, REFERENCE = "choosing", "proof", "reference"
"""Names of roles of episodes in the labels of parts."""


@dataclass(frozen=True, slots=True)
class Price:
    """The price study and its settings.

    Numbers of episodes refer to episodes of 10 s; if the episodes of a task are longer, fewer are
    played, with the same total duration.
    """

    name = "price"
    depends = ("env", "tracker", "emulator", "motion", "shield", "agents")
    task: str = DEFAULT
    """Id of the environment."""
    setups: tuple[str, ...] = field(default_factory=list_default_setups)
    """Names of the perception setups."""
    levels_per_hour: tuple[float, ...] = (1.0, 10.0)
    """Levels of the rate of contacts towards the worker [1/h]."""
    n_settings: int = 12
    """Number of settings of the shield for each setup, the first of `list_settings`."""
    n_choosing: int = 500
    """Number of episodes of each setting on the choosing seeds."""
    n_kept: int = 3
    """Number of settings of each setup that are played on the proof seeds."""
    n_proof: int = 4000
    """Number of episodes of each of them on the proof seeds."""
    choosing_seed: int = CHOOSING_SEED
    """First choosing seed."""
    proof_seed: int = PROOF_SEED
    """First proof seed."""
    n_together: int = 500
    """Maximum number of episodes in a part, a multiple of the numbers of camera choices (4)."""
    n_steps: int | None = None
    """Number of control steps of an episode; None: the time limit of the task."""
    driver: Driver = field(default_factory=Driver)
    """Agent that controls the robot."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        numbers = ("n_settings", "n_choosing", "n_kept", "n_proof", "n_together")
        check_at_least_one(self, *numbers)
        find_setups(self.setups)
        if not self.setups:
            raise ConfigError(
                f"No perception setup to compare; valid are {', '.join(list_default_setups())}."
            )
        levels = self.levels_per_hour
        if not levels or min(levels) <= 0 or len(set(levels)) < len(levels):
            raise ConfigError(
                f"levels_per_hour must be different positive rates, got {self.levels_per_hour}."
            )
        if self.n_together % 4:
            raise ConfigError(f"n_together must be a multiple of 4, got {self.n_together}.")
        both = set(self.choosing_seeds) & set(self.proof_seeds)
        if both:
            raise ConfigError(
                "Choosing seeds and proof seeds must differ, as data on which a choice was made "
                f"cannot prove it; {len(both)} seeds are both, such as {min(both)}."
            )
        check_choice(self.driver.agent)
        _check_task(self.task, self.driver.agent)

    @property
    def choosing_seeds(self) -> list[int]:
        """Seeds of the episodes on which settings are chosen."""
        return self._list_seeds(self.choosing_seed, self.n_choosing)

    @property
    def proof_seeds(self) -> list[int]:
        """Seeds of the episodes that prove the chosen settings."""
        return self._list_seeds(self.proof_seed, self.n_proof)

    @property
    def seeds(self) -> list[int]:
        """All seeds."""
        return self.choosing_seeds + self.proof_seeds

    def _list_seeds(self, first: int, n: int) -> list[int]:
        """Return the seeds of episodes that take as long as `n` episodes of the default task."""
        share = find_task(DEFAULT).max_episode_steps / find_task(self.task).max_episode_steps
        return list(range(first, first + max(round(n * share), 1)))

    def list_settings(self, setup: PriceSetup) -> dict[str, Setting]:
        """Return the settings of the shield that are compared for a perception setup, by name."""
        return dict(islice(list_settings(setup.family).items(), self.n_settings))

    def count_steps(self) -> int:
        """Return the number of control steps of an episode."""
        return self.n_steps or find_task(self.task).max_episode_steps

    @property
    def n_parts(self) -> int:
        """Number of parts on the choosing seeds and on the proof seeds."""
        n_choosing, n_proof = (
            -(-len(seeds) // self.n_together) for seeds in (self.choosing_seeds, self.proof_seeds)
        )
        settings = [len(self.list_settings(setup)) for setup in find_setups(self.setups)]
        kept = sum(min(n, self.n_kept) for n in settings)
        return sum(settings) * n_choosing + (kept + 1) * n_proof

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a shorter run; "" for others."""
        usual = Price()
        if self.n_proof >= usual.n_proof and self.n_choosing >= usual.n_choosing:
            return ""
        return describe_quick_run(self.n_proof, self.count_steps() * DT_S)

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend."""
        given = {name: each for name, each in asdict(self).items() if name != "driver"}
        shields = {
            setup.name: {name: _describe(each) for name, each in self.list_settings(setup).items()}
            for setup in find_setups(self.setups)
        }
        given |= {"people": PEOPLE, "worker": WORKER, "shields": shields}
        return {**given, **self.driver.settings()}

    def play(self, cache: PartCache) -> Played:
        """Play all settings on the choosing seeds, and the best of them on the proof seeds."""
        setups = find_setups(self.setups)
        everything = [(s, each) for s in setups for each in self.list_settings(s).values()]
        choosing = self._play_rows(cache, CHOOSING, everything)
        kept = [
            (setup, self.list_settings(setup)[name])
            for setup in setups
            for name in self.keep_settings(choosing[setup.name])
        ]
        proof = self._play_rows(cache, PROOF, [self.reference, *kept])
        (reference,) = proof.pop(REFERENCE).values()
        return Played(choosing, proof, reference)

    def keep_settings(self, choosing: Mapping[str, Rows]) -> tuple[str, ...]:
        """Return the names of the settings to play on the proof seeds.

        Args:
            choosing: sums of the episodes of one setup on the choosing seeds, by setting.
        """
        tallies = {name: tally(rows) for name, rows in choosing.items()}
        proof_hours = len(self.proof_seeds) * self.count_steps() * DT_S / 3600
        return keep_settings(tallies, self.levels_per_hour, self.n_kept, proof_hours)

    @property
    def reference(self) -> tuple[PriceSetup, Setting]:
        """The unshielded robot with true joints, to which throughput is relative."""
        (truth,) = find_setups([TRUTH])
        return replace(truth, name=REFERENCE), list_settings(truth.family)[UNSHIELDED]

    def make_parts(self, role: str, setup: PriceSetup, setting: Setting) -> list[Part]:
        """Return the parts with the episodes of one setting.

        Args:
            role: `CHOOSING` or `PROOF`, which determines the seeds.
            setup: the perception setup.
            setting: the setting of the shield.
        """
        seeds = self.choosing_seeds if role == CHOOSING else self.proof_seeds
        blocks = (seeds[k : k + self.n_together] for k in range(0, len(seeds), self.n_together))
        return [self._make_part(role, setup, setting, block) for block in blocks]

    def _make_part(
        self, role: str, setup: PriceSetup, setting: Setting, seeds: Sequence[int]
    ) -> Part:
        n_steps, driver = self.count_steps(), self.driver
        made_of = {
            "people": PEOPLE, "worker": WORKER, "task": self.task, "seeds": [*seeds],
            "n_steps": n_steps, "perception": asdict(setup.perception),
            "knows_bodies": setup.knows_bodies, "shield": _describe(setting),
            "estimator": hash_source(find_estimator(setup.perception.estimator).make),
            **driver.settings(),
        }  # fmt: skip
        driver = override(driver, agent=carried(driver.agent))
        make = partial(play_episodes, setup, setting.shield, self.task, n_steps, driver, [*seeds])
        label = f"{setup.name}.{setting.name}.{role}.{seeds[0]}"
        return Part(label, make, make_key(made_of, self.depends))

    def _play_rows(
        self, cache: PartCache, role: str, settings: Iterable[tuple[PriceSetup, Setting]]
    ) -> dict[str, dict[str, Rows]]:
        """Return the sums of all episodes of settings, by perception setup and setting."""
        asked = [(s.name, c.name, self.make_parts(role, s, c)) for s, c in settings]
        made = iter(cache.make_parts([part for *_, parts in asked for part in parts]))
        table: dict[str, dict[str, Rows]] = {}
        for setup, setting, parts in asked:
            rows = _join([next(made) for _ in parts])
            table.setdefault(setup, {})[setting] = rows
        check_walks(self.task, table)
        return table

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(played, self.levels_per_hour)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        tables = (
            declaration.make_best_table(find_setups(self.setups), self.levels_per_hour),
            declaration.make_worth_table(self.levels_per_hour),
        )
        return tuple(replace(table, conditions=self.conditions) for table in tables)

    @property
    def conditions(self) -> Conditions:
        """The conditions of the episodes on the proof seeds."""
        return Conditions(
            people=f"`{PEOPLE}`", scene=f"`{find_task(self.task).scene}`",
            perception="`keypoints`, and `truth` for true capsules and joints",
            seeds=format_seeds(self.proof_seeds),
            chosen_on=f"settings of the shield were chosen on {format_seeds(self.choosing_seeds)}; "
            f"{SHIELD_CHOSEN_ON}",
            worker=WORKER,
        )  # fmt: skip

    @property
    def choosing_conditions(self) -> Conditions:
        """The conditions of the episodes on the choosing seeds."""
        return replace(
            self.conditions, seeds=format_seeds(self.choosing_seeds), chosen_on=SHIELD_CHOSEN_ON
        )

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw the figures and return the report."""
        return make_report(figures, self, played, metrics)


def _describe(setting: Setting) -> dict[str, Any] | None:
    """Return the shield of a setting as a value for JSON; None without a shield."""
    return None if setting.shield is None else asdict(setting.shield)


def _join(parts: Sequence[Mapping[str, list[Any]]]) -> Rows:
    """Return the sums of several parts as one."""
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}


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

    The quick form has four perception setups with four settings each, and seeds of its own, as has
    every run with another number of seeds.
    """
    if len(robots) > 1:
        raise ConfigError(
            "The study compares perception setups for a single robot, got --robots "
            f"{' '.join(robots)}. Run it separately for each robot, with different folders (--out)."
        )
    usual = Price(task=task, driver=Driver(*robots or (SCRIPTED,), control=control, trust=trust))
    if quick:
        usual = override(usual, setups=QUICK, n_settings=4, n_choosing=8, n_kept=2, n_proof=16)
    config = override(usual, setups=tuple(dict.fromkeys(setups)) or None)
    if seeds is not None:
        config = override(config, n_choosing=seeds, n_proof=(2 if quick else 8) * seeds)
    if config.quick_note:
        config = override(config, choosing_seed=QUICK_SEEDS[0], proof_seed=QUICK_SEEDS[1])
    return config


def replay(config: Price, cache: PartCache, labels: Iterable[str]) -> None:
    """Play parts of a study separately, in any order.

    Args:
        config: settings of the study.
        cache: cache from which every part is requested.
        labels: labels of the parts (`Price.make_parts`).
    """
    rows = [
        (s, each) for s in find_setups(config.setups) for each in config.list_settings(s).values()
    ]
    known = {
        part.label: part
        for role, listed in ((CHOOSING, rows), (PROOF, [config.reference, *rows]))
        for setup, setting in listed
        for part in config.make_parts(role, setup, setting)
    }
    cache.make_parts([known[label] for label in labels])


def check_walks(task: str, table: Mapping[str, Mapping[str, Rows]]) -> None:
    """Raise `HRCError` if the workers' motion differs between settings with the same seeds.

    Workers of tasks in which they wait for the robot are not compared.

    Args:
        task: id of the environment.
        table: sums of the episodes, by perception setup and setting.
    """
    walks = [rows.get("walk") for settings in table.values() for rows in settings.values()]
    if find_task(task).signal is Task.signal and any(walk != walks[0] for walk in walks):
        raise HRCError(
            f"In {task} workers moved differently than near other robots, so rows cannot be "
            "compared. Delete the folder's parts and start again."
        )
