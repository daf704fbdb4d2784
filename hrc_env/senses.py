"""Perception levels: how a belief about the workers comes about, behind one protocol.

| level | what the estimator is given |
|---|---|
| `pixels` | MediaPipe Pose on crops rendered round the worker it predicts |
| `keypoints` | an emulator of that: projected truth with the detector's errors |
| `truth` | nothing: the estimate is the worker as they are |
| `none` | nothing: the estimate stays the prior |

The organs do not know each other; they meet here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hrc_env.batching import one, rows, write_rows
from hrc_env.config import HRCConfig
from hrc_env.errors import unknown
from hrc_env.geometry.cameras import project, projections
from hrc_env.perception import emulator
from hrc_env.perception.eyes import Eyes, Sight
from hrc_env.perception.lensed import Lensed, pinhole_keypoints
from hrc_env.perception.windows import steady_window, window_from_joints
from hrc_env.records import CropWindow, Keypoints, PoseEstimate, WorkerMotion, WorkerTruth
from hrc_env.scene.build import Scene
from hrc_env.scene.render import CropRenderer
from hrc_env.skeleton import N_JOINTS
from hrc_env.stateful import Stateful
from hrc_env.tracking import given
from hrc_env.tracking.ahead import ahead
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import Estimator, make_estimator
from hrc_env.tracking.people.association import associate
from hrc_env.typing import Bools, Ints, JointAngles

LEVELS = ("pixels", "keypoints", "truth", "none")
CAMERA_LEVELS = LEVELS[:2]
"""Those that have cameras."""

Generators = list[np.random.Generator]
Windows = list[list[CropWindow | None]]
"""For each worker, a window for each camera; None where it did not look."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The scene when the shutters open; rows are environments `ids`."""

    ids: Ints
    """(B,) environments of the batch that these rows are."""
    q: JointAngles
    """(B, N) the arm [rad]."""
    motion: WorkerMotion
    """(B, W, S, ...)."""
    truth: WorkerTruth
    """(B, W, ...): for the emulator and the level `truth`, and for nobody else."""
    present: Bools
    """(B, W) who is in the episode: for the level `truth`, and for nobody else."""


