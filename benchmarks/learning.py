"""PPO by train.py on several seeds: python benchmarks/learning.py

How long it takes until 80 % of the goals are reached, in steps and in seconds on the wall, how many
steps a second that is, learner included, and what the policies are worth in the end. A seed whose
run is there is not learnt again; delete its folder for that. Nothing else should run meanwhile.
"""

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.common import publish
from hrc_env.core.results import Metric, over
from hrc_env.experiments.study.plots import label, new_figure, save
from hrc_env.experiments.study.report import Column, Report, picture, table_of

ROOT = Path(__file__).resolve().parent.parent
GOOD = 0.8
"""Share of the goals of the last 64 episodes, actions noisy as in learning, that is looked for."""
AT_THE_END = {
    "success_rate": "goals reached (share)",
    "goals_per_minute": "goals per minute",
    "contacts_per_episode": "true contacts per episode",
    "close_steps_per_episode": "steps < 15 cm per episode",
}
Run = tuple[list[dict[str, float]], dict[str, Any]]
"""The curve of a seed and its score."""


@dataclass(frozen=True)
class Arguments:
    """Learn on several seeds."""

    out: Path = Path("out/learning")
    """Folder for the runs, results.json and a report with the curves."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of environments and learner."""
    timesteps: int = 1_000_000
    """Environment steps of each."""
    ramp: int = 400_000
    """As of train.py: steps in which the safety term's weight grows."""


def main(arguments: Arguments) -> None:
    """Learn, draw, write, show."""
    runs = [learnt(arguments, seed) for seed in arguments.seeds]
    metrics = metrics_of(runs)
    curves = arguments.out / "figures" / "curves.png"
    draw(curves, dict(zip(arguments.seeds, runs, strict=True)))
    rows = {name: f"{name} [{metric.unit}]" for name, metric in metrics.items()}
    parts = [
        table_of("", rows, [Column("{}", "median (lowest-highest)", 3)], metrics),
        picture(curves, f"PPO on the emulator; safety grows over {arguments.ramp:,} steps."),
    ]
    report = Report("Learning", (__doc__ or "").strip(), parts, "the lowest and the highest run")
    publish(arguments.out, report, asdict(arguments), arguments.seeds, metrics)


def learnt(arguments: Arguments, seed: int) -> Run:
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


def metrics_of(runs: list[Run]) -> dict[str, Metric]:
    """When 80 % were reached (infinite if never), steps a second from end to end, and what the
    policies are worth on the seeds of evaluations, actions without noise."""
    never = {"steps": np.inf, "wall_s": np.inf}
    first = [next((p for p in curve if p["success_rate"] >= GOOD), never) for curve, _ in runs]
    return {
        "steps_to_80_percent": over([point["steps"] for point in first], "1"),
        "seconds_to_80_percent": over([point["wall_s"] for point in first], "s"),
        "frames_per_s": over([c[-1]["steps"] / c[-1]["wall_s"] for c, _ in runs], "1/s"),
        **{f"evaluated.{name}": over([s[name] for _, s in runs], "1") for name in AT_THE_END},
    }


def draw(path: Path, runs: dict[int, Run]) -> None:
    """Curves over minutes, a line a seed."""
    figure = new_figure(9, 6)
    axes = figure.subplots(2, 2, sharex=True)
    for axis, (name, words) in zip(axes.ravel(), AT_THE_END.items(), strict=True):
        for seed, (curve, _) in runs.items():
            minutes = [point["wall_s"] / 60 for point in curve]
            axis.plot(minutes, [point[name] for point in curve], label=f"seed {seed}", alpha=0.8)
        label(axis, "wall-clock minutes", words)
        axis.set_ylim(bottom=0)
    axes[0, 0].axhline(GOOD, color="grey", linestyle="--", linewidth=0.8)
    axes[0, 0].legend()
    save(figure, path)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
