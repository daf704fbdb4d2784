"""Perception levels: how a belief about the workers comes about, behind one protocol.

| level | what the estimator is given |
|---|---|
| `pixels` | MediaPipe Pose on crops rendered round the worker it predicts |
| `keypoints` | an emulator of that: projected truth with the detector's errors |
| `truth` | nothing: the estimate is the worker as they are |
| `none` | nothing: the estimate stays the prior |

The organs do not know each other; they meet here and in `sensing`.
"""

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.stateful import Stateful
from hrc_env.core.typing import Bools, Image, Ints
from hrc_env.geometry.cameras import projections
from hrc_env.perception.faults.fault import IMAGE, KINDS
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.pipeline.emulated import EmulatedSenses
from hrc_env.pipeline.rendered import CameraSenses
from hrc_env.pipeline.sensor_input import Generators, Moment, Windows
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, Look
from hrc_env.tracking import oracle
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import EstimatorChoice, make_estimator
from hrc_env.tracking.forecast import forecast

LEVELS = ("pixels", "keypoints", "truth", "none")
CAMERA_LEVELS = LEVELS[:2]
"""Those that have cameras."""


class Senses(Protocol):
    """One perception level with its estimator, for a batch of environments."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget environments `ids`; there is a generator for each environment of the batch."""
        ...

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """Look at `now` and say what is believed of it, in its rows."""
        ...

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s` of rows `ids`, of which `sense` has just said `now`."""
        ...

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """What environment `b` saw last, and through which windows (for pictures)."""
        ...

    def crops(self, b: int) -> list[Image | None]:
        """What the pose network was given of environment `b`'s first worker, one a camera (for
        pictures); none where there is no network."""
        ...

    def look_of(self, b: int) -> Look | None:
        """How environment `b` looks in its episode (for pictures); None: as it was built."""
        ...

    def suspected(self, ids: Ints) -> Bools:
        """(B, C) which cameras of environments `ids` are thought to be miscalibrated."""
        ...

    def get_state(self) -> Any:
        """A copy of what changes."""
        ...

    def set_state(self, state: Any) -> None:
        """Continue from a state."""
        ...

    def close(self) -> None:
        """Release threads and graphics contexts."""
        ...


def make_senses(
    level: str, estimator: EstimatorChoice, scene: Scene, batch: int, config: HRCConfig
) -> Senses:
    """The senses of a perception level.

    Raises:
        ConfigError: `level` is not a name of one.
        WeightsError: `pixels` without the network's weights.
        RenderingError: `pixels` without OpenGL.
    """
    if level not in LEVELS:
        raise unknown("perception", level, LEVELS)
    if level != "pixels" and config.appearance != AS_BUILT:
        raise ConfigError(
            f"Looks are of images, and perception={level!r} has none: leave appearance out, or use "
            "perception='pixels'."
        )
    schedule = _schedule(scene, level, config)
    memory_s = max(config.tracker.longest_delay_s, min(schedule.longest_delay_s, 1.0))
    settings = replace(config.tracker, longest_delay_s=memory_s)
    tracker = make_estimator(estimator, projections(scene.cameras), config.ctrl_dt, settings)
    if level == "truth":
        return GivenSenses(config.tracker, oracle.prior(batch, scene.n_workers, config.tracker))
    if level == "none":
        return BlindSenses(oracle.prior(batch, scene.n_workers, config.tracker))
    if level == "keypoints":
        return EmulatedSenses(scene, batch, tracker, config, schedule)
    return CameraSenses(scene, batch, tracker, config, schedule)


def _schedule(scene: Scene, level: str, config: HRCConfig) -> Schedule:
    """What the cameras do over an episode.

    Raises:
        ConfigError: faults that this level does not know.
    """
    faults = config.faults
    if faults and level not in CAMERA_LEVELS:
        raise ConfigError(
            f"Faults are of cameras; perception={level!r} has none. Leave them out, or use one of "
            f"{', '.join(map(repr, CAMERA_LEVELS))}."
        )
    images = sorted({fault.kind for fault in faults if fault.group == IMAGE})
    if images and level == "keypoints":
        raise ConfigError(
            f'Faults of images ({", ".join(images)}) need images: use perception="pixels". What '
            'they do to the detector is not emulated; perception="keypoints" knows '
            f"{', '.join(kind for kind, each in KINDS.items() if each.group != IMAGE)}."
        )
    return Schedule(scene.rig, faults, config.ctrl_dt)


class GivenSenses(Stateful):
    """Level `truth`: the worker as they are."""

    def __init__(self, config: TrackerConfig, prior: PoseEstimate) -> None:
        self.config, self.prior = config, prior

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Nothing to forget."""

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """The truth, as an estimate; of who is not there, the prior."""
        seen = oracle.estimate_from_truth(now.truth)
        if now.present.all():
            return seen
        return _chosen(now.present, seen, rows(self.prior, now.ids))

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Where a body that moves so goes: nobody is given the future."""
        return forecast(now, horizon_s, self.config)

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """No camera took part."""
        return None, []

    def crops(self, b: int) -> list[Image | None]:
        """No network was given anything."""
        return []

    def look_of(self, b: int) -> Look | None:
        """As it was built."""
        return None

    def suspected(self, ids: Ints) -> Bools:
        """(B, 0): there are no cameras."""
        return np.zeros((len(ids), 0), np.bool_)

    def close(self) -> None:
        """Nothing to release."""


class BlindSenses(Stateful):
    """Level `none`: the prior, whatever happens."""

    def __init__(self, prior: PoseEstimate) -> None:
        self.prior = prior

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Nothing to forget."""

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """The prior."""
        return rows(self.prior, now.ids)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """The prior, then as now."""
        return rows(self.prior, ids)

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """No camera took part."""
        return None, []

    def crops(self, b: int) -> list[Image | None]:
        """No network was given anything."""
        return []

    def look_of(self, b: int) -> Look | None:
        """As it was built."""
        return None

    def suspected(self, ids: Ints) -> Bools:
        """(B, 0): there are no cameras."""
        return np.zeros((len(ids), 0), np.bool_)

    def close(self) -> None:
        """Nothing to release."""


def _chosen(who: Bools, one: PoseEstimate, other: PoseEstimate) -> PoseEstimate:
    """Of workers `who` (B, W) the first estimate, of the others the second."""
    return PoseEstimate(
        np.where(who[..., None, None], one.mean_world, other.mean_world),
        np.where(who[..., None, None, None], one.cov_world, other.cov_world),
        np.where(who[..., None, None], one.velocity_world, other.velocity_world),
        np.where(who[..., None], one.age_s, other.age_s),
        np.where(who, one.tracked, other.tracked),
    )
