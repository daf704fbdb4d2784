"""A policy through all conditions of all tasks that it is for: episodes, numbers, report."""

import datetime
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from hrc_env.agents.registry import control_of, make_agent
from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric, provenance
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.intervals import goals_over, rate_of, ratio_over, success_over
from hrc_env.experiments.benchmark.conditions import CONDITIONS, SEED, VERSION
from hrc_env.experiments.benchmark.entries import Entry, enter, entries, regret
from hrc_env.experiments.benchmark.report import report
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.runner import Study, at_least_one
from hrc_env.experiments.versions import key_of
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks import BUILT_IN

DEPENDS = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems that finished parts depend on."""
Episodes = list[dict[str, float]]
Played = Mapping[tuple[str, str], Episodes]
"""By task and condition."""


@dataclass(frozen=True, slots=True)
class BenchmarkConfig:
    """Who is judged, and how long."""

    policy: str = "scripted"
    """As `agents.make_agent` takes it."""
    control: str | None = None
    """What its actions are; None: joint velocities."""
    ids: tuple[str, ...] = tuple(BUILT_IN)
    """Which environments."""
    n_seeds: int = 64
    """Episodes of every row."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for what cannot work."""
        at_least_one(self, "n_seeds")
        check_names("environment", self.ids, BUILT_IN)


def config_for(policy: str, ids: Sequence[str], control: str | None, seeds: int) -> BenchmarkConfig:
    """The settings that the command line asks for; a policy may say what its actions are."""
    known = control_of(policy)
    return BenchmarkConfig(policy, control or known, tuple(ids), seeds)


def play(config: BenchmarkConfig, cache: PartCache) -> Played:
    """Every row from the cache or anew; a policy that does not fit says so in the first."""
    path = Path(config.policy)
    made_of = {"policy": config.policy, "control": config.control, "version": VERSION}
    if path.is_file():
        made_of["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    played = {}
    for task in config.ids:
        for name in CONDITIONS:
            key = key_of({**made_of, "n": config.n_seeds, "row": [task, name]}, DEPENDS)
            make = partial(_episodes, config, task, name)
            played[task, name] = cache.part(f"{task}.{name}", make, key)["episodes"]
    return played


def _episodes(
    config: BenchmarkConfig, task: str, name: str, tick: PartProgress
) -> dict[str, Episodes]:
    """One row, whose episodes take turns in the condition's cameras."""
    control = {} if config.control is None else {"control": config.control}
    turns, done = CONDITIONS[name].keywords(task), []
    for k, kwargs in enumerate(turns):
        n = len(range(k, config.n_seeds, len(turns)))
        part = partial(lambda share, of: tick(share * of / config.n_seeds), of=n)
        if n:
            done += play_episodes(
                partial(make_agent, config.policy), n, SEED + len(done), part,
                **kwargs, **control,
            )  # fmt: skip
    return {"episodes": done}


def metrics_of(config: BenchmarkConfig, played: Played) -> dict[str, Metric]:
    """By "ID.CONDITION.WHAT"."""
    metrics, others = {}, entries()
    for (task, name), episodes in played.items():
        key, found = f"{task}.{name}", worth(episodes)
        metrics |= {f"{key}.{what}": metric for what, metric in found.items()}
        missed = regret(key, metrics, others)
        metrics[f"{key}.regret"] = Metric(missed, missed, missed, "1/min", len(episodes))
    return metrics


def worth(episodes: Episodes) -> dict[str, Metric]:
    """What episodes came to, with 95 % intervals."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    minutes = [seconds / 60 for seconds in column["seconds"]]
    hours = [seconds / 3600 for seconds in column["seconds"]]
    achieved, missed = column["goals_reached"], column["goals_missed"]
    tries = [a + b for a, b in zip(achieved, missed, strict=True)]
    touches = [sum(each[f"contacts_{kind}"] for kind in KINDS) for each in episodes]
    return {
        "goals_per_minute": goals_over(achieved, minutes),
        "success": success_over(achieved, tries),
        "cost_per_minute": ratio_over(column["cost"], minutes, "1/min"),
        "contacts_per_hour": rate_of(touches, hours, "1/h"),
        **{f"{kind}_per_hour": rate_of(column[f"contacts_{kind}"], hours, "1/h")
           for kind in KINDS},
    }  # fmt: skip


def entered(name: str, config: BenchmarkConfig, out: Path) -> Path:
    """Put what a folder's run found into the leaderboard; the file."""
    content = json.loads((out / "results.json").read_text())
    scores = {key: Metric(**value) for key, value in content["metrics"].items()}
    git, day = str(provenance()["git"]), datetime.date.today().isoformat()
    return enter(Entry(name, config.policy, git, day, scores))


STUDY = Study(
    name=f"benchmark, version {VERSION}",
    depends=DEPENDS,
    settings=lambda config: {"version": VERSION, **asdict(config)},
    seeds=lambda config: range(SEED, SEED + config.n_seeds),
    n_parts=lambda config: len(config.ids) * len(CONDITIONS),
    play=play,
    metrics=metrics_of,
    report=lambda config, played, metrics, figures: report(config.policy, config.ids, metrics),
)
