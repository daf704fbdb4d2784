"""The configuration of an environment: a tree of frozen dataclasses, one for each component.

`HRCConfig()` holds the defaults; `dataclasses.replace`, a nested mapping or a TOML file changes
them: `gymnasium.make("HRCReach-v0", config={"reward": {"proximity": 0.0}})`.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from hrc_env.control import ControlConfig
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import (
    PRESETS,
    answer_unknown_fields,
    convert_to_plain,
    from_mapping,
    merge,
    read_toml,
    to_toml,
)
from hrc_env.core.results import write_whole
from hrc_env.motion.generator import PEOPLE, MotionConfig, PeopleConfig
from hrc_env.motion.schedule import WORK, Job
from hrc_env.observations import UNCERTAINTY
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.rewards import RewardConfig
from hrc_env.safety.cost import CostConfig
from hrc_env.scene.build import SceneConfig
from hrc_env.scene.domain_randomization import APPEARANCES, AppearanceConfig
from hrc_env.scene.handling import ObjectsConfig
from hrc_env.tasks.task import TaskType
from hrc_env.tracking.config import ParticleConfig, TrackerConfig, cast_config
from hrc_env.tracking.estimators import EstimatorSpec
from hrc_env.tracking.forecast import LONGEST_S
from hrc_env.tracking.people.association import AssociationConfig
from hrc_env.worker.body import select_bodies


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class HRCConfig:
    """All settings of an environment that are not among its keyword arguments."""

    ctrl_dt: float = 0.04
    """Duration of a control step [s], a multiple of `scene.sim_dt`; 0.04 s is 25 Hz."""
    start_spread_rad: tuple[float, ...] = ()
    """Largest deviation of each joint from its home angle at a reset [rad]; empty for the default
    of the robot."""
    forecast_s: tuple[float, ...] = ()
    """Horizons of the forecast of the workers' joints in the observation, each in (0, 1] [s]; none
    by default. (0.2, 0.4) adds 120 entries per worker."""
    uncertainty: tuple[str, ...] = ()
    """Additional entries of the observation for the covariance of each joint, besides the standard
    deviation averaged over the axes: "towards_robot", the standard deviation along the line to the
    robot; "factor", the six entries of the Cholesky factor; or both."""
    observe_shield: bool = False
    """Whether the observation contains the change of the last command by the shield."""
    worker: str | tuple[str, ...] = "worker_1"
    """Body of the workers: a name, several names, or "any" for all bodies. If there are several,
    bodies are assigned to the workers in every episode, as far as possible a different one to
    each."""
    scene: SceneConfig = field(default_factory=SceneConfig)
    """Settings of the scene, the cameras and the physics."""
    motion: MotionConfig = field(default_factory=MotionConfig)
    """Settings of the workers' motion."""
    detector: DetectorConfig = field(default_factory=DetectorConfig)
    """Settings of the pose detector (`perception="pixels"`)."""
    emulator: EmulatorConfig = field(default_factory=EmulatorConfig)
    """Settings of the emulator of the pose detector (`perception="keypoints"`)."""
    faults: tuple[FaultConfig, ...] = ()
    """Faults of the cameras, with the times at which they occur (docs/cameras.md)."""
    appearance: AppearanceConfig = field(default_factory=AppearanceConfig)
    """Appearance of scene and workers, sampled for every episode (`perception="pixels"`)."""
    tracker: TrackerConfig = field(default_factory=ParticleConfig)
    """Settings of the estimator, an instance of `EstimatorSpec.config`."""
    association: AssociationConfig = field(default_factory=AssociationConfig)
    """Settings of the association of detections with workers."""
    control: ControlConfig = field(default_factory=ControlConfig)
    """Scaling and limits of actions."""
    objects: ObjectsConfig = field(default_factory=ObjectsConfig)
    """Noise of the robot's measurement of the task's loose objects."""
    task: Any = None
    """Settings of the task (`Task.config_type`); None for its defaults."""
    reward: RewardConfig = field(default_factory=RewardConfig)
    """Weights of the reward terms that all tasks share."""
    cost: CostConfig = field(default_factory=CostConfig)
    """Components of the safety cost, and whether a contact ends the episode."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.ctrl_dt) and self.ctrl_dt > 0):
            raise ConfigError(f"ctrl_dt must be a positive time [s], got {self.ctrl_dt}.")
        if min(self.start_spread_rad, default=0.0) < 0:
            raise ConfigError(f"start_spread_rad must be >= 0, got {self.start_spread_rad}.")
        if not all(0 < time_s <= LONGEST_S for time_s in self.forecast_s):
            raise ConfigError(
                f"forecast_s must be in (0, {LONGEST_S:g}] s each, got {self.forecast_s}."
            )
        check_names("uncertainty", self.uncertainty, UNCERTAINTY)
        select_bodies(self.worker)
        substeps = self.ctrl_dt / self.scene.sim_dt
        if substeps < 0.5 or abs(substeps - round(substeps)) > 1e-6:
            near = max(round(substeps), 1) * self.scene.sim_dt
            raise ConfigError(
                f"ctrl_dt must be a multiple of scene.sim_dt = {self.scene.sim_dt} s, "
                f"got {self.ctrl_dt} s; the nearest valid value is {near:.6g} s."
            )

    @property
    def n_substeps(self) -> int:
        """Number of physics substeps in a control step."""
        return round(self.ctrl_dt / self.scene.sim_dt)


ConfigChoice: TypeAlias = HRCConfig | Mapping[str, Any] | str | Path | None
"""Valid types of the argument `config`."""
PRESETS.update({AppearanceConfig: APPEARANCES, PeopleConfig: PEOPLE, tuple[Job, ...]: WORK})


def resolve(config: ConfigChoice, task: TaskType, estimator: EstimatorSpec) -> HRCConfig:
    """Return the configuration for a value of the argument `config`.

    Args:
        config: a configuration, a (nested) mapping of changes, the path of a TOML file, or None.
        task: class of the task.
        estimator: the estimator.

    Raises:
        ConfigError: a field is unknown, a value is invalid, or the settings are those of another
            task.
    """
    if isinstance(config, str | Path):
        config = read_toml(config)
    if config is None or isinstance(config, Mapping):
        values = merge(task.defaults, config or {})
        values = {name: value for name, value in values.items() if (name, value) != ("task", None)}
        kinds = {"task": task.config_type, "tracker": estimator.config}
        config = from_mapping(HRCConfig, values, kinds=kinds)
    if not isinstance(config, HRCConfig):
        raise ConfigError(
            "config must be an HRCConfig, a mapping, a TOML file's path or None, "
            f"got {type(config).__name__}."
        )
    config = replace(config, tracker=cast_config(config.tracker, estimator.config))
    if config.task is None:
        return replace(config, task=task.config_type())
    if not isinstance(config.task, task.config_type):
        raise ConfigError(
            f"config.task must be {task.config_type.__name__} with {task.id}, "
            f"got {type(config.task).__name__}."
        )
    return config


def save_config(config: HRCConfig, path: str | Path) -> None:
    """Write all settings to a TOML file, which `config=` and `--config` accept.

    Raises:
        ConfigError: `motion.motions` contains a clip in memory, which a file cannot hold.
    """
    for motion in config.motion.motions:
        if not isinstance(motion, str):
            raise ConfigError(
                f"The clip {motion.source!r} is held in memory and cannot be "
                "written: use the path of its file instead."
            )
    write_whole(Path(path), to_toml(convert_to_plain(asdict(config))))
