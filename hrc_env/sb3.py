"""The vector environment as a `VecEnv` of Stable-Baselines3.

from hrc_env import HRCVecEnv
PPO("MlpPolicy", HRCVecEnv(64, stagger=True, perception="keypoints"))
"""

import time
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import OrderEnforcing, TimeLimit
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, check_integer, check_shape, learner
from hrc_env.core.typing import Bools, Floats
from hrc_env.env import ENDLESS
from hrc_env.env_config import check_keywords
from hrc_env.evaluation.sums import EpisodeSums, read_step_value
from hrc_env.reset_options import named_options
from hrc_env.rewards import RewardConfig
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.tasks.goal import TERM
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.vector.infos import choose_infos
from hrc_env.vector.make import REFUSING, raise_first_error
from hrc_env.vector.member import TOGETHER, Member, info_of
from hrc_env.vector.options import ALONE, count_elapsed_steps

with learner():
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

REPLACED = (Monitor, OrderEnforcing)
"""Wrappers of a single environment that `HRCVecEnv` replaces, in addition to `TimeLimit`."""


class HRCVecEnv(VecEnv):
    """An `HRCVectorEnv` with the interface of SB3's `VecEnv` and the statistics of `Monitor`.

    After `seed(s)` and `reset()`, environment k is in the same state as the single environment
    after `reset(seed=s + k)`.

    The info of a step contains only "cost" and, if the task has goals, the terms of the reward that
    do not depend on the goal, for HER with `copy_info_dict`. At the end of an episode it contains
    all infos, "terminal_observation", "TimeLimit.truncated" and the statistics "episode"; therefore
    no `Monitor` is needed. `infos=` adds infos to every step, for example for wrappers that shape
    the reward. Infos "reward/..." are computed from the belief; "cost", "safety/...",
    "tracking/..." and "worker_N/..." are computed from the truth, which is unavailable to robots
    (docs/reference/infos.md). `hrc_env.vector.member.Member` describes the attributes and methods
    of one environment.

    Args:
        num_envs: number of environments.
        stagger: whether the first episode of each environment after `seed()` ends early, at a
            random time, so that a short rollout covers all phases of an episode. Do not use this
            for evaluation.
        seed: seed of the first reset.
        infos: names of infos to include in every step, or patterns such as "safety/*".
        kwargs: arguments of `HRCVectorEnv`.

    Raises:
        ConfigError: no info matches a pattern, or an argument is invalid.
    """

    def __init__(
        self,
        num_envs: int,
        *,
        stagger: bool = False,
        seed: int = 0,
        infos: str | Sequence[str] = (),
        **kwargs: Any,
    ) -> None:
        check_keywords(HRCVecEnv, kwargs, HRCVectorEnv)
        self.info_names = choose_infos(infos, kwargs)
        """Names of the infos that every step includes."""
        self.env = HRCVectorEnv(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **kwargs)
        space, actions = self.env.single_observation_space, self.env.single_action_space
        self._past: list[list[Past]] = [[] for _ in range(num_envs)]
        self._n_steps = np.zeros(num_envs, int)
        super().__init__(num_envs, space, actions)
        self.metadata = self._member(0).metadata
        self.stagger, self.started_s = stagger, time.time()
        self.seed(seed)
        self.costs: Floats = np.zeros(num_envs)
        """(num_envs,) cost of the last step [control steps]; 0 after a reset."""
        self._action = np.zeros((num_envs, *(actions.shape or ())), np.float32)
        self._sums = EpisodeSums(num_envs)

    @property
    def simulation(self) -> Simulation:
        """Simulation of the environments; the first one if they are distributed over several."""
        return self.env.shards.first

    @property
    def spec(self) -> EnvSpec | None:
        """Specification of one environment for `gymnasium.make`; None for an unregistered task."""
        return self._member(0).spec

    def seed(self, seed: int | None = None) -> list[int | None]:  # type: ignore[override]
        """Set the seed of environment k at the next reset to seed + k; None samples a seed."""
        seeds = list(super().seed(seed))
        self._phases = np.random.default_rng(seeds[0]) if self.stagger else None
        return seeds

    def set_options(self, options: Any = None) -> None:
        """Set the options of the next reset.

        `env_method("set_options", options)` sets the options of all future resets.

        Args:
            options: options of one environment, as for `HRCVectorEnv.reset`: a mapping for all
                environments, or a list with one for each.

        Raises:
            ConfigError: an option is unknown or invalid, or the list has the wrong length.
        """
        each = _one_each(options, self.num_envs)
        for k, one in enumerate(each):
            self.env.check_options(k, one)
        super().set_options([dict(named_options(one, *ALONE)) for one in each])

    def reset(self) -> Observation:  # type: ignore[override]
        """Start an episode of every environment, with new seeds if `seed` was called before."""
        limit = self.env.max_episode_steps
        elapsed = np.zeros(self.num_envs, int)
        if self._phases is not None:
            elapsed, self._phases = self._phases.integers(limit, size=self.num_envs), None
        each = [dict(options or {}) for options in self._options]
        for k, options in enumerate(each):
            steps = {name: options.pop(name) for name in ALONE if name in options}
            elapsed[k] = count_elapsed_steps(steps, limit) if steps else elapsed[k]
        given = {"each": each} if any(each) else {}
        options = {"elapsed_steps": elapsed, **given}
        observation, infos = self.env.reset(seed=self._seeds, options=options)
        self._reset_seeds()
        self._reset_options()
        self.costs = np.zeros(self.num_envs)
        self._sums.begin(np.arange(self.num_envs))
        self.reset_infos = [info_of(infos, b) for b in range(self.num_envs)]
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Store the actions for `step_wait`."""
        self._action = actions

    def step_wait(
        self,
    ) -> tuple[Observation, NDArray[np.float32], Bools, list[dict[str, Any]]]:
        """Advance every environment by one control step, and reset those with an ended episode."""
        observation, reward, terminated, truncated, fresh = self.env.step(self._action)
        self._n_steps += 1
        self.costs = self._sums.add(reward, fresh)
        done = terminated | truncated
        infos = self._infos(fresh)
        ended = np.flatnonzero(done)
        for b in ended.tolist():
            infos[b] = info_of(fresh["final_info"], b)
            infos[b]["terminal_observation"] = fresh["final_obs"][b]
            infos[b]["TimeLimit.truncated"] = bool(truncated[b] and not terminated[b])
            infos[b]["episode"] = episode = self._episode(b, infos[b])
            self._past[b].append(Past(episode["r"], int(episode["l"]), episode["t"]))
            self.reset_infos[b] = info_of(fresh, b)
        self._sums.begin(ended)
        return observation, reward.astype(np.float32), done, infos

    def _infos(self, fresh: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the infos of a step: cost, reward terms except the goal's, and chosen infos."""
        columns = {"cost": self.costs}
        for term in self.simulation.task.reward_terms if self.simulation.task.goal else ():
            if term.name != TERM:
                name = f"reward/{term.name}"
                columns[name] = read_step_value(fresh, name, self.num_envs)
        columns |= {name: fresh[name] for name in self.info_names if name not in columns}
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in values]

    def set_reward(
        self, weights: RewardConfig | None = None, factors: Mapping[str, float] | None = None
    ) -> None:
        """Set the weights of the reward's terms in all environments, like `HRCEnv.set_reward`."""
        self.env.set_reward(weights, factors)

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.env.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Return a picture of every environment.

        If the render mode is not "rgb_array", issue a warning and return None for each environment.
        """
        if self.render_mode != "rgb_array":
            warnings.warn(
                f"Images require render_mode='rgb_array', but this one is {self.render_mode!r}.",
                stacklevel=2,
            )
            return [None] * self.num_envs
        return list(self.env.render() or ())

    def _episode(self, b: int, info: Mapping[str, Any]) -> dict[str, float]:
        """Return the statistics of an episode, with the names that SB3's `Monitor` uses."""
        task, dt_s = self.simulation.task, self.env.config.ctrl_dt
        episode = self._sums.summarize(b, info, task, dt_s)
        return {**episode, "t": time.time() - self.started_s}

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return the values of an attribute in the chosen environments."""
        return [getattr(self._member(k), attr_name) for k in self._choose(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set `np_random` or a custom attribute; raise `ConfigError` for a setting."""
        for k in self._choose(indices):
            setattr(self._member(k), attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of each chosen environment and return the results.

        Raises:
            NoAttributeError: there is no such method.
            ConfigError: the method can be called only for all environments together.
        """
        chosen = self._choose(indices)
        if method_name not in TOGETHER:
            methods = [getattr(self._member(k), method_name) for k in chosen]
            return [method(*method_args, **method_kwargs) for method in methods]
        if set(chosen) != set(range(self.num_envs)):
            raise ConfigError(
                f"{method_name}() applies to all environments together: leave out "
                f"indices={indices}."
            )
        return [getattr(self.env, method_name)(*method_args, **method_kwargs)] * len(chosen)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return for each chosen environment whether this class replaces a wrapper."""
        limited = self.env.max_episode_steps != ENDLESS
        done = (*REPLACED, TimeLimit) if limited else REPLACED
        wrapped = any(issubclass(each, wrapper_class) for each in done)
        return [wrapped] * len(self._choose(indices))

    def _choose(self, indices: Any) -> list[int]:
        """Return the indices of the chosen environments; negative indices count from the end."""
        n = self.num_envs
        return [check_integer("indices", k, -n, n - 1) % n for k in self._get_indices(indices)]

    def _member(self, k: int) -> "MonitoredMember":
        """Return a handle of environment `k`."""
        return MonitoredMember(self, k)

    def past_of(self, k: int) -> list["Past"]:
        """Return the finished episodes of environment `k`."""
        return self._past[k]

    def count_steps(self, k: int) -> int:
        """Return the number of steps of environment `k` since it was made."""
        return int(self._n_steps[k])

    def begin_alone(self, k: int, info: dict[str, Any]) -> None:
        """Restart the statistics of environment `k` after it was reset individually."""
        self._sums.begin(np.array([k]))
        self.costs = np.where(np.arange(self.num_envs) == k, 0.0, self.costs)
        self.reset_infos[k] = info


class HRCSubprocVecEnv(SubprocVecEnv):
    """SB3's `SubprocVecEnv`, in which an error in options does not end a subprocess.

    PPO("MlpPolicy", make_vec_env("HRCReach-v0", 4, env_kwargs={"perception": "pixels"},
        vec_env_cls=HRCSubprocVecEnv))

    It is intended for perception="pixels", which cannot be batched; `HRCVecEnv` is faster at other
    levels. With SB3's class, an error in options ends the environment's subprocess and appears as
    an `EOFError`; here the error itself is raised.
    """

    def set_options(self, options: Any = None) -> None:
        """Set the options of the next reset.

        `env_method("set_options", options)` sets the options of all future resets.

        Args:
            options: options of one environment: a mapping for all environments, or a list with one
                for each.

        Raises:
            ConfigError: an option is invalid, or the list has the wrong length.
        """
        each = [named_options(one) for one in _one_each(options, self.num_envs)]
        for k, one in enumerate(each):
            self.env_method("check_options", one, indices=k)
        super().set_options(each)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of the outermost wrapper, like SB3 does.

        Args:
            attr_name: name of the attribute; "options", for all future resets, is set in the
                environment itself.
            value: value of the attribute.
            indices: indices of the environments; None for all.
        """
        if attr_name == "options":
            self.env_method("set_options", value, indices=indices)
        else:
            super().set_attr(attr_name, value, indices)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of each environment and return the results.

        Raises:
            ConfigError: an environment rejects the arguments.
        """
        attempt = ("attempt",) if method_name in REFUSING else ()
        name, *args = *attempt, method_name, *method_args
        return [
            *raise_first_error(super().env_method(name, *args, indices=indices, **method_kwargs))
        ]


def _one_each(options: Any, num_envs: int) -> Sequence[Any]:
    """Return a list with the options of each environment, given a common mapping or such a list."""
    each = options if isinstance(options, (list, tuple)) else [options] * num_envs
    check_shape("options", (len(each),), (num_envs,), "one mapping per environment")
    return each


class Past(NamedTuple):
    """Statistics of a finished episode, equivalent to those of SB3's `Monitor`."""

    reward: float
    """Return of the episode."""
    length: int
    """Length of the episode [control steps]."""
    since_start_s: float
    """Wall-clock time between making the environments and the end of the episode [s]."""


class MonitoredMember(Member):
    """Environment `k` of an `HRCVecEnv`, with the statistics of a `Monitor`.

    Args:
        many: the environments.
        k: index of the environment.
    """

    def __init__(self, many: HRCVecEnv, k: int) -> None:
        super().__init__(many.env, k)
        self.__dict__["_many"] = many

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode of this environment, and restart its statistics."""
        observation, info = super().reset(seed=seed, options=options)
        self._many.begin_alone(self._k, info)
        return observation, info

    def get_total_steps(self) -> int:
        """Return the number of steps since the environment was made."""
        return self._many.count_steps(self._k)

    def get_episode_rewards(self) -> list[float]:
        """Return the sums of rewards of the finished episodes."""
        return [each.reward for each in self._many.past_of(self._k)]

    def get_episode_lengths(self) -> list[int]:
        """Return the lengths of the finished episodes [steps]."""
        return [each.length for each in self._many.past_of(self._k)]

    def get_episode_times(self) -> list[float]:
        """Return the end times of the finished episodes, since the environments were made [s]."""
        return [each.since_start_s for each in self._many.past_of(self._k)]
