"""What an agent is worth: fixed seeds, deterministic actions, cost counted on the truth."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from hrc_env.core.results import Metric
from hrc_env.env import HRCEnv
from hrc_env.experiments.study.intervals import goals_over, mean_over, rate_of
from hrc_env.safety.incidents import KINDS
from hrc_env.sb3 import ACHIEVED, FAILED, HRCVecEnv
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import Task

from .env_info import Agent, env_info

EVALUATION_SEED = 1_000_000
"""First seed of evaluations, far from those that training uses."""


@dataclass(frozen=True, slots=True)
class Score:
    """Means over episodes."""

    episodes: int
    success_rate: float
    """Of all attempts (`Task.achieved` and `Task.failed`)."""
    goals_per_minute: float
    contacts_per_episode: float
    """Touches of the true worker; one that lasts counts once."""
    cost_per_episode: float
    close_steps_per_episode: float
    """Steps nearer than the proximity limit to the true worker."""
    median_min_separation_m: float
    return_mean: float


def evaluate(
    make: Callable[[Any], Agent], n_episodes: int = 64, seed: int = EVALUATION_SEED, **kwargs: Any
) -> Score:
    """Score of an agent; arguments as of `judged`."""
    return summarise(judged(make, n_episodes, seed, **kwargs))


def judged(
    make: Callable[[Any], Agent],
    n_episodes: int,
    seed: int = EVALUATION_SEED,
    tick: Callable[[float], None] = lambda share: None,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """The statistics of whole episodes, the k-th after `reset(seed=seed + k)` whatever the agent:
    agents and perception levels can be compared episode by episode.

    Args:
        make: builds the agent for an `EnvInfo`.
        n_episodes: how many.
        seed: of the first.
        tick: told by how much the share that is done grew.
        kwargs: as of `HRCVecEnv`; with perception="pixels", which has no batched form, as of
            `HRCEnv`.
    """
    if kwargs.get("perception") == "pixels":
        return one_by_one(make, n_episodes, seed, tick, **kwargs)
    env = HRCVecEnv(n_episodes, seed=seed, **kwargs)
    try:
        agent, observation = make(env_info(env.simulation)), env.reset()
        first: dict[int, dict[str, float]] = {}
        while len(first) < n_episodes:
            env.step_async(agent.act(observation))
            observation, _, _, infos = env.step_wait()
            for k, info in enumerate(infos):
                if "episode" in info:
                    first.setdefault(k, info["episode"])
            tick(1 / env.env.max_episode_steps)
        return [first[k] for k in range(n_episodes)]
    finally:
        env.close()


def one_by_one(
    make: Callable[[Any], Agent],
    n_episodes: int,
    seed: int,
    tick: Callable[[float], None] = lambda share: None,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """As `judged`, in the single environment."""
    env = gymnasium.make(kwargs.pop("task", DEFAULT), **kwargs)
    inner = env.unwrapped
    assert isinstance(inner, HRCEnv)
    try:
        agent, done = make(env_info(inner.simulation)), []
        for k in range(n_episodes):
            done.append(_one(env, agent, seed + k, inner.simulation.task, inner.config.ctrl_dt))
            tick(1 / n_episodes)
        return done
    finally:
        env.close()


def _one(
    env: gymnasium.Env[Any, Any], agent: Agent, seed: int, task: Task, ctrl_dt: float
) -> dict[str, float]:
    """Statistics of one episode, by the names that `HRCVecEnv` gives them."""
    observation, info = env.reset(seed=seed)
    rewards, infos, over = [], [], False
    while not over:
        observation, reward, terminated, truncated, info = env.step(agent.act(observation))
        rewards.append(float(reward))
        infos.append(info)
        over = terminated or truncated
    touching = np.array([each["cost_contact"] > 0 for each in infos])
    gaps_m = [each.get("safety/min_separation_m", np.inf) for each in infos]
    return {
        "r": sum(rewards),
        "l": len(infos),
        "seconds": len(infos) * ctrl_dt,
        "cost": float(sum(each["cost"] for each in infos)),
        "cost_steps": float(sum(each["cost_proximity"] for each in infos)),
        "contacts": float((touching & ~np.append(False, touching[:-1])).sum()),
        **{f"contacts_{kind}": info[f"safety/contacts_{kind}"] for kind in KINDS},
        ACHIEVED: info[task.achieved],
        FAILED: info[task.failed],
        "success": float(info["is_success"]),
        "min_separation_m": float(np.min(gaps_m)),
    }


def summarise(episodes: list[dict[str, float]]) -> Score:
    """The score of finished episodes."""
    column = {name: np.array([each[name] for each in episodes]) for name in episodes[0]}
    reached, missed = column[ACHIEVED].sum(), column[FAILED].sum()
    minutes = column["seconds"].sum() / 60
    return Score(
        episodes=len(episodes),
        success_rate=float(reached / max(reached + missed, 1)),
        goals_per_minute=float(reached / minutes),
        contacts_per_episode=float(column["contacts"].mean()),
        cost_per_episode=float(column["cost"].mean()),
        close_steps_per_episode=float(column["cost_steps"].mean()),
        median_min_separation_m=float(np.median(column["min_separation_m"])),
        return_mean=float(column["r"].mean()),
    )


def worth(episodes: list[dict[str, float]]) -> dict[str, Metric]:
    """Means over episodes with 95 % intervals: exact ones of contacts, else bootstraps."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    minutes = [seconds / 60 for seconds in column["seconds"]]
    return {
        "return": mean_over(column["r"], "1"),
        "goals_per_minute": goals_over(column["goals_reached"], minutes),
        "cost_per_episode": mean_over(column["cost"], "1"),
        "contacts_per_episode": rate_of(column["contacts"], len(episodes), "1"),
    }
