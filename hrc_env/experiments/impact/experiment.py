"""What perception is worth in safety: every policy with every setup, on the same workers."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, HRCError, check_names
from hrc_env.core.results import Metric
from hrc_env.experiments.agents import check_choice, labels_of
from hrc_env.experiments.cache import Part, PartCache
from hrc_env.experiments.impact.declaration import LATENESS, documented
from hrc_env.experiments.impact.episodes import play_row
from hrc_env.experiments.impact.metrics import Played, metrics_of
from hrc_env.experiments.impact.policies import (
    POLICIES,
    PPO,
    SLOWED,
    WORDS,
    Policy,
    control_for,
    made_of,
    maker,
    trained,
)
from hrc_env.experiments.impact.report import report
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import DT_S
from hrc_env.experiments.runner import at_least_one, changed
from hrc_env.experiments.setups import (
    LATE,
    REFERENCE,
    PerceptionSetup,
    all_setups,
    setup_called,
    usual_setups,
)
from hrc_env.experiments.stage import N_TOGETHER, PEOPLE
from hrc_env.experiments.versions import key_of, source_digest
from hrc_env.safety.shield import find_shield
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import find_task
from hrc_env.tracking.estimators import find_estimator

FIRST_SEED = 1_000_000
"""Of the episodes, far from those that the policy learns in."""


@dataclass(frozen=True, slots=True)
class Impact:
    """The experiment, and how much is played."""

    name = "impact"
    depends = ("env", "tracker", "emulator", "detector", "motion", "shield", "agents")
    task: str = DEFAULT
    """What the robots do."""
    shield: str | None = None
    """What may change their commands, by its name."""
    n_seeds: int = 90
    """Episodes of every row, at level `pixels` at most `n_pixels`."""
    n_pixels: int = 3
    """Episodes of a row at level `pixels`, where every image is drawn."""
    n_steps: int = 250
    """Control steps of an episode; the commands say the task's."""
    learning_steps: int = 300_000
    """Environment steps in which the trained policy learns."""
    policies: tuple[str, ...] = POLICIES
    """Whose perception is exchanged: `POLICIES`, or agents as `hrc_env.make_agent` takes them."""
    control: str | None = None
    """The control of policies whose files do not name one; None: the default."""
    trust: bool = False
    """Whether pickles in their checkpoints are read, as of `make_agent`."""
    setups: tuple[str, ...] = field(default_factory=usual_setups)
    """Which perception they get; the reference is always among them."""
    margins_m: tuple[float, ...] = (0.05, 0.1, 0.2)
    """What `scripted_slowed` adds to its distances where margins are compared [m]."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        find_task(self.task)
        find_shield(self.shield)
        at_least_one(self, "n_seeds", "n_pixels", "n_steps", "learning_steps")
        for name in self.policies:
            if name in POLICIES:
                continue
            if re.fullmatch(r"\w+", name) and not Path(name).exists():
                check_names("policy", [name], (*POLICIES, "random"))
            check_choice(name)
        labels_of(self.policies, WORDS)
        check_names("perception setup", self.setups, all_setups())
        if REFERENCE not in self.setups or not self.policies:
            raise ConfigError(
                f"setups must hold the reference {REFERENCE!r}; policies at least one."
            )

    @property
    def seeds(self) -> list[int]:
        """One an episode."""
        return self.seeds_at("keypoints")

    def seeds_at(self, level: str) -> list[int]:
        """Return those of a perception level."""
        n = min(self.n_seeds, self.n_pixels) if level == "pixels" else self.n_seeds
        return [FIRST_SEED + k for k in range(n)]

    @property
    def is_quick(self) -> bool:
        """Whether the episodes or the learning are too few to compare anything."""
        is_short = PPO in self.policies and self.learning_steps <= QUICK["learning_steps"]
        return any(getattr(self, n) <= QUICK[n] for n in ("n_seeds", "n_steps")) or is_short

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a quick run; "" if it is not quick."""
        return quick_words(self.n_seeds, self.n_steps * DT_S) if self.is_quick else ""

    @property
    def warning(self) -> str:
        """What the report of a quick run says of itself; "" of others."""
        if not self.is_quick:
            return ""
        played = f"{self.n_seeds} episodes of {self.n_steps * DT_S:g} s a row"
        learnt = f", and `{PPO}` has learnt for {self.learning_steps:,} steps only"
        return (
            f"This run was quick: {played}{learnt if PPO in self.policies else ''}. That is not "
            "enough to compare estimators, cameras or delays; nothing is marked as a difference."
        )

    def rows(self) -> Iterator[tuple[PerceptionSetup, list[Policy]]]:
        """Every setup, and who is played with it; late ones and the reference with all margins."""
        swept = [REFERENCE, *(each.name for each in LATE)] if SLOWED in self.policies else []
        for name in self.setups:
            margins_m = self.margins_m if name in swept else ()
            policies = [Policy(policy) for policy in self.policies]
            yield setup_called(name), policies + [Policy(SLOWED, m) for m in margins_m]

    @property
    def n_parts(self) -> int:
        """Rows, and a training."""
        return sum(len(policies) for _, policies in self.rows()) + (PPO in self.policies)

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        given = {name: each for name, each in asdict(self).items() if name != "trust"}
        if self.control is None:
            del given["control"]
        return {"people": PEOPLE, **given}

    def play(self, cache: PartCache) -> Played:
        """Return every row; `HRCError` if workers walked otherwise in some."""
        table: dict[tuple[str, str], dict[str, list[Any]]] = {}
        checkpoint, ppo = cache.folder / "ppo.zip", ""
        if PPO in self.policies:
            n = self.learning_steps
            learnt = {"task": self.task, "people": PEOPLE, "learning_steps": n}
            key = key_of(learnt, self.depends)
            ppo = trained(cache, n, checkpoint, key, self.task)
        rows: list[tuple[str, str]] = []
        parts: list[Part] = []
        for setup, policies in self.rows():
            for policy in policies:
                made = self._parts(setup, policy, checkpoint, ppo)
                rows += [(policy.label, setup.name)] * len(made)
                parts += made
        for row, sums in zip(rows, cache.parts(parts), strict=True):
            for name, values in sums.items():
                table.setdefault(row, {}).setdefault(name, []).extend(values)
        check_walks(table)
        return table

    def _parts(
        self, setup: PerceptionSetup, policy: Policy, checkpoint: Path, ppo: str
    ) -> list[Part]:
        """Return the parts of a row, of at most `N_TOGETHER` episodes each."""
        control = control_for(policy, self.control)
        made_with: dict[str, Any] = {"task": self.task, "shield": self.shield}
        made_with |= {} if control is None else {"control": control}
        seeds, name = self.seeds_at(setup.level), f"{policy.label}.{setup.name}"
        shards = [seeds[k : k + N_TOGETHER] for k in range(0, len(seeds), N_TOGETHER)]
        return [
            Part(
                name if len(shards) == 1 else f"{name}.{shard[0]}",
                partial(
                    _play, policy.label, setup, made_with, shard, self.n_steps,
                    maker(policy, checkpoint, self.trust), policy.margin_m,
                ),
                self._key(setup, control, policy, ppo, shard),
            )
            for shard in shards
        ]  # fmt: skip

    def _key(
        self,
        setup: PerceptionSetup,
        control: str | None,
        policy: Policy,
        ppo: str,
        seeds: Sequence[int],
    ) -> str:
        """Return the key of a part of a row."""
        shared = {
            "people": PEOPLE,
            "task": self.task,
            **({} if self.shield is None else {"shield": self.shield}),
            **({} if control is None else {"control": control}),
            "seeds": list(seeds),
            "n_steps": self.n_steps,
            "setup": asdict(setup),
            "estimator": source_digest(find_estimator(setup.estimator).make),
        }
        return key_of(shared | made_of(policy, ppo), self.depends)

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return every number."""
        return metrics_of(played, self.margins_m)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the documentation."""
        return (documented(self.setups), LATENESS)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Draw the figure; return the tables beside it."""
        robots = labels_of(self.policies, WORDS)
        return report(figures, played, metrics, robots, self.warning)


def _play(label: str, *given: Any) -> Any:
    """Return the rows of `play_row`; errors begin with the label of the policy."""
    try:
        return play_row(*given)
    except ConfigError as error:
        raise ConfigError(f"{label}: {error}") from error


QUICK: dict[str, Any] = {"n_seeds": 8, "n_pixels": 1, "n_steps": 100, "learning_steps": 65_536}
"""Every number, from little, and for 4 s: what takes the time is the number of steps."""


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
    """The settings that the command line asks for; if estimators are named, only these, the
    reference, the truth and nothing are compared; if robots are named, only these act."""
    whole = Impact(n_steps=find_task(task).max_episode_steps)
    config = changed(
        Impact(**QUICK) if quick else whole, task=task, shield=shield, control=control,
        policies=tuple(dict.fromkeys(robots)) or None, trust=trust,
    )  # fmt: skip
    asked = [PerceptionSetup(estimator=find_estimator(name).name).name for name in estimator]
    setups = tuple(dict.fromkeys(("truth", "none", REFERENCE, *asked))) if asked else None
    return changed(config, n_seeds=seeds, setups=setups)


def check_walks(table: Mapping[tuple[str, str], Mapping[str, list[Any]]]) -> None:
    """Raise unless the worker of a seed walked the same way in every row, bit for bit."""
    longest = max((row["walk"] for row in table.values()), key=len)
    for (policy, setup), row in table.items():
        if row["walk"] != longest[: len(row["walk"])]:
            raise HRCError(
                f"With {policy} and {setup} the workers walked otherwise than in other rows: "
                "nothing can be compared. Delete the folder's parts and start again."
            )
