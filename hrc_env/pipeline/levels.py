"""Perception levels: how a belief about the workers comes about, behind one protocol.

| level | what the estimator is given |
|---|---|
| `pixels` | MediaPipe Pose on crops rendered round the worker it predicts |
| `keypoints` | an emulator of that: projected truth with the detector's errors |
| `truth` | nothing: the estimate is the worker as they are |
| `none` | nothing: the estimate stays the prior |
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows, write_rows
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.kernels import ahead
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Ints
from hrc_env.geometry.cameras import projections
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.faults.fault import IMAGE, KINDS, FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.weights import fetch_weights
from hrc_env.pipeline.emulated import EmulatorPipeline
from hrc_env.pipeline.episodic import CameraSetup
from hrc_env.pipeline.rendered import PixelPipeline
from hrc_env.pipeline.sensor_input import Generators, Sensor, TrueState, with_truth
from hrc_env.pipeline.tracking import PerceptionPipeline
from hrc_env.scene.build import Scene, with_rig
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig
from hrc_env.tracking import oracle
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator
from hrc_env.tracking.forecast import forecast

LEVELS = ("pixels", "keypoints", "truth", "none")
CAMERA_LEVELS = LEVELS[:2]
"""Those that have cameras."""
EMULATED = ("darkness",)
"""Faults of images that level `keypoints` emulates."""


def prepare(level: str, detector: DetectorConfig) -> None:
    """Fetch and compile a perception level's needs that are missing, the quickest first. Raises
    `WeightsError` without the network's weights, and with no way to them."""
    if level == "pixels":
        fetch_weights(detector.weights)
    ahead.ensure(level)


def make_pipeline(
    level: str, estimator: EstimatorChoice, scene: Scene, batch: int, config: HRCConfig,
    shows_images: bool = False,
    like: PerceptionPipeline | None = None,
) -> PerceptionPipeline:  # fmt: skip
    """Return the pipeline of a perception level.

    Args:
        level: one of `LEVELS`.
        estimator: as of `EnvConfig`.
        scene: with the rig's cameras.
        batch: number of environments.
        config: of the environment.
        shows_images: whether observations hold images, too, whatever the level.
        like: a pipeline of the same level and scene with other cameras, which lends what takes
            time; None: there is none.

    Raises:
        ConfigError: an unknown level, or one that cannot have what `config` wants.
        WeightsError, RenderingError: level "pixels" is impossible here.
    """
    if level not in LEVELS:
        raise unknown("perception", level, LEVELS)
    check_knows(level, config.appearance, config.faults, shows_images)
    schedule = Schedule(scene.rig, config.faults, config.ctrl_dt)
    memory_s = max(config.tracker.longest_delay_s, min(schedule.longest_delay_s, 1.0))
    settings = replace(config.tracker, longest_delay_s=memory_s)
    tracker = make_estimator(estimator, projections(scene.cameras), config.ctrl_dt, settings)
    if level == "truth":
        absence = oracle.estimate_absence(batch, scene.n_workers, config.tracker)
        return Oracle(config.tracker, absence)
    if level == "none":
        prior = oracle.estimate_prior(batch, scene.n_workers, config.tracker)
        return NoPerception(prior, config.ctrl_dt)
    if level == "keypoints":
        return EmulatorPipeline(scene, batch, tracker, config, schedule)
    lender = like if isinstance(like, PixelPipeline) else None
    return PixelPipeline(scene, batch, tracker, config, schedule, lender)


@dataclass(frozen=True, slots=True)
class PipelineOfEpisode:
    """Makes the pipeline of one environment whose episode has cameras of its own."""

    level: str
    estimator: EstimatorChoice
    scene: Scene
    config: HRCConfig
    shows_images: bool
    """Whether observations hold images, too."""

    def __call__(self, setup: CameraSetup, like: PerceptionPipeline) -> PerceptionPipeline:
        """Return the pipeline; `like` is that of the others."""
        scene = with_rig(self.scene, setup.rig)
        config = replace(self.config, faults=setup.faults, appearance=setup.appearance)
        return make_pipeline(self.level, self.estimator, scene, 1, config, self.shows_images, like)


def _knows(level: str, appearance: AppearanceConfig) -> bool:
    """Return whether a perception level can show this appearance."""
    if level == "keypoints":
        appearance = replace(appearance, light=AS_BUILT.light)
    return level == "pixels" or appearance == AS_BUILT


def check_knows(
    level: str,
    appearance: AppearanceConfig,
    faults: Sequence[FaultConfig],
    shows_images: bool = False,
) -> None:
    """Raise `ConfigError` for looks and faults that a perception level does not know; observations
    that hold images show all looks."""
    if not (shows_images or _knows(level, appearance)):
        raise ConfigError(
            f"Looks are of images, and perception={level!r} has none: leave appearance out, or use "
            "perception='pixels' or observe_images. perception='keypoints' knows the strength of "
            'the light alone: appearance={"light": (0.15, 0.5)}.'
        )
    if faults and level not in CAMERA_LEVELS:
        raise ConfigError(
            f"Faults are of cameras; perception={level!r} has none. Leave them out, or use one of "
            f"{', '.join(map(repr, CAMERA_LEVELS))}."
        )
    images = sorted({f.kind for f in faults if f.group == IMAGE} - {*EMULATED})
    if images and level == "keypoints":
        raise ConfigError(
            f'Faults of images ({", ".join(images)}) need images: use perception="pixels". What '
            'they do to the detector is not emulated; perception="keypoints" knows '
            f"{', '.join(kind for kind, each in KINDS.items() if each.group != IMAGE)}, "
            f"{', '.join(EMULATED)}."
        )


class Oracle(PerceptionPipeline):
    """Level `truth`: the worker as they are."""

    def __init__(self, config: TrackerConfig, nobody: PoseEstimate) -> None:
        self.sensor = TrueState()
        self.config, self.nobody = config, nobody

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """The truth, as an estimate; of who is not there, the prior, and nobody is unknown."""
        known = with_truth(self.sensor.now)
        seen = oracle.estimate_from_truth(known.truth)
        if known.present.all():
            return seen
        believed = rows(self.nobody, ids)
        write_rows(believed, known.present, rows(seen, known.present))
        return believed

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Where a body that moves so goes: nobody is given the future."""
        return forecast(now, horizon_s, self.config)


class NoPerception(PerceptionPipeline):
    """Level `none`: the prior, whatever happens, and whoever could be there is unknown."""

    CHANGES = ("prior",)

    def __init__(self, prior: PoseEstimate, dt_s: float) -> None:
        self.sensor, self.prior, self.dt_s = Sensor(), prior, dt_s

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Nobody has looked since now."""
        self.prior.blind_s[ids] = 0.0

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """The prior."""
        self.prior.blind_s[ids] += self.dt_s
        return rows(self.prior, ids)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """The prior, then as now."""
        return rows(self.prior, ids)
