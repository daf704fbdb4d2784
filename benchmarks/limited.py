"""Learning with a limit, or fast and then under a shield: python -m benchmarks.limited

For each seed PPO-Lagrangian learns with a limit of cost, and PPO without any care. Of the first it
is told when it reached its limit and how well it stayed there: the cost of its noisy actions, on
the truth, over windows of 250,000 steps, which are 1,000 episodes. Both are judged on the same
fixed seeds, the second also under shields. What is finished stays in the folder.
"""

import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
import tyro
from rich.console import Console

from benchmarks.common import exactly, publish
from hrc_env.agents.callbacks import Curve
from hrc_env.agents.registry import make_agent
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric, over
from hrc_env.evaluation.episodes import EVALUATION_SEED, measure, play_episodes
from hrc_env.evaluation.intervals import rate_of
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.versions import key_of

DEPENDS = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems that the numbers depend on."""
TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that policies depend on."""
WINDOW_STEPS = 250_000
HELD = 1.1
"""Times the limit: below that it is reached."""
RUNS: Mapping[str, tuple[str, ...]] = {
    "limited": ("--algorithm", "ppo_lagrangian"),
    "fast": ("--proximity", "0"),
}
COLUMNS = (
    Column("{}.goals_per_minute", "goals a minute"),
    Column("{}.cost_per_episode", "cost"),
    Column("{}.contacts_per_episode", "contacts", 2),
    Column("{}.towards", "contacts towards in 1,000 episodes", 1),
)
HELD_COLUMNS = (
    Column("{}.reached_at_steps", "limit reached after [steps]", 0),
    Column("{}.cost", "cost of the last windows"),
    Column("{}.furthest", "furthest window from the limit [share]", 2),
    Column("{}.goals_per_minute", "goals a minute, actions noisy"),
)


@dataclass(frozen=True)
class Arguments:
    """Learn with a limit on several seeds."""

    out: Path = Path("out/limited")
    """Folder for the runs, results.json and the report."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of environments and learner."""
    cost_limit: float = 30.0
    """Of an episode."""
    timesteps: int = 3_000_000
    """Of who learns with the limit."""
    fast_timesteps: int = 1_000_000
    """Of who learns without care."""
    windows: int = 2
    """How many of the last windows count."""
    shields: tuple[str, ...] = ("qp",)
    """Under which the second is judged, too."""
    episodes: int = 1000
    """Of each row."""


def main(arguments: Arguments) -> None:
    """Learn, judge, show."""
    torch.set_num_threads(1)
    metrics: dict[str, Metric] = {}
    runs = {(name, seed): learnt(arguments, name, seed)
            for seed in arguments.seeds for name in RUNS}  # fmt: skip
    n_parts = len(arguments.seeds) * (2 + len(arguments.shields))
    with progress_bar(Console(), "judging") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), n_parts, progress)
        for seed in arguments.seeds:
            curve = json.loads((runs["limited", seed] / "curve.json").read_text())
            found = held(curve, arguments.cost_limit, arguments.windows)
            metrics |= {f"seed_{seed}.{name}": each for name, each in found.items()}
            for row, name, shield in rows(arguments, seed):
                episodes = played(parts, arguments, row, runs[name, seed], shield)
                metrics |= worth_of(row, episodes)
    names = dict.fromkeys(n.rpartition(".")[0] for n in metrics if n.endswith("cost_per_episode"))
    parts = [
        table_of("Staying at the limit", {f"seed_{s}": f"seed {s}" for s in arguments.seeds},
                 HELD_COLUMNS, metrics),
        table_of("Judged", {name: name for name in names}, COLUMNS, metrics),
    ]  # fmt: skip
    seeds = range(EVALUATION_SEED, EVALUATION_SEED + arguments.episodes)
    report = Report("Learning with a limit", (__doc__ or "").strip(), parts)
    publish(arguments.out, report, asdict(arguments), list(seeds), metrics)


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    return key_of({"episodes": arguments.episodes, "seed": EVALUATION_SEED}, DEPENDS)


