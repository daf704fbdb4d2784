"""Environments with one perception setup, for episodes of a fixed length.

Workers ignore the robot. Their motions are therefore the same for all policies, estimators and
shields. Successive episodes use the setup's choices of cameras in turn.
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
from hrc_env.core.mapping import merge
from hrc_env.core.typing import Bools, Floats
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.vector.shards import Shards

PEOPLE = "unaware"
"""Kind of workers. They ignore the robot: their motion does not depend on its actions."""
WORKER = "any"
"""Bodies of the workers: each episode draws one of all bodies."""
N_TOGETHER = 300
"""Maximum number of episodes that are played as one batch."""
Rows = dict[str, list[Any]]
"""Lists of sums by name, one value per episode."""
Block = Callable[[Shards, list[int], PartProgress], Rows]
"""Function that plays one episode per seed as a batch and returns the sums of the episodes."""


class Stage:
    """Environments of one setup, which are created when they are needed and then reused."""

    def __init__(
        self, setup: PerceptionSetup, turns: Sequence[Turn], made_with: Mapping[str, Any]
    ) -> None:
        self.setup, self.turns, self.made_with = setup, turns, made_with
        self._envs: dict[tuple[int, int], Shards] = {}

    def play(self, seeds: Sequence[int], play_block: Block, tick: PartProgress) -> Rows:
        """Play all episodes and return their sums, in the order of the seeds.

        Args:
            seeds: one seed per episode; episode k uses turn k modulo the number of turns.
            play_block: function that plays a batch of episodes.
            tick: callback that receives the increase of the completed fraction.
        """
        rows, n = Rows(), len(seeds)
        for k, turn in enumerate(self.turns[:n]):
            turn_ids = np.arange(k, n, len(self.turns))
            for ids in np.array_split(turn_ids, -(-len(turn_ids) // N_TOGETHER)):
                env, share = self._get_env(k, turn, len(ids)), len(ids) / n
                tick_block = partial(lambda of, done: tick(of * done), share)
                sums = play_block(env, [seeds[i] for i in ids], tick_block)
                for name, values in sums.items():
                    row = rows.setdefault(name, [None] * n)
                    for i, value in zip(ids.tolist(), values, strict=True):
                        row[i] = value
        return rows

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for env in self._envs.values():
            env.close()

    def _get_env(self, k: int, turn: Turn, n_episodes: int) -> Shards:
        if (k, n_episodes) not in self._envs:
            config = merge(self.made_with.get("config", {}), {"worker": WORKER})
            settings = resolve_settings(**{
                **self.made_with,
                "perception": self.setup.level, "estimator": self.setup.estimator,
                "people": PEOPLE, "faults": list(turn.faults), "cameras": list(turn.cameras),
                "config": config,
            })  # fmt: skip
            threads = 1 if self.setup.level == "pixels" else min(n_cores(), n_episodes)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a rig of one camera is intended here
                env = Shards(n_episodes, threads, partial(Simulation, settings=settings))
            self._envs[k, n_episodes] = env
        return self._envs[k, n_episodes]


class EndlessEpisodes:
    """Environments that continue after the end of an episode, for studies of a fixed length."""

    def __init__(self, env: Shards) -> None:
        self.env = env
        self.terminated: Bools = np.zeros(env.bounds[-1], np.bool_)
        """Mask (B,) of the environments in which the last step completed an episode."""

    def reset(self, seeds: Sequence[int]) -> Observation:
        """Begin an episode for every seed and return the observation."""
        rngs = [seeding.np_random(seed)[0] for seed in seeds]
        return self.env.reset(np.arange(len(seeds)), rngs).observation

    def step(self, action: Any) -> tuple[Observation, Floats, Bools, Bools, Info]:
        """Step every environment without ending any episode."""
        shape = len(self.terminated), self.env.first.n_actions
        result = self.env.step(check_action(action, shape, self.env.first.control))
        self.terminated, never = result.terminated, np.zeros_like(result.terminated)
        return result.observation, result.reward, never, never, result.info
