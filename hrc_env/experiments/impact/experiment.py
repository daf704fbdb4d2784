"""The impact study, in which each policy meets the same workers with all perception setups."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hrc_env.core.errors import ConfigError, HRCError, check_names
from hrc_env.core.results import Metric
from hrc_env.experiments.agents import check_choice, label_agents
from hrc_env.experiments.cache import Part, PartCache
from hrc_env.experiments.impact.declaration import LATENESS, make_documentation_table
from hrc_env.experiments.impact.episodes import play_row
from hrc_env.experiments.impact.metrics import Played, compute_metrics
from hrc_env.experiments.impact.policies import (
    POLICIES,
    PPO,
    SEED,
    SLOWED,
    WORDS,
    Policy,
    choose_env_arguments,
    describe_policy,
    get_maker,
    train_once,
)
from hrc_env.experiments.impact.report import make_report
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
from hrc_env.experiments.setups import (
    LATE,
    REFERENCE,
    PerceptionSetup,
    find_setup,
    list_default_setups,
    list_setups,
)
from hrc_env.experiments.stage import N_TOGETHER, PEOPLE, WORKER
from hrc_env.experiments.versions import hash_source, make_key
from hrc_env.safety.shield import find_shield
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import find_task
from hrc_env.tracking.estimators import find_estimator

FIRST_SEED = 1_000_000
"""Seed of the first episode, far from those of training."""


class SetupRows(NamedTuple):
    """Rows of results with one perception setup."""

    setup: PerceptionSetup
    policies: list[Policy]
    """Policies, one per row."""


@dataclass(frozen=True, slots=True)
class Impact:
    """The impact study and its settings."""

    name = "impact"
    depends = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
    task: str = DEFAULT
    """Id of the environment."""
    shield: str | None = None
    """Name of the shield, or None for no shield."""
    n_seeds: int = 90
    """Number of episodes per row. At the level `pixels`, it is limited to `n_pixels`."""
    n_pixels: int = 3
    """Number of episodes per row at the level `pixels`, at which every image is rendered."""
    n_steps: int = 250
    """Number of control steps of an episode; the command uses the time limit of the task."""
    learning_steps: int = 300_000
    """Number of environment steps for the training of PPO."""
    policies: tuple[str, ...] = POLICIES
    """Policies to compare: `POLICIES`, or agents as `hrc_env.make_agent` accepts them."""
    control: str | None = None
    """Control mode of the policies that have none in their files; None: the default."""
    trust: bool = False
    """Whether pickles in the policies' checkpoints may be loaded, as in `make_agent`."""
    setups: tuple[str, ...] = field(default_factory=list_default_setups)
    """Names of perception setups, which must include the reference."""
    margins_m: tuple[float, ...] = (0.05, 0.1, 0.2)
    """Margins to compare [m]. The agent `scripted_slowed` adds them to its limits."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a setting is invalid."""
        find_task(self.task)
        find_shield(self.shield)
        check_at_least_one(self, "n_seeds", "n_pixels", "n_steps", "learning_steps")
        for name in self.policies:
            if name in POLICIES:
                continue
            if re.fullmatch(r"\w+", name) and not Path(name).exists():
                check_names("policy", [name], (*POLICIES, "random"))
            check_choice(name)
        label_agents(self.policies, WORDS)
        check_names("perception setup", self.setups, list_setups())
        if REFERENCE not in self.setups or not self.policies:
            raise ConfigError(
                f"setups must contain the reference {REFERENCE!r}, and policies at least one "
                "policy."
            )

    @property
    def seeds(self) -> list[int]:
        """Seeds, one per episode."""
        return self.list_seeds("keypoints")

    def list_seeds(self, level: str) -> list[int]:
        """Return the seeds of the episodes at a perception level."""
        n = min(self.n_seeds, self.n_pixels) if level == "pixels" else self.n_seeds
        return [FIRST_SEED + k for k in range(n)]

    @property
    def is_quick(self) -> bool:
        """Whether the numbers of episodes or training steps are too small for comparisons."""
        is_short = PPO in self.policies and self.learning_steps <= QUICK["learning_steps"]
        return any(getattr(self, n) <= QUICK[n] for n in ("n_seeds", "n_steps")) or is_short

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" for other runs."""
        return describe_quick_run(self.n_seeds, self.n_steps * DT_S) if self.is_quick else ""

    @property
    def warning(self) -> str:
        """The warning at the top of the report of a quick run; "" for other runs."""
        if not self.is_quick:
            return ""
        played = f"{self.n_seeds} episodes of {self.n_steps * DT_S:g} s per row"
        learnt = f", and `{PPO}` was trained for {self.learning_steps:,} steps only"
        return (
            f"This run was quick: {played}{learnt if PPO in self.policies else ''}. That is not "
            "enough to compare estimators, cameras or delays; no difference is marked."
        )

    def list_rows(self) -> Iterator[SetupRows]:
        """Yield each setup with its policies; delayed setups and the reference have all margins."""
        swept = [REFERENCE, *(each.name for each in LATE)] if SLOWED in self.policies else []
        for name in self.setups:
            margins_m = self.margins_m if name in swept else ()
            policies = [Policy(policy) for policy in self.policies]
            yield SetupRows(find_setup(name), policies + [Policy(SLOWED, m) for m in margins_m])

    @property
    def n_parts(self) -> int:
        """Number of rows, plus one if a policy is trained."""
        return sum(len(row.policies) for row in self.list_rows()) + (PPO in self.policies)

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all numbers depend."""
        given = {name: each for name, each in asdict(self).items() if name != "trust"}
        if self.control is None:
            del given["control"]
        return {"people": PEOPLE, "worker": WORKER, **given}

    def play(self, cache: PartCache) -> Played:
        """Return the sums of all rows; raise `HRCError` if workers moved differently in any row."""
        table: dict[tuple[str, str], dict[str, list[Any]]] = {}
        checkpoint, ppo = cache.folder / "ppo.zip", ""
        if PPO in self.policies:
            n = self.learning_steps
            learnt = {"task": self.task, "people": PEOPLE, "worker": WORKER, "learning_steps": n}
            key = make_key(learnt, self.depends)
            ppo = train_once(cache, n, checkpoint, key, self.task)
        rows: list[tuple[str, str]] = []
        parts: list[Part] = []
        for setup, policies in self.list_rows():
            for policy in policies:
                made = self._make_parts(setup, policy, checkpoint, ppo)
                rows += [(policy.label, setup.name)] * len(made)
                parts += made
        for row, sums in zip(rows, cache.make_parts(parts), strict=True):
            for name, values in sums.items():
                table.setdefault(row, {}).setdefault(name, []).extend(values)
        check_walks(table)
        return table

    def _make_parts(
        self, setup: PerceptionSetup, policy: Policy, checkpoint: Path, ppo: str
    ) -> list[Part]:
        """Return the parts of a row; each has at most `N_TOGETHER` episodes."""
        interface = choose_env_arguments(policy, self.control)
        env_arguments = {"task": self.task, "shield": self.shield, **interface}
        seeds, name = self.list_seeds(setup.level), f"{policy.label}.{setup.name}"
        shards = [seeds[k : k + N_TOGETHER] for k in range(0, len(seeds), N_TOGETHER)]
        return [
            Part(
                name if len(shards) == 1 else f"{name}.{shard[0]}",
                partial(
                    _play, policy.label, setup, env_arguments, shard, self.n_steps,
                    get_maker(policy, checkpoint, self.trust), policy.margin_m,
                ),
                self._make_key(setup, interface, policy, ppo, shard),
            )
            for shard in shards
        ]  # fmt: skip

    def _make_key(
        self,
        setup: PerceptionSetup,
        interface: Mapping[str, Any],
        policy: Policy,
        ppo: str,
        seeds: Sequence[int],
    ) -> str:
        """Return the cache key of a part of a row."""
        shared = {
            "people": PEOPLE,
            "worker": WORKER,
            "task": self.task,
            **({} if self.shield is None else {"shield": self.shield}),
            **interface,
            "seeds": list(seeds),
            "n_steps": self.n_steps,
            "setup": asdict(setup),
            "estimator": hash_source(find_estimator(setup.estimator).make),
        }
        return make_key(shared | describe_policy(policy, ppo), self.depends)

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics by name."""
        return compute_metrics(played, self.margins_m)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        table = make_documentation_table(self.setups)
        return tuple(replace(each, conditions=self.conditions) for each in (table, LATENESS))

    @property
    def conditions(self) -> Conditions:
        """The conditions of all episodes."""
        chosen_on = [
            f"`{PPO}` was trained on seed {SEED}" if PPO in self.policies else "",
            "" if self.shield is None else SHIELD_CHOSEN_ON,
            "the limits of the scripted agents were not chosen on any",
        ]
        return Conditions(
            people=f"`{PEOPLE}`", scene=f"`{find_task(self.task).scene}`",
            perception="`keypoints`, unless a row names another",
            seeds=format_seeds(self.seeds), chosen_on="; ".join(filter(None, chosen_on)),
            worker=WORKER,
        )  # fmt: skip

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure and return the report."""
        robots = label_agents(self.policies, WORDS)
        return make_report(figures, played, metrics, robots, self.conditions, self.warning)


def _play(label: str, *given: Any) -> Any:
    """Return the sums of `play_row`, and prefix messages of errors with the policy's label."""
    try:
        return play_row(*given)
    except ConfigError as error:
        raise ConfigError(f"{label}: {error}") from error


