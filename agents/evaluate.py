"""What an agent is worth: fixed seeds, deterministic actions, cost counted on the truth."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.sb3 import HRCVecEnv

from .base import Agent, situation

EVALUATION_SEED = 1_000_000
"""First seed of evaluations, far from those that training uses."""


@dataclass(frozen=True, slots=True)
class Score:
    """Means over episodes."""

    episodes: int
    success_rate: float
    """Goals reached of goals reached or missed."""
    goals_per_minute: float
    contacts_per_episode: float
    """Touches of the true worker; one that lasts counts once."""
    cost_per_episode: float
    close_steps_per_episode: float
    """Steps nearer than the proximity limit to the true worker."""
    median_min_separation_m: float
    return_mean: float

    def as_dict(self) -> dict[str, float]:
        """Names and values."""
        return asdict(self)


def evaluate(
    make: Callable[[Any], Agent],
    n_episodes: int = 64,
    num_envs: int = 32,
    seed: int = EVALUATION_SEED,
    **kwargs: Any,
) -> Score:
    """Score of an agent over `n_episodes` whole episodes; kwargs as of `HRCVecEnv`.

    Args:
        make: builds the agent for a `Situation`.
    """
    env = HRCVecEnv(min(num_envs, n_episodes), stagger=False, seed=seed, **kwargs)
    try:
        agent = make(situation(env.simulation))
        return summarise(_episodes(env, agent, n_episodes))
    finally:
        env.close()


def _episodes(env: HRCVecEnv, agent: Agent, n_episodes: int) -> list[dict[str, float]]:
    observation: NDArray[np.float32] = env.reset()
    done: list[dict[str, float]] = []
    while len(done) < n_episodes:
        env.step_async(agent.act(observation))
        observation, _, _, infos = env.step_wait()
        done += [info["episode"] for info in infos if "episode" in info]
    return done[:n_episodes]


def summarise(episodes: list[dict[str, float]]) -> Score:
    """The score of finished episodes."""
    column = {name: np.array([each[name] for each in episodes]) for name in episodes[0]}
    reached, missed = column["goals_reached"].sum(), column["goals_missed"].sum()
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
