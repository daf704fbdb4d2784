"""The whole configuration: one frozen tree, a branch for each organ.

`HRCConfig()` is the default; `dataclasses.replace` or a nested mapping changes it:
`gymnasium.make("HRCReach-v0", config={"reward": {"proximity": 0.0}})`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.control import ControlConfig
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.mapping import from_mapping, restored
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.rig_files import read_rig
from hrc_env.metrics import CostConfig
from hrc_env.motion.generator import PEOPLE, Clip, MotionConfig, PeopleConfig, people_called
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.rewards import RewardConfig
from hrc_env.safety.shield import Shield, shield_called
from hrc_env.scene.build import SceneConfig
from hrc_env.scene.domain_randomization import AppearanceConfig, appearance_called
from hrc_env.scene.rigs import RIGS
from hrc_env.scene.robot import DEFAULT as DEFAULT_ROBOT
from hrc_env.scene.robot import Robot, robot_called
from hrc_env.tasks import DEFAULT
from hrc_env.tasks.task import Task, task_called
from hrc_env.tracking.ahead import LONGEST_S
from hrc_env.tracking.config import ParticleConfig, TrackerConfig, of_kind
from hrc_env.tracking.estimators import EstimatorChoice, EstimatorSpec, estimator_called
from hrc_env.tracking.people.association import AssociationConfig
from hrc_env.worker.body import pool


@dataclass(frozen=True, slots=True)
class HRCConfig:
    """Everything about an environment that is not one of its keyword arguments."""

    ctrl_dt: float = 0.04
    """Time between actions [s]; a multiple of `scene.sim_dt`. 0.04 s is 25 Hz."""
    start_spread_rad: tuple[float, ...] = ()
    """At reset each joint is drawn within so much of its home angle [rad]; none: the robot's."""
    horizons_s: tuple[float, ...] = ()
    """Times ahead at which the observation also holds where the workers' joints are expected,
    each in (0, 1] [s]; none by default. (0.2, 0.4) adds 120 entries a worker."""
    worker: str | tuple[str, ...] = "worker_1"
    """Which baked body the workers have: a name; several, or "any" for all that there are: then
    every episode gives each worker one of them, no two the same as long as there are others."""
    scene: SceneConfig = field(default_factory=SceneConfig)
    """Room, cameras, physics."""
    motion: MotionConfig = field(default_factory=MotionConfig)
    """How the workers move."""
    detector: DetectorConfig = field(default_factory=DetectorConfig)
    """The camera pipeline (`perception="pixels"`)."""
    emulator: EmulatorConfig = field(default_factory=EmulatorConfig)
    """Its emulator (`perception="keypoints"`)."""
    faults: tuple[FaultConfig, ...] = ()
    """What goes wrong with the cameras, and when (docs/cameras.md)."""
    appearance: AppearanceConfig = field(default_factory=AppearanceConfig)
    """How scene and workers look, drawn for every episode (`perception="pixels"`)."""
    tracker: TrackerConfig = field(default_factory=ParticleConfig)
    """The estimator; what may be set is its own (`EstimatorSpec.config`)."""
    association: AssociationConfig = field(default_factory=AssociationConfig)
    """Which detection is of whom, where there are several workers."""
    control: ControlConfig = field(default_factory=ControlConfig)
    """What an action means."""
    task: Any = None
    """The task's own settings (`Task.config`); None: its defaults."""
    reward: RewardConfig = field(default_factory=RewardConfig)
    """Weights of the reward's terms."""
    cost: CostConfig = field(default_factory=CostConfig)
    """What counts as unsafe."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.ctrl_dt) and self.ctrl_dt > 0):
            raise ConfigError(f"ctrl_dt must be a positive time [s], got {self.ctrl_dt}.")
        if min(self.start_spread_rad, default=0.0) < 0:
            raise ConfigError(f"start_spread_rad must be >= 0, got {self.start_spread_rad}.")
        pool(self.worker)
        for horizon_s in self.horizons_s:
            if not 0 < horizon_s <= LONGEST_S:
                raise ConfigError(
                    f"horizons_s must be in (0, {LONGEST_S:g}] s each, got {self.horizons_s}."
                )
        substeps = self.ctrl_dt / self.scene.sim_dt
        if substeps < 0.5 or abs(substeps - round(substeps)) > 1e-6:
            near = max(round(substeps), 1) * self.scene.sim_dt
            raise ConfigError(
                f"ctrl_dt must be a multiple of scene.sim_dt = {self.scene.sim_dt} s, "
                f"got {self.ctrl_dt} s; the nearest valid value is {near:.6g} s."
            )

    @property
    def n_substeps(self) -> int:
        """Physics steps in a control step."""
        return round(self.ctrl_dt / self.scene.sim_dt)


@dataclass(frozen=True, slots=True)
class Settings:
    """Everything that a simulation is made from, whole and checked."""

    task: Task
    perception: str
    estimator: EstimatorSpec
    cameras: Sequence[int | str] | None
    """Which of the scene's cameras are used; None: all."""
    scene: str
    robot: Robot
    n_workers: int | tuple[int, int]
    control: str
    shield: Shield | None
    config: HRCConfig


