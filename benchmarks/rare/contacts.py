"""Contacts of a robot that moves towards a worker, as rare events for multilevel splitting.

The level function is minus the time to contact: the true separation, divided by the sum of both
true directed speeds, while the robot moves towards the worker. It and its levels were chosen on
episodes of seeds from 11,000,000 and from 11,010,000: unlike the separation, it is among the
highest of all episodes shortly before a contact.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks.rare.splitting import Moment
from hrc_env.agents.env_info import Agent, env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.safety.incidents import MOVING_M_S
from hrc_env.vector.env import HRCVectorEnv, Kept

LEVELS_S = (-0.3, -0.2, -0.13, -0.08)
"""Levels of minus the time to contact [s]."""
AGENT = "scripted"
"""The agent. It has no memory, which a branch would have to copy."""


class KeptEpisode(NamedTuple):
    """An episode in its middle."""

    environment: Kept
    """The environment."""
    step: int
    """Number of control steps since the episode began."""
    contacts: int
    """Number of contacts towards the worker until now."""


class ShieldedRobot:
    """Episodes of the scripted agent, each an environment of a batch, as a `splitting.Process`.

    Args:
        n_rows: number of environments.
        env: arguments of `HRCVectorEnv`, such as shield and config.
        threads: number of threads; None for all cores.
    """

    def __init__(self, n_rows: int, env: Mapping[str, Any], threads: int | None = None) -> None:
        self.n_rows = n_rows
        self.envs = HRCVectorEnv(n_rows, num_threads=threads, max_episode_steps=-1, **env)
        self.agent: Agent = make_agent(AGENT, env_info(self.envs))
        self.n_steps = self.envs.task.max_episode_steps
        self.step_of, self.contacts = np.zeros(n_rows, int), np.zeros(n_rows, int)
        self._observation: Any = None

    @property
    def episode_h(self) -> float:
        """Duration of an episode [h]."""
        return self.n_steps * self.envs.simulation.config.ctrl_dt / 3600

    def begin(self, rows: Ints, seeds: Ints) -> None:
        """Begin episodes in environments `rows`."""
        given: list[int | None] = [None] * self.n_rows
        for row, seed in zip(rows.tolist(), seeds.tolist(), strict=True):
            given[row] = seed
        mask = np.isin(np.arange(self.n_rows), rows) | (self._observation is None)
        self._observation = self.envs.reset(seed=given, options={"reset_mask": mask})[0]
        self.step_of[rows], self.contacts[rows] = 0, 0

    def branch(self, rows: Ints, kept: Sequence[KeptEpisode], seeds: Ints) -> None:
        """Let environments `rows` go on from kept episodes."""
        if self._observation is None:
            self.begin(rows[:0], seeds[:0])
        distinct = {id(each): each for each in kept}
        number = {key: self.n_rows + k for k, key in enumerate(distinct)}
        ids, given = np.arange(self.n_rows), [None] * self.n_rows
        for row, each, seed in zip(rows.tolist(), kept, seeds.tolist(), strict=True):
            ids[row], given[row] = number[id(each)], seed
            self.step_of[row], self.contacts[row] = each.step, each.contacts
        known = [each.environment for each in distinct.values()]
        self._observation = self.envs.branch(ids, given, known)

    def step(self) -> Moment:
        """Let the agent act for one control step in all environments."""
        action = self.agent.act(self._observation)
        self._observation, _, terminated, _, info = self.envs.step(action)
        self.step_of += 1
        contacts = info["safety/contacts_towards"].astype(int)
        score = measure_score(
            info["safety/min_separation_m"],
            info["safety/robot_towards_m_s"],
            info["safety/worker_towards_m_s"],
            contacts > self.contacts,
        )
        self.contacts = contacts
        return Moment(score, terminated | (self.step_of >= self.n_steps), contacts.copy())

    def keep(self, row: int) -> KeptEpisode:
        """Return a copy of an episode."""
        return KeptEpisode(self.envs.keep([row]), int(self.step_of[row]), int(self.contacts[row]))

    def close(self) -> None:
        """Release the environments."""
        self.envs.close()


def measure_score(gap_m: Floats, robot_m_s: Floats, worker_m_s: Floats, begins: Bools) -> Floats:
    """Return minus the time to contact (B,) [s].

    It is infinite in the step in which a contact begins, and minus infinity while the robot does
    not move towards the worker.

    Args:
        gap_m: (B,) true separation [m].
        robot_m_s: (B,) true directed speed of the robot [m/s]; 0 if it is not measured.
        worker_m_s: (B,) true directed speed of the worker [m/s].
        begins: (B,) whether a contact begins.
    """
    moves = robot_m_s > MOVING_M_S
    closing_m_s = np.where(moves, robot_m_s + np.maximum(worker_m_s, 0.0), 1.0)
    score = np.where(moves, -np.maximum(gap_m, 0.0) / closing_m_s, -np.inf)
    return np.where(begins, np.inf, score)
