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

import hrc_env  # noqa: F401  registers the ids
from benchmarks.common import exactly
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric, write_results
from hrc_env.safety.incidents import SUMMARY
from hrc_env.vector.env import HRCVectorEnv

WARM_UP_STEPS = 1_000_000
"""Memory is compared with what it was after so many environment steps."""
READINGS = 40
"""How often a run reads the memory."""
NOT_WHEN_LOST = "tracking/mpjpe_m"
"""Not measured where a worker is there who has no track."""
SOMETIMES = (
    "tracking/mpjpe_by_identity_m",
    *(f"safety/{name}" for name in SUMMARY.names or ()
      if not name.startswith("contacts_") and name != "near_misses"),
)  # fmt: skip
"""Absent before anybody was matched; where nobody is near, or no contact begins."""


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
    workers: int = 1
    """In each of them."""
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
    switches: int = 0
    """Of workers from one track to another, in whole episodes."""
    idf1: list[float] = field(default_factory=list)
    """An episode."""
    seconds: float = 0.0

    def warm(self) -> list[float]:
        """Memory [MiB] after the warm-up; of a short run, after its first tenth."""
        last = self.resident[-1][0]
        start = WARM_UP_STEPS if last > WARM_UP_STEPS else last / 10
        return [mib for steps, mib in self.resident if steps >= start]


def single(n_episodes: int) -> int:
    """Steps of episodes of the single environment at level truth; raises if one has no number."""
    env, rng = gymnasium.make("HRCReach-v0", perception="truth"), np.random.default_rng(0)
    n_steps = 0
    for seed in track(range(n_episodes), "episodes"):
        env.reset(seed=seed)
        ended = False
        while not ended:
            action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
            observation, reward, terminated, truncated, info = env.step(action)
            numbers = np.array([reward, *info.values()], float)
            if not_numbers(observation) + not_numbers(numbers):
                raise FloatingPointError(f"Not a number in episode {seed}: {info}")
            n_steps, ended = n_steps + 1, terminated or truncated
    env.close()
    return n_steps


def vector(arguments: Arguments) -> Notes:
    """Step the vector environment."""
    n_envs, level = arguments.num_envs, arguments.perception
    env = HRCVectorEnv(
        n_envs, perception=level, n_workers=arguments.workers, num_threads=arguments.threads
    )
    rng, notes = np.random.default_rng(0), Notes()
    n_calls = max(arguments.steps // n_envs, 1)
    every = max(n_calls // READINGS, 1)
    env.reset(seed=0)
    ended, started_s = np.zeros(n_envs, bool), time.monotonic()
    for call in track(range(1, n_calls + 1), f"steps of {n_envs} environments"):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, infos = env.step(action)
        notes.nans += not_numbers(observation) + not_numbers(reward) + lacking(infos, ~ended)
        ended = terminated | truncated
        notes.episodes += int(ended.sum())
        if ended.any() and arguments.workers > 1:
            notes.switches += int(infos["tracking/id_switches"][ended].sum())
            notes.idf1 += infos["tracking/idf1"][ended].tolist()
        if call % every == 0 or call == n_calls:
            notes.resident.append((call * n_envs, resident_mib()))
    notes.seconds = time.monotonic() - started_s
    env.close()
    return notes


def not_numbers(values: Any) -> int:
    """How many values are NaN or infinite."""
    return int(np.size(values) - np.isfinite(values).sum())


def lacking(infos: Mapping[str, Any], stepped: np.ndarray) -> int:
    """Infos that are no numbers, or that an environment which `stepped` lacks without reason."""
    count = 0
    for name in infos:
        if not name.startswith("_"):
            known = infos[f"_{name}"]
            count += not_numbers(infos[name][known].astype(float))
            wanted = stepped & (infos["tracking/lost"] == 0) if name == NOT_WHEN_LOST else stepped
            count += int((wanted & ~known).sum()) if name not in SOMETIMES else 0
    return count


def resident_mib() -> float:
    """Memory that this process holds now [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def main(arguments: Arguments) -> None:
    """Soak, print, write."""
    warnings.simplefilter("error")
    single_steps, notes = single(arguments.episodes), vector(arguments)
    warm, (steps, _) = notes.warm(), notes.resident[-1]
    metrics = {
        "steps": exactly(steps, "1"),
        "episodes": exactly(notes.episodes, "1"),
        "single_steps": exactly(single_steps, "1"),
        "nans": exactly(notes.nans, "1"),
        "resident_memory": Metric(warm[-1], min(warm), max(warm), "MiB", len(warm)),
        "resident_growth": exactly(max(warm) / warm[0] - 1, "share"),
        "peak_memory": exactly(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "MiB"),
        "env_steps_per_s": exactly(steps / notes.seconds, "1/s"),
    }
    if notes.idf1:
        metrics["id_switches"] = exactly(notes.switches / notes.episodes, "1/episode")
        metrics["idf1"] = exactly(float(np.mean(notes.idf1)), "share", len(notes.idf1))
    for name, metric in metrics.items():
        Console().print(f"{name}: {metric.value:,.4g} {metric.unit}")
    config = {**asdict(arguments), "out": str(arguments.out), "readings": notes.resident}
    write_results(arguments.out, config, list(range(arguments.num_envs)), metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
