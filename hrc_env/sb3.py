"""For Stable-Baselines3: the vector environment as a `VecEnv`.

from hrc_env.sb3 import HRCVecEnv
PPO("MlpPolicy", HRCVecEnv(64, stagger=True, perception="keypoints"))
"""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, learner
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.rewards import RewardConfig
from hrc_env.safety.incidents import KINDS
from hrc_env.simulation import Simulation
from hrc_env.step import Observation
from hrc_env.tasks.goal import TERM
from hrc_env.vector.env import HRCVectorEnv

with learner():
    from stable_baselines3.common.vec_env import VecEnv

COSTS = ("cost", "cost_proximity", "cost_contact")
"""Infos whose sums over an episode are kept."""
SO_FAR = np.dtype(
    [(name, "f8") for name in ("steps", "reward", *COSTS, "contacts", "touching", "nearest_m")]
)
"""What an episode has come to so far; a long touch is one contact."""
ACHIEVED, FAILED = "goals_reached", "goals_missed"
"""What an episode's statistics call the attempts of every task (`Task.achieved`, `Task.failed`)."""


class HRCVecEnv(VecEnv):
    """An `HRCVectorEnv` as SB3 expects environments, with episode statistics.

    Environment k of `seed(s)` and then `reset()` is the single environment after
    `reset(seed=s + k)`. The info of a step holds its "cost" only (with goals also the rest of the
    reward, for HER with `copy_info_dict`), but where an episode ended the whole, with
    "terminal_observation", "TimeLimit.truncated" and the statistics, "episode".

    Args:
        stagger: after a `seed()`, let each environment's first episode end early at a random
            time, so that a short rollout sees all phases of an episode. Not for evaluation.
        seed: of the first reset.
        kwargs: as of `HRCVectorEnv`.
    """

    def __init__(
        self, num_envs: int, *, stagger: bool = False, seed: int = 0, **kwargs: Any
    ) -> None:
        self.env = HRCVectorEnv(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **kwargs)
        space, actions = self.env.single_observation_space, self.env.single_action_space
        super().__init__(num_envs, space, actions)
        self.metadata = self.env.metadata
        self.stagger, self.started_s = stagger, time.time()
        self.seed(seed)
        self.costs: Floats = np.zeros(num_envs)
        """(num_envs,) the cost of the last step; 0 after a reset."""
        self._action = np.zeros((num_envs, *(actions.shape or ())), np.float32)
        self._so_far = np.zeros(num_envs, SO_FAR)

    @property
    def simulation(self) -> Simulation:
        """The environments' simulation; of several, the first."""
        return self.env.shards.first

    def seed(self, seed: int | None = None) -> list[int | None]:  # type: ignore[override]
        """Seed environment k with seed + k at the next reset; None draws a seed."""
        seeds = list(super().seed(seed))
        self._phases = np.random.default_rng(seeds[0]) if self.stagger else None
        return seeds

    def set_options(self, options: Any = None) -> None:
        """Not supported: environments take their settings when they are made."""
        if options:
            raise ConfigError(f"HRCVecEnv takes no options, got {options}; use its arguments.")

    def reset(self) -> Observation:  # type: ignore[override]
        """Start every environment: from its seed the first time, then on with its stream."""
        options = None
        if self._phases is not None:
            elapsed = self._phases.integers(self.env.max_episode_steps, size=self.num_envs)
            options, self._phases = {"elapsed_steps": elapsed}, None
        seeds = None if None in self._seeds else self._seeds
        observation, infos = self.env.reset(seed=seeds, options=options)
        self._reset_seeds()
        self.costs = np.zeros(self.num_envs)
        self._begin(np.arange(self.num_envs))
        self.reset_infos = [_info_of(infos, b) for b in range(self.num_envs)]
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._action = actions

    def step_wait(
        self,
    ) -> tuple[Observation, NDArray[np.float32], Bools, list[dict[str, Any]]]:
        """Step everyone; whoever is done starts anew, as SB3 expects."""
        observation, reward, terminated, truncated, fresh = self.env.step(self._action)
        self._count(reward, fresh)
        done = terminated | truncated
        infos = self._infos(fresh)
        ended = np.flatnonzero(done)
        for b in ended.tolist():
            infos[b] = _info_of(fresh["final_info"], b)
            infos[b]["terminal_observation"] = fresh["final_obs"][b]
            infos[b]["TimeLimit.truncated"] = bool(truncated[b] and not terminated[b])
            infos[b]["episode"] = self._episode(b, infos[b])
            self.reset_infos[b] = _info_of(fresh, b)
        self._begin(ended)
        return observation, reward.astype(np.float32), done, infos

    def _infos(self, fresh: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Of every step: its cost, and what `compute_reward` adds to a goal's term."""
        columns = {"cost": self.costs}
        for term in self.simulation.task.reward_terms if self.simulation.task.goal else ():
            if term.name != TERM:
                name = f"reward/{term.name}"
                columns[name] = of_step(fresh, name, self.num_envs)
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in values]

    def set_reward(self, weights: RewardConfig) -> None:
        """Weigh the reward's terms so from the next step on, in every environment."""
        self.env.set_reward(weights)

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.env.close()

    def get_images(self) -> list[NDArray[np.uint8]]:
        """A picture of every environment."""
        return list(self.env.render() or ())

    def _begin(self, ids: Ints) -> None:
        self._so_far[ids] = np.zeros(1, SO_FAR)
        self._so_far["nearest_m"][ids] = np.inf

    def _count(self, reward: Floats, infos: Mapping[str, Any]) -> None:
        now = self._so_far
        now["steps"] += 1
        now["reward"] += reward
        costs = {name: of_step(infos, name, self.num_envs) for name in COSTS}
        for name, cost in costs.items():
            now[name] += cost
        self.costs, touching = costs["cost"], costs["cost_contact"] > 0
        now["contacts"] += touching > now["touching"]
        now["touching"] = touching
        separation_m = of_step(infos, "safety/min_separation_m", self.num_envs)
        now["nearest_m"] = np.fmin(now["nearest_m"], separation_m)

    def _episode(self, b: int, info: Mapping[str, Any]) -> dict[str, float]:
        """Statistics of an episode under the names of SB3's Monitor, and ours."""
        task, episode = self.simulation.task, self._so_far[b]
        return {
            "r": float(episode["reward"]),
            "l": int(episode["steps"]),
            "seconds": float(episode["steps"] * self.env.config.ctrl_dt),
            "t": time.time() - self.started_s,
            "cost": float(episode["cost"]),
            "cost_steps": float(episode["cost_proximity"]),
            "contacts": float(episode["contacts"]),
            **{f"contacts_{kind}": info[f"safety/contacts_{kind}"] for kind in KINDS},
            ACHIEVED: info[task.achieved],
            FAILED: info[task.failed],
            "success": float(info["is_success"]),
            "min_separation_m": float(episode["nearest_m"]),
        }

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the vector environment, the same for everyone."""
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not supported: the environments are one object."""
        raise ConfigError(f"HRCVecEnv cannot set {attr_name!r} on single environments.")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        """What HER asks for: "compute_reward" of goals and infos, the same for everyone. No other
        method: the environments are one object.

        Raises:
            NoGoalError: the task has no goals apart from its observation.
        """
        if method_name == "compute_reward":
            reward = self.env.compute_reward(*args, **kwargs)
            return [reward] * len(list(self._get_indices(indices)))
        raise ConfigError(f"HRCVecEnv cannot call {method_name!r} on single environments.")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No environment is wrapped."""
        return [False] * len(list(self._get_indices(indices)))


def of_step(infos: Mapping[str, Any], name: str, num_envs: int) -> Floats:
    """(B,) a value of the step itself, also where the episode ended with it; else NaN."""
    value = np.full(num_envs, np.nan)
    for part in (infos, infos.get("final_info", {})):
        if name in part:
            known = part[f"_{name}"]
            value[known] = part[name][known]
    return value


def _info_of(infos: Mapping[str, Any], b: int) -> dict[str, Any]:
    """What a vector environment's infos say about environment `b`."""
    return {name: infos[name][b] for name in infos if not name.startswith(("_", "final_"))}
