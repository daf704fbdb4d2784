"""Contacts an hour of shielded robots that move towards a worker, by multilevel splitting.

The scripted agent, which ignores people, reaches beside workers of any body with four cameras. The
contacts of a good shield are too rare to be counted. Multilevel splitting (`benchmarks/rare/
splitting.py`) estimates them from episodes that it branches where robot and worker come close; with
the shipped shield, contacts are also counted in whole episodes (brute force), which checks it. All
episodes and branches have seeds from 12,000,000 to 12,199,999; levels and level function were
chosen on seeds from 11,000,000 to 11,099,999.
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rare.contacts import AGENT, LEVELS_S, ShieldedRobot
from benchmarks.rare.splitting import Replication, count_seeds, estimate, replicate
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.intervals import estimate_rate
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, Table
from hrc_env.experiments.runner import is_as_short
from hrc_env.experiments.versions import make_key

FIRST_SEED, N_SEEDS = 12_000_000, 200_000
"""First seed, and number of seeds of the benchmark."""
SHIELDS: Mapping[str, Any] = {
    "qp": "qp",
    "far": {"kind": "qp", "margin_m": 0.05, "hand_margin_m": 0.05},
}
"""Shields by the name of their row."""
WORDS = {"qp": '`"qp"`', "far": '`"qp"`, `margin_m` and `hand_margin_m` 0.05'}
"""Descriptions of the shields."""
COUNTED = "qp"
"""Shield with which contacts are also counted in whole episodes."""
N_TOGETHER = 250
"""Number of whole episodes in a part."""


@dataclass(frozen=True, slots=True)
class RareBench:
    """Benchmark of the rate of rare contacts."""

    name = "bench rare"
    depends = ("env", "tracker", "emulator", "motion", "shield", "agents")
    n_replications: int = 8
    """Number of independent replications of the splitting for each shield; their spread gives the
    interval."""
    n_starts: int = 200
    """Number of futures at each level."""
    n_episodes: int = 4000
    """Number of whole episodes with the shipped shield."""
    shields: tuple[str, ...] = tuple(SHIELDS)
    """Names of the shields."""
    n_rows: int = 100
    """Number of environments that step together, without effect on the results."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if the numbers do not allow an interval, or need too many seeds."""
        if self.n_replications < 2 or self.n_starts < 1 or self.n_episodes < 1:
            raise ConfigError(
                "The benchmark needs at least 2 replications, 1 start and 1 episode, got "
                f"{self.n_replications}, {self.n_starts} and {self.n_episodes}."
            )
        needed = self.n_replications * count_seeds(LEVELS_S, self.n_starts)
        if max(needed, self.n_episodes) > self._seeds_per_block:
            raise ConfigError(
                f"The benchmark has {self._seeds_per_block} seeds for each shield, but "
                f"{self.n_replications} replications with {self.n_starts} starts take {needed}, "
                f"and whole episodes take {self.n_episodes}: choose smaller numbers."
            )

    @property
    def _seeds_per_block(self) -> int:
        """Number of seeds of whole episodes, and of the splitting of each shield."""
        return N_SEEDS // (1 + len(SHIELDS))

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the episodes and branches."""
        return range(FIRST_SEED, FIRST_SEED + N_SEEDS)

    @property
    def n_parts(self) -> float:
        """Number of parts."""
        return len(self._list_parts())

    @property
    def quick_note(self) -> str:
        """Warning for the tables of a short run, or "" if the run is long enough."""
        if not is_as_short(self, QUICK):
            return ""
        return f"{self.n_replications} replications of {self.n_starts} starts: too few to compare."

    def settings(self) -> dict[str, Any]:
        """Return all settings on which all results depend."""
        shields = {name: SHIELDS[name] for name in self.shields}
        return {**asdict(self), "shields": shields, "levels_s": LEVELS_S, "first_seed": FIRST_SEED}

    def play(self, cache: PartCache) -> dict[str, list[Any]]:
        """Return the results of the parts of each row; compute those that are not in the cache."""
        parts = self._list_parts()
        played: dict[str, list[Any]] = {}
        for part, made in zip(parts, cache.make_parts(parts, one_core=True), strict=True):
            played.setdefault(part.label.rpartition(".")[0], []).append(made)
        return played

    def metrics(self, played: dict[str, list[Any]]) -> dict[str, Metric]:
        """Return all metrics by name."""
        metrics: dict[str, Metric] = {}
        for row, parts in played.items():
            if row.startswith("counted"):
                counts = [each for part in parts for each in part["contacts_towards"]]
                hours = [each / 3600 for part in parts for each in part["seconds"]]
                metrics[f"{row}.contacts"] = estimate_rate(counts, hours, "1/h")
                metrics[f"{row}.simulated"] = _state(sum(hours), "h", len(hours))
                continue
            replications = [_read(part) for part in parts]
            episode_h = parts[0]["episode_h"]
            metrics[f"{row}.contacts"] = estimate(replications, 1 / episode_h, "1/h")
            steps = sum(each.n_steps for each in replications)
            metrics[f"{row}.simulated"] = _state(steps * parts[0]["step_h"], "h", len(replications))
            reached = np.array([each.reached for each in replications]).sum(0)
            shares = np.cumprod(reached / sum(each.n for each in replications))
            for k, share in enumerate(shares.tolist()):
                metrics[f"{row}.reached_{k}"] = _state(share, "share", len(replications))
        return metrics

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table that this benchmark fills in the documentation."""
        return (TABLE,)

    def report(self, played: dict[str, list[Any]], metrics: Metrics, figures: Path) -> Report:
        """Return the report with the table."""
        return Report(
            "Rare contacts",
            (__doc__ or "").strip(),
            [TABLE.to_markdown(metrics)],
            spread="95 % intervals: exact for counted contacts, otherwise over replications",
        )

    def _list_parts(self) -> list[Part]:
        """Return the parts: whole episodes, then the replications of each shield."""
        parts: list[Part] = []
        if COUNTED in self.shields:
            for first in range(0, self.n_episodes, N_TOGETHER):
                n = min(N_TOGETHER, self.n_episodes - first)
                made = partial(count_contacts, COUNTED, FIRST_SEED + first, n)
                key = make_key({"shield": SHIELDS[COUNTED], "first": first, "n": n}, self.depends)
                parts.append(Part(f"counted_{COUNTED}.{first}", made, key))
        n_seeds = count_seeds(LEVELS_S, self.n_starts)
        for name in self.shields:
            block = 1 + list(SHIELDS).index(name)
            for k in range(self.n_replications):
                first = FIRST_SEED + block * self._seeds_per_block + k * n_seeds
                made = partial(split, name, self.n_starts, first, self.n_rows)
                given = {"shield": SHIELDS[name], "n": self.n_starts, "first": first}
                key = make_key({**given, "levels_s": LEVELS_S}, self.depends)
                parts.append(Part(f"split_{name}.{k}", made, key))
        return parts


