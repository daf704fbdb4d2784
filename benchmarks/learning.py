"""PPO by train.py on several seeds: python benchmarks/learning.py

How long it takes until 80 % of the goals are reached, in steps and in seconds on the wall, how many
steps a second that is, learner included, and what the policies are worth in the end. A seed whose
run is there is not learnt again; delete its folder for that. Nothing else should run meanwhile.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from hrc_env.core.results import Metric, over, write_results

ROOT = Path(__file__).resolve().parent.parent
GOOD = 0.8
"""Share of the goals of the last 64 episodes, actions noisy as in learning, that is looked for."""
AT_THE_END = ("success_rate", "goals_per_minute", "contacts_per_episode", "close_steps_per_episode")


@dataclass(frozen=True)
class Arguments:
    """Learn on several seeds."""

    out: Path = Path("out/learning")
    """Folder for the runs, results.json and curves.png."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of environments and learner."""
    timesteps: int = 1_000_000
    """Environment steps of each."""
    ramp: int = 400_000
    """As of train.py: steps in which the safety term's weight grows."""


def main(arguments: Arguments) -> None:
    """Learn, print, write, draw."""
    runs = [learnt(arguments, seed) for seed in arguments.seeds]
    metrics = {**speed(runs), **worth(runs)}
    table = Table("", "median", "lowest", "highest", title=f"PPO, seeds {arguments.seeds}")
    for name, metric in metrics.items():
        table.add_row(name, *(f"{x:,.4g}" for x in (metric.value, metric.low, metric.high)))
    Console().print(table)
    config = {"timesteps": arguments.timesteps, "ramp": arguments.ramp}
    write_results(arguments.out / "results.json", config, arguments.seeds, metrics)
    draw(arguments, runs)


def learnt(arguments: Arguments, seed: int) -> tuple[list[dict[str, float]], dict[str, Any]]:
    """The curve and the score of a seed's run, which is made if it is not there."""
    folder = arguments.out / f"seed-{seed}"
    if not (folder / "score.json").exists():
        options = {"seed": seed, "out": folder, "timesteps": arguments.timesteps}
        options["ramp"] = arguments.ramp
        command = [sys.executable, str(ROOT / "train.py"), "--no-film"]
        for name, value in options.items():
            command += [f"--{name}", str(value)]
        subprocess.run(command, check=True)
    curve = json.loads((folder / "curve.json").read_text())
    return curve, json.loads((folder / "score.json").read_text())


def speed(runs: list[tuple[list[dict[str, float]], dict[str, Any]]]) -> dict[str, Metric]:
    """When 80 % were reached (infinite if never), and steps a second from end to end."""
    first = [next((p for p in curve if p["success_rate"] >= GOOD), None) for curve, _ in runs]
    return {
        "steps_to_80_percent": over([p["steps"] if p else np.inf for p in first], "1"),
        "seconds_to_80_percent": over([p["wall_s"] if p else np.inf for p in first], "s"),
        "frames_per_s": over([c[-1]["steps"] / c[-1]["wall_s"] for c, _ in runs], "1/s"),
    }


def worth(runs: list[tuple[list[dict[str, float]], dict[str, Any]]]) -> dict[str, Metric]:
    """The learnt policies on the seeds of evaluations, actions without noise."""
    units = {"goals_per_minute": "1/min"}
    return {
        f"evaluated.{name}": over([score[name] for _, score in runs], units.get(name, "1"))
        for name in AT_THE_END
    }


def draw(arguments: Arguments, runs: list[tuple[list[dict[str, float]], dict[str, Any]]]) -> None:
    """Curves over minutes, a line a seed."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    labels = ("goals reached (share)", "goals per minute")
    labels += ("true contacts per episode", "steps < 15 cm per episode")
    figure, axes = plt.subplots(2, 2, figsize=(9, 6), sharex=True, layout="constrained")
    for axis, name, label in zip(axes.ravel(), AT_THE_END, labels, strict=True):
        for seed, (curve, _) in zip(arguments.seeds, runs, strict=True):
            minutes = [point["wall_s"] / 60 for point in curve]
            axis.plot(minutes, [point[name] for point in curve], label=f"seed {seed}", alpha=0.8)
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    axes[0, 0].axhline(GOOD, color="grey", linestyle="--", linewidth=0.8)
    axes[0, 0].set_ylim(0, 1.05)
    axes[0, 0].legend()
    for axis in axes[1]:
        axis.set_xlabel("wall-clock minutes")
    grows = f"safety term grows over {arguments.ramp:,} steps" if arguments.ramp else "no ramp"
    figure.suptitle(f"PPO on the camera emulator ({grows})")
    figure.savefig(arguments.out / "curves.png", dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
