"""Random actions for a long time: python benchmarks/soak.py --steps 10000000

First episodes of the single environment with every warning an error, then steps of the vector
environment. Counts what is not a number and watches the resident memory, which must not grow.
"""

import os
import resource
import time
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress, track

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.results import Metric, over, write_results
from hrc_env.step import ACTIVITY, BODY, MISCALIBRATED
from hrc_env.vector.env import HRCVectorEnv

WARM_UP_STEPS = 1_000_000
"""Memory is compared with what it was after so many environment steps."""
READINGS = 40
"""How often a run reads the memory."""
NAMES = (ACTIVITY, BODY, MISCALIBRATED)
"""The infos that are no numbers."""
NOT_WHEN_LOST = "tracking/mpjpe_m"
"""The one info that a step may lack: nobody is tracked, so nobody is wrong."""


@dataclass(frozen=True)
class Arguments:
    """Soak the environment."""

    out: Path = Path("out/soak/results.json")
    """Where to write the results."""
    steps: int = 2_000_000
    """Environment steps of the vector environment."""
    num_envs: int = 64
    """Environments that step together."""
    threads: int | None = None
    """Threads; all cores by default."""
    perception: str = "keypoints"
    """keypoints, truth or none."""
    episodes: int = 1000
    """Episodes of the single environment, at level truth, before that."""


@dataclass
class Notes:
    """What the vector environment gave."""

    resident: list[tuple[int, float]] = field(default_factory=list)
    """Steps taken and resident memory [MiB]."""
    nans: int = 0
    episodes: int = 0
    seconds: float = 0.0

    def warm(self) -> list[float]:
        """Memory [MiB] after the warm-up; of a short run, after its first tenth."""
        last = self.resident[-1][0]
        start = WARM_UP_STEPS if last > WARM_UP_STEPS else last / 10
        return [mib for steps, mib in self.resident if steps >= start]


def main(arguments: Arguments) -> None:
    """Soak, print, write."""
    warnings.simplefilter("error")
    lengths = single(arguments.episodes)
    notes = vector(arguments)
    report(arguments, lengths, notes)


def single(n_episodes: int) -> list[int]:
    """Steps of episodes of the single environment at level truth."""
    env = gymnasium.make("HRCReach-v0", perception="truth")
    rng = np.random.default_rng(0)
    lengths = [episode(env, s, rng) for s in track(range(n_episodes), description="episodes")]
    env.close()
    return lengths


def episode(env: gymnasium.Env, seed: int, rng: np.random.Generator) -> int:
    """Steps of one episode; raises where anything is not a number."""
    observation, _ = env.reset(seed=seed)
    n_steps, ended = 0, False
    while not ended:
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        numbers = np.array([reward, *(info[name] for name in info if name not in NAMES)], float)
        if not (np.isfinite(observation).all() and np.isfinite(numbers).all()):
            raise FloatingPointError(f"Not a number in episode {seed}, step {n_steps}: {info}")
        n_steps, ended = n_steps + 1, terminated or truncated
    return n_steps


def vector(arguments: Arguments) -> Notes:
    """Step the vector environment."""
    env = HRCVectorEnv(
        arguments.num_envs, perception=arguments.perception, num_threads=arguments.threads
    )
    rng, notes = np.random.default_rng(0), Notes()
    n_calls = max(arguments.steps // env.num_envs, 1)
    every = max(n_calls // READINGS, 1)
    env.reset(seed=0)
    ended, started_s = np.zeros(env.num_envs, bool), time.monotonic()
    with Progress() as progress:
        task = progress.add_task("steps", total=n_calls)
        for call in range(1, n_calls + 1):
            action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
            observation, reward, terminated, truncated, infos = env.step(action)
            notes.nans += not_numbers(observation) + not_numbers(reward)
            notes.nans += lacking(infos, ~ended)
            ended = terminated | truncated
            notes.episodes += int(ended.sum())
            progress.advance(task)
            if call % every == 0 or call == n_calls:
                steps, mib = call * env.num_envs, resident_mib()
                notes.resident.append((steps, mib))
                progress.console.print(f"{steps:>11,} steps {mib:8.1f} MiB {notes.nans} NaN")
    notes.seconds = time.monotonic() - started_s
    env.close()
    return notes


def not_numbers(values: np.ndarray) -> int:
    """How many values are NaN or infinite."""
    return int(values.size - np.isfinite(values).sum())


def lacking(infos: Mapping[str, Any], stepped: np.ndarray) -> int:
    """Infos that are no numbers, or that an environment which `stepped` lacks without reason."""
    count = 0
    for name in infos:
        if not name.startswith("_") and name not in NAMES:
            known = infos[f"_{name}"]
            count += not_numbers(infos[name][known].astype(float))
            wanted = stepped & (infos["tracking/lost"] == 0) if name == NOT_WHEN_LOST else stepped
            count += int((wanted & ~known).sum())
    return count


def resident_mib() -> float:
    """Memory that this process holds now [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def report(arguments: Arguments, lengths: list[int], notes: Notes) -> None:
    """A few lines and results.json."""
    warm = notes.warm()
    growth = max(warm) / warm[0] - 1
    steps = notes.resident[-1][0]
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    Console().print(
        f"{len(lengths)} single episodes, {sum(lengths)} steps at truth: no NaN, no warning.\n"
        f"{steps} steps of {arguments.num_envs} environments at {arguments.perception}, "
        f"{notes.episodes} episodes: {notes.nans} NaN, no warning; "
        f"{steps / notes.seconds:.0f} steps/s; resident {warm[-1]:.0f} MiB, at most "
        f"{growth:.2%} above what it was when warm; peak {peak_mib:.0f} MiB"
    )
    metrics = {
        "steps": over([steps], "1"),
        "single_steps": over([sum(lengths)], "1"),
        "nans": over([notes.nans], "1"),
        "resident_memory": Metric(warm[-1], min(warm), max(warm), "MiB", len(warm)),
        "resident_growth": over([growth], "share"),
        "peak_memory": over([peak_mib], "MiB"),
        "env_steps_per_s": over([steps / notes.seconds], "1/s"),
    }
    config = {**asdict(arguments), "out": str(arguments.out), "readings": notes.resident}
    write_results(arguments.out, config, list(range(arguments.num_envs)), metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