QUICK: dict[str, Any] = {"n_seeds": 8, "n_pixels": 1, "n_steps": 100, "learning_steps": 65_536}
"""Settings of the quick form, with few episodes of 4 s and little training."""


def make_experiment(
    quick: bool = False,
    seeds: int | None = None,
    estimator: Sequence[str] = (),
    task: str = DEFAULT,
    shield: str | None = None,
    robots: Sequence[str] = (),
    control: str | None = None,
    trust: bool = False,
) -> Impact:
    """Return the experiment for the options of the command line.

    If estimators are given, only these, the reference, true poses and no perception are compared.
    If robots are given, only these agents are compared.
    """
    whole = Impact(n_steps=find_task(task).max_episode_steps)
    config = override(
        Impact(**QUICK) if quick else whole, task=task, shield=shield, control=control,
        policies=tuple(dict.fromkeys(robots)) or None, trust=trust,
    )  # fmt: skip
    asked = [PerceptionSetup(estimator=find_estimator(name).name).name for name in estimator]
    setups = tuple(dict.fromkeys(("truth", "none", REFERENCE, *asked))) if asked else None
    return override(config, n_seeds=seeds, setups=setups)


def check_walks(table: Mapping[tuple[str, str], Mapping[str, list[Any]]]) -> None:
    """Raise `HRCError` if the workers of a seed moved differently in any two rows."""
    longest = max((row["walk"] for row in table.values()), key=len)
    for (policy, setup), row in table.items():
        if row["walk"] != longest[: len(row["walk"])]:
            raise HRCError(
                f"With {policy} and {setup} the workers moved differently than in other rows, so "
                "rows cannot be compared. Delete the folder's parts and start again."
            )
