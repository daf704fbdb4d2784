"""What simple agents and PPO are worth at every perception level: python -m benchmarks.baselines

Random actions, the scripted reacher without and with yielding, and PPO without and with the safety
term, by return, goals a minute, cost and contacts on the same seeds. PPO learns at the level that
it is judged at; at `pixels`, which is too slow for that, the policy of `keypoints` acts. Everybody
is judged by the default reward, safety term included.

Policies and finished parts stay in the folder: a run that was stopped goes on where it was.
`python -m docs.generate --renew baselines out/baselines/results.json` puts them into the docs.
"""

import hashlib
import os
import subprocess
import sys
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import torch
import tyro
from rich.console import Console

from benchmarks.common import publish
from hrc_env.agents import checkpoints
from hrc_env.agents.registry import AGENTS, make_agent
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import EVALUATION_SEED, measure, play_episodes
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.versions import key_of

DEPENDS = ("env", "tracker", "emulator", "detector", "motion", "agents")
"""Subsystems that finished parts depend on."""
TRAINED_ON = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that policies depend on."""
PPO = {"ppo": 0.0, "ppo_safety": 2.0}
"""The weight of the safety term in what each of them learns from."""
ROWS = {
    **{name: f"`{name}`" for name in AGENTS},
    "ppo": "PPO without the safety term",
    "ppo_safety": "PPO with it",
}
"""Agents, as the table calls them."""
ORDER = ("truth", "keypoints", "none", "pixels")
COLUMNS = (
    Column("{}.return", "return"),
    Column("{}.goals_per_minute", "goals a minute"),
    Column("{}.cost_per_episode", "cost", 2),
    Column("{}.contacts_per_episode", "contacts", 2),
)
ABOUT = """\
Means over episodes of 10 s. Cost and contacts are counted on the truth; the return is what the
robot is rewarded for, by its estimate: compare it within a level only. PPO: one policy each."""


@dataclass(frozen=True)
class Arguments:
    """Judge the baselines."""

    out: Path = Path("out/baselines")
    """Folder for results.json, baselines.md, policies and finished parts."""
    quick: bool = False
    """Policies that have hardly learnt, and few episodes: every number, in a few minutes."""
    episodes: int = 128
    """Episodes of each row; 8 if quick."""
    pixel_episodes: int = 5
    """Those at `pixels`; 2 if quick."""
    timesteps: int = 500_000
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
    metrics: dict[str, Metric] = {}
    with progress_bar(Console(), "baselines") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), len(ORDER) * len(ROWS), progress)
        for level, agent in product(ORDER, ROWS):
            done = played(parts, arguments, level, agent, policies.get((level, agent)))
            metrics |= {f"{level}.{agent}.{name}": each for name, each in measure(done).items()}
    rows = {
        f"{level}.{agent}": f"`{level}`, {ROWS[agent]}" for level, agent in product(ORDER, ROWS)
    }
    report = Report("Baselines", ABOUT, [table_of("", rows, COLUMNS, metrics)])
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + arguments.episodes))
    publish(arguments.out, report, settings, seeds, metrics)


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    names = ("quick", "episodes", "pixel_episodes", "timesteps")
    return key_of({name: getattr(arguments, name) for name in names}, DEPENDS)


def lesson(level: str, agent: str) -> tuple[str, float]:
    """Return the level that the policy of a row learns at, and its weight of the safety term.

    At `none` whoever is there is unknown: the safety term is the same whatever the robot does, and
    both are.
    """
    return ("keypoints" if level == "pixels" else level), (0.0 if level == "none" else PPO[agent])


def policy_of(arguments: Arguments, level: str, agent: str) -> Path:
    """Return the path of the policy of a row, whether it has learnt or not."""
    on, proximity = lesson(level, agent)
    trained = key_of({"timesteps": arguments.timesteps}, TRAINED_ON)
    return arguments.out / "policies" / f"{on}-{proximity:g}-{trained}" / "policy.zip"


def learnt(arguments: Arguments, level: str, agent: str) -> Path:
    """Return the policy that acts at a level, which is trained until it has learnt enough."""
    (on, proximity), policy = lesson(level, agent), policy_of(arguments, level, agent)
    folder, begun = policy.parent, policy.exists()
    if begun and checkpoints.describe(policy)["num_timesteps"] >= arguments.timesteps:
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
    parts: PartCache, arguments: Arguments, level: str, agent: str, policy: Path | None
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
        return {"episodes": play_episodes(make, n_episodes, tick=tick, **kwargs)}

    return parts.part(label, play)["episodes"]


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
