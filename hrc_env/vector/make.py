"""Making of vector environments: one batch, or at level "pixels" a process for each environment."""

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
from hrc_env.vector.options import options_of_each

PROCESSES_PER_CORE = 2
"""More processes that render and run networks only wait for each other."""
REFUSING = ("check_options", "set_options", "set_reward")
"""Methods of `HRCEnv` that refuse arguments."""


def without_refusal(results: Iterable[Any]) -> tuple[Any, ...]:
    """Return results of `HRCEnv.attempt`; raise the first error among them."""
    told = tuple(results)
    for each in told:
        if isinstance(each, ConfigError):
            raise each
    return told


class PixelVectorEnv(HasSpec, AsyncVectorEnv):  # type: ignore[misc]  # `spec` is a property
    """Environments at level "pixels", a process for each.

    Errors of options and rewards are raised here, and processes go on.
    """

    def reset_async(self, seed: int | list[int | None] | None = None, options: Any = None) -> None:
        """Ask for resets, each environment's with options of its own, as of `HRCVectorEnv`."""
        given = named_options(options, "reset_mask", "each")
        mask = {name: given.pop(name) for name in ("reset_mask",) if name in given}
        if given:
            each = options_of_each(given, self.num_envs)
            chosen = mask.get("reset_mask", [True] * self.num_envs)
            asked = zip(each, chosen, strict=True)
            self._offer([of_one if goes else {} for of_one, goes in asked])
        super().reset_async(seed, mask or None)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix something of all episodes to come, as `HRCVectorEnv.set_options` does."""
        self.set_attr("options", options_of_each(lasting_options(options, "each"), self.num_envs))

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every environment, "options" among them.

        Args:
            name: of the attribute.
            values: one for all environments, or a list or tuple of one for each.

        Raises:
            ConfigError: options that cannot be; they are then as they were in every environment.
        """
        if name == "options":
            each = values if isinstance(values, (list, tuple)) else [values] * self.num_envs
            self._offer([lasting_options(of_one) for of_one in each], lasting=True)
            super().set_attr("next_options", None)
        super().set_attr(name, values)

    def call_async(self, name: str, /, *args: Any, **kwargs: Any) -> None:
        """Start a call of every environment; `call_wait` raises their errors."""
        attempt = ("attempt",) if name in REFUSING else ()
        super().call_async(*attempt, name, *args, **kwargs)

    def call_wait(self, timeout: float | None = None) -> tuple[Any, ...]:
        """Return the results of calls.

        Args:
            timeout: after which it is a `TimeoutError` [s]; None: none.

        Raises:
            ConfigError: an environment refuses the arguments.
        """
        return without_refusal(super().call_wait(timeout))

    def words(self, infos: Mapping[str, Any]) -> dict[str, NDArray[np.object_]]:
        """Return in words what infos say, as `HRCVectorEnv.words` does."""
        return words_of_infos(infos, self.num_envs, self.get_attr("body_names")[0])

    def _offer(self, each: Sequence[Mapping[str, Any]], lasting: bool = False) -> None:
        """Give every environment options of its next reset, and take them back if one cannot have
        them."""
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
        num_envs: how many environments step together.
        perception: as of `HRCEnv`.
        force: with "pixels" allow more processes than two for each core.
        kwargs: of `HRCVectorEnv`; no `num_threads` with "pixels".

    Returns:
        An `HRCVectorEnv`; for "pixels" gymnasium's `AsyncVectorEnv`, a process an environment.

    Raises:
        ConfigError: a value that is not valid, or more processes than make sense.
    """
    if perception != "pixels":
        if kwargs.get("render_mode") != "human":
            return HRCVectorEnv(num_envs, perception=perception, **kwargs)
        drawn = {**kwargs, "render_mode": "rgb_array"}
        return HumanRendering(HRCVectorEnv(num_envs, perception=perception, **drawn))
    limit = PROCESSES_PER_CORE * n_cores()
    if num_envs > limit and not force:
        raise ConfigError(
            f'num_envs={num_envs} with perception="pixels" are as many processes, each with a '
            f"renderer and a network; on {n_cores()} cores no more than {limit} make sense. "
            'Use perception="keypoints", which emulates the detector and steps thousands of '
            "environments in one process, or force=True."
        )
    if kwargs.pop("num_threads", None) is not None:
        raise ConfigError('perception="pixels" is processes, not threads: leave out num_threads.')
    mode = kwargs.pop("autoreset_mode", AutoresetMode.NEXT_STEP)
    task = find_task(kwargs.pop("task", DEFAULT))
    if TASKS.name_of(task) is None:  # not registered: it is pickled
        kwargs = {"max_episode_steps": task.max_episode_steps, **kwargs, "task": task}
    task_id = TASKS.name_of(task) or DEFAULT
    make = partial(gymnasium.make, f"hrc_env:{task_id}", perception="pixels", **kwargs)
    return PixelVectorEnv([make] * num_envs, context="spawn", autoreset_mode=mode)
