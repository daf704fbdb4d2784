"""Resolution and checks of an environment's arguments, from which a simulation is made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_type_hints

import numpy as np

from hrc_env.config import HRCConfig, resolve
from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import convert_to_hint
from hrc_env.env_config import EnvConfig
from hrc_env.geometry.camera_config import CameraConfig, parse_camera, read_rig
from hrc_env.safety.shield import Shield, find_shield
from hrc_env.scene.build import Scene
from hrc_env.scene.camera_images import ImageConfig, parse_images
from hrc_env.scene.rig_distribution import RigDistribution
from hrc_env.scene.rigs import RIGS
from hrc_env.scene.robot import DEFAULT as DEFAULT_ROBOT
from hrc_env.scene.robot import ROBOTS, Robot, find_robot
from hrc_env.tasks.check import check_parts
from hrc_env.tasks.hooks import protect_arrays
from hrc_env.tasks.task import AnyTask, find_task, is_known
from hrc_env.tracking.estimators import EstimatorSpec, find_estimator

RecordT = TypeVar("RecordT")
PARTS = {
    "people": "motion.people",
    "motions": "motion.motions",
    "faults": "faults",
    "appearance": "appearance",
}
"""Path of the field in `config` that an argument of the environment replaces, by argument."""


class WorkerCounts(NamedTuple):
    """Bounds on the number of workers in an episode."""

    fewest: int
    """Smallest number of workers."""
    most: int
    """Largest number of workers."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Checked settings of a simulation."""

    asked: EnvConfig
    """Arguments with which the environment was made."""
    task: AnyTask
    """Instance of the task, with its settings."""
    estimator: EstimatorSpec
    """Specification of the estimator."""
    cameras: Any
    """Names and indices of the scene's cameras in use; None for all."""
    scene: str
    """Name of the scene."""
    robot: Robot
    """Robot of the environment."""
    n_workers: WorkerCounts
    """Bounds on the number of workers in an episode."""
    shield: Shield | None
    """Function of the shield; None for no shield."""
    config: HRCConfig
    """Settings that are not keyword arguments of an environment."""
    images: ImageConfig | None = None
    """Settings of the camera images in the observation; None for no images."""
    rigs: RigDistribution | None = None
    """Distribution from which the rig of every episode is sampled; None if all episodes have the
    same rig."""

    def describe(self, batch: int, scene: Scene) -> dict[str, Any]:
        """Return the settings that must be equal for a state to be restored in another simulation.

        Args:
            batch: number of environments.
            scene: the scene.
        """
        fewest, most = self.n_workers
        return {
            "batch": batch,
            "task": self.task.id,
            "perception": self.asked.perception,
            "estimator": self.estimator.name,
            "scene": self.scene,
            "robot": self.robot.name,
            "cameras": tuple(camera.name for camera in scene.cameras),
            "n_workers": (fewest, most) if fewest < most else most,
            "control": self.asked.control,
            "config": self.config,
            **({} if self.rigs is None else {"rigs": self.rigs}),
        }


def resolve_settings(**arguments: Any) -> Settings:
    """Return the checked settings for keyword arguments of an environment."""
    return make_settings(EnvConfig(**arguments))


