"""Write hrc_env/core/kernels/signatures.json: python -m assets.kernels.record.

Plays every perception level, single and batched, and records the kernels that Python called and
their types. Kernels that are not cached are compiled meanwhile, and the compile time is recorded,
too; with an empty folder as NUMBA_CACHE_DIR these are all. Run it when a test reports that a level
compiles a kernel that is not recorded.
"""

import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
from numba.core import event

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.kernels import DISPATCHER, KERNELS, ahead, signatures
from hrc_env.core.kernels.signatures import Signature

LEVELS = {"truth": 250, "keypoints": 250, "none": 250, "pixels": 40}
"""Number of steps of each level."""
VARIANTS: dict[str, dict[str, Any]] = {
    "": {},
    " and more": {"scene": "site", "n_workers": 2, "shield": "qp"},
    " and ssm": {"shield": "ssm"},
}
"""Further configurations that are played; kernels that only these call are compiled by `setup`, not
by the first `make`."""
NUM_ENVS = 8
SEEDS = range(4)
"""Seeds of the environments whose first step is played."""


class Stopwatch(event.Listener):
    """Processor time for the compilation of each kernel for Python, callees included."""

    def __init__(self) -> None:
        self.seconds: dict[tuple[str, str], float] = {}

    def on_start(self, event: event.Event) -> None:
        """Store the start time."""
        event.data["dispatcher"]._started_s = time.process_time()

    def on_end(self, event: event.Event) -> None:
        """Store the elapsed time."""
        kernel = event.data["dispatcher"]
        if isinstance(kernel, DISPATCHER):
            name = f"{kernel.py_func.__module__}:{kernel.py_func.__qualname__}"
            taken_s = time.process_time() - kernel._started_s
            self.seconds[name, str(event.data["args"])] = taken_s


def main() -> None:
    """Record each level in a process of its own."""
    before = {each.kernel: each.seconds for each in signatures.recorded()}
    signatures.write([])
    for level in LEVELS:
        print(f"{level} ...", flush=True)
        subprocess.run([sys.executable, "-m", "assets.kernels.record", level], check=True)
    found = signatures.recorded()
    signatures.write(
        [
            Signature(
                each.kernel,
                each.args,
                each.levels,
                each.seconds or before.get(each.kernel, 1.0),
            )
            for each in found
        ]
    )
    print(f"{len(found)} signatures, {sum(each.seconds for each in found):.0f} s to compile")


def record(level: str) -> None:
    """Play a level, and add the kernels that Python called to the file."""
    watch = Stopwatch()
    event.register("numba:compile", watch)
    known = {(each.kernel, str(each.args)): each for each in signatures.recorded()}
    noted: set[tuple[str, str]] = set()
    plays = {suffix: partial(play, level, variant) for suffix, variant in VARIANTS.items()}
    for suffix, start in {ahead.FIRST: partial(play_first, level), **plays}.items():
        start()
        for name, types in list_called():
            args = [signatures.encode(each) for each in types]
            key = name, str(args)
            if key not in noted:
                noted.add(key)
                other = known.get(key, Signature(name, args, [], 0.0))
                seconds = watch.seconds.get((name, str(types)), other.seconds)
                groups = [level, level + suffix] if suffix == ahead.FIRST else [level + suffix]
                levels = [*other.levels, *groups]
                known[key] = Signature(name, args, levels, round(seconds, 2))
    signatures.write(list(known.values()))


def list_called() -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield the kernels that Python has called, and their types."""
    for name, kernel in KERNELS.items():
        for types in kernel.overloads:
            yield name, types


def play_first(level: str) -> None:
    """Play the first step of environments, with several seeds because activities differ."""
    for seed in SEEDS:
        env = gymnasium.make("HRCReach-v0", perception=level)
        env.reset(seed=seed)
        env.step(env.action_space.sample())
        env.close()
    if level != "pixels":
        envs = gymnasium.make_vec("HRCReach-v0", NUM_ENVS, perception=level)
        envs.reset(seed=0)
        envs.step(envs.action_space.sample())
        envs.close()


def play(level: str, variant: dict[str, Any]) -> None:
    """Play an episode of one environment, and of a vector of them if there is one."""
    env = gymnasium.make("HRCReach-v0", perception=level, **variant)
    agent = make_agent("scripted_slowed", env_info(env.unwrapped.simulation))
    observation, _ = env.reset(seed=0)
    for _ in range(LEVELS[level]):
        observation, *_ = env.step(agent.act(observation))
    env.close()
    if level == "pixels":
        return
    envs = gymnasium.make_vec("HRCReach-v0", NUM_ENVS, perception=level, **variant)
    envs.reset(seed=0)
    for _ in range(LEVELS[level] + 1):
        envs.step(envs.action_space.sample())
    envs.close()


if __name__ == "__main__":
    ahead.ensure = lambda level: None  # nothing is compiled before it is called
    warnings.simplefilter("ignore", UserWarning)
    record(sys.argv[1]) if len(sys.argv) > 1 else main()
