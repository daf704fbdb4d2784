"""Speed and accuracy of level `pixels` with settings of the detector.

    python -m benchmarks.speed.pixels

In every round, each setting plays an episode with the same seed, so that noise of the machine
affects all of them equally. Columns: processor time of a step and its ratio to the default setting,
with quartiles of the rounds; mean and 95 % quantile of the errors of tracked joints, and the ratio
of the means to that of the default; share of errors within the 95 % ellipsoid of the estimate's
covariance; and share of time in which the worker is tracked. The option `--out` writes the results
as JSON; those of the last run are in `pixels.json` beside this file.
"""

import json
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table
from scipy.stats import chi2

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import provenance, write_whole
from hrc_env.core.typing import Bools, Floats
from hrc_env.experiments.price.episodes import read_true_joints
from hrc_env.perception import vino
from hrc_env.simulation import Simulation

DEFAULT = "every image, LiteRT"
SETTINGS: dict[str, Mapping[str, Any]] = {
    DEFAULT: {},
    "every 2nd image, LiteRT": {"every": 2},
    "two cameras in turns, LiteRT": {"every": 2, "in_turns": True},
    "every image, OpenVINO": {"runtime": "openvino"},
    "every 2nd image, OpenVINO": {"runtime": "openvino", "every": 2},
}
"""Settings of the detector, by name."""
SETTLED = 15
"""Number of steps at the start of an episode whose errors are left out, while a track begins."""
WITHIN = float(chi2.ppf(0.95, 3))
"""Square of the radius of a 95 % ellipsoid [standard deviations squared]."""


@dataclass(frozen=True)
class Arguments:
    """Measure the speed and the accuracy of level `pixels`."""

    episodes: int = 16
    """Number of episodes of each setting."""
    steps: int = 120
    """Number of control steps of an episode."""
    seed: int = 23_400_000
    """Seed of the first episode."""
    task: str = "HRCReach-v0"
    """Id of the environment."""
    worker: str = "any"
    """Bodies of the workers."""
    out: Path | None = None
    """JSON file to which the results are written."""


@dataclass(slots=True)
class Played:
    """Measurements of the episodes of one setting."""

    step_ms: list[float] = field(default_factory=list)
    """Processor time of a step, for each episode [ms]."""
    errors_m: list[Floats] = field(default_factory=list)
    """Errors of the tracked joints, for each step [m]."""
    within: list[Bools] = field(default_factory=list)
    """Masks of the errors within the 95 % ellipsoid."""
    tracked: list[float] = field(default_factory=list)
    """Share of tracked workers, for each step."""


def main(arguments: Arguments) -> int:
    """Play the episodes, print a table, write the results, and return the exit status."""
    named = {name: each for name, each in SETTINGS.items() if is_available(each)}
    played = {name: Played() for name in named}
    with ExitStack() as exits, progress_bar(Console(), "pixels") as say:
        envs = {}
        for name, detector in named.items():
            config = {"detector": dict(detector), "worker": arguments.worker}
            envs[name] = gymnasium.make(
                arguments.task, perception="pixels", config=config, max_episode_steps=-1
            )
            exits.callback(envs[name].close)
        for episode in range(arguments.episodes):
            for name, env in envs.items():
                play_episode(env, arguments.seed + episode, arguments.steps, played[name])
                say(1 / arguments.episodes / len(envs), name)
    found = {name: summarize(each, played[DEFAULT]) for name, each in played.items()}
    table = Table("detector", "ms a step", "of default", "mean error [mm]", "of default",
                  "95 % [mm]", "in ellipsoid [%]", "tracked [%]")  # fmt: skip
    for name, row in found.items():
        low, middle, high = row["time_ratio_quartiles"]
        table.add_row(
            name, f"{row['step_ms']:.1f}", f"{middle:.2f} ({low:.2f} to {high:.2f})",
            f"{row['mean_error_mm']:.1f}", f"{row['error_ratio']:.3f}",
            f"{row['p95_error_mm']:.1f}", f"{100 * row['coverage']:.1f}",
            f"{100 * row['tracked']:.1f}",
        )  # fmt: skip
    Console().print(table)
    if left_out := sorted(SETTINGS.keys() - named.keys()):
        Console().print(f"Not measured, because OpenVINO is not installed: {', '.join(left_out)}.")
    if arguments.out is not None:
        settings = {
            name: str(each) if isinstance(each, Path) else each
            for name, each in vars(arguments).items()
            if name != "out"
        }
        record = {**provenance(), "settings": settings, "measured": found}
        write_whole(arguments.out, json.dumps(record, indent=1))
    return 0


def is_available(detector: Mapping[str, Any]) -> bool:
    """Return whether the runtime of a setting is installed."""
    return detector.get("runtime") != "openvino" or vino.is_installed()


def play_episode(env: Any, seed: int, n_steps: int, played: Played) -> None:
    """Play an episode with the scripted agent, and add its measurements.

    Args:
        env: environment of level `pixels`.
        seed: seed of the episode.
        n_steps: number of control steps.
        played: measurements, which are extended.
    """
    part: Simulation = env.unwrapped.simulation
    agent = make_agent("scripted", env_info(part), seed=seed)
    observation, _ = env.reset(seed=seed)
    taken_s = 0.0
    for step in range(n_steps):
        action = agent.act(observation)
        started_s = time.process_time()
        observation, *_ = env.step(action)
        taken_s += time.process_time() - started_s
        if step < SETTLED:
            continue
        estimate = part.belief.estimate
        error_m = (read_true_joints(part) - estimate.mean_world)[estimate.tracked]
        cov = estimate.cov_world[estimate.tracked]
        squared = np.einsum("...i,...i", error_m, np.linalg.solve(cov, error_m[..., None])[..., 0])
        played.errors_m.append(np.linalg.norm(error_m, axis=-1).ravel())
        played.within.append(np.ravel(squared <= WITHIN))
        played.tracked.append(float(estimate.tracked.mean()))
    played.step_ms.append(1e3 * taken_s / n_steps)


def summarize(played: Played, default: Played) -> dict[str, Any]:
    """Return the numbers of a setting.

    Args:
        played: its measurements.
        default: those of the default setting.
    """
    ratios = np.divide(played.step_ms, default.step_ms)
    errors_m, usual_m = np.concatenate(played.errors_m), np.concatenate(default.errors_m)
    return {
        "step_ms": float(np.median(played.step_ms)),
        "time_ratio_quartiles": np.percentile(ratios, (25, 50, 75)).tolist(),
        "mean_error_mm": float(1e3 * errors_m.mean()),
        "error_ratio": float(errors_m.mean() / usual_m.mean()),
        "p95_error_mm": float(1e3 * np.quantile(errors_m, 0.95)),
        "coverage": float(np.concatenate(played.within).mean()),
        "tracked": float(np.mean(played.tracked)),
        "n_errors": len(errors_m),
    }


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