def rows(arguments: Arguments, seed: int) -> Iterator[tuple[str, str, str | None]]:
    """Yield the rows of a seed: name, run, and the shield under which its policy is judged."""
    yield f"limited_{seed}", "limited", None
    for shield in (None, *arguments.shields):
        yield f"fast_{seed}.{shield or 'none'}", "fast", shield


def folder_of(arguments: Arguments, name: str, seed: int) -> Path:
    """Return the folder of a run, whether it has learnt or not."""
    limited = name == "limited"
    timesteps = arguments.timesteps if limited else arguments.fast_timesteps
    made_of = {"timesteps": timesteps, "cost_limit": arguments.cost_limit if limited else None}
    return arguments.out / f"{name}-{seed}-{key_of(made_of, TRAINED_ON)}"


def learnt(arguments: Arguments, name: str, seed: int) -> Path:
    """The folder of a run, which is made, or goes on, if it is not there."""
    folder, limited = folder_of(arguments, name, seed), name == "limited"
    timesteps = arguments.timesteps if limited else arguments.fast_timesteps
    if (folder / "score.json").exists():
        return folder
    options: dict[str, Any] = {"resume" if (folder / "policy.zip").exists() else "out": folder}
    options |= {"seed": seed, "episodes": 1, "timesteps": timesteps}
    if limited:
        options["cost-limit"] = arguments.cost_limit
    words = [word for option, value in options.items() for word in (f"--{option}", str(value))]
    command = [sys.executable, "-m", "hrc_env", "train", "--no-film", *RUNS[name], *words]
    subprocess.run(command, check=True)
    return folder


def held(curve: Curve, limit: float, windows: int) -> dict[str, Metric]:
    """When the smoothed cost first was near the whole limit (infinite: never), the mean cost of the
    last windows, and how far from the limit the furthest of them is, as a share of it."""
    whole = (each for each in curve if each["safety_share"] == 1)
    reached = next((each["steps"] for each in whole if each["cost"] <= HELD * limit), np.inf)
    steps = np.array([each["steps"] for each in curve])
    age = (steps[-1] - steps) // WINDOW_STEPS
    last = [[each for each, k in zip(curve, age, strict=True) if k == w] for w in range(windows)]
    costs = [float(np.mean([each["cost"] for each in window])) for window in last if window]
    goals = [each["goals_per_minute"] for window in last for each in window]
    furthest = max(abs(cost / limit - 1) for cost in costs)
    return {
        "reached_at_steps": exactly(reached, "1"),
        "cost": over(costs, "1"),
        "furthest": exactly(furthest, "share", len(costs)),
        "goals_per_minute": exactly(float(np.mean(goals)), "1/min"),
    }


def played(
    parts: PartCache, arguments: Arguments, row: str, folder: Path, shield: str | None
) -> list[dict[str, float]]:
    """Return a policy's episodes on fixed seeds, by its mean action, at its own level."""
    policy = folder / "policy.zip"
    digest = hashlib.sha256(policy.read_bytes()).hexdigest()[:12]

    def play(tick: PartProgress) -> dict[str, Any]:
        make = partial(make_agent, str(policy))
        kwargs: dict[str, Any] = {"perception": "keypoints", "shield": shield}
        return {"episodes": play_episodes(make, arguments.episodes, tick=tick, **kwargs)}

    return parts.part(f"{row}.{digest}", play)["episodes"]


def worth_of(name: str, episodes: list[dict[str, float]]) -> dict[str, Metric]:
    """What a policy is worth, from its episodes."""
    towards = [each["contacts_towards"] for each in episodes]
    found = measure(episodes) | {"towards": rate_of(towards, len(towards) / 1000, "per 1000")}
    return {f"{name}.{key}": each for key, each in found.items()}


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
