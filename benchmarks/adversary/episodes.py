"""Episodes in which the worker follows a script, and their scores."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.rare.contacts import AGENT, measure_score
from hrc_env.agents.env_info import Agent, env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.typing import Floats
from hrc_env.motion.config import PEOPLE, PeopleConfig
from hrc_env.motion.reaches import ReachDistribution, Script
from hrc_env.vector.env import HRCVectorEnv

TOGETHER = 64
"""Number of episodes that are played as one batch."""
NEVER_S = 10.0
"""Time to contact of an episode in which the robot never moves towards the worker [s], the duration
of an episode of `HRCReach-v0`."""


def make_people(reaches: Script | ReachDistribution) -> PeopleConfig:
    """Return people "unaware" of the robot with a script, or scripts of a distribution."""
    return replace(PEOPLE["unaware"], reaches=reaches)


def make_env(shield: str | None) -> dict[str, Any]:
    """Return the arguments of the environments with a shield or without one."""
    return {"perception": "keypoints", "shield": shield, "config": {"worker": "any"}}


def score_scripts(
    scripts: Sequence[Script],
    first_seed: int,
    env: Mapping[str, Any],
    tick: Callable[[float], None] = lambda share: None,
) -> Floats:
    """Return the score (n,) of each script in an episode of the scripted robot.

    The score is the number of contacts that began while the robot moved towards the worker; if
    there is none, minus the shortest time to contact while the robot moved towards the worker [s].

    Args:
        scripts: n scripts.
        first_seed: seed of the episode of the first script; those of the others follow.
        env: arguments of `HRCVectorEnv`.
        tick: callback that receives the increase of the completed fraction.
    """
    scores = []
    for first in range(0, len(scripts), TOGETHER):
        some = scripts[first : first + TOGETHER]
        share = len(some) / len(scripts)
        scores.append(
            _score_together(some, first_seed + first, env, lambda of, to=share: tick(of * to))
        )
    return np.concatenate(scores)


def _score_together(
    scripts: Sequence[Script],
    first_seed: int,
    env: Mapping[str, Any],
    tick: Callable[[float], None],
) -> Floats:
    """Return the scores of scripts that are played as one batch; see `score_scripts`."""
    n = len(scripts)
    with closing(HRCVectorEnv(n, num_threads=1, max_episode_steps=-1, **env)) as envs:
        agent: Agent = make_agent(AGENT, env_info(envs))
        each = [{"people": make_people(script)} for script in scripts]
        seeds = list(range(first_seed, first_seed + n))
        observation: Any = envs.reset(seed=seeds, options={"each": each})[0]
        n_steps = envs.task.max_episode_steps
        nearest, contacts = np.full(n, -NEVER_S), np.zeros(n, int)
        for _ in range(n_steps):
            observation, _, _, _, info = envs.step(agent.act(observation))
            contacts = info["safety/contacts_towards"].astype(int)
            score = measure_score(
                info["safety/min_separation_m"],
                info["safety/robot_towards_m_s"],
                info["safety/worker_towards_m_s"],
                np.zeros(n, np.bool_),
            )
            nearest = np.maximum(nearest, score)
            tick(1 / n_steps)
    return np.where(contacts > 0, contacts, nearest)
