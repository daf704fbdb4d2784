"""The pixel loop: acquisition, accuracy, calibration, speed: python benchmarks/pixels.py

Every step measures with all four cameras; the robot is the scripted reacher that yields to
the estimated worker. Errors are of single joints against the calibrated truth, while the
worker is tracked.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from agents.env_info import env_info
from agents.registry import make_agent
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric, write_results
from hrc_env.env import HRCEnv
from hrc_env.motion import generator
from hrc_env.worker.body import worker_truth

CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""


@dataclass(frozen=True)
class Arguments:
    """Measure the pixel loop."""

    out: Path = Path("out/pixels.json")
    """Where to write the results."""
    episodes: int = 20
    """Episodes of 250 steps for accuracy and speed."""
    resets: int = 100
    """Resets for acquisition."""
    estimator: str = "particle"
    """Name of an estimator: python -m hrc_env list."""
    perception: str = "pixels"
    """pixels; or keypoints, for comparison."""


@dataclass
class Notes:
    """What the episodes gave."""

    errors_m: list[np.ndarray]
    inside_95: list[np.ndarray]
    std_m: list[np.ndarray]
    lost: list[bool]
    seconds: list[float]


def frames_until_tracked(env: HRCEnv, seed: int, limit: int = 5) -> int | None:
    """Looks until the worker is tracked; the reset's own look is the first."""
    env.reset(seed=seed)
    for frame in range(1, limit + 1):
        if env.simulation.estimate.tracked.all():
            return frame
        env.step(np.zeros(6, np.float32))
    return None


def episode(env: HRCEnv, seed: int, notes: Notes) -> None:
    """Play one episode and note every step."""
    agent = make_agent("scripted_slowed", env_info(env.simulation))
    observation, _ = env.reset(seed=seed)
    for _ in range(250):
        action = agent.act(observation)
        started_s = time.perf_counter()
        observation, *_ = env.step(action)
        notes.seconds.append(time.perf_counter() - started_s)
        note(env, notes)


def note(env: HRCEnv, notes: Notes) -> None:
    """Errors of the tracked joints, and whether the reported region held them."""
    simulation = env.simulation
    truth = worker_truth(simulation.bodies, generator.current(simulation.motion))
    estimate = simulation.estimate
    notes.lost.append(not bool(estimate.tracked.all()))
    if notes.lost[-1]:
        return
    offset = (estimate.mean_world - truth.joints_world)[0, 0]
    squared = np.einsum("ji,jik,jk->j", offset, np.linalg.inv(estimate.cov_world[0, 0]), offset)
    notes.errors_m.append(np.linalg.norm(offset, axis=-1))
    notes.inside_95.append(squared < CHI2_95_3D)
    notes.std_m.append(np.sqrt(np.trace(estimate.cov_world[0, 0], axis1=-2, axis2=-1)))


def main(arguments: Arguments) -> None:
    """Measure, print, write."""
    env = HRCEnv(perception=arguments.perception, estimator=arguments.estimator)
    frames = [
        frames_until_tracked(env, 1000 + k)
        for k in track(range(arguments.resets), description="acquisition")
    ]
    notes = Notes([], [], [], [], [])
    for seed in track(range(arguments.episodes), description="episodes"):
        episode(env, seed, notes)
    env.close()
    errors, acquired = np.concatenate(notes.errors_m), [frame is not None for frame in frames]
    rmse = float(np.sqrt(np.mean(errors**2)))
    ratio = float(np.sqrt(np.mean(np.concatenate(notes.std_m) ** 2))) / rmse
    metrics = {
        "acquired_within_5": _plain(np.mean(acquired), "share", len(acquired)),
        "error_median_m": _plain(np.median(errors), "m", errors.size),
        "error_p95_m": _plain(np.percentile(errors, 95), "m", errors.size),
        "rmse_m": _plain(rmse, "m", errors.size),
        "lost_steps": _plain(np.mean(notes.lost), "share", len(notes.lost)),
        "coverage95": _plain(np.concatenate(notes.inside_95).mean(), "share", errors.size),
        "std_over_rmse": _plain(ratio, "-", errors.size),
        "env_steps_per_s": _plain(1 / np.median(notes.seconds), "1/s", len(notes.seconds)),
    }
    asked = {
        "acquired_within_5": ">= 0.95", "error_median_m": "<= 0.028", "error_p95_m": "<= 0.080",
        "lost_steps": "<= 0.02", "coverage95": "0.90 to 0.98", "env_steps_per_s": ">= 20",
    }  # fmt: skip
    table = Table(
        "metric", "measured", "asked for", title=f"{arguments.perception}, {arguments.estimator}"
    )
    for name, metric in metrics.items():
        table.add_row(name, f"{metric.value:.4g} {metric.unit}", asked.get(name, ""))
    Console().print(table)
    config = {"estimator": arguments.estimator, "perception": arguments.perception}
    write_results(arguments.out, config, list(range(arguments.episodes)), metrics)


def _plain(value: float, unit: str, n: int) -> Metric:
    return Metric(float(value), float(value), float(value), unit, n)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
