"""Learners, after a few updates: what they have learnt, what is said of it, what they record."""

import tempfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values

SEED = 2049
LEARNT_TOLERANCE = 0.01
"""Largest difference that rounding makes to what a few updates have learnt."""
N_ACTS = 10


def learn(
    algorithm: str, env_id: str, ends: tuple[int, ...], options: Mapping[str, Any], _: Values
) -> Played:
    """Return the curves of a short training, and what its policy is worth and does."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        values = doors.learn(algorithm, env_id, ends, folder, seed=SEED, **options)
        env = doors.Env(env_id, perception="keypoints", control=options.get("control", "joint"))
        for name in (doors.LEARNT, doors.EXPORTED):
            env.reset(SEED)
            act, acts = env.make_agent(str(folder / name)), []
            for _step in range(N_ACTS):
                acts.append(act(env.observation))
                env.step(acts[-1])
            values[f"acts/{name}"] = np.array(acts)
        env.close()
    return Played(values)


def clone(env_id: str, control: str, _: Values) -> Played:
    """Return what a policy does that was taught for a moment."""
    return Played(doors.clone(env_id, control, SEED, n_rounds=2, n_steps=6))


def record(env_id: str, agent: str, _: Values) -> Played:
    """Return every so many steps of recorded episodes, and sums over all."""
    values: Values = {}
    for k, episode in enumerate(doors.record_episodes(env_id, agent, 3, SEED)):
        for name, value in episode.items():
            steps = value.T if name == "ends" else value
            values[f"{k}/{name}"] = steps[::25].astype(float)
            values[f"{k}/{name}_sum"] = np.array([steps.astype(float).sum(axis=0)])
    return Played(values)


def judge(env_id: str, agent: str, is_batch: bool, options: Mapping[str, Any], _: Values) -> Played:
    """Return the statistics of some episodes."""
    return Played(doors.judge_agent(env_id, agent, 3, not is_batch, **options))


def _learning(name: str, algorithm: str, env_id: str, *ends: int, **options: Any) -> Probe:
    return Probe(
        name=name, play=partial(learn, algorithm, env_id, ends, {"num_envs": 16, **options}),
        subject=env_id, tolerance=LEARNT_TOLERANCE,
    )  # fmt: skip


def _judging(name: str, env_id: str, agent: str, is_batch: bool, **options: Any) -> Probe:
    return Probe(
        name=name, play=partial(judge, env_id, agent, is_batch, options), subject=env_id,
        is_short=is_batch,
        tolerance=1e-4,  # sums over whole episodes, with contacts
    )  # fmt: skip


REACH, REACH_GOAL = "HRCReach-v0", "HRCReachGoal-v0"
PROBES: tuple[Probe, ...] = (
    _learning("ppo", "ppo", REACH, 2048, 3072, ramp=4096),
    _learning("ppo_goals", "ppo", REACH_GOAL, 2048),
    _learning("ppo_lagrangian", "ppo_lagrangian", REACH, 2048, 3072, cost_limit=4.0, ramp=4096),
    _learning("sac", "sac", REACH, 1012, num_envs=4),
    _learning("sac_goals", "sac", REACH_GOAL, 430, num_envs=4, control="tool"),
    *(
        Probe(name=f"clone_{env_id}", play=partial(clone, env_id, control), subject=env_id,
              tolerance=LEARNT_TOLERANCE)
        for env_id, control in (("HRCPickPlace-v0", "twist"), ("HRCReachGoal-v0", "joint"))
    ),
    *(
        Probe(name=f"record_{env_id}_{agent}", play=partial(record, env_id, agent), subject=env_id,
              tolerance=1e-5)
        for env_id, agent in ((REACH, "random"), (REACH_GOAL, "scripted"))
    ),
    _judging("judge_reach", REACH, "scripted", is_batch=True, people="unaware"),
    _judging("judge_reach_one_by_one", REACH, "scripted", is_batch=False, people="unaware"),
    _judging("judge_goals_slowed", REACH_GOAL, "scripted_slowed", is_batch=True, shield="qp"),
)  # fmt: skip