def make_settings(asked: EnvConfig) -> Settings:
    """Return the checked settings of a simulation.

    Args:
        asked: arguments of the environment.

    Raises:
        ConfigError: a value is invalid; the error names the valid ones.
    """
    task, estimator = find_task(asked.task), find_estimator(asked.estimator)
    if not is_known(task):
        check_parts(task)
    config, cameras = resolve(asked.config, task, estimator), asked.cameras
    if isinstance(cameras, np.ndarray):
        cameras = cameras.tolist()
    rigs = None
    if isinstance(cameras, RigDistribution | Mapping):
        rigs = convert_to_hint(RigDistribution, cameras, "cameras")
        cameras = rigs.rig or None
    if (rig := rig_of(cameras)) is not None:
        config, cameras = replace(config, scene=replace(config.scene, cameras=rig)), None
    for name, path in PARTS.items():
        if (part := getattr(asked, name)) is not None:
            config = _with_part(config, path, part, name)
    choice = task.robot if asked.robot is None else asked.robot
    robot = find_robot(DEFAULT_ROBOT if choice is None else choice)
    if task.needs_gripper and not robot.grips:
        able = [name for name, each in ROBOTS.items() if each.grips]
        raise ConfigError(
            f"{task.id} needs a robot with a hand, but {robot.name!r} has none; valid are "
            f"{', '.join(map(repr, able))}."
        )
    if task.needs_mobile_base != robot.drives:
        able = [name for name, each in ROBOTS.items() if each.drives == task.needs_mobile_base]
        kind = "a mobile robot" if task.needs_mobile_base else "an arm on the pedestal"
        raise ConfigError(
            f"{task.id} needs {kind}, which {robot.name!r} is not; valid are "
            f"{', '.join(map(repr, able))}."
        )
    scene = task.scene if asked.scene is None else asked.scene
    n_workers = task.n_workers if asked.n_workers is None else asked.n_workers
    return Settings(
        asked=asked,
        task=protect_arrays(task(config.task)),
        estimator=estimator,
        cameras=cameras,
        scene=scene,
        robot=robot,
        n_workers=_parse_worker_counts(n_workers),
        shield=find_shield(asked.shield),
        config=config,
        images=parse_images(asked.observe_images),
        rigs=rigs,
    )


def rig_of(cameras: Any) -> tuple[CameraConfig, ...] | None:
    """Return the rig for a value of `cameras`; None if it selects cameras of the scene."""
    if isinstance(cameras, str | Path):
        if str(cameras).endswith(".toml"):
            return read_rig(cameras)
        if cameras in RIGS:
            return RIGS[str(cameras)]
        raise ConfigError(
            f"cameras={cameras!r} is not a rig: valid are {', '.join(map(repr, RIGS))}, a path "
            "that ends in .toml, a list of names, indices, positions or cameras, or a "
            "RigDistribution."
        )
    several = isinstance(cameras, Sequence)
    if not several or all(isinstance(each, str | int | float | np.number) for each in cameras):
        return None
    return tuple(_camera(camera, k) for k, camera in enumerate(cameras))


def _camera(given: Any, index: int) -> CameraConfig:
    """Parse a rig's camera from a record, a mapping or a position, or raise `ConfigError`."""
    if isinstance(given, CameraConfig):
        return given
    if isinstance(given, Mapping):
        return parse_camera(given, f"cameras[{index}]")
    place = np.asarray(given) if isinstance(given, Sequence | np.ndarray) else np.zeros(0)
    if place.shape != (3,) or not np.issubdtype(place.dtype, np.number):
        raise ConfigError(
            "cameras must be names and indices of the scene's cameras, or positions (x, y, z) [m] "
            f"and CameraConfigs of a custom rig; got {given!r} among them."
        )
    x, y, z = (float(value) for value in place)
    return CameraConfig(f"camera_{index + 1}", (x, y, z))


def _parse_worker_counts(n_workers: int | tuple[int, int]) -> WorkerCounts:
    """Return the bounds on the number of workers, given one number or a pair of bounds."""
    pair = tuple(n_workers) if isinstance(n_workers, Sequence) else (n_workers, n_workers)
    are_whole = all(isinstance(k, int | np.integer) and not isinstance(k, bool) for k in pair)
    if not are_whole or len(pair) != 2 or not 0 <= pair[0] <= pair[1]:
        raise ConfigError(
            "n_workers must be a whole number, 0 or more, or (fewest, most), from which the number "
            f"is drawn in each episode, got {n_workers!r}."
        )
    return WorkerCounts(int(pair[0]), int(pair[1]))


def _with_part(record: RecordT, path: str, value: object, argument: str) -> RecordT:
    """Return a copy of a record in which the value of a field is replaced.

    Args:
        record: the record.
        path: path of the field, such as "motion.people".
        value: the new value, as passed by the user.
        argument: name of the argument, for error messages.
    """
    name, _, rest = path.partition(".")
    if rest:
        new = _with_part(getattr(record, name), rest, value, argument)
    else:
        new = convert_to_hint(get_type_hints(type(record))[name], value, argument)
    return replace(record, **{name: new})  # type: ignore[type-var]
