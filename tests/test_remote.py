"""Environments in processes of their own: the same numbers, and words when a process ends."""

import itertools
import os
import pickle
import signal
import time

import numpy as np
import pytest

from hrc_env.errors import ConfigError, HRCError
from hrc_env.rewards import RewardConfig
from hrc_env.vector_env import HRCVectorEnv

SETTINGS = {"max_episode_steps": 8, "num_threads": 2}


def make(backend: str, **kwargs) -> HRCVectorEnv:
    return HRCVectorEnv(3, backend=backend, **{"perception": "none", **SETTINGS, **kwargs})


def played(env: HRCVectorEnv, n_steps: int = 20, seed: int = 0) -> list:
    """Steps with ends, a reset of some, and steps again."""
    draw = np.random.default_rng(seed).uniform(-1, 1, (2, n_steps, 3, 6)).astype(np.float32)
    some = {"reset_mask": np.array([False, True, True])}
    return [
        *(env.step(action) for action in draw[0]),
        env.reset(options=some),
        *(env.step(action) for action in draw[1]),
    ]


def compare() -> None:
    """Raise unless processes give the numbers of threads."""
    for level, mode in itertools.product(["keypoints", "truth"], ["NextStep", "SameStep"]):
        kwargs = {"perception": level, "autoreset_mode": mode, "n_workers": (1, 2)}
        threads, processes = make("threads", **kwargs), make("processes", **kwargs)
        for env in (threads, processes):
            env.set_reward(RewardConfig(proximity=3.0))
        same(threads.reset(seed=4), processes.reset(seed=4))
        same(played(threads), played(processes))
        same(threads.reset(), processes.reset())
        threads.close(), processes.close()


def same(one, other) -> None:
    """Raise unless two results are equal: NaNs, masks, and arrays in arrays too."""
    if isinstance(one, np.ndarray) and one.dtype == object:
        one, other = one.tolist(), other.tolist()
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        one, other = list(one.values()), list(other.values())
    if isinstance(one, list | tuple):
        assert len(one) == len(other)
        for each, its in zip(one, other, strict=True):
            same(each, its)
        return
    np.testing.assert_array_equal(one, other, strict=isinstance(one, np.ndarray))


def test_processes_give_the_numbers_of_threads_once_everything_is_compiled(process):
    """In a program of its own, twice: kernels that were compiled just now may differ from the
    same kernels out of their cache in the last bit."""
    for is_warm in (False, True):
        done = process(__file__)
        assert done.returncode == 0 or not is_warm, done.stderr


def test_a_state_goes_back_and_to_threads():
    processes, threads = make("processes"), make("threads")
    processes.reset(seed=1)
    state = processes.get_state()
    first = played(processes)
    processes.set_state(state)
    threads.set_state(pickle.loads(pickle.dumps(state)))
    np.testing.assert_equal(first, played(processes))
    np.testing.assert_equal(first, played(threads))
    threads.close(), processes.close()


def test_pictures_come_from_there(process):
    threads, processes = (make(each, render_mode="rgb_array") for each in ("threads", "processes"))
    for env in (threads, processes):
        env.reset(seed=2)
    np.testing.assert_equal(threads.render(), processes.render())
    threads.close(), processes.close()


def test_errors_come_back_as_they_were():
    env, other = make("processes"), make("processes", control="tool")
    env.reset(seed=0), other.reset(seed=0)
    with pytest.raises(ConfigError, match="control='tool'"):
        env.shards.parts[1].set_state(other.shards.parts[1].get_state())
    env.step(np.zeros((3, 6)))
    with pytest.raises(pickle.PicklingError, match="get_state"):
        pickle.dumps(env)
    env.close(), other.close()
    with pytest.raises(ConfigError, match="Did you mean 'processes'"):
        make("process")


def test_an_answer_nobody_waited_for_is_not_taken_for_the_next():
    env = make("processes")
    env.reset(seed=0)
    part = env.shards.parts[1]
    part.start("step", (np.zeros((2, 6)),))  # and interrupted
    assert part.get_state()["settings"]["batch"] == 2
    env.close()


def test_a_process_that_is_killed_is_named():
    env = make("processes")
    env.reset(seed=0)
    os.kill(env.shards.parts[1]._child.pid, signal.SIGKILL)
    with pytest.raises(HRCError, match="process of 2 environments has ended"):
        env.step(np.zeros((3, 6)))
    env.close()
    assert env.shards.parts[1]._child.stdin.closed


def test_processes_end_with_a_parent_that_is_killed(process):
    """A script without a guard makes some, says who they are, and is killed."""
    script = """
import os, signal
from hrc_env.vector_env import HRCVectorEnv
env = HRCVectorEnv(2, perception="none", num_threads=2, backend="processes")
env.reset(seed=0)
print(env.shards.parts[1]._child.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
    done = process("-c", script)
    child = int(done.stdout)
    for _ in range(600):
        if not _is_running(child):
            return
        time.sleep(0.1)
    pytest.fail(f"process {child} is still there a minute after its parent was killed")


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{pid}/stat") as stat:
        return stat.read().rsplit(")", 1)[1].split()[0] != "Z"


if __name__ == "__main__":
    compare()
