"""Contacts of the scripted robot with people with reaches that a search found.

For each shield, the cross-entropy method (`benchmarks/adversary/cross_entropy.py`) searches for the
times, targets and speeds of the reaches of a worker at the robot that lead to contacts while the
robot moves towards the worker or, if there are none, to the shortest time to contact. The speeds
and targets are within the ranges of other people (`hrc_env/motion/reaches.py`), and the script does
not depend on the robot: the worker does not watch it. The reaches that the search finds are then
compared with those of people unaware of the robot, on other seeds. Such searches for the worst
people are also called adaptive stress testing (Lee et al. 2020, arXiv:1811.02188).

The folder then contains `reaches.json` with the distributions that were found and the worst episode
of each search. The package plays those in `assets/adversary/reaches.json` for `people="adversary"`.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.adversary.cross_entropy import CrossEntropy, Normal
from benchmarks.adversary.episodes import make_env, make_people, score_scripts
from benchmarks.rare.contacts import AGENT
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import from_mapping
from hrc_env.core.results import Metric, write_whole
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.film import film_episode
from hrc_env.evaluation.intervals import estimate_quantile, estimate_rate_ratio
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.columns import Column, list_safety_columns, per_minute
from hrc_env.experiments.report import (
    SHIELD_CHOSEN_ON,
    Conditions,
    Metrics,
    Report,
    Table,
    format_seeds,
)
from hrc_env.experiments.runner import is_as_short
from hrc_env.experiments.versions import make_key
from hrc_env.motion.config import FOUND, PEOPLE, MotionConfig
from hrc_env.motion.reaches import PARAMETERS, Reach, ReachDistribution, make_script
from hrc_env.motion.scripted import COMMAND, describe_found_reaches

SEARCH_SEED, SEARCH_SEEDS = 18_300_000, 100_000
"""First seed, and number of seeds of the search."""
JUDGE_SEED, JUDGE_SEEDS = 18_400_000, 100_000
"""First seed, and number of seeds on which the reaches are judged."""
N_REACHES = 6
"""Number of reaches of a script; at the mean distance of two reaches they take 12 s."""
N_TOGETHER = 250
"""Number of judged episodes in a part."""
UNAWARE, ADVERSARY = "unaware", "adversary"
"""People of the rows of the table."""
CLOSE = 0.1
"""Quantile of the shortest distance of an episode that the table shows."""
FILE = "reaches.json"
"""File of the reaches that were found, in the folder of the benchmark."""


@dataclass(frozen=True, slots=True)
class AdversaryBench:
    """Search for reaches that lead to contacts, and comparison with people unaware of the robot."""

    name = "bench adversary"
    depends = ("env", "tracker", "emulator", "motion", "shield", "agents")
    n_iterations: int = 10
    """Number of iterations of the search for each shield."""
    n_samples: int = 256
    """Number of scripts per iteration, each of which is played in one episode."""
    n_judged: int = 1000
    """Number of episodes with each shield and people in which contacts are counted."""
    shields: tuple[str, ...] = FOUND
    """Shields of the robot; "none" for no shield."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid, or if seeds do not suffice."""
        if min(self.n_iterations, self.n_samples, self.n_judged) < 1:
            raise ConfigError(
                "The benchmark needs at least 1 iteration, 1 sample and 1 episode, got "
                f"{self.n_iterations}, {self.n_samples} and {self.n_judged}."
            )
        check_names("shield of the search", self.shields, FOUND)
        needed = self.n_iterations * self.n_samples
        if needed > self._seeds_per_shield or self.n_judged > JUDGE_SEEDS:
            raise ConfigError(
                f"The benchmark has {self._seeds_per_shield} seeds for each search and "
                f"{JUDGE_SEEDS} to judge, but needs {needed} and {self.n_judged}: choose smaller "
                "numbers."
            )
        CrossEntropy(self.n_samples)

    @property
    def _seeds_per_shield(self) -> int:
        """Number of seeds of the search for each shield."""
        return SEARCH_SEEDS // len(FOUND)

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the search and of the judged episodes."""
        return range(SEARCH_SEED, JUDGE_SEED + JUDGE_SEEDS)

    @property
    def n_parts(self) -> float:
        """Number of parts."""
        n_judged = 2 * len(range(0, self.n_judged, N_TOGETHER))
        return len(self.shields) * (self.n_iterations + n_judged)

    @property
    def quick_note(self) -> str:
        """Warning for the tables of a short run, or "" if the run is long enough."""
        if not is_as_short(self, QUICK):
            return ""
        return f"{self.n_iterations} iterations of {self.n_samples} scripts: too few to compare."

    def settings(self) -> dict[str, Any]:
        """Return all settings on which all results depend."""
        return {
            **asdict(self), "n_reaches": N_REACHES, "search": asdict(CrossEntropy(self.n_samples)),
            "search_seed": SEARCH_SEED, "judge_seed": JUDGE_SEED,
        }  # fmt: skip

    def play(self, cache: PartCache) -> dict[str, list[Any]]:
        """Return the results of the parts of each row; compute those that are not in the cache.

        The rows are "search_SHIELD", with the iterations of a search, and "SHIELD.PEOPLE".
        """
        played: dict[str, list[Any]] = {f"search_{name}": [] for name in self.shields}
        for k in range(self.n_iterations):
            parts = [self._make_iteration(name, k, played) for name in self.shields]
            made = cache.make_parts(parts, one_core=True)
            for name, iteration in zip(self.shields, made, strict=True):
                played[f"search_{name}"].append(iteration)
        parts = [part for name in self.shields for part in self._list_judged(name, played)]
        for part, made in zip(parts, cache.make_parts(parts, one_core=True), strict=True):
            played.setdefault(part.label.rpartition(".")[0], []).extend(made["episodes"])
        return played

    def metrics(self, played: dict[str, list[Any]]) -> dict[str, Metric]:
        """Return all metrics by name."""
        metrics: dict[str, Metric] = {}
        for name in self.shields:
            for people in (UNAWARE, ADVERSARY):
                row, episodes = f"{name}.{people}", played[f"{name}.{people}"]
                for column in COLUMNS:
                    if column.measure is not None:
                        metrics[column.metric.format(row)] = column.measure(episodes, episodes)
                gaps = [[each["min_separation_m"]] for each in episodes]
                metrics[f"{row}.closest"] = estimate_quantile(gaps, CLOSE, "m")
            both = [played[f"{name}.{people}"] for people in (ADVERSARY, UNAWARE)]
            counts = [[each["contacts_towards"] for each in rows] for rows in both]
            hours = [[each["seconds"] / 3600 for each in rows] for rows in both]
            metrics[f"{name}.{ADVERSARY}.ratio"] = estimate_rate_ratio(*counts, *hours)
            for k, iteration in enumerate(played[f"search_{name}"]):
                for what in ("share", "elite"):
                    metrics[f"search_{name}.{what}_{k}"] = _state(iteration[what], self.n_samples)
        return metrics

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table of this benchmark."""
        return (TABLE,)

    def report(self, played: dict[str, list[Any]], metrics: Metrics, figures: Path) -> Report:
        """Write `reaches.json` beside the figures, and return the report with the table."""
        found = {name: _read(played[f"search_{name}"][-1]) for name in self.shields}
        made = {"command": COMMAND, "seeds": format_seeds(self.seeds), **self.settings()}
        worst = {name: find_worst(played[f"search_{name}"]) for name in self.shields}
        content = describe_found_reaches(
            {name: convert_to_distribution(each) for name, each in found.items()}, made
        )
        write_whole(figures.parent / FILE, json.dumps({**content, "worst": worst}, indent=1))
        return Report(
            "People who reach where contacts are likely",
            (__doc__ or "").strip(),
            [TABLE.to_markdown(metrics)],
            spread="95 % intervals: exact for contacts, otherwise bootstraps over episodes",
        )

    def _make_iteration(self, name: str, k: int, played: Mapping[str, list[Any]]) -> Part:
        """Return the part of iteration `k` of a search, which goes on from the previous one."""
        before = played[f"search_{name}"]
        search = CrossEntropy(self.n_samples)
        normal = _read(before[-1]) if before else search.begin((N_REACHES, len(PARAMETERS)))
        block = SEARCH_SEED + FOUND.index(name) * self._seeds_per_shield
        first_seed = block + k * self.n_samples
        given = {
            "shield": name, "first": first_seed, "search": asdict(search),
            "mean": normal.mean.tolist(), "deviation": normal.deviation.tolist(),
        }  # fmt: skip
        make = partial(search_once, name, search, normal, first_seed)
        return Part(f"search_{name}.{k}", make, make_key(given, self.depends))

    def _list_judged(self, name: str, played: Mapping[str, list[Any]]) -> list[Part]:
        """Return the parts of the episodes with a shield in which contacts are counted."""
        found = convert_to_distribution(_read(played[f"search_{name}"][-1]))
        people = {UNAWARE: PEOPLE[UNAWARE], ADVERSARY: make_people(found)}
        parts: list[Part] = []
        for who, config in people.items():
            for first in range(0, self.n_judged, N_TOGETHER):
                n = min(N_TOGETHER, self.n_judged - first)
                env = {**make_env(_to_shield(name)), "people": config, "num_threads": 1}
                make = partial(judge, env, JUDGE_SEED + first, n)
                given = {"shield": name, "people": asdict(config), "first": first, "n": n}
                parts.append(Part(f"{name}.{who}.{first}", make, make_key(given, self.depends)))
        return parts