def settle(
    *,
    task: str | Task = DEFAULT,
    perception: str = "pixels",
    estimator: EstimatorChoice = "particle",
    scene: str = "lab",
    robot: str | Robot = DEFAULT_ROBOT,
    n_workers: int | tuple[int, int] = 1,
    control: str = "joint",
    shield: "str | Shield | None" = None,
    config: "HRCConfig | Mapping[str, Any] | None" = None,
    cameras: "str | Path | Sequence[Any] | np.ndarray | None" = None,
    **changes: Any,
) -> Settings:
    """Settings from the keyword arguments of an environment; see `HRCEnv`.

    Args:
        changes: people, motions, faults, appearance, folded into the config.

    Raises:
        ConfigError: an argument that there is not, or a value that cannot be.
    """
    chosen = task_called(task)
    spec = estimator_called(estimator)
    whole = resolve(config, chosen, spec)
    for name, value in changes.items():
        if name not in _CHANGES:
            raise unknown("argument", name, [*_ARGUMENTS, *_CHANGES])
        whole = whole if value is None else _CHANGES[name](whole, value)
    whole, used = with_cameras(whole, cameras)
    return Settings(
        chosen, perception, spec, used, scene, robot_called(robot), n_workers, control,
        shield_called(shield), whole,
    )  # fmt: skip


def resolve(
    config: "HRCConfig | Mapping[str, Any] | None", task: Task, estimator: EstimatorSpec
) -> HRCConfig:
    """A config from what a user gave: a config, a (nested) mapping of changes, or nothing.

    Raises:
        ConfigError: a field that does not exist, with the nearest that does; a bad value; the
            settings of another task.
    """
    if config is None:
        config = HRCConfig()
    elif isinstance(config, Mapping):
        said = {name: value for name, value in config.items() if (name, value) != ("task", None)}
        kinds = {"task": task.config, "tracker": estimator.config}
        config = from_mapping(HRCConfig, said, kinds=kinds)
    elif not isinstance(config, HRCConfig):
        raise ConfigError(
            f"config must be an HRCConfig, a mapping or None, got {type(config).__name__}."
        )
    config = replace(config, tracker=of_kind(config.tracker, estimator.config))
    if config.task is None:
        return replace(config, task=task.config())
    if not isinstance(config.task, task.config):
        raise ConfigError(
            f"config.task must be {task.config.__name__} with {task.id}, "
            f"got {type(config.task).__name__}."
        )
    return config


def with_cameras(
    config: HRCConfig, cameras: "str | Path | Sequence[Any] | np.ndarray | None"
) -> "tuple[HRCConfig, Sequence[int | str] | None]":
    """A config with another rig, and which of its cameras are used; see `HRCEnv`.

    Raises:
        ConfigError: no rig of that name, no such file, or a mixture of names and cameras.
    """
    given: Any = cameras.tolist() if isinstance(cameras, np.ndarray) else cameras
    if isinstance(given, str | Path):
        rig = _rig(given)
    elif isinstance(given, Sequence) and any(not isinstance(c, _CHOICE) for c in given):
        rig = tuple(_camera(camera, k) for k, camera in enumerate(given))
    else:
        return config, given
    return replace(config, scene=replace(config.scene, cameras=rig)), None