class Senses(Protocol):
    """One perception level with its estimator, for a batch of environments."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget environments `ids`; there is a generator for each environment of the batch."""
        ...

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """Look at `now` and say what is believed of it, in its rows."""
        ...

    def ahead(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s` of rows `ids`, of which `sense` has just said `now`."""
        ...

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """What environment `b` saw last, and through which windows (for pictures)."""
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


def make_senses(level: str, estimator: str, scene: Scene, batch: int, config: HRCConfig) -> Senses:
    """The senses of a perception level.

    Raises:
        ConfigError: `level` or `estimator` is not a name of one.
        WeightsError: `pixels` without the network's weights.
        RenderingError: `pixels` without OpenGL.
    """
    if level not in LEVELS:
        raise unknown("perception", level, LEVELS)
    P = projections(scene.cameras)
    tracker = make_estimator(estimator, P, config.ctrl_dt, config.tracker)
    if level == "truth":
        return GivenSenses(config.tracker, given.prior(batch, scene.n_workers, config.tracker))
    if level == "none":
        return BlindSenses(given.prior(batch, scene.n_workers, config.tracker))
    if level == "keypoints":
        return EmulatedSenses(scene, batch, tracker, config)
    return CameraSenses(scene, batch, tracker, config)


class GivenSenses(Stateful):
    """Level `truth`: the worker as they are."""

    def __init__(self, config: TrackerConfig, prior: PoseEstimate) -> None:
        self.config, self.prior = config, prior

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Nothing to forget."""

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """The truth, as an estimate; of who is not there, the prior."""
        seen = given.estimate_from_truth(now.truth)
        if now.present.all():
            return seen
        return _chosen(now.present, seen, rows(self.prior, now.ids))

    def ahead(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Where a body that moves so goes: nobody is given the future."""
        return ahead(now, horizon_s, self.config)

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """No camera took part."""
        return None, []

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

    def ahead(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """The prior, then as now."""
        return rows(self.prior, ids)

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """No camera took part."""
        return None, []

    def close(self) -> None:
        """Nothing to release."""


class TrackingSenses(Stateful):
    """What the levels with cameras share: predict, get keypoints, update."""

    CHANGES = ("state", "keypoints")

    def __init__(self, batch: int, scene: Scene, tracker: Estimator, config: HRCConfig) -> None:
        self.scene, self.tracker, self.dt_s = scene, tracker, config.ctrl_dt
        self.association = config.association
        self.P = projections(scene.cameras)
        self.state: Any = tracker.init(batch, scene.n_workers)
        self.keypoints = _no_keypoints(batch, len(scene.cameras), scene.n_workers)

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks of environments `ids`."""
        self.tracker.reset(self.state, ids, tracker_rngs)

    def sense(self, now: Moment, sensor_rngs: Generators, tracker_rngs: Generators) -> PoseEstimate:
        """Predict the workers, look at them where they should be, and update."""
        whole = len(now.ids) == len(self.keypoints.px)
        state = self.state if whole else rows(self.state, now.ids)
        self.tracker.predict(state, self.dt_s, tracker_rngs)
        found = pinhole_keypoints(self.detect(now, state, sensor_rngs), self.scene.cameras)
        keypoints = self._sorted(found, state)
        self.tracker.update(state, keypoints, tracker_rngs)
        if whole:
            self.keypoints = keypoints
        else:
            write_rows(self.keypoints, now.ids, keypoints)
            write_rows(self.state, now.ids, state)
        return self.tracker.estimate(state)

    def ahead(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What the estimator expects."""
        whole = len(ids) == len(self.keypoints.px)
        return self.tracker.ahead(self.state if whole else rows(self.state, ids), horizon_s)

    def detect(self, now: Moment, predicted: Any, sensor_rngs: Generators) -> Keypoints:
        """Keypoints of this moment, by whatever eyes the level has; whose they are is open.

        They are in pixels of the images, as the lenses bend them.

        Args:
            now: the scene.
            predicted: the tracker's state before the measurement.
            sensor_rngs: one generator a row.
        """
        raise NotImplementedError

    def _sorted(self, keypoints: Keypoints, predicted: Any) -> Keypoints:
        """Keypoints by worker; where there is one worker, whatever was found is theirs."""
        if self.scene.n_workers < 2:
            return keypoints
        expected = self.tracker.estimate(predicted)
        return associate(self.P, keypoints, expected, self.association).keypoints

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b`."""
        return rows(self.keypoints, np.array([b])), []

    def close(self) -> None:
        """Nothing to release."""


class EmulatedSenses(TrackingSenses):
    """Level `keypoints`: the detector's errors on the projected truth."""

    CHANGES = (*TrackingSenses.CHANGES, "emulator")

    def __init__(self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig) -> None:
        super().__init__(batch, scene, tracker, config)
        self.config = config.emulator
        self.emulator = emulator.make_state(
            batch, len(scene.cameras), scene.n_workers, config.ctrl_dt, config.emulator
        )

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks and the detector's slow errors."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        emulator.reset(self.emulator, ids, sensor_rngs, self.config)

    def detect(self, now: Moment, predicted: Any, sensor_rngs: Generators) -> Keypoints:
        """Emulated keypoints; room, robot and bodies stand in the lines of sight."""
        whole = len(now.ids) == len(self.keypoints.px)
        state = self.emulator if whole else rows(self.emulator, now.ids)
        surroundings = self.scene.surroundings(now.q, now.motion.held)
        keypoints = emulator.emulate(
            state, sensor_rngs, now.truth, surroundings, self.scene.cameras, self.config
        )
        if not whole:
            write_rows(self.emulator, now.ids, state)
        if self.scene.n_workers < 2:
            return keypoints
        return emulator.without_names(keypoints, sensor_rngs)


class CameraSenses(TrackingSenses):
    """Level `pixels`: rendered crops through the pose network."""

    CHANGES = (*TrackingSenses.CHANGES, "windows", "eyes")

    def __init__(self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig) -> None:
        super().__init__(batch, scene, tracker, config)
        self.renderer = CropRenderer(scene)
        self.images = Lensed(self.renderer, scene.cameras)
        self.eyes = Eyes(scene.cameras, config.eyes)
        self.windows: list[Windows] = [
            [[None] * len(scene.cameras) for _ in range(scene.n_workers)] for _ in range(batch)
        ]

    def detect(self, now: Moment, predicted: Any, sensor_rngs: Generators) -> Keypoints:
        """Landmarks of crops round the predicted worker, or of a search where there is none."""
        seen = _no_keypoints(len(now.ids), len(self.scene.cameras), self.scene.n_workers)
        expected = self.tracker.estimate(predicted)
        for row, b in enumerate(now.ids):
            self.renderer.draw(now.q[row], one(now.motion, row))
            for worker, sight in self._look(expected, row, int(b)):
                self.windows[b][worker] = sight.windows
                seen.px[row, :, worker] = sight.px
                seen.confidence[row, :, worker] = sight.confidence
                seen.sigma_px[row, :, worker] = sight.sigma_px
        return seen

    def _look(self, expected: PoseEstimate, row: int, b: int) -> Iterator[tuple[int, Sight]]:
        """Look for every worker of an environment; a search finds nobody who has been looked at.

        Those with a window come first, and one search serves all the others.
        """
        wanted = [self._windows(expected, row, w) for w in range(self.scene.n_workers)]
        taken: Windows = []
        people = None
        for worker in sorted(range(len(wanted)), key=lambda w: not any(wanted[w])):
            windows = list(map(steady_window, self.windows[b][worker], wanted[worker]))
            if people is None and not any(windows):
                people = self.eyes.search(self.images)
            track = self._track(b, worker)
            sight = self.eyes.look(self.images, windows, track, taken, people)
            taken.append(sight.windows)
            yield worker, sight

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks, and whom the eyes were following."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            for worker in range(self.scene.n_workers):
                self.eyes.forget(self._track(b, worker))
                self.windows[b][worker] = [None] * len(self.scene.cameras)

    def _track(self, b: int, worker: int) -> int:
        """The number by which the eyes know a worker of an environment."""
        return int(b) * self.scene.n_workers + worker

    def looks(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b` and the windows they were found in."""
        return rows(self.keypoints, np.array([b])), self.windows[b]

    def close(self) -> None:
        """Stop the detector's thread and free the graphics context."""
        self.eyes.close()
        self.renderer.close()

    def _windows(self, predicted: PoseEstimate, row: int, worker: int) -> list[CropWindow | None]:
        """A window a camera; None where the worker is unknown or out of view: search."""
        if not predicted.tracked[row, worker]:
            return [None] * len(self.scene.cameras)
        px, depth_m = project(self.P, predicted.mean_world[row : row + 1, worker])
        return [
            window_from_joints(px[0, c], depth_m[0, c], camera)
            for c, camera in enumerate(self.scene.cameras)
        ]


def _chosen(who: Bools, one: PoseEstimate, other: PoseEstimate) -> PoseEstimate:
    """Of workers `who` (B, W) the first estimate, of the others the second."""
    return PoseEstimate(
        np.where(who[..., None, None], one.mean_world, other.mean_world),
        np.where(who[..., None, None, None], one.cov_world, other.cov_world),
        np.where(who[..., None, None], one.velocity_world, other.velocity_world),
        np.where(who[..., None], one.age_s, other.age_s),
        np.where(who, one.tracked, other.tracked),
    )


def _no_keypoints(batch: int, n_cameras: int, n_workers: int) -> Keypoints:
    shape = (batch, n_cameras, n_workers, N_JOINTS)
    return Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf))