def search_once(
    name: str, search: CrossEntropy, normal: Normal, first_seed: int, tick: PartProgress
) -> dict[str, Any]:
    """Play an iteration of a search, and return its outcome as JSON values.

    Args:
        name: name of the shield.
        search: settings of the search.
        normal: distribution from which the scripts are drawn.
        first_seed: seed of the first episode, and of the random numbers of the scripts.
        tick: callback that receives the increase of the completed fraction.
    """
    limits = MotionConfig().reach_limits
    samples = normal.draw(search.n_samples, np.random.default_rng(first_seed))
    scripts = [make_script(each, limits) for each in samples]
    scores = score_scripts(scripts, first_seed, make_env(_to_shield(name)), tick)
    after, best = search.update(normal, samples, scores), int(np.argmax(scores))
    return {
        "mean": after.mean.tolist(),
        "deviation": after.deviation.tolist(),
        "share": float((scores > 0).mean()),
        "elite": float(np.sort(scores)[-search.n_elite]),
        "worst": {
            "seed": first_seed + best,
            "score": float(scores[best]),
            "reaches": [asdict(reach) for reach in scripts[best]],
        },
    }


def judge(env: Mapping[str, Any], first_seed: int, n: int, tick: PartProgress) -> dict[str, Any]:
    """Play whole episodes of the scripted robot, and return their statistics as JSON values."""
    return {"episodes": play_episodes(partial(make_agent, AGENT), n, first_seed, tick, **env)}


