"""What an estimator is worth in safety: the experiment, part by part."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.machine import n_cores
from hrc_env.core.results import Metric, write_results
from hrc_env.experiments.impact.measures import Table, metrics_of
from hrc_env.experiments.impact.report import write_pages
from hrc_env.experiments.impact.tax import tax_metrics
from hrc_env.experiments.impact.trial.episodes import PEOPLE, Stages
from hrc_env.experiments.impact.trial.eyes import (
    LATE,
    PIXELS,
    REFERENCE,
    Eyes,
    eyes_called,
    seeing,
    usual_eyes,
)
from hrc_env.experiments.impact.trial.policies import (
    POLICIES,
    PPO,
    SLOWED,
    Policy,
    check_policy,
    maker,
)
from hrc_env.experiments.study.cache import PartCache, Progress, own_folder
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.tracking.estimators import estimator_called

NAME = "impact"
PARTS_FROM = (
    "hrc_env.experiments.impact.trial.episodes",
    "hrc_env.experiments.impact.trial.training",
    "agents.base",
    "agents.scripted",
    "agents.ppo",
)
"""The modules that finished parts are made by."""
FIRST_SEED = 1_000_000
"""Of the episodes, far from those that the policy learns in."""
SWEPT = (REFERENCE, *(eyes.name for eyes in LATE))
"""Eyes for which margins are compared."""


@dataclass(frozen=True, slots=True)
class ImpactConfig:
    """How much is played."""

    n_episodes: int = 200
    """Episodes of every row, at level `pixels` at most `n_pixels`."""
    n_pixels: int = 6
    """Episodes of a row at level `pixels`, where every image is drawn."""
    n_steps: int = 250
    """Control steps of an episode."""
    learning_steps: int = 300_000
    """Environment steps in which the trained policy learns."""
    policies: tuple[str, ...] = POLICIES
    """Whose eyes are exchanged."""
    eyes: tuple[str, ...] = field(default_factory=usual_eyes)
    """Which eyes they get; the reference is always among them."""
    margins_m: tuple[float, ...] = (0.05, 0.1, 0.2)
    """What `scripted_slowed` adds to its distances where margins are compared [m]."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        for name in ("n_episodes", "n_pixels", "n_steps", "learning_steps"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 1, got {getattr(self, name)}.")
        for name in self.policies:
            check_policy(name)
        for name in self.eyes:
            eyes_called(name)
        if REFERENCE not in self.eyes or not self.policies:
            raise ConfigError(f"eyes must hold the reference {REFERENCE!r}; policies at least one.")
        if any(margin <= 0 for margin in self.margins_m):
            raise ConfigError(f"margins_m must be positive, got {self.margins_m}.")


QUICK: dict[str, Any] = {"n_episodes": 8, "n_pixels": 1, "n_steps": 100, "learning_steps": 65_536}
"""Every number, from little, and for 4 s: what takes the time is the number of steps."""


def config_for(
    quick: bool = False, seeds: int | None = None, estimators: Sequence[str] = ()
) -> ImpactConfig:
    """The settings of a run.

    Args:
        quick: every number, from little.
        seeds: episodes of a row.
        estimators: compare these with the reference, the truth and nothing; all eyes if none.
    """
    config = ImpactConfig(**QUICK) if quick else ImpactConfig()
    if estimators:
        asked = (seeing(estimator_called(name).name).name for name in estimators)
        config = replace(config, eyes=tuple(dict.fromkeys(("truth", "none", REFERENCE, *asked))))
    return config if seeds is None else replace(config, n_episodes=seeds)


def run(
    config: ImpactConfig, out: Path, say: Progress, overwrite: bool = False
) -> dict[str, Metric]:
    """Play everything that is not there yet; results.json, figures, report.html into `out`.

    Args:
        config: how much.
        out: a folder; what an earlier run with the same settings and code finished is used.
        say: hears of the progress: shares that sum to 1.
        overwrite: throw away what something else left there.

    Raises:
        ConfigError: the folder holds other results.
        HRCError: workers did not walk the same way with different eyes.
    """
    own_folder(out, NAME, overwrite)
    settings = _settings(config)
    fingerprint = fingerprint_of(settings, *PARTS_FROM)
    n_parts = len(list(_rows(config))) + (PPO in config.policies)
    cache = PartCache(out / "parts", fingerprint, n_parts, say)
    checkpoint = out / "parts" / "ppo.zip"
    if PPO in config.policies:
        from hrc_env.experiments.impact.trial.training import Learning, trained

        trained(cache, Learning(config.learning_steps, n_cores(), checkpoint))
    table = _played(config, cache, checkpoint)
    _check_walks(table)
    metrics = metrics_of(table)
    metrics |= tax_metrics(table, metrics, config.margins_m)
    write_results(out / "results.json", settings, _seeds(config.n_episodes), metrics)
    write_pages(out, config.n_episodes, config.margins_m, table, metrics)
    return metrics


def _played(config: ImpactConfig, cache: PartCache, checkpoint: Path) -> Table:
    """Every row, by policy and eyes."""
    table: dict[tuple[str, str], dict[str, list[Any]]] = {}
    stages: Stages | None = None
    for eyes, policy in _rows(config):
        if stages is None or stages.eyes != eyes:
            if stages is not None:
                stages.close()
            stages = Stages(eyes, _seeds(_n_episodes(config, eyes)), config.n_steps, n_cores())
        here, make = stages, maker(policy, checkpoint)
        table[policy.label, eyes.name] = cache.part(
            f"{policy.label}.{eyes.name}",
            lambda tick, here=here, make=make, policy=policy: here.play(
                make, policy.margin_m, tick
            ),
        )
    if stages is not None:
        stages.close()
    return table


def _rows(config: ImpactConfig) -> Iterator[tuple[Eyes, Policy]]:
    """What is played, eyes by eyes."""
    for name in config.eyes:
        eyes = eyes_called(name)
        yield from ((eyes, Policy(policy)) for policy in config.policies)
        if SLOWED in config.policies and name in SWEPT:
            yield from ((eyes, Policy(SLOWED, margin_m)) for margin_m in config.margins_m)


def _n_episodes(config: ImpactConfig, eyes: Eyes) -> int:
    few = min(config.n_episodes, config.n_pixels)
    return few if eyes.name == PIXELS else config.n_episodes


def _seeds(n: int) -> list[int]:
    return [FIRST_SEED + k for k in range(n)]


def _settings(config: ImpactConfig) -> dict[str, Any]:
    """What all numbers depend on."""
    return {
        "experiment": NAME,
        "people": PEOPLE,
        **asdict(config),
    }


def _check_walks(table: Mapping[tuple[str, str], Mapping[str, list[Any]]]) -> None:
    """Raise unless the worker of a seed walked the same way in every row, bit for bit."""
    walks = [row["walk"] for row in table.values()]
    longest = max(walks, key=len)
    for (policy, eyes), row in table.items():
        if row["walk"] != longest[: len(row["walk"])]:
            raise HRCError(
                f"With {policy} and {eyes} the workers walked otherwise than in other rows: "
                "nothing can be compared. Delete the folder's parts and start again."
            )
