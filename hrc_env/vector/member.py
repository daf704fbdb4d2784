"""Interface of a single environment in a vector environment, like that of `HRCEnv`."""

import inspect
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from hrc_env import observations
from hrc_env.core.batching import copy_arrays, one
from hrc_env.core.errors import ConfigError, NoAttributeError, make_unknown_name_error
from hrc_env.core.infos import InfoDict
from hrc_env.core.mapping import convert_to_plain
from hrc_env.core.typing import Floats
from hrc_env.env import ENDLESS, HRCEnv
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.render.views import CameraChoice
from hrc_env.reset_options import ResetOptions
from hrc_env.step_result import Observation

if TYPE_CHECKING:
    from hrc_env.vector.env import HRCVectorEnv

ALIKE = (
    "closed",
    "compute_reward",
    "compute_terminated",
    "compute_truncated",
    "config",
    "max_episode_steps",
    "render_mode",
)
"""Names of attributes of the vector environment that are the same for every environment."""
TOGETHER = ("close", "set_reward")
"""Methods that can only be called for all environments together."""
TAKEN = {*inspect.signature(HRCEnv).parameters, *dir(HRCEnv), *ALIKE, "simulation", "views"}
"""Names of attributes and arguments of an environment, which user-defined attributes must not
have."""


class Member(gymnasium.Env[Observation, NDArray[np.float32]]):
    """Interface of environment `k` of a vector environment: attributes, pictures and resets.

    The environment can only step together with the others. The vector environment stores attributes
    that users set.

    Args:
        vector: the vector environment.
        k: index of the environment.
    """

    def __init__(self, vector: "HRCVectorEnv", k: int) -> None:
        self.__dict__.update(_vector=vector, _k=k)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode of this environment.

        Args:
            seed: seed of the environment's random stream; with None, the stream continues.
            options: options of `HRCEnv.reset`, or "elapsed_steps".
        """
        alone = np.arange(self._vector.num_envs) == self._k
        observation, infos = self._vector.reset(
            seed=[seed if each else None for each in alone],
            options={"reset_mask": alone, "each": [options if each else None for each in alone]},
        )
        return copy_arrays(one(observation, self._k)), info_of(infos, self._k)

    def step(self, action: Any) -> NoReturn:
        """Raise `ConfigError`, because environments can only step together."""
        raise ConfigError(
            f"Environment {self._k} of {self._vector} steps with the others: call step() of the "
            "vector, with an action for each."
        )

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """Calibration of this episode's cameras, as known to the estimator."""
        simulation, b = self._vector.shards.locate(self._k)
        return simulation.rig_of(b)

    @property
    def faults(self) -> tuple[FaultConfig, ...]:
        """Faults of this episode's cameras, each with its sampled severity."""
        simulation, b = self._vector.shards.locate(self._k)
        return simulation.cameras.faults_of(b)

    @property
    def options(self) -> dict[str, Any]:
        """Options of all future episodes, by name. The property can be set."""
        return self._vector.options_of(self._k)

    @options.setter
    def options(self, options: Mapping[str, Any] | ResetOptions | None) -> None:
        self.set_options(options)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix parts of all future episodes of this environment, as `HRCEnv.set_options` does."""
        self._vector.set_options_of(self._k, options)

    def render(self, camera: CameraChoice = None) -> Any:
        """Return a picture, or in list modes the pictures since the last call, of this environment.

        Args:
            camera: camera of the picture, as for `HRCEnv.render`.
        """
        self._vector.refuse_closed()
        return self._vector.pictures.of(self._k, camera)

    def mosaic(self) -> NDArray[np.uint8]:
        """Return a mosaic of the cameras' images with crops, keypoints and estimated skeletons."""
        self._vector.refuse_closed()
        return self._vector.pictures.mosaic(self._k)

    def split_observation(self, observation: Observation) -> dict[str, Floats]:
        """Return the terms of an observation by name, as `HRCEnv.split_observation` does."""
        return observations.split(observation, self._vector.shards.first.layout)

    @property
    def observation_space(self) -> Any:  # type: ignore[override]
        """Space of one environment's observations."""
        return self._vector.single_observation_space

    @property
    def action_space(self) -> Any:  # type: ignore[override]
        """Space of one environment's actions."""
        return self._vector.single_action_space

    @property
    def metadata(self) -> dict[str, Any]:  # type: ignore[override]
        """Metadata of one environment; `autoreset_mode` is not included."""
        metadata = self._vector.metadata
        return {name: value for name, value in metadata.items() if name != "autoreset_mode"}

    @property
    def render_mode(self) -> str | None:  # type: ignore[override]
        """Render mode, which is the same for all environments."""
        return self._vector.render_mode

    @property
    def spec(self) -> EnvSpec | None:  # type: ignore[override]
        """Specification for `gymnasium.make`; None for an unregistered task."""
        vector = self._vector
        known = gymnasium.registry.get(vector.task.id)
        if known is None:
            return None
        limit = None if vector.max_episode_steps == ENDLESS else vector.max_episode_steps
        kwargs = {**vector.arguments, "task": vector.task.id}
        return replace(known, max_episode_steps=limit, kwargs=convert_to_plain(kwargs))

    @property
    def np_random(self) -> np.random.Generator:
        """Random generator of the environment."""
        return self._vector.np_random[self._k]

    @np_random.setter
    def np_random(self, value: np.random.Generator) -> None:
        self._vector.set_stream(self._k, value)

    @property
    def np_random_seed(self) -> int:
        """Seed of the random generator; -1 if a user has set the generator."""
        return self._vector.np_random_seed[self._k]

    def __getattr__(self, name: str) -> Any:
        if "_vector" not in self.__dict__:  # while it is copied
            raise AttributeError(name)
        if name in ALIKE:
            return getattr(self._vector, name)
        if name not in self._vector.notes[self._k]:
            valid = [each for each in dir(self) if not each.startswith("_")]
            valid += [each for each in (*ALIKE, *TOGETHER) if each not in valid]
            raise NoAttributeError(
                str(make_unknown_name_error("attribute of a single environment", name, valid))
            )
        return self._vector.notes[self._k][name]

    def __setattr__(self, name: str, value: Any) -> None:
        if name in ("np_random", "options"):
            super().__setattr__(name, value)
        elif name in TAKEN or hasattr(type(self), name):
            raise ConfigError(
                f"{name!r} of a member of a vector environment cannot be set: settings are fixed "
                "at creation. Only `np_random`, `options` and custom attributes can be set; "
                "reset(options=...), set_options(...) and set_reward(...) change episodes and "
                "rewards."
            )
        else:
            self._vector.notes[self._k][name] = value

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *ALIKE, *self._vector.notes[self._k]})


def info_of(infos: Mapping[str, Any], b: int) -> InfoDict:
    """Return the info of environment `b` from the infos of a vector environment."""
    names = (name for name in infos if not name.startswith(("_", "final_")))
    return InfoDict({name: infos[name][b] for name in names})