def find_worst(iterations: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the episode with the highest score of a search: its seed, score and reaches."""
    return max((each["worst"] for each in iterations), key=lambda worst: worst["score"])


def convert_to_distribution(normal: Normal) -> ReachDistribution:
    """Return a distribution of the search as people follow it."""
    mean, deviation = (
        tuple(tuple(round(value, 4) for value in row) for row in values.tolist())
        for values in (normal.mean, normal.deviation)
    )
    return ReachDistribution(mean, deviation)


def film_worst(folder: Path, say: Callable[[str], None]) -> None:
    """Film the worst episode of each search in the folder of a finished run, as worst_SHIELD.mp4.

    Raises:
        ConfigError: the folder does not contain found reaches.
    """
    try:
        worst = json.loads((folder / FILE).read_text())["worst"]
    except (OSError, ValueError, KeyError) as error:
        raise ConfigError(
            f"{folder / FILE} must be the found reaches of `{COMMAND}`, got {error!r}."
        ) from error
    for name, episode in worst.items():
        script = tuple(
            from_mapping(Reach, each, f"reaches[{k}].") for k, each in enumerate(episode["reaches"])
        )
        path = folder / f"worst_{name}.mp4"
        env = {**make_env(_to_shield(name)), "people": make_people(script)}
        film_episode(partial(make_agent, AGENT), path, episode["seed"], **env)
        say(f"{path}: seed {episode['seed']}, score {episode['score']:.3g}")


def _to_shield(name: str) -> str | None:
    """Return the argument `shield` for the name of a row."""
    return None if name == "none" else name


def _read(iteration: Mapping[str, Any]) -> Normal:
    """Return the distribution after an iteration from JSON values."""
    return Normal(np.array(iteration["mean"]), np.array(iteration["deviation"]))


def _state(value: float, n: int) -> Metric:
    """Return a number without an interval."""
    return Metric(value, value, value, "1", n)


COLUMNS = (per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"), *list_safety_columns())
"""Columns with metrics of a row's episodes."""
TABLE = Table(
    "adversary",
    "People who reach where contacts are likely",
    {
        f"{name}.{people}": ("none" if name == "none" else f"`{name}`", f"`{people}`")
        for name in FOUND
        for people in (UNAWARE, ADVERSARY)
    },
    (
        *COLUMNS,
        Column("{}.closest", "closest 10 % [cm]", 1, 100),
        Column("{}.ratio", "contacts towards, ratio", 2),
    ),
    ("shield", "people"),
    "The agent `scripted` in `HRCReach-v0` with four cameras, {n[qp.unaware.closest]} episodes of "
    "10 s per row, with the same seeds in all rows; contacts and interventions per hour. Each "
    "shield has its own search. Closest: quantile .1 of the shortest true distance of an episode.",
    conditions=Conditions(
        people="as in the table", scene="`lab`", perception="`keypoints`",
        chosen_on=f"reaches were searched on seeds {SEARCH_SEED:,} to "
        f"{SEARCH_SEED + SEARCH_SEEDS - 1:,}; {SHIELD_CHOSEN_ON}",
        seeds=f"seeds from {JUDGE_SEED:,}",
    ),
)  # fmt: skip
QUICK = AdversaryBench(2, 16, 16)
"""Settings of the quick form."""
