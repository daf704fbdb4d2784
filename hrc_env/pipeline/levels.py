"""Perception levels: pipelines with a common interface that estimate the workers from sensors.

| level | input of the estimator |
|---|---|
| `pixels` | keypoints of MediaPipe Pose in crops that are rendered around the predicted workers |
| `keypoints` | keypoints of an emulator: the projected true joints with the detector's errors |
| `truth` | none: the estimate is the truth |
| `none` | none: the estimate is the prior |
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows, write_rows
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.kernels import ahead
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Ints
from hrc_env.geometry.cameras import projections
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.perception.faults.fault import IMAGE, KINDS, FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.weights import fetch_weights
from hrc_env.pipeline.emulated import EmulatorPipeline
from hrc_env.pipeline.episodic import CameraSetup
from hrc_env.pipeline.rendered import PixelPipeline
from hrc_env.pipeline.sensor_input import Generators, Sensor, TrueState, require_truth
from hrc_env.pipeline.tracking import PerceptionPipeline
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig
from hrc_env.tracking import oracle
from hrc_env.tracking.config import ParticleConfig, TrackerConfig
from hrc_env.tracking.estimators import EstimatorChoice, find_estimator, make_estimator
from hrc_env.tracking.forecast import forecast

LEVELS = ("pixels", "keypoints", "truth", "none")
"""Names of the perception levels."""
CAMERA_LEVELS = LEVELS[:2]
"""Perception levels with cameras."""
CALIBRATED_ESTIMATORS = ("particle", "kalman")
"""Names of the estimators with calibrated errors. With several cameras, they are equal."""
EMULATED = ("darkness",)
"""Kinds of image faults that are emulated at level `keypoints`."""


def prepare(level: str, detector: DetectorConfig) -> None:
    """Fetch the weights and compile the kernels that a perception level needs.

    Raises:
        WeightsError: the weights are missing and cannot be fetched.
    """
    if level == "pixels":
        fetch_weights(detector.weights)
    ahead.ensure(level)


def make_pipeline(
    level: str,
    estimator: EstimatorChoice,
    scene: Scene,
    batch: int,
    config: HRCConfig,
    shows_images: bool = False,
    like: PerceptionPipeline | None = None,
) -> PerceptionPipeline:
    """Return the pipeline of a perception level.

    Args:
        level: one of `LEVELS`.
        estimator: the estimator, as in `EnvConfig`.
        scene: the scene with the rig's cameras.
        batch: number of environments.
        config: settings of the environment.
        shows_images: whether observations contain images.
        like: a pipeline of the same level and scene with other cameras, with a renderer and
            networks to be shared; None to create new ones.

    Raises:
        ConfigError: the level is unknown or does not support the settings.
        WeightsError: the weights of level "pixels" are missing.
        RenderingError: OpenGL, which level "pixels" needs, is not available.
    """
    if level not in LEVELS:
        raise make_unknown_name_error("perception", level, LEVELS)
    check_supported(level, config.appearance, config.faults, shows_images)
    schedule = Schedule(scene.rig, config.faults, config.ctrl_dt)
    memory_s = max(config.tracker.max_delay_s, min(schedule.max_delay_s, 1.0))
    settings = replace(config.tracker, max_delay_s=memory_s)
    tracker = make_estimator(estimator, projections(scene.cameras), config.ctrl_dt, settings)
    if level == "truth":
        absence = oracle.estimate_absence(batch, scene.n_workers, config.tracker)
        return Oracle(config.tracker, absence)
    if level == "none":
        prior = oracle.estimate_prior(batch, scene.n_workers, config.tracker)
        return NoPerception(prior, config.ctrl_dt)
    if level == "keypoints":
        is_calibrated = has_calibrated_errors(estimator, config)
        return EmulatorPipeline(scene, batch, tracker, config, schedule, is_calibrated)
    lender = like if isinstance(like, PixelPipeline) else None
    return PixelPipeline(scene, batch, tracker, config, schedule, lender)


def has_calibrated_errors(estimator: EstimatorChoice, config: HRCConfig) -> bool:
    """Return whether the bounds of `safety.error_bounds` apply to an estimator's errors.

    They were calibrated for the default estimator with the default settings.
    """
    is_default = config.tracker == ParticleConfig() and config.emulator == EmulatorConfig()
    is_default &= config.detector.every == 1
    return is_default and find_estimator(estimator).name in CALIBRATED_ESTIMATORS


@dataclass(frozen=True, slots=True)
class PipelineOfEpisode:
    """Factory of pipelines for single environments with cameras that vary between episodes."""

    level: str
    """Perception level."""
    estimator: EstimatorChoice
    """The estimator, as in `EnvConfig`."""
    scene: Scene
    """The scene of all environments."""
    config: HRCConfig
    """Settings of all environments."""
    shows_images: bool
    """Whether observations contain images."""

    def __call__(self, setup: CameraSetup, like: PerceptionPipeline) -> PerceptionPipeline:
        """Return a pipeline with the cameras of `setup` and the renderer and networks of `like`."""
        scene = with_rig(self.scene, setup.rig)
        config = replace(self.config, faults=setup.faults, appearance=setup.appearance)
        return make_pipeline(self.level, self.estimator, scene, 1, config, self.shows_images, like)


def _supports(level: str, appearance: AppearanceConfig) -> bool:
    """Return whether a perception level supports an appearance."""
    if level == "keypoints":
        appearance = replace(appearance, light=AS_BUILT.light)
    return level == "pixels" or appearance == AS_BUILT


def check_supported(
    level: str,
    appearance: AppearanceConfig,
    faults: Sequence[FaultConfig],
    shows_images: bool = False,
) -> None:
    """Check that a perception level supports an appearance and faults.

    Args:
        level: the perception level.
        appearance: the appearance of the scene.
        faults: the faults of the cameras.
        shows_images: whether observations contain images, which are supported with every
            appearance.

    Raises:
        ConfigError: the level does not support the appearance or a fault.
    """
    if not (shows_images or _supports(level, appearance)):
        raise ConfigError(
            f"Appearances need images, but perception={level!r} has none: leave out appearance, or "
            "use perception='pixels' or observe_images. perception='keypoints' supports only the "
            'intensity of the light: appearance={"light": (0.15, 0.5)}.'
        )
    if faults and level not in CAMERA_LEVELS:
        raise ConfigError(
            f"Faults need cameras, but perception={level!r} has none. Leave out faults, or use one "
            f"of {', '.join(map(repr, CAMERA_LEVELS))}."
        )
    images = sorted({f.kind for f in faults if f.group == IMAGE} - {*EMULATED})
    if images and level == "keypoints":
        raise ConfigError(
            f'Faults of images ({", ".join(images)}) need images: use perception="pixels". Their '
            'effects on the detector are not emulated; perception="keypoints" supports '
            f"{', '.join(kind for kind, each in KINDS.items() if each.group != IMAGE)}, "
            f"{', '.join(EMULATED)}."
        )


class Oracle(PerceptionPipeline):
    """Pipeline of level `truth`, which returns the true states as the estimate.

    Args:
        config: settings of the tracker.
        nobody: (B, W, ...) estimate for slots without a worker.
    """

    def __init__(self, config: TrackerConfig, nobody: PoseEstimate) -> None:
        self.sensor = TrueState()
        self.config, self.nobody = config, nobody

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Return the truth as an estimate, with the prior for absent workers.

        No slot is unknown.
        """
        known = require_truth(self.sensor.now)
        seen = oracle.estimate_from_truth(known.truth)
        if known.present.all():
            return seen
        believed = rows(self.nobody, ids)
        write_rows(believed, known.present, rows(seen, known.present))
        return believed

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Return a forecast by the tracker's motion model, as true future poses are unknown."""
        return forecast(now, horizon_s, self.config)


class NoPerception(PerceptionPipeline):
    """Pipeline of level `none`, which returns the prior as the estimate, with all slots unknown.

    Args:
        prior: (B, W, ...) prior of the workers.
        dt_s: time between steps [s].
    """

    CHANGES = ("prior",)

    def __init__(self, prior: PoseEstimate, dt_s: float) -> None:
        self.sensor, self.prior, self.dt_s = Sensor(), prior, dt_s

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Reset environments `ids`, and set the age of their prior to zero."""
        self.prior.unobserved_s[ids] = 0.0

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Return the prior of environments `ids`, with its age increased by one step."""
        self.prior.unobserved_s[ids] += self.dt_s
        return rows(self.prior, ids)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Return the prior of environments `ids`, which does not change."""
        return rows(self.prior, ids)
