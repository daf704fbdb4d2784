"""What learning makes of every task: python -m benchmarks.learners

Each id is learnt by the one command that its page names, `python -m hrc_env train --task ID`, with
three seeds, and judged beside its scripted agent on the same fixed seeds: success, cost, contacts,
and how long it took. Policies and finished parts stay in the folder: a run that was stopped goes
on where it was.
"""

import hashlib
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
import tyro
from rich.console import Console

from benchmarks.common import exactly, publish
from hrc_env.agents.recipes import filled
from hrc_env.agents.registry import make_agent
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.cli.train import Train
from hrc_env.core.results import Metric, over
from hrc_env.evaluation.episodes import EVALUATION_SEED, play_episodes
from hrc_env.evaluation.intervals import mean_over, rate_of, success_over
from hrc_env.evaluation.sums import ACHIEVED, FAILED
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.versions import key_of
from hrc_env.tasks import BUILT_IN

DEPENDS = ("env", "tracker", "emulator", "motion", "agents")
"""Subsystems that policies and finished parts depend on."""
Episodes = list[dict[str, float]]
COLUMNS = (
    Column("{}.learnt.success", "success of the policy", 2),
    Column("{}.scripted.success", "of `scripted`", 2),
    Column("{}.learnt.cost", "cost of the policy", 1),
    Column("{}.scripted.cost", "of `scripted`", 1),
    Column("{}.learnt.contacts", "its contacts", 2),
    Column("{}.scripted.contacts", "of `scripted`", 2),
    Column("{}.minutes", "core minutes of learning", 0),
)
ABOUT = """\
Success is the share of what was to be achieved in an episode: goals, studs, screws, deliveries.
Beside attentive workers at `keypoints`. Of policies: median of the seeds (lowest to highest, of
contacts the ends of their exact 95 % intervals); of scripted agents: means of the same episodes
with 95 % intervals. Cost is counted on the truth."""


@dataclass(frozen=True)
class Arguments:
    """Learn every task."""

    out: Path = Path("out/learners")
    """Folder for results.json, the report, policies and finished parts."""
    ids: tuple[str, ...] = tuple(BUILT_IN)
    """Which tasks."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Of learning."""
    episodes: int = 128
    """Episodes of each row; 4 if quick."""
    threads: int | None = None
    """Threads that the environments of a run share; all cores by default."""
    quick: bool = False
    """Policies that have hardly learnt, and few episodes: every number, in some minutes."""


def main(arguments: Arguments) -> None:
    """Learn, judge, print, write."""
    if arguments.quick:
        arguments = replace(arguments, episodes=4, seeds=arguments.seeds[:1])
    at_least("--episodes", arguments.episodes, 1)
    writable_folder(arguments.out)
    torch.set_num_threads(1)
    settings = {name: value for name, value in asdict(arguments).items() if name != "out"}
    metrics: dict[str, Metric] = {}
    n_parts = len(arguments.ids) * (1 + len(arguments.seeds))
    runs = {task: [learnt(arguments, task, seed) for seed in arguments.seeds]
            for task in arguments.ids}  # fmt: skip
    with progress_bar(Console(), "judging") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), n_parts, progress)
        for task in arguments.ids:
            metrics |= worth(parts, arguments, task, runs[task])
    rows = {task: f"`{task}`" for task in arguments.ids}
    report = Report("Learners", ABOUT, [table_of("", rows, COLUMNS, metrics)])
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + arguments.episodes))
    publish(arguments.out, report, settings, seeds, metrics)


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    return key_of({"episodes": arguments.episodes}, DEPENDS)


def folder_of(arguments: Arguments, task: str, seed: int) -> Path:
    """Return the folder of a policy, whether it has learnt or not."""
    trained = key_of({"quick": arguments.quick}, DEPENDS)
    return arguments.out / "policies" / f"{task}-{seed}-{trained}"


def learnt(arguments: Arguments, task: str, seed: int) -> Path:
    """The folder of a policy, which is learnt if it is not there, or learnt on."""
    folder = folder_of(arguments, task, seed)
    if (folder / "score.json").exists():
        return folder
    options: dict[str, Any] = {"task": task, "seed": seed, "out": folder, "episodes": 1}
    if (folder / "policy.zip").exists():
        options = {"resume": folder, "episodes": 1}
    if arguments.threads is not None:
        options["threads"] = arguments.threads
    if arguments.quick:
        options |= {"timesteps": 4096, "num-envs": 8, "demonstrations": 0}
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    subprocess.run([sys.executable, "-m", "hrc_env", "train", "--no-film", *words], check=True)
    return folder


def worth(parts: PartCache, arguments: Arguments, task: str, runs: list[Path]) -> dict[str, Metric]:
    """What a task's policies and its scripted agents are worth."""
    expert = score(played(parts, arguments, task))
    metrics = {f"{task}.scripted.{name}": each for name, each in expert.items()}
    scores = [score(played(parts, arguments, task, run / "policy.zip")) for run in runs]
    for name in scores[0]:
        metrics[f"{task}.learnt.{name}"] = over([each[name].value for each in scores], "1")
    metrics[f"{task}.learnt.contacts"] = spanning([each["contacts"] for each in scores])
    told = [json.loads((folder / "score.json").read_text())["processor_s"] for folder in runs]
    metrics[f"{task}.minutes"] = over([seconds / 60 for seconds in told], "min")
    share = metrics[f"{task}.learnt.success"].value / expert["success"].value
    return {**metrics, f"{task}.share_of_expert": exactly(share, "share", len(runs))}


def spanning(rates: list[Metric]) -> Metric:
    """The median of rates, from the lowest end of their intervals to the highest."""
    found = over([each.value for each in rates], rates[0].unit)
    low, high = min(each.low for each in rates), max(each.high for each in rates)
    return replace(found, low=low, high=high)


def played(
    parts: PartCache, arguments: Arguments, task: str, policy: Path | None = None
) -> Episodes:
    """Return the episodes of a policy, or of the scripted agent, from the cache or anew."""
    kwargs = filled(Train(task=task, perception="keypoints")).keywords()
    kwargs["config"] = {}  # the default reward
    agent = label = "scripted"
    if policy is not None:
        agent = str(policy)
        label = f"policy.{hashlib.sha256(policy.read_bytes()).hexdigest()[:12]}"

    def play(tick: PartProgress) -> dict[str, Any]:
        make: Callable[[Any], Any] = partial(make_agent, agent)
        return {"episodes": play_episodes(make, arguments.episodes, tick=tick, **kwargs)}

    return parts.part(f"{task}.{label}", play)["episodes"]


def score(episodes: Episodes) -> dict[str, Metric]:
    """Success, cost and contacts of episodes."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    tries = [a + b for a, b in zip(column[ACHIEVED], column[FAILED], strict=True)]
    return {
        "success": success_over(column[ACHIEVED], tries),
        "cost": mean_over(column["cost"], "1"),
        "contacts": rate_of(column["contacts"], len(episodes), "1"),
    }


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
