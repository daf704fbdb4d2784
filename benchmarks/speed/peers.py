"""The benchmark of speed beside environments of others, and of the first start.

    python -m benchmarks peers

All environments take turns in one process. Speed is the number of environment steps per second of
processor time, summed over all threads, so that numbers of threads do not matter; that of
Gymnasium's Reacher is 1. EnvPool is an extra of the package (`pip install "hrc_env[peers]"`);
without it, its row is empty. The first start is `make`, `reset` and one `step` in a new process,
once with an empty folder of compiled kernels and then with the same folder.
"""

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import list_endings
from benchmarks.speed.contenders import MANY, OURS, PEER, Pace, Single, Vector
from hrc_env.core.errors import HRCError
from hrc_env.core.results import Metric, over
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, Table
from hrc_env.experiments.runner import check_at_least_one

PUSHER, PANDA = "Pusher-v5", "PandaPickCube-v1"
THREADS = 2
"""Number of threads of batches."""
ROWS: dict[str, tuple[str, str]] = {
    "reacher": (f"Gymnasium's {PEER}", "one"),
    "pusher": (f"Gymnasium's {PUSHER}", "one"),
    "panda": (f"EnvPool's {PANDA}, in C++", f"{MANY} on {THREADS} threads"),
    "truth.many": (f"`{OURS}`, `truth`", f"{MANY} on {THREADS} threads"),
    "keypoints.many": (f"`{OURS}`, `keypoints`", f"{MANY} on {THREADS} threads"),
    "truth": (f"`{OURS}`, `truth`", "one"),
    "keypoints": (f"`{OURS}`, `keypoints`", "one"),
    "pixels": (f"`{OURS}`, `pixels`, four cameras", "one"),
}
"""Environment and batch of each row, by name."""
ROBOSUITE = (
    "For comparison with `pixels`: robosuite 1.5.2 makes 6.6 to 7.2 steps per second of its task "
    "Lift with four images of 256 x 256 pixels, on one such core and without a pose network."
)
PEERS = Table(
    "speed_peers",
    "Speed beside other environments, per second of processor time",
    ROWS,
    (
        Column("steps_per_cpu_s.{}", "environment steps [1/s]", 0),
        Column("of_reacher.{}", f"of {PEER}", 4),
    ),
    ("environment", "batch"),
    "Random actions; resets are included and every info is read. Processor time of all threads. "
    f"Median, smallest and largest value of {{n[of_reacher.reacher]}} rounds in which environments "
    f"take turns; ratios are within a round. {ROBOSUITE}",
    fewest=1,
)
STARTS = {"empty": ("nothing compiled",), "filled": ("kernels compiled before",)}
FIRST_START = Table(
    "first_start",
    "First start",
    STARTS,
    (Column("first_start_s.{}", "processor time [s]", 1),),
    ("kernels",),
    f"`make`, `reset` and one `step` of `{OURS}` at `keypoints` in a new process, with the "
    "processes that compile kernels. Median, smallest and largest value.",
    fewest=1,
)
START = f"""
import resource, time
import gymnasium, hrc_env
env = gymnasium.make("{OURS}", perception="keypoints")
env.reset(seed=0)
env.step(env.action_space.sample())
others = resource.getrusage(resource.RUSAGE_CHILDREN)
print(time.process_time() + others.ru_utime + others.ru_stime)
"""
"""Program that prints the processor time of its start [s]."""
Measured = Mapping[str, Sequence[float]]
"""Measured numbers by name."""


class Pool:
    """EnvPool's vector environment, which resets in the step after an episode."""

    def __init__(self, id: str, num_envs: int, num_threads: int) -> None:
        import envpool  # of the extra "peers"

        self.num_envs = num_envs
        self.env: Any = envpool.make(
            id, env_type="gymnasium", num_envs=num_envs, num_threads=num_threads
        )
        self.env.reset()
        self._ended = np.zeros(num_envs, bool)

    def run_steps(self, n_steps: int) -> Pace:
        """Take random actions for a number of vector steps, which continue the current episodes."""
        shape = (n_steps, self.num_envs, *self.env.action_space.shape)
        actions = np.random.default_rng(0).uniform(-1, 1, shape)
        n_starts, started_s = 0, time.perf_counter()
        for action in actions:
            n_starts += int(self._ended.sum())
            _, _, terminated, truncated, info = self.env.step(action)
            for name in info:
                _ = info[name]
            self._ended = terminated | truncated
        return Pace(n_steps * self.num_envs - n_starts, time.perf_counter() - started_s)

    def close(self) -> None:
        """Close the environment."""
        self.env.close()


