"""What simple agents and PPO are worth at every perception level: python -m benchmarks.baselines

Random actions, the scripted reacher without and with yielding, and PPO without and with the safety
term, by return, goals a minute, cost and contacts on the same seeds. PPO learns at the level that
it is judged at; at `pixels`, which is too slow for that, the policy of `keypoints` acts. Everybody
is judged by the default reward, safety term included.

Policies and finished parts stay in the folder: a run that was stopped goes on where it was.
docs/baselines.json is a copy of results.json, from which `python docs/generate.py` writes the
tables in README.md and docs/learning.md.
"""

import hashlib
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
import tyro
from rich.console import Console
from rich.markdown import Markdown

from agents import ppo
from agents.evaluate import EVALUATION_SEED, judged
from agents.registry import AGENTS, make_agent
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric, write_results, write_whole
from hrc_env.experiments.study.cache import PartCache, PartProgress
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.experiments.study.intervals import mean_over, ratio_over

ROOT = Path(__file__).resolve().parent.parent
PPO = {"ppo": 0.0, "ppo_safety": 2.0}
"""The weight of the safety term in what each of them learns from."""
ROWS = {
    **{name: f"`{name}`" for name in AGENTS},
    "ppo": "PPO without the safety term",
    "ppo_safety": "PPO with it",
}
"""Agents, as the table calls them."""
ORDER = ("truth", "keypoints", "none", "pixels")
COLUMNS = {
    "return": ("return", 1),
    "goals_per_minute": ("goals a minute", 1),
    "cost_per_episode": ("cost", 2),
    "contacts_per_episode": ("contacts", 2),
}
"""Metrics: their heading, and how many decimals are shown."""


@dataclass(frozen=True)
class Arguments:
    """Judge the baselines."""

    out: Path = Path("out/baselines")
    """Folder for results.json, baselines.md, policies and finished parts."""
    quick: bool = False
    """Policies that have hardly learnt, and few episodes: every number, in a few minutes."""
    episodes: int = 256
    """Episodes of each row; 8 if quick."""
    pixel_episodes: int = 10
    """Those at `pixels`; 2 if quick."""
    timesteps: int = 1_000_000
    """Environment steps that a policy learns; 4096 if quick."""
    threads: int | None = None
    """Threads that the environments share; all cores by default."""


def main(arguments: Arguments) -> None:
    """Learn, judge, print, write."""
    if arguments.quick:
        arguments = replace(arguments, episodes=8, pixel_episodes=2, timesteps=4096)
    for option in ("episodes", "pixel_episodes", "timesteps"):
        at_least(f"--{option.replace('_', '-')}", getattr(arguments, option), 1)
    writable_folder(arguments.out)
    torch.set_num_threads(1)  # two are slower in networks as small as these
    settings = {name: value for name, value in asdict(arguments).items() if name != "out"}
    policies = {(level, agent): learnt(arguments, level, agent) for level in ORDER for agent in PPO}
    console, metrics = Console(), dict[str, Metric]()
    mark = fingerprint_of(settings, "benchmarks.baselines", "agents.scripted", "agents.ppo")
    with progress_bar(console, "baselines") as say:
        cache = PartCache(arguments.out / "parts", mark, len(ORDER) * len(ROWS), say)
        for level in ORDER:
            for agent in ROWS:
                done = played(cache, arguments, level, agent, policies.get((level, agent)))
                metrics |= {f"{level}.{agent}.{key}": each for key, each in worth(done).items()}
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + arguments.episodes))
    write_results(arguments.out / "results.json", settings, seeds, metrics)
    said = table(settings, {name: asdict(metric) for name, metric in metrics.items()})
    write_whole(arguments.out / "baselines.md", said)
    console.print(Markdown(said))
    console.print(f"In [bold]{arguments.out}[/]: results.json, baselines.md, policies/")


def learnt(arguments: Arguments, level: str, agent: str) -> Path:
    """The policy that acts at a level; it is trained, or trained on, if it has not learnt enough.

    At `none` nobody is believed to be near: the safety term is nothing, and both are the same.
    """
    on = "keypoints" if level == "pixels" else level
    proximity = 0.0 if level == "none" else PPO[agent]
    folder = arguments.out / "policies" / f"{on}-{proximity:g}-{arguments.timesteps}"
    policy = folder / "policy.zip"
    begun = policy.exists()
    if begun and ppo.describe(policy)["num_timesteps"] >= arguments.timesteps:
        return policy
    options: dict[str, Any] = {"resume" if begun else "out": folder}
    options |= {"timesteps": arguments.timesteps, "episodes": 1}
    options |= {"perception": on, "proximity": proximity}
    if arguments.threads is not None:
        options["threads"] = arguments.threads
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    print(f"Learning at {on}, safety term {proximity:g}: {policy}", flush=True)
    subprocess.run(
        [sys.executable, "-m", "hrc_env", "train", "--no-film", *words],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}, check=True,
    )  # fmt: skip
    return policy


def played(
    cache: PartCache, arguments: Arguments, level: str, agent: str, policy: Path | None
) -> list[dict[str, float]]:
    """Statistics of an agent's episodes at a level, from the cache or anew."""
    label, make = f"{level}.{agent}", partial(make_agent, str(policy or agent))
    if policy is not None:
        label += "." + hashlib.sha256(policy.read_bytes()).hexdigest()[:12]
    kwargs: dict[str, Any] = {"perception": level}
    n_episodes = arguments.pixel_episodes
    if level != "pixels":
        kwargs["num_threads"], n_episodes = arguments.threads, arguments.episodes

    def play(tick: PartProgress) -> dict[str, Any]:
        return {"episodes": judged(make, n_episodes, tick=tick, **kwargs)}

    return cache.part(label, play)["episodes"]


def worth(episodes: list[dict[str, float]]) -> dict[str, Metric]:
    """Means over episodes with 95 % bootstrap intervals."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    minutes = [seconds / 60 for seconds in column["seconds"]]
    return {
        "return": mean_over(column["r"], "1"),
        "goals_per_minute": ratio_over(column["goals_reached"], minutes, "1/min"),
        "cost_per_episode": mean_over(column["cost"], "1"),
        "contacts_per_episode": mean_over(column["contacts"], "1"),
    }


def table(config: Mapping[str, Any], metrics: Mapping[str, Mapping[str, Any]]) -> str:
    """The table in Markdown, from what results.json holds."""
    lines = [
        "| perception | agent | " + " | ".join(title for title, _ in COLUMNS.values()) + " |",
        "|---" * (len(COLUMNS) + 2) + "|",
    ]
    for level in ORDER:
        for agent, name in ROWS.items():
            cells = []
            for key, (_, digits) in COLUMNS.items():
                each = metrics[f"{level}.{agent}.{key}"]
                value, low, high = (f"{each[k]:.{digits}f}" for k in ("value", "low", "high"))
                cells.append(f"{value} [{low}, {high}]")
            lines.append(f"| `{level}` | {name} | " + " | ".join(cells) + " |")
    lines += [
        "",
        f"Means of {config['episodes']} episodes of 10 s ({config['pixel_episodes']} at `pixels`), "
        "in brackets 95 % bootstrap intervals over episodes. Cost and contacts are counted on "
        "the truth; the return is what the robot is rewarded for, by its estimate: compare it "
        f"within a level only. PPO: one policy each, {config['timesteps']:,} steps. Made by "
        f"`python -m benchmarks.baselines{' --quick' if config['quick'] else ''}`.",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