def make_env(shield: str) -> dict[str, Any]:
    """Return the arguments of the environments with one of `SHIELDS`."""
    return {
        "perception": "keypoints",
        "shield": SHIELDS[shield],
        "config": {"worker": "any"},
    }


def count_contacts(shield: str, first_seed: int, n: int, tick: PartProgress) -> dict[str, Any]:
    """Play whole episodes, and return their numbers of contacts and durations as JSON values."""
    episodes = play_episodes(partial(make_agent, AGENT), n, first_seed, tick, **make_env(shield))
    return {name: [each[name] for each in episodes] for name in ("contacts_towards", "seconds")}


def split(shield: str, n: int, first_seed: int, n_rows: int, tick: PartProgress) -> dict[str, Any]:
    """Return a replication of the splitting as JSON values."""
    with closing(ShieldedRobot(min(n_rows, n), make_env(shield))) as robot:
        found = asdict(replicate(robot, LEVELS_S, n, first_seed, tick))
        return {**found, "episode_h": robot.episode_h, "step_h": robot.episode_h / robot.n_steps}


def _read(part: Mapping[str, Any]) -> Replication:
    """Return a replication from JSON values."""
    return Replication(part["n"], tuple(part["reached"]), part["n_events"], part["n_steps"])


def _state(value: float, unit: str, n: int) -> Metric:
    """Return a number without an interval."""
    return Metric(value, value, value, unit, n)


TABLE = Table(
    "rare",
    "Rare contacts",
    {
        f"counted_{COUNTED}": (WORDS[COUNTED], "whole episodes"),
        **{f"split_{name}": (words, "splitting") for name, words in WORDS.items()},
    },
    (
        Column("{}.contacts", "contacts towards [1/h]", 3, counted=True),
        Column("{}.simulated", "simulated [h]", 1, plain=True),
        *(
            Column(f"{{}}.reached_{k}", f"within {-level:.2f} s [%]", 2, 100, plain=True)
            for k, level in enumerate(LEVELS_S)
        ),
    ),
    ("shield", "method"),
    "The agent `scripted` beside workers of any body, with four cameras. Contacts while the robot "
    "moves towards the worker; 95 % intervals, exact for whole episodes ({n[counted_qp.contacts]} "
    "of 10 s), and over {n[split_qp.contacts]} independent replications of the splitting. On the "
    "right: share of episodes in which the time to contact falls below a level.",
)
QUICK = RareBench(2, 20, 40, n_rows=20)
"""Settings of the quick form."""