@dataclass(frozen=True, slots=True)
class PeersBench:
    """Benchmark of the speed beside environments of others."""

    name = "bench peers"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    seeds = (0,)
    n_parts = 1
    n_rounds: int = 7
    """Number of rounds in which environments take turns."""
    least_steps: int = 4000
    """Minimum number of environment steps in a turn; it is rounded up to whole episodes or vector
    steps."""
    pixel_episodes: int = 1
    """Number of episodes in a turn at level `pixels`; 0 leaves this level out."""
    n_starts: int = 3
    """Number of starts with compiled kernels; 0 leaves out the first start, too."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a value is invalid."""
        check_at_least_one(self, "n_rounds", "least_steps")

    @property
    def quick_note(self) -> str:
        """Warning for the table of a short run, or "" if the run is long enough."""
        is_short = self.n_rounds < PeersBench().n_rounds
        return f"Quick run, {self.n_rounds} rounds: too few for a comparison." if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return {"bench": asdict(self)}

    def play(self, cache: PartCache) -> Measured:
        """Measure all rounds and the first start; no results are cached."""
        return {**self._play_rounds(cache), **self._start(cache)}

    def metrics(self, played: Measured) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return compute_metrics(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables that this benchmark fills in the documentation."""
        return (PEERS, FIRST_START)

    def report(self, played: Measured, metrics: Metrics, figures: Path) -> Report:
        """Return the report with both tables."""
        names = {"speed_peers": "of_reacher.reacher", "first_start": "first_start_s.empty"}
        parts = [
            table.to_markdown(metrics)
            for table in self.shown_tables()
            if names[table.name] in metrics
        ]
        return Report("Peers bench", (__doc__ or "").partition("\n\n")[2], parts,
                      "the smallest and the largest of all rounds")  # fmt: skip

    def _play_rounds(self, cache: PartCache) -> Measured:
        """Return environment steps per second of processor time, one number per round."""
        found: dict[str, list[float]] = {}
        with ExitStack() as exits:
            turns = {name: make() for name, make in self._list_turns().items()}
            for turn in turns.values():
                exits.callback(turn.close)
            for _ in range(self.n_rounds):
                for name, turn in turns.items():
                    started_s = time.process_time()
                    pace = self._take(name, turn)
                    taken_s = time.process_time() - started_s
                    found.setdefault(f"steps_per_cpu_s.{name}", []).append(pace.env_steps / taken_s)
                    cache.progress(0.8 / self.n_rounds / len(turns), name)
        return found

    def _list_turns(self) -> dict[str, Any]:
        """Return functions that make the environment of each row."""
        turns: dict[str, Any] = {
            "reacher": lambda: Single(PEER),
            "pusher": lambda: Single(PUSHER),
        }
        if find_spec("envpool") is not None:
            turns["panda"] = lambda: Pool(PANDA, MANY, THREADS)
        for level in ("truth", "keypoints"):
            turns[f"{level}.many"] = lambda level=level: Vector(
                OURS, MANY, perception=level, num_threads=THREADS
            )
            turns[level] = lambda level=level: Single(OURS, perception=level)
        if self.pixel_episodes:
            turns["pixels"] = lambda: Single(OURS, perception="pixels")
        return turns

    def _take(self, name: str, turn: Any) -> Pace:
        """Take the turn of a row."""
        if not isinstance(turn, Single):
            return turn.run_steps(math.ceil(self.least_steps / turn.num_envs))
        least = math.ceil(self.least_steps / turn.episode_env_steps)
        return turn.run(self.pixel_episodes if name == "pixels" else least)

    def _start(self, cache: PartCache) -> Measured:
        """Return the processor time of starts in new processes [s]."""
        if self.n_starts == 0:
            return {}
        with tempfile.TemporaryDirectory() as folder:
            empty = [measure_start(Path(folder))]
            cache.progress(0.15, "first start")
            filled = [measure_start(Path(folder)) for _ in range(self.n_starts)]
            cache.progress(0.05, "later starts")
        return {"first_start_s.empty": empty, "first_start_s.filled": filled}


QUICK = PeersBench(n_rounds=1, least_steps=500, pixel_episodes=0, n_starts=0)
"""Benchmark settings for a quick run, without level `pixels` and the first start."""


def measure_start(folder: Path) -> float:
    """Return the processor time of a start with compiled kernels in a folder [s].

    Raises:
        HRCError: the process failed.
    """
    done = subprocess.run(
        [sys.executable, "-c", START], capture_output=True, text=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder)}, check=False,
    )  # fmt: skip
    if done.returncode:
        raise HRCError(f"A start failed: {done.stderr[-500:]}")
    return float(done.stdout.split()[-1])


def compute_metrics(measured: Measured) -> dict[str, Metric]:
    """Compute all metrics as medians over rounds, with the range over rounds as interval."""
    found = {
        name: over(values, "s" if name.startswith("first_start_s") else "1/s")
        for name, values in measured.items()
    }
    reacher = measured["steps_per_cpu_s.reacher"]
    for name in list_endings(measured, "steps_per_cpu_s."):
        own = measured[f"steps_per_cpu_s.{name}"]
        ratios = [mine / theirs for mine, theirs in zip(own, reacher, strict=True)]
        found[f"of_reacher.{name}"] = over(ratios, "share")
    return found
