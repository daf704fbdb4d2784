"""Whole episodes are the same to the bit: alone, in a batch, in processes, and for SB3."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv

import hrc_env
from hrc_env import HRCVecEnv, HRCVectorEnv, RigDistribution
from hrc_env.vector.member import info_of

LIMIT, SEED = 50, 5
"""The time limit [steps], and a seed of `HRCReach-v0` whose episode ends by a contact before."""
FACTORS = {"effort": 3.0, "proximity": 0.5}
LATE = {"kind": "late", "cameras": ["all"], "amount": [0.0, 0.3]}
TURNED = {"kind": "wrong_rotation", "cameras": ["camera_2"], "amount": [0.01, 0.03]}
OPTIONS: list[dict[str, Any]] = [
    {"faults": [TURNED, LATE]},
    {"n_workers": 2, "bodies": ["worker_2", "worker_1"], "people": "unaware"},
    {
        "n_workers": 1,
        "cameras": RigDistribution(max_shift_m=0.2, max_rotation_rad=0.05, n_cameras=(2, 4)),
    },
    {"faults": [{"kind": "late", "cameras": ["all"], "amount": 0.12}]},
]
"""Of four environments: a range of faults, workers by number and kind, a drawn rig, a delay."""
WITH_GOALS = [{**OPTIONS[0]}, {"goal": (0.5, 0.3, 1.1), **OPTIONS[1]}, *OPTIONS[2:]]
TASKS = {
    "HRCReach-v0": WITH_GOALS, "HRCReachGoal-v0": WITH_GOALS,
    "HRCPickPlace-v0": OPTIONS, "HRCHandover-v0": OPTIONS,
}  # fmt: skip
ARGUMENTS: dict[str, Any] = {
    "perception": "keypoints", "max_episode_steps": LIMIT,
    "config": {"worker": "any", "cost": {"contact_terminates": True}},
}  # fmt: skip
PEOPLE = {"n_workers": (1, 2)}


@dataclass
class Told:
    """What an environment says of an episode, and of the beginning of the next."""

    steps: list[tuple[Any, ...]] = field(default_factory=list)
    """Observation, reward, terminated, truncated and info of each; first those of the reset."""
    next_seen: Any = None
    over: bool = False

    def add(self, seen: Any, reward: Any, terminated: Any, truncated: Any, info: Any) -> None:
        kept = {name: np.array(value) for name, value in info.items()}
        now = float(reward), bool(terminated), bool(truncated)
        self.steps.append((_parts(seen), *now, kept))
        self.over = now[1] or now[2]


def _parts(seen: Any) -> dict[str, Any]:
    parts = seen if isinstance(seen, Mapping) else {"": seen}
    return {name: np.array(part) for name, part in parts.items()}


def _row(seen: Any, k: int) -> dict[str, Any]:
    return {name: part[k] for name, part in _parts(seen).items()}


def actions_of(n: int) -> Any:
    """The same for all environments: one direction, and some noise."""
    drawn = np.random.default_rng(3)
    push = drawn.uniform(-1, 1, n)
    while True:
        yield np.clip(push + drawn.normal(0, 0.02, n), -1, 1).astype(np.float32)


def alone(task: str, k: int) -> Told:
    env = gymnasium.make(task, **ARGUMENTS, **PEOPLE)
    inner: hrc_env.HRCEnv = env.unwrapped
    inner.set_options(TASKS[task][k])
    inner.set_reward(factors=FACTORS)
    told = Told()
    seen, info = env.reset(seed=SEED + k)
    told.add(seen, 0, False, False, info)
    for action in actions_of(env.action_space.shape[0]):
        told.add(*env.step(action))
        if told.over:
            break
    told.next_seen = _parts(env.reset()[0])
    return told


def together(envs: gymnasium.vector.VectorEnv) -> list[Told]:
    """The same of vectors that start anew at the step after an end."""
    told = [Told() for _ in range(envs.num_envs)]
    seen, infos = envs.reset(seed=SEED)
    for k, each in enumerate(told):
        each.add(_row(seen, k), 0, False, False, info_of(infos, k))
    for action in actions_of(envs.single_action_space.shape[0]):
        seen, reward, terminated, truncated, infos = envs.step(np.tile(action, (len(told), 1)))
        for k, each in enumerate(told):
            if not each.over:
                said = reward[k], terminated[k], truncated[k], info_of(infos, k)
                each.add(_row(seen, k), *said)
            elif each.next_seen is None:
                each.next_seen = _row(seen, k)
        if all(each.next_seen is not None for each in told):
            return told
    raise AssertionError


def for_sb3(envs: HRCVecEnv) -> list[Told]:
    """The same of a `VecEnv`, which starts anew at once."""
    told = [Told() for _ in range(envs.num_envs)]
    envs.seed(SEED)
    seen = envs.reset()
    for k, each in enumerate(told):
        each.add(_row(seen, k), 0, False, False, envs.reset_infos[k])
    for action in actions_of(envs.action_space.shape[0]):
        seen, reward, done, infos = envs.step(np.tile(action, (len(told), 1)))
        for k, each in enumerate(told):
            if each.over:
                continue
            last = infos[k].get("terminal_observation", _row(seen, k))
            truncated = infos[k].pop("TimeLimit.truncated", False)
            info = {
                n: v for n, v in infos[k].items() if n not in ("terminal_observation", "episode")
            }
            each.add(last, reward[k], done[k] and not truncated, truncated, info)
            each.next_seen = _row(seen, k)
        if all(each.over for each in told):
            return told
    raise AssertionError


def assert_same(one: Told, other: Told, reward_type: type = np.float64) -> None:
    assert len(one.steps) == len(other.steps)
    for t, (mine, yours) in enumerate(zip(one.steps, other.steps, strict=True)):
        _assert_same_arrays(mine[0], yours[0], f"observation {t}")
        assert reward_type(mine[1]) == yours[1]
        assert mine[2:4] == yours[2:4], t
        _assert_same_arrays(mine[4], yours[4], f"info {t}")
    _assert_same_arrays(one.next_seen, other.next_seen, "next observation")


def _assert_same_arrays(mine: Mapping[str, Any], yours: Mapping[str, Any], what: str) -> None:
    assert set(mine) == set(yours), what
    for name, value in mine.items():
        np.testing.assert_array_equal(value, yours[name], err_msg=f"{what} {name}")


@pytest.fixture(scope="module", params=TASKS)
def task(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def singles(task: str) -> list[Told]:
    return [alone(task, k) for k in range(len(OPTIONS))]


def test_episodes_end_in_both_ways(singles: list[Told], task: str) -> None:
    assert all(each.over and len(each.steps) > 2 for each in singles)
    if task == "HRCReach-v0":
        ends = [each.steps[-1][2:4] for each in singles]
        assert (True, False) in ends
        assert (False, True) in ends


@pytest.mark.parametrize("num_threads", [1, 2])
def test_a_batch_gives_the_episodes_of_single_environments(
    task: str, singles: list[Told], num_threads: int
) -> None:
    envs = HRCVectorEnv(len(OPTIONS), task=task, num_threads=num_threads, **ARGUMENTS, **PEOPLE)
    envs.set_options({"each": TASKS[task]})
    envs.set_reward(factors=FACTORS)
    for one, other in zip(singles, together(envs), strict=True):
        assert_same(one, other)
    envs.close()


def test_sb3_gets_the_episodes_of_single_environments(task: str, singles: list[Told]) -> None:
    envs = HRCVecEnv(len(OPTIONS), task=task, infos="*", **ARGUMENTS, **PEOPLE)
    for k, options in enumerate(TASKS[task]):
        envs.env_method("set_options", options, indices=k)
    envs.set_reward(factors=FACTORS)
    for one, other in zip(singles, for_sb3(envs), strict=True):
        assert_same(one, other, reward_type=np.float32)
    envs.close()


@pytest.mark.usefixtures("process")
def test_processes_give_the_episodes_of_single_environments(task: str, singles: list[Told]) -> None:
    make = partial(gymnasium.make, f"hrc_env:{task}", **ARGUMENTS, **PEOPLE)
    envs = AsyncVectorEnv([make] * len(OPTIONS), context="spawn")
    envs.set_attr("options", TASKS[task])
    envs.call("set_reward", factors=FACTORS)
    for one, other in zip(singles, together(envs), strict=True):
        assert_same(one, other)
    envs.close()