_CHOICE = (str, int, float, np.number)


def _rig(named: str | Path) -> tuple[CameraConfig, ...]:
    if isinstance(named, Path) or named.endswith(".toml"):
        return read_rig(named)
    if named not in RIGS:
        raise ConfigError(
            f"cameras={named!r} is no rig: valid are {', '.join(map(repr, RIGS))}, a path that "
            "ends in .toml, or a list of names, indices, places or cameras."
        )
    return RIGS[named]


def _camera(given: Any, index: int) -> CameraConfig:
    if isinstance(given, CameraConfig):
        return given
    if isinstance(given, Mapping):
        return from_mapping(CameraConfig, given, f"cameras[{index}].")
    place = np.asarray(given) if isinstance(given, Sequence | np.ndarray) else np.zeros(0)
    if place.shape != (3,) or not np.issubdtype(place.dtype, np.number):
        raise ConfigError(
            "cameras must be names and indices of the scene's cameras, or else places (x, y, z) "
            f"[m] and CameraConfigs of a rig of your own; got {given!r} among them."
        )
    x, y, z = (float(value) for value in place)
    return CameraConfig(f"camera_{index + 1}", (x, y, z))


def _with_faults(
    config: HRCConfig, faults: "Sequence[FaultConfig | Mapping[str, Any]]"
) -> HRCConfig:
    """A config with these faults of cameras.

    Raises:
        ConfigError: something else than a list of faults or mappings, or a fault that cannot be.
    """
    if isinstance(faults, FaultConfig | Mapping | str) or not isinstance(faults, Sequence):
        raise ConfigError(f"faults must be a list of FaultConfigs or mappings, got {faults!r}.")
    return replace(config, faults=restored(tuple[FaultConfig, ...], list(faults), "faults"))


def _with_appearance(
    config: HRCConfig, appearance: "str | AppearanceConfig | Mapping[str, Any]"
) -> HRCConfig:
    """A config with another appearance: by name, settings or a mapping.

    Raises:
        ConfigError: a name or a field that there is not, a value that cannot be.
    """
    if isinstance(appearance, Mapping):
        appearance = from_mapping(AppearanceConfig, appearance, "appearance.")
    return replace(config, appearance=appearance_called(appearance))


def _with_motions(config: HRCConfig, motions: "Sequence[str | Path | Clip]") -> HRCConfig:
    """A config whose workers play these clips, too.

    Raises:
        ConfigError: something else than paths and clips.
    """
    if isinstance(motions, str | Path | Clip):
        motions = (motions,)
    if not isinstance(motions, Sequence):
        raise ConfigError(f"motions must be a list of paths or clips, got {motions!r}.")
    given = tuple(str(motion) if isinstance(motion, Path) else motion for motion in motions)
    return replace(config, motion=replace(config.motion, motions=given))


def _with_people(config: HRCConfig, people: "str | PeopleConfig | Mapping[str, Any]") -> HRCConfig:
    """A config with other people: by name, settings or a mapping.

    Raises:
        ConfigError: a name of no preset, with those that there are; a field that there is not, a
            value that cannot be.
    """
    if isinstance(people, Mapping):
        people = from_mapping(PeopleConfig, people, "people.")
    elif isinstance(people, str):
        people = people_called(people)
    elif not isinstance(people, PeopleConfig):
        raise ConfigError(
            f"people must be a name ({', '.join(map(repr, PEOPLE))}), a PeopleConfig or a mapping "
            f"of its fields, got {people!r}."
        )
    return replace(config, motion=replace(config.motion, people=people))


_CHANGES: dict[str, Callable[[HRCConfig, Any], HRCConfig]] = {
    "people": _with_people,
    "motions": _with_motions,
    "faults": _with_faults,
    "appearance": _with_appearance,
}
_ARGUMENTS = (
    "task", "perception", "estimator", "scene", "robot", "n_workers", "control", "shield",
    "config", "cameras",
)  # fmt: skip
