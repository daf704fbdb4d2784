"""Construction of vector environments: one batch, or for "pixels" one process per environment."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import HumanRendering
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores
from hrc_env.registration import HasSpec
from hrc_env.reset_options import ResetOptions, lasting_options, named_options
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import TASKS, find_task
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.vector.infos import words_of_infos
from hrc_env.vector.options import split_options

PROCESSES_PER_CORE = 2
"""Maximum number of processes per core; a greater number does not increase the throughput of
renderers and networks."""
REFUSING = ("check_options", "set_options", "set_reward")
"""Methods of `HRCEnv` that raise errors for invalid arguments."""


def raise_first_error(results: Iterable[Any]) -> tuple[Any, ...]:
    """Return the results of `HRCEnv.attempt`, or raise the first error among them."""
    values = tuple(results)
    for value in values:
        if isinstance(value, ConfigError):
            raise value
    return values


class PixelVectorEnv(HasSpec, AsyncVectorEnv):  # type: ignore[misc]  # `spec` is a property
    """Vector environment at perception level "pixels", with one process per environment.

    Errors in options and reward weights are raised in the calling process, and the environments
    remain usable.
    """

    def reset_async(self, seed: int | list[int | None] | None = None, options: Any = None) -> None:
        """Start resets with the arguments of `HRCVectorEnv.reset`."""
        given = named_options(options, "reset_mask", "each")
        mask = {name: given.pop(name) for name in ("reset_mask",) if name in given}
        if given:
            each = split_options(given, self.num_envs)
            chosen = mask.get("reset_mask", [True] * self.num_envs)
            pairs = zip(each, chosen, strict=True)
            self._set_next_options([of_env if is_reset else {} for of_env, is_reset in pairs])
        super().reset_async(seed, mask or None)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix parts of all future episodes, as `HRCVectorEnv.set_options` does."""
        self.set_attr("options", split_options(lasting_options(options, "each"), self.num_envs))

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every environment, which may be "options".

        Args:
            name: name of the attribute.
            values: a value for all environments, or a list or tuple with one for each.

        Raises:
            ConfigError: an option is invalid; in that case no environment's options are changed.
        """
        if name == "options":
            each = values if isinstance(values, (list, tuple)) else [values] * self.num_envs
            self._set_next_options([lasting_options(of_env) for of_env in each], lasting=True)
            super().set_attr("next_options", None)
        super().set_attr(name, values)

    def call_async(self, name: str, /, *args: Any, **kwargs: Any) -> None:
        """Start a method call in every environment; `call_wait` raises its errors."""
        attempt = ("attempt",) if name in REFUSING else ()
        super().call_async(*attempt, name, *args, **kwargs)

    def call_wait(self, timeout: float | None = None) -> tuple[Any, ...]:
        """Return the results of the calls started by `call_async`.

        Args:
            timeout: time after which `TimeoutError` is raised [s]; None for no limit.

        Raises:
            ConfigError: an environment rejects the arguments.
        """
        return raise_first_error(super().call_wait(timeout))

    def words(self, infos: Mapping[str, Any]) -> dict[str, NDArray[np.object_]]:
        """Convert indices in infos to names, as `HRCVectorEnv.words` does."""
        return words_of_infos(infos, self.num_envs, self.get_attr("body_names")[0])

    def _set_next_options(self, each: Sequence[Mapping[str, Any]], lasting: bool = False) -> None:
        """Set the options of the next reset of each environment; if any is invalid, set none.

        Args:
            each: options for each environment.
            lasting: whether the options apply to all future resets.
        """
        super().set_attr("next_options", list(each))
        try:
            self.call("check_options", lasting=lasting)
        except ConfigError:
            super().set_attr("next_options", None)
            raise


def make_vector(
    num_envs: int = 1, *, perception: str = "pixels", force: bool = False, **kwargs: Any
) -> VectorEnv[Any, Any, Any]:
    """Make a vector environment at any perception level, as `gymnasium.make_vec` does.

    Args:
        num_envs: number of environments.
        perception: perception level, as for `HRCEnv`.
        force: whether more than `PROCESSES_PER_CORE` processes per core are permitted with
            "pixels".
        kwargs: arguments of `HRCVectorEnv`; "pixels" does not accept `num_threads`.

    Returns:
        An `HRCVectorEnv`; for "pixels", gymnasium's `AsyncVectorEnv` with one process per
        environment.

    Raises:
        ConfigError: a value is invalid, or there are too many processes.
    """
    if perception != "pixels":
        if kwargs.get("render_mode") != "human":
            return HRCVectorEnv(num_envs, perception=perception, **kwargs)
        drawn = {**kwargs, "render_mode": "rgb_array"}
        return HumanRendering(HRCVectorEnv(num_envs, perception=perception, **drawn))
    limit = PROCESSES_PER_CORE * n_cores()
    if num_envs > limit and not force:
        raise ConfigError(
            f'num_envs={num_envs} with perception="pixels" creates as many processes, each with a '
            f"renderer and a network; on {n_cores()} cores, at most {limit} are useful. Use "
            'perception="keypoints", which emulates the detector and steps thousands of '
            "environments in one process, or force=True."
        )
    if kwargs.pop("num_threads", None) is not None:
        raise ConfigError(
            'perception="pixels" uses processes instead of threads: leave out num_threads.'
        )
    mode = kwargs.pop("autoreset_mode", AutoresetMode.NEXT_STEP)
    task = find_task(kwargs.pop("task", DEFAULT))
    if TASKS.name_of(task) is None:  # not registered: it is pickled
        kwargs = {"max_episode_steps": task.max_episode_steps, **kwargs, "task": task}
    task_id = TASKS.name_of(task) or DEFAULT
    make = partial(gymnasium.make, f"hrc_env:{task_id}", perception="pixels", **kwargs)
    return PixelVectorEnv([make] * num_envs, context="spawn", autoreset_mode=mode)
