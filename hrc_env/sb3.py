"""Stable-Baselines3 door: many environments as one `VecEnv`, without per-environment Python.

from hrc_env.sb3 import HRCVecEnv
PPO("MlpPolicy", HRCVecEnv(64, perception="keypoints"))
"""

import time
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from hrc_env.config import HRCConfig, resolve
from hrc_env.errors import ConfigError
from hrc_env.simulation import Simulation, checked_action
from hrc_env.typing import Bools, Floats, Ints

EPISODE_SUMS = ("cost", "cost_proximity", "cost_contact")


class HRCVecEnv(VecEnv):
    """`num_envs` environments in one simulation, with time limits and episode statistics.

    Environment k of `seed(s)` and then `reset()` is `HRCReach-v0` after `reset(seed=s + k)`;
    what follows the end of an episode continues its random stream.

    Args:
        num_envs: how many.
        max_episode_steps: the time limit, told from failures by "TimeLimit.truncated".
        stagger: let the first episode of each environment end early at a random time, so
            that a short rollout sees all phases of an episode and not one.
        n_threads: threads for the physics.
        perception, estimator, cameras, scene, n_workers, control, config: as `HRCReachEnv`.
    """

    def __init__(
        self,
        num_envs: int,
        *,
        perception: str = "keypoints",
        estimator: str = "particle",
        cameras: Sequence[int | str] | None = None,
        scene: str = "lab",
        n_workers: int = 1,
        control: str = "joint",
        config: HRCConfig | Mapping[str, Any] | None = None,
        max_episode_steps: int = 250,
        stagger: bool = True,
        n_threads: int = 1,
        seed: int = 0,
    ) -> None:
        if num_envs < 1:
            raise ConfigError(f"num_envs must be at least 1, got {num_envs}.")
        self.simulation = Simulation(
            num_envs, perception, estimator, cameras, scene, n_workers, control,
            resolve(config), n_threads,
        )  # fmt: skip
        where = self.simulation.layout
        super().__init__(
            num_envs,
            gymnasium.spaces.Box(where.low, where.high, dtype=np.float32),
            gymnasium.spaces.Box(-1.0, 1.0, (self.simulation.n_actions,), np.float32),
        )
        self.max_episode_steps, self.stagger = max_episode_steps, stagger
        self.started_s = time.time()
        self.first_seed, self._reseed = seed, True
        self._action = np.zeros((num_envs, self.simulation.n_actions))
        self._sums = {name: np.zeros(num_envs) for name in ("reward", "contacts", *EPISODE_SUMS)}
        self._touching = np.zeros(num_envs, bool)
        self._nearest_m = np.full(num_envs, np.inf)
        self._steps, self._limit = np.zeros(num_envs, int), np.full(num_envs, max_episode_steps)

    def seed(self, seed: int | None = None) -> list[int | None]:  # type: ignore[override]
        """Seed environment k with seed + k at the next reset."""
        self.first_seed = self.first_seed if seed is None else seed
        self._reseed = True
        return [self.first_seed + k for k in range(self.num_envs)]

    def reset(self) -> NDArray[np.float32]:
        """Start every environment: from its seed the first time, then on with its stream."""
        everyone = np.arange(self.num_envs)
        if self._reseed:
            self.rngs = [np.random.default_rng(self.first_seed + k) for k in everyone]
            self._reseed = False
        self._begin(everyone)
        self._limit[:] = self.max_episode_steps
        if self.stagger:
            rng = np.random.default_rng(self.first_seed)
            self._limit[:] = rng.integers(1, self.max_episode_steps + 1, self.num_envs)
        return self.simulation.reset(everyone, self.rngs).observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for `step_wait`.

        Raises:
            ConfigError: they are not finite or not (num_envs, actions).
        """
        self._action = checked_action(actions, (self.num_envs, self.simulation.n_actions))

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], Bools, list[dict[str, Any]]]:
        """Step everyone; whoever is done starts anew, as SB3 expects."""
        outcome = self.simulation.step(self._action)
        self._count(outcome.reward, outcome.info)
        truncated = (self._steps >= self._limit) & ~outcome.terminated
        done = outcome.terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        observation, ended = outcome.observation, np.flatnonzero(done)
        for b in ended.tolist():
            infos[b] = outcome.info_of(b)
            infos[b]["terminal_observation"] = observation[b].copy()
            infos[b]["TimeLimit.truncated"] = bool(truncated[b])
            infos[b]["episode"] = self._episode(b, infos[b])
        if len(ended):
            self._begin(ended)
            fresh = self.simulation.reset(ended, [self.rngs[b] for b in ended])
            observation[ended] = fresh.observation
        return observation, outcome.reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.simulation.close()

    def _begin(self, ids: Ints) -> None:
        for total in self._sums.values():
            total[ids] = 0.0
        self._steps[ids], self._touching[ids], self._nearest_m[ids] = 0, False, np.inf
        self._limit[ids] = self.max_episode_steps

    def _count(self, reward: Floats, info: Mapping[str, Floats]) -> None:
        touching = info["cost_contact"] > 0
        self._steps += 1
        self._sums["reward"] += reward
        self._sums["contacts"] += touching & ~self._touching  # a long touch is one contact
        for name in EPISODE_SUMS:
            self._sums[name] += info[name]
        self._touching = touching
        self._nearest_m = np.fmin(self._nearest_m, info["safety/min_separation_m"])

    def _episode(self, b: int, info: Mapping[str, Any]) -> dict[str, float]:
        """Statistics of an episode under the names of SB3's Monitor, and ours."""
        return {
            "r": float(self._sums["reward"][b]),
            "l": int(self._steps[b]),
            "seconds": float(self._steps[b] * self.simulation.config.ctrl_dt),
            "t": time.time() - self.started_s,
            "cost": float(self._sums["cost"][b]),
            "cost_steps": float(self._sums["cost_proximity"][b]),
            "contacts": float(self._sums["contacts"][b]),
            "goals_reached": info["task/goals_reached"],
            "goals_missed": info["task/goals_missed"],
            "min_separation_m": float(self._nearest_m[b]),
        }

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The same value for everyone: the environments are one object."""
        value = getattr(self, attr_name, None)
        return [value] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not supported: the environments are one object."""
        raise ConfigError(f"HRCVecEnv cannot set {attr_name!r} on single environments.")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        """Not supported: the environments are one object."""
        raise ConfigError(f"HRCVecEnv cannot call {method_name!r} on single environments.")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No environment is wrapped."""
        return [False] * len(list(self._get_indices(indices)))
