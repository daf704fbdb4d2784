"""Environments with one perception setup, in which episodes of a fixed length are played.

Workers take no notice of the robot, so that all policies, estimators and shields meet the same
ones. Episodes take turns in the setup's cameras.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from hrc_env.control import check_action
from hrc_env.core.infos import Info
from hrc_env.core.machine import n_cores
from hrc_env.core.typing import Bools, Floats
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.settings import settle
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.vector.shards import Shards

PEOPLE = "unaware"
"""Workers who take no notice of the robot: their walk is then the same whatever it does."""
N_TOGETHER = 300
"""So many episodes are played side by side."""
Rows = dict[str, list[Any]]
"""Sums by name, one an episode."""
Block = Callable[[Shards, list[int], PartProgress], Rows]
"""Plays one episode of each seed, side by side; returns what they came to."""


class Stage:
    """Environments of one setup, built when they are needed and used again."""

    def __init__(
        self, setup: PerceptionSetup, turns: Sequence[Turn], made_with: Mapping[str, Any]
    ) -> None:
        self.setup, self.turns, self.made_with = setup, turns, made_with
        self._envs: dict[tuple[int, int], Shards] = {}

    def play(self, seeds: Sequence[int], play_block: Block, tick: PartProgress) -> Rows:
        """Return what every episode came to, in the order of the seeds.

        Args:
            seeds: one an episode, of which the k-th has turn k modulo the number of turns.
            play_block: plays some of them.
            tick: called with the growth of the share that is done.
        """
        rows, n = Rows(), len(seeds)
        for k, turn in enumerate(self.turns[:n]):
            mine = np.arange(k, n, len(self.turns))
            for ids in np.array_split(mine, -(-len(mine) // N_TOGETHER)):
                env, share = self._env(k, turn, len(ids)), len(ids) / n
                note = partial(lambda of, done: tick(of * done), share)
                played = play_block(env, [seeds[i] for i in ids], note)
                for name, values in played.items():
                    row = rows.setdefault(name, [None] * n)
                    for i, value in zip(ids.tolist(), values, strict=True):
                        row[i] = value
        return rows

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for env in self._envs.values():
            env.close()

    def _env(self, k: int, turn: Turn, n_episodes: int) -> Shards:
        if (k, n_episodes) not in self._envs:
            settings = settle(
                perception=self.setup.level, estimator=self.setup.estimator, people=PEOPLE,
                faults=list(turn.faults), cameras=list(turn.cameras), **self.made_with,
            )  # fmt: skip
            threads = 1 if self.setup.level == "pixels" else min(n_cores(), n_episodes)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that one camera is a poor rig is what we ask
                made = Shards(n_episodes, threads, partial(Simulation, settings=settings))
            self._envs[k, n_episodes] = made
        return self._envs[k, n_episodes]


class Endless:
    """Environments whose episodes go on after their end, for studies of a fixed length."""

    def __init__(self, env: Shards) -> None:
        self.env = env
        self.terminated: Bools = np.zeros(env.bounds[-1], np.bool_)
        """(B,) whether an episode ended with the last step."""

    def reset(self, seeds: Sequence[int]) -> Observation:
        """Begin an episode of every seed; return the observation."""
        rngs = [seeding.np_random(seed)[0] for seed in seeds]
        return self.env.reset(np.arange(len(seeds)), rngs).observation

    def step(self, action: Any) -> tuple[Observation, Floats, Bools, Bools, Info]:
        """Step every environment; no episode is over."""
        shape = len(self.terminated), self.env.first.n_actions
        result = self.env.step(check_action(action, shape, self.env.first.control))
        self.terminated, never = result.terminated, np.zeros_like(result.terminated)
        return result.observation, result.reward, never, never, result.info
