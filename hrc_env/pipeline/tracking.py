"""The loop of following people with cameras: predict, look, update, judge presence."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import Stateful, rows, write_rows
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Image, Ints
from hrc_env.core.vacancy import Coverage, Others, Vacancy, no_others
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.perception.calibration import Calibration, read_calibration
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lensed import pinhole_keypoints
from hrc_env.perception.noise import our_joints
from hrc_env.pipeline.sensor_input import Generators, Sensor, Windows
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.rigs import coverage
from hrc_env.tracking.calibration_monitor import forget_monitor, make_monitor, monitor
from hrc_env.tracking.contradiction import find_unexplained
from hrc_env.tracking.estimators import Estimator
from hrc_env.tracking.frozen_frames import (
    believed,
    forget_frozen,
    leave_out_frozen,
    make_frozen,
)
from hrc_env.tracking.people.association import AssociationConfig, associate
from hrc_env.tracking.presence import IMAGES, Looks, Presence


class PerceptionPipeline(Stateful):
    """One perception level with its estimator, for a batch; here, without cameras and memory."""

    sensor: Sensor
    """To be shown the scene (`Sensor.expose`) before `perceive`, which is not."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget environments `ids`; there is a generator for each environment of the batch."""

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """What is believed of environments `ids` after what the sensor measures of them."""
        raise NotImplementedError

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s` of rows `ids`, of which `now` is believed."""
        raise NotImplementedError

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """What environment `b` saw last, and through which windows (for pictures)."""
        return None, []

    @property
    def given(self) -> Keypoints:
        """The keypoints (B, C, W, J) that the estimator was given last; `ConfigError` without
        cameras."""
        raise ConfigError("Keypoints are of cameras, and this perception level has none.")

    @property
    def now_s(self) -> Floats:
        """(B,) the present moment by the clock of `Keypoints.time_s` [s]; as `given`."""
        raise ConfigError("Frames are of cameras, and this perception level has none.")

    def crops(self, b: int) -> list[Image | None]:
        """What the network was given of `b`'s first worker, one a camera (for pictures)."""
        return []

    def look_of(self, b: int) -> Look | None:
        """How environment `b` looks in its episode (for pictures); None: as it was built."""
        return None

    def schedule_of(self, b: int) -> Schedule | None:
        """Return the schedule of environment `b`'s cameras in its episode; None without cameras."""
        return None

    def light_of(self, b: int) -> float:
        """Return the strength of the light in environment `b`'s episode; 1: as it was built."""
        return 1.0

    def suspected(self, ids: Ints) -> Bools:
        """(B, C) which cameras of environments `ids` are thought to be miscalibrated."""
        return np.zeros((len(ids), 0), np.bool_)

    def vacancy(self, ids: Ints) -> Vacancy | None:
        """Return the state of the floor of environments `ids`, by groups of the scene's `coverage`;
        None without cameras."""
        return None

    def close(self) -> None:
        """Release threads and graphics contexts."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackingSetup:
    """Where people are followed, how many and how often."""

    cameras: tuple[PinholeCamera, ...]
    """The rig, as it is calibrated."""
    n_workers: int
    """People who are followed at most."""
    coverage: Coverage
    """Which cameras would see a person on each piece of the floor."""
    dt_s: float
    """The usual time between two updates [s]."""
    association: AssociationConfig = field(default_factory=AssociationConfig)
    calibration: Calibration = field(default_factory=read_calibration)
    """Where the network means joints to be."""


def setup_in(scene: Scene, config: HRCConfig) -> TrackingSetup:
    """Return how the workers of a scene are followed."""
    calibration = config.emulator.make_calibration()
    followed = scene.cameras, scene.n_workers, coverage(scene)
    return TrackingSetup(*followed, config.ctrl_dt, config.association, calibration)


class PoseTracking(PerceptionPipeline):
    """Follows people with cameras: predict, look where they should be, update, judge presence.

    Args:
        batch: number of environments.
        setup: where people are followed.
        tracker: the estimator.
        sensor: in whose images keypoints are found.
    """

    CHANGES = ("state", "keypoints", "sensor", "steps", "frozen", "monitored", "presence")
    LOOKS = IMAGES
    """So many say that nobody is there (`looked`)."""

    def __init__(
        self, batch: int, setup: TrackingSetup, tracker: Estimator, sensor: Sensor
    ) -> None:
        self.setup, self.tracker, self.sensor = setup, tracker, sensor
        n_cameras, n_workers = len(setup.cameras), setup.n_workers
        self.P, self.steps = projections(setup.cameras), np.zeros(batch, int)
        self.state: Any = tracker.init(batch, n_workers)
        self.keypoints = no_keypoints(batch, n_cameras, n_workers)
        self.frozen = make_frozen(batch, n_cameras)
        self.monitored = make_monitor(batch, n_cameras)
        self.presence = Presence(batch, n_workers, setup.coverage)
        self.axes = np.array([(*camera.K[:2, 2], camera.K[0, 0]) for camera in setup.cameras])
        """(C, 3) principal point and focal length [px]."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks of environments `ids`, and what their cameras gave."""
        self.tracker.reset(self.state, ids, tracker_rngs)
        forget_monitor(self.monitored, ids)
        forget_frozen(self.frozen, ids)
        self.presence.forget(ids)
        self.sensor.reset(ids, sensor_rngs)
        self.steps[ids] = 0

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Take in the measurements after the usual time."""
        return self.follow(ids, self.setup.dt_s, sensor_rngs, tracker_rngs)

    def follow(
        self, ids: Ints, dt_s: float, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Predict the workers, look at them where they should be, and update.

        Args:
            ids: (B,) environments.
            dt_s: time since their last update [s].
            sensor_rngs, tracker_rngs: (B,) a generator for each of `ids`.

        Returns:
            What is believed of the workers (B, W, ...), and who is there or unknown.
        """
        whole = len(ids) == len(self.keypoints.px)
        state = self.state if whole else rows(self.state, ids)
        self.tracker.predict(state, dt_s, tracker_rngs)
        expected = self.followed(ids, self.tracker.estimate(state))
        found = pinhole_keypoints(self.detect(ids, expected, sensor_rngs), self.setup.cameras)
        self.steps[ids] += 1
        if found.time_s is not None:
            leave_out_frozen(self.frozen, ids, found)
        keypoints = self._sorted(found, expected)
        self.tracker.update(state, keypoints, tracker_rngs)
        if whole:
            self.keypoints = keypoints
        else:
            write_rows(self.keypoints, ids, keypoints)
            write_rows(self.state, ids, state)
        estimate = self.tracker.estimate(state)
        age_s = self._age_s(ids, keypoints)
        monitor(self.monitored, ids, keypoints, age_s, estimate, self.P, self.axes)
        whole_images = self.looked(ids, age_s) & believed(self.frozen, ids)
        shown = find_unexplained(keypoints, age_s, estimate, self.P, self.axes[:, 2])
        shown.unexplained[:] |= whole_images & self.strangers(ids)
        looks = Looks(whole_images, age_s, self.LOOKS, shown, self.others(ids))
        ours, config = our_joints(estimate, self.setup.calibration), self.tracker.config
        return self.presence.update(ids, ours, found, keypoints, looks, dt_s, config)

    def strangers(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras whose last search found people beside the workers; here the
        keypoints hold all people."""
        return np.zeros((len(ids), len(self.setup.cameras)), np.bool_)

    def followed(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return what is expected of the workers who are to be followed; here, of all."""
        return expected

    def others(self, ids: Ints) -> Others:
        """Return the people beyond the slots; here, there are none."""
        return no_others(len(ids))

    def vacancy(self, ids: Ints) -> Vacancy:
        """Return the state of the floor."""
        return self.presence.vacancy(ids)

    def looked(self, ids: Ints, age_s: Floats) -> Bools:
        """(B, C) which cameras have looked over whole images, of these ages [s]: here, all."""
        return np.isfinite(age_s)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """What the estimator expects."""
        whole = len(ids) == len(self.keypoints.px)
        state = self.state if whole else rows(self.state, ids)
        later = our_joints(self.tracker.forecast(state, horizon_s), self.setup.calibration)
        kept = {name: getattr(now, name) for name in ("unknown", "blind_s", "seen_world")}
        return replace(later, **kept)

    def detect(self, ids: Ints, expected: PoseEstimate, sensor_rngs: Generators) -> Keypoints:
        """Keypoints of environments `ids` in pixels of the images, by the level's detector; whose
        they are is open. `expected` is what the tracker predicts before the measurement."""
        raise NotImplementedError

    def _sorted(self, keypoints: Keypoints, expected: PoseEstimate) -> Keypoints:
        """Keypoints by worker; where there is one worker, whatever was found is theirs."""
        if self.setup.n_workers < 2:
            return keypoints
        return associate(self.P, keypoints, expected, self.setup.association).keypoints

    def suspected(self, ids: Ints) -> Bools:
        """(B, C) which cameras of environments `ids` are thought to be miscalibrated."""
        return self.monitored["suspected"][ids] | self.presence.contradicted(ids)

    def _age_s(self, ids: Ints, keypoints: Keypoints) -> Floats:
        """(B, C) how old the images of this update are, as they say [s]; NaN: none."""
        if keypoints.time_s is None:
            return np.zeros(keypoints.px.shape[:2])
        return self.steps[ids, None] * self.setup.dt_s - keypoints.time_s

    @property
    def given(self) -> Keypoints:
        """The keypoints (B, C, W, J) that the estimator was given last."""
        return self.keypoints

    @property
    def now_s(self) -> Floats:
        """(B,) the present moment by the clock of `Keypoints.time_s` [s]."""
        return self.steps * self.setup.dt_s

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b`."""
        return rows(self.keypoints, np.array([b])), []


def no_keypoints(batch: int, n_cameras: int, n_workers: int) -> Keypoints:
    """Nobody is seen by any camera."""
    shape = (batch, n_cameras, n_workers, N_JOINTS)
    return Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf))
