"""Random actions for a long time, every warning an error: python benchmarks/soak.py

Counts episodes, NaNs and memory; with the default level `truth` it takes two minutes.
"""

import resource
import warnings
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

import hrc_env  # noqa: F401  registers the ids
from hrc_env.results import Metric, write_results


@dataclass(frozen=True)
class Arguments:
    """Soak the environment."""

    out: Path = Path("out/soak.json")
    """Where to write the results."""
    episodes: int = 1000
    """How many."""
    perception: str = "truth"
    """pixels, keypoints, truth or none."""


def episode(env: gymnasium.Env, seed: int, rng: np.random.Generator) -> int:
    """Steps of one episode; raises where anything is not a number."""
    observation, _ = env.reset(seed=seed)
    n_steps, ended = 0, False
    while not ended:
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        numbers = np.array([reward, *info.values()], float)
        if not (np.isfinite(observation).all() and np.isfinite(numbers).all()):
            raise FloatingPointError(f"Not a number in episode {seed}, step {n_steps}: {info}")
        n_steps, ended = n_steps + 1, terminated or truncated
    return n_steps


def main(arguments: Arguments) -> None:
    """Soak, print, write."""
    warnings.simplefilter("error")
    env = gymnasium.make("HRCReach-v0", perception=arguments.perception)
    rng = np.random.default_rng(0)
    seeds = range(arguments.episodes)
    steps = sum(episode(env, seed, rng) for seed in track(seeds, description="soaking"))
    env.close()
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    Console().print(
        f"{arguments.episodes} episodes, {steps} steps at {arguments.perception}: no NaN, no "
        f"warning; peak memory {peak_mib:.0f} MiB"
    )
    metrics = {
        "steps": Metric(steps, steps, steps, "1", arguments.episodes),
        "peak_memory": Metric(peak_mib, peak_mib, peak_mib, "MiB", 1),
    }
    write_results(arguments.out, {"perception": arguments.perception}, list(seeds), metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
