"""What the scripted agents of all tasks are worth: python -m benchmarks.experts

By success, time, cost and contacts on the same seeds: without workers, and beside attentive ones
at perception levels. Episodes at `pixels` are played one by one. Finished parts stay in the folder:
a run that was stopped goes on where it was.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from benchmarks.common import publish
from hrc_env.agents.registry import make_agent
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.errors import check_names
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.intervals import mean_over, rate_of, share_of
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.versions import key_of
from hrc_env.tasks import BUILT_IN

DEPENDS = ("env", "tracker", "emulator", "detector", "motion", "agents")
"""Subsystems that finished parts depend on."""
SEED = 3_000_000
"""Of the first episode."""


@dataclass(frozen=True, slots=True)
class Way:
    """In which company an agent works, and what it sees of it."""

    agent: str
    perception: str
    says: str
    n_workers: int | None = None
    """None: as the task has it."""


WAYS: Mapping[str, Way] = {
    "alone": Way("scripted", "none", "no worker", 0),
    "truth": Way("scripted", "truth", "`truth`"),
    "keypoints": Way("scripted", "keypoints", "`keypoints`"),
    "slowed": Way("scripted_slowed", "keypoints", "`keypoints`, slowed"),
    "pixels": Way("scripted", "pixels", "`pixels`"),
}
"""By name, as tables have them."""
NEEDS_WORKERS = ("HRCHandover-v0",)
"""Tasks that nobody can do alone."""
ROWS = {
    (task, way): f"{task}, {each.says}"
    for (way, each), task in product(WAYS.items(), BUILT_IN)
    if way != "alone" or task not in NEEDS_WORKERS
}
"""Tasks and ways, as the table calls them, in the order in which they are played."""
COLUMNS = (
    Column("{}.success", "success [%]", 1, 100.0),
    Column("{}.seconds", "time [s]"),
    Column("{}.cost", "cost", 2),
    Column("{}.contacts", "contacts", 2),
)


@dataclass(frozen=True)
class Arguments:
    """Judge the scripted agents."""

    out: Path = Path("out/experts")
    """Folder for results.json, a report and finished parts."""
    quick: bool = False
    """Two episodes of each row; one at `pixels`, where it is cut short."""
    tasks: tuple[str, ...] = tuple(BUILT_IN)
    """Ids."""
    ways: tuple[str, ...] = tuple(WAYS)
    """Of alone, truth, keypoints, slowed, pixels."""
    episodes: int = 50
    """Of each row."""
    pixel_episodes: int = 5
    """Those at `pixels`."""
    threads: int | None = None
    """Threads that the environments share; all cores by default."""


def main(arguments: Arguments) -> None:
    """Play, print, write."""
    check_names("task", arguments.tasks, BUILT_IN)
    check_names("way", arguments.ways, WAYS)
    if arguments.quick:
        arguments = replace(arguments, episodes=2, pixel_episodes=1)
    for option in ("episodes", "pixel_episodes"):
        at_least(f"--{option.replace('_', '-')}", getattr(arguments, option), 1)
    writable_folder(arguments.out)
    rows = {
        (task, way): words
        for (task, way), words in ROWS.items()
        if task in arguments.tasks and way in arguments.ways
    }
    metrics: dict[str, Metric] = {}
    with progress_bar(Console(), "experts") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), len(rows), progress)
        for task, way in rows:
            done = played(parts, arguments, task, way)
            metrics |= {f"{task}.{way}.{name}": each for name, each in worth(done).items()}
    table = table_of("", {".".join(k): words for k, words in rows.items()}, COLUMNS, metrics)
    seeds = list(range(SEED, SEED + arguments.episodes))
    settings = {name: value for name, value in asdict(arguments).items() if name != "out"}
    report = Report("Scripted agents", (__doc__ or "").strip(), [table])
    publish(arguments.out, report, settings, seeds, metrics)


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    return key_of({"seed": SEED, "quick": arguments.quick}, DEPENDS)


def played(parts: PartCache, arguments: Arguments, task: str, way: str) -> list[dict[str, float]]:
    """Statistics of a row's episodes, from the cache or anew; at `pixels` each is a part."""
    how, kwargs = WAYS[way], {"task": task, "perception": WAYS[way].perception}
    kwargs |= {} if how.n_workers is None else {"n_workers": how.n_workers}

    def play(n_episodes: int, seed: int, tick: PartProgress) -> dict[str, Any]:
        make = partial(make_agent, how.agent)
        return {"episodes": play_episodes(make, n_episodes, seed, tick=tick, **kwargs)}

    if how.perception != "pixels":
        n = arguments.episodes
        kwargs["num_threads"] = arguments.threads
        return parts.part(f"{task}.{way}.{n}", partial(play, n, SEED))["episodes"]
    if arguments.quick:
        kwargs["max_episode_steps"] = 10
    each = replace(parts, n_parts=parts.n_parts * arguments.pixel_episodes)
    seeds = range(SEED, SEED + arguments.pixel_episodes)
    return [
        episode
        for seed in seeds
        for episode in each.part(f"{task}.{way}.{seed}", partial(play, 1, seed))["episodes"]
    ]


def worth(episodes: list[dict[str, float]]) -> dict[str, Metric]:
    """Return success and contacts with exact intervals, means of time and cost with bootstraps."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    return {
        "success": share_of([bool(each) for each in column["success"]]),
        "seconds": mean_over(column["seconds"], "s"),
        "cost": mean_over(column["cost"], "1"),
        "contacts": rate_of(column["contacts"], len(episodes), "1"),
    }


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
