"""Actions of the scripted agents and of trained policies on stored observations."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from tests.behaviour import doors
from tests.behaviour.probe import Played, Probe, Values

EVERY = 17
"""Of the episode from which observations are taken, every so many steps."""
N_STEPS = {"HRCReachGoal-v0": 100, "HRCReach-v0": 250}
SEED = 1049
SCRIPTED = ("scripted", "scripted_slowed")
DISTURBED = "_disturbed"


def play(
    env_id: str, agents: tuple[str, ...], options: Mapping[str, Any], inputs: Values
) -> Played:
    """Return the actions of some agents for the stored observations, one after the other."""
    env = _open(env_id, options)
    observations = _split(inputs)
    values = {}
    for name in agents:
        act = env.make_agent(name)
        values[name.split("/")[-1]] = np.array([act(each) for each in observations])
    env.close()
    return Played(values)


def play_disturbed(
    env_id: str, agents: tuple[str, ...], options: Mapping[str, Any], inputs: Values
) -> Played:
    """Return sums of the actions of some agents for the stored observations, each of which is
    played many times with an error in three entries that are side by side."""
    rng, disturbed = np.random.default_rng(SEED), {}
    for name, value in inputs.items():
        copies = np.repeat(value, N_ERRORS, axis=0)
        n, size = copies.shape
        at = rng.integers(max(size - 3, 1), size=n)[:, None] + np.arange(3)
        error = np.tile(ERRORS, -(-n // len(ERRORS)))[:n, None] * rng.normal(0, 1, (n, 3))
        copies[np.arange(n)[:, None], at % size] += error.astype(np.float32)
        disturbed[name] = copies
    acts = play(env_id, agents, options, disturbed).values
    weights = np.cos(1.0 + np.arange(N_ERRORS) ** 1.3)
    return Played({
        name: np.tensordot(value.reshape(-1, N_ERRORS, value.shape[-1]), weights, (1, 0))
        for name, value in acts.items()
    })  # fmt: skip


ERRORS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Standard deviations of errors, in units of the observation."""
N_ERRORS = 60
"""How often each observation is played."""


def record_observations(env_id: str, options: Mapping[str, Any], every: int) -> Values:
    """Return observations of two episodes, one beside people who come near, one of random acts."""
    env, rng, kept = _open(env_id, options), np.random.default_rng(SEED), []
    for episode in range(2):
        env.reset(SEED + episode)
        act = env.make_agent("scripted")
        for step in range(N_STEPS.get(env_id, 600)):
            if step % every == 0:
                kept.append(env.observation)
            action = np.asarray(act(env.observation), np.float32)
            if episode == 1:
                action = action + rng.normal(0, 0.5, action.shape).astype(np.float32)
            if env.step(np.clip(action, -1, 1).astype(np.float32))[1]:
                break
    env.close()
    if not isinstance(kept[0], dict):
        return {"observation": np.array(kept)}
    return {name: np.array([each[name] for each in kept]) for name in kept[0]}


def list_recipes(_: Values) -> Played:
    """Return how every task is learnt by every learner."""
    values: Values = {}
    for env_id in doors.ENV_IDS:
        for algorithm in (None, "ppo", "sac", "ppo_lagrangian"):
            recipe = doors.recipe_of(env_id, algorithm)
            values[f"{env_id}/{algorithm}"] = np.array(
                [f"{name} = {value}" for name, value in recipe.items()]
            )
    return Played(values)


def _open(env_id: str, options: Mapping[str, Any]) -> doors.Env:
    return doors.Env(env_id, **{"perception": "keypoints", "people": "hurried", **options})


def _split(inputs: Values) -> list[Any]:
    """Return the observations one by one, as an agent gets them."""
    if list(inputs) == ["observation"]:
        return list(inputs["observation"])
    n = len(inputs["observation"])
    return [{name: value[k] for name, value in inputs.items()} for k in range(n)]


def _make(
    env_id: str, agents: tuple[str, ...], end: str = "", every: int = EVERY, **options: Any
) -> Probe:
    play_how = play_disturbed if end == DISTURBED else play
    return Probe(
        name=f"{env_id}{end}",
        play=partial(play_how, env_id, agents, options),
        inputs=partial(record_observations, env_id, options, every),
        subject=env_id,
        is_short=every == EVERY,
    )


PROBES: tuple[Probe, ...] = (
    *(_make(env_id, SCRIPTED) for env_id in doors.ENV_IDS),
    *(_make(env_id, SCRIPTED, DISTURBED) for env_id in doors.ENV_IDS),
    Probe(name="recipes", play=list_recipes, is_short=True),
    _make("HRCReach-v0", SCRIPTED, "_tool", control="tool"),
    *(_make(each.env_id, (each.name,), "_policy", control=each.control)
      for each in doors.policies()),
    *(_make(env_id, SCRIPTED, "_crowd", 11, people="headlong", n_workers=4, perception=level)
      for env_id, level in zip(doors.ENV_IDS, ("keypoints", "truth") * 4, strict=False)),
)  # fmt: skip
