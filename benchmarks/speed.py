"""Steps a second of the single environment and of the batch: python benchmarks/speed.py

Whole steps through `gymnasium.make`, resets inside, random actions; the median of runs that
take turns, so that a noisy machine slows all of them alike. Gymnasium's Reacher runs beside.
"""

import time
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hrc_env  # noqa: F401  registers the ids
from hrc_env.results import Metric, over, write_results
from hrc_env.sb3 import HRCVecEnv

ASKED = {"keypoints": 1500.0, "truth": 2500.0}


@dataclass(frozen=True)
class Arguments:
    """Measure speed."""

    out: Path = Path("out/speed.json")
    """Where to write the results."""
    runs: int = 7
    """Runs of each; the median counts."""
    steps: int = 1000
    """Steps of a run."""


def single(env: gymnasium.Env, n_steps: int) -> float:
    """Steps a second of one environment, resets inside."""
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (n_steps, *env.action_space.shape)).astype(np.float32)
    env.reset(seed=0)
    started_s = time.perf_counter()
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return n_steps / (time.perf_counter() - started_s)


def batched(env: HRCVecEnv, n_steps: int) -> float:
    """Environment steps a second of a batch, resets inside."""
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (n_steps, env.num_envs, 6)).astype(np.float32)
    env.reset()
    started_s = time.perf_counter()
    for action in actions:
        env.step(action)
    return n_steps * env.num_envs / (time.perf_counter() - started_s)


def main(arguments: Arguments) -> None:
    """Measure, print, write."""
    singles = {
        level: gymnasium.make("HRCReach-v0", perception=level)
        for level in ("keypoints", "truth", "none")
    }
    singles["gymnasium Reacher-v5"] = gymnasium.make("Reacher-v5")
    batches = {level: HRCVecEnv(64, perception=level, num_threads=2) for level in ASKED}
    speeds: dict[str, list[float]] = {}
    for run in track(range(arguments.runs + 1), description="measuring"):
        for name, env in singles.items():
            speeds.setdefault(f"{name}.1.1", []).append(single(env, arguments.steps))
        for name, env in batches.items():
            speed = batched(env, max(arguments.steps // 16, 1))
            speeds.setdefault(f"{name}.64.2", []).append(speed)
        if run == 0:
            speeds.clear()  # warm-up
    report(speeds, arguments)


def report(speeds: dict[str, list[float]], arguments: Arguments) -> None:
    """A table and results.json."""
    metrics: dict[str, Metric] = {}
    table = Table("level", "envs", "threads", "env steps/s (median)", "min", "max", "asked for")
    for name, values in speeds.items():
        metric = over(values, "1/s")
        metrics[f"env_steps_per_s.{name}"] = metric
        level, envs, threads = name.rsplit(".", 2)
        asked = f">= {ASKED[level]:.0f}" if level in ASKED and envs == "1" else ""
        row = (f"{metric.value:.0f}", f"{metric.low:.0f}", f"{metric.high:.0f}", asked)
        table.add_row(level, envs, threads, *row)
    Console().print(table)
    config = {"runs": arguments.runs, "steps": arguments.steps}
    write_results(arguments.out, config, [0], metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
