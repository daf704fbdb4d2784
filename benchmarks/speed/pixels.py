"""Speed and accuracy of level `pixels` with settings of the detector.

    python -m benchmarks.speed.pixels

In every round, each setting plays an episode with the same seed, so that noise of the machine
affects all of them equally.
"""

import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from scipy.stats import chi2

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.cli.checks import check_at_least
from hrc_env.cli.entry import show_errors
from hrc_env.core.progress import progress_bar
from hrc_env.core.results import Metric, over, write_results
from hrc_env.core.typing import Bools, Floats
from hrc_env.evaluation.intervals import (
    estimate_clustered_share,
    estimate_mean,
    estimate_quantile,
    estimate_ratio,
)
from hrc_env.experiments.columns import Column
from hrc_env.experiments.price.episodes import read_true_joints
from hrc_env.experiments.report import Table
from hrc_env.perception import vino
from hrc_env.simulation import Simulation

DEFAULT = "litert"
SETTINGS: dict[str, tuple[str, Mapping[str, Any]]] = {
    DEFAULT: ("every image, LiteRT", {}),
    "litert_2": ("every 2nd image, LiteRT", {"every": 2}),
    "litert_turns": ("two cameras in turns, LiteRT", {"every": 2, "in_turns": True}),
    "openvino": ("every image, OpenVINO", {"runtime": "openvino"}),
    "openvino_2": ("every 2nd image, OpenVINO", {"runtime": "openvino", "every": 2}),
}
"""Description and settings of the detector, by name."""
SETTLED = 15
"""Number of steps at the start of an episode whose errors are left out, while a track begins."""
WITHIN = float(chi2.ppf(0.95, 3))
"""Square of the radius of a 95 % ellipsoid [standard deviations squared]."""
TABLES = (
    Table(
        "pixels_detector",
        "Level `pixels` with settings of the detector",
        {name: (words,) for name, (words, _) in SETTINGS.items()},
        (
            Column("{}.step_ms", "processor time of a step [ms]"),
            Column("{}.time_ratio", "of default", 2),
            Column("{}.error_mm", "mean error [mm]"),
            Column("{}.error_ratio", "of default", 3),
            Column("{}.p95_mm", "95 % [mm]", 0),
            Column("{}.coverage", "in 95 % ellipsoid [%]", 1, 100),
            Column("{}.tracked", "tracked [%]", 1, 100),
        ),
        ("detector",),
        "Median, smallest and largest times of {n[litert.step_ms]} episodes, and errors of tracked "
        "joints with 95 % intervals over episodes; ratios are to the default setting on the same "
        "seeds. `HRCReach-v0`, one worker with any of the bodies, four cameras.",
    ),
)
"""Tables of the documentation."""


@dataclass(frozen=True)
class Arguments:
    """Measure the speed and the accuracy of level `pixels`."""

    out: Path = Path("out/pixels")
    """Folder for results.json."""
    episodes: int = 16
    """Number of episodes of each setting."""
    steps: int = 120
    """Number of control steps of an episode."""
    seed: int = 23_400_000
    """Seed of the first episode."""
    worker: str = "any"
    """Bodies of the workers."""


@dataclass(slots=True)
class Played:
    """Measurements of the episodes of one setting, with one entry per episode."""

    step_ms: list[float] = field(default_factory=list)
    """Processor time of a step [ms]."""
    errors_mm: list[Floats] = field(default_factory=list)
    """Errors of the tracked joints in all steps [mm]."""
    within: list[Bools] = field(default_factory=list)
    """Masks of the errors within the 95 % ellipsoid."""
    tracked: list[Bools] = field(default_factory=list)
    """Masks of the steps in which the worker is tracked."""


def main(arguments: Arguments) -> int:
    """Play the episodes, write results.json, print the table, and return the exit status."""
    check_at_least("--episodes", arguments.episodes, 1)
    check_at_least("--steps", arguments.steps, SETTLED + 1)
    named = {name: each for name, (_, each) in SETTINGS.items() if is_available(each)}
    played = {name: Played() for name in named}
    console = Console()
    with ExitStack() as exits, progress_bar(console, "pixels") as say:
        envs = {}
        for name, detector in named.items():
            config = {"detector": dict(detector), "worker": arguments.worker}
            envs[name] = gymnasium.make(
                "HRCReach-v0", perception="pixels", config=config, max_episode_steps=-1
            )
            exits.callback(envs[name].close)
        for episode in range(arguments.episodes):
            for name, env in envs.items():
                play_episode(env, arguments.seed + episode, arguments.steps, played[name])
                say(1 / arguments.episodes / len(envs), SETTINGS[name][0])
    metrics = compute_metrics(played)
    config = {name: each for name, each in asdict(arguments).items() if name != "out"}
    seeds = range(arguments.seed, arguments.seed + arguments.episodes)
    write_results(arguments.out / "results.json", config, list(seeds), metrics)
    print(TABLES[0].to_markdown(metrics))
    if left_out := [SETTINGS[name][0] for name in SETTINGS if name not in named]:
        console.print(f"Not measured, because OpenVINO is not installed: {', '.join(left_out)}.")
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
    errors_mm, within, tracked = list[Floats](), list[Bools](), list[Bools]()
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
        errors_mm.append(1e3 * np.linalg.norm(error_m, axis=-1).ravel())
        within.append(np.ravel(squared <= WITHIN))
        tracked.append(np.ravel(estimate.tracked))
    played.step_ms.append(1e3 * taken_s / n_steps)
    played.errors_mm.append(np.concatenate(errors_mm))
    played.within.append(np.concatenate(within))
    played.tracked.append(np.concatenate(tracked))


def compute_metrics(played: Mapping[str, Played]) -> dict[str, Metric]:
    """Return the metrics of all settings, by "NAME.METRIC".

    Args:
        played: measurements by name of the setting, with those of `DEFAULT`.
    """
    found: dict[str, Metric] = {}
    usual = played[DEFAULT]
    usual_mm = [each.mean() for each in usual.errors_mm]
    for name, own in played.items():
        own_mm = [each.mean() for each in own.errors_mm]
        of_default = np.divide(own.step_ms, usual.step_ms)
        found |= {
            f"{name}.step_ms": over(own.step_ms, "ms"),
            f"{name}.time_ratio": over(of_default.tolist(), "ratio"),
            f"{name}.error_mm": estimate_mean(own_mm, "mm"),
            f"{name}.error_ratio": estimate_ratio(own_mm, usual_mm, "ratio"),
            f"{name}.p95_mm": estimate_quantile(own.errors_mm, 0.95, "mm"),
            f"{name}.coverage": _estimate_share(own.within),
            f"{name}.tracked": _estimate_share(own.tracked),
        }
    return found


def _estimate_share(masks: Sequence[Bools]) -> Metric:
    """Return the share of True in masks, one per episode."""
    return estimate_clustered_share([each.sum() for each in masks], [each.size for each in masks])


if __name__ == "__main__":
    sys.exit(show_errors(lambda: main(tyro.cli(Arguments, description=__doc__))))
