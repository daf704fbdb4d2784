"""The tracking loop: prediction, detection, update and estimation of presence."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import Stateful, change_fields, rows, write_rows
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Image, Ints
from hrc_env.core.vacancy import Coverage, Others, Vacancy, no_others
from hrc_env.geometry.cameras import PinholeCamera, projections
from hrc_env.perception.calibration import Calibration, read_calibration
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lenses import pinhole_keypoints
from hrc_env.perception.noise import our_joints
from hrc_env.pipeline.sensor_input import Generators, Sensor, Windows
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.rigs import coverage
from hrc_env.tracking.agreement import add_agreement
from hrc_env.tracking.calibration_monitor import forget_monitor, make_monitor, monitor
from hrc_env.tracking.contradiction import find_unexplained
from hrc_env.tracking.estimators import Estimator
from hrc_env.tracking.frozen_frames import (
    find_live_cameras,
    forget_frozen,
    leave_out_frozen,
    make_frozen,
)
from hrc_env.tracking.people.association import AssociationConfig, associate
from hrc_env.tracking.presence import IMAGES, ImageSearches, Presence


class Detections(NamedTuple):
    """The last detections of an environment, which are used in pictures."""

    keypoints: Keypoints | None
    """(1, C, W, J, ...) keypoints of the workers; None if there are no cameras."""
    windows: Windows
    """(W, C) windows in which the keypoints were found; empty if the detector does not use
    windows."""


class PerceptionPipeline(Stateful):
    """A perception level with its estimator, for a batch of environments.

    The base class has no cameras.
    """

    sensor: Sensor
    """The sensor, which must be exposed to the scene (`Sensor.expose`) before `perceive`."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Reset environments `ids`, for new episodes.

        Args:
            ids: indices of environments.
            sensor_rngs: one generator for each environment of the batch.
            tracker_rngs: one generator for each environment of the batch.
        """

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Return the belief about the workers in environments `ids`, updated by the measurement.

        Args:
            ids: (B,) indices of environments.
            sensor_rngs: one generator for each of `ids`.
            tracker_rngs: one generator for each of `ids`.
        """
        raise NotImplementedError

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Forecast the belief for a future time.

        Args:
            now: (B, W, ...) present belief about the workers in environments `ids`.
            ids: (B,) indices of environments.
            horizon_s: time from now to the forecast [s].
        """
        raise NotImplementedError

    def last_detections(self, b: int) -> Detections:
        """Return the last detections of environment `b`, for pictures."""
        return Detections(None, [])

    @property
    def measurements(self) -> Keypoints:
        """Last keypoints (B, C, W, J) that the estimator received.

        Raises `ConfigError` if there are no cameras.
        """
        raise ConfigError("Keypoints need cameras, but this perception level has none.")

    @property
    def now_s(self) -> Floats:
        """Present time (B,) by the clock of `Keypoints.time_s` [s].

        Raises `ConfigError` if there are no cameras.
        """
        raise ConfigError("Frames need cameras, but this perception level has none.")

    def crops(self, b: int) -> list[Image | None]:
        """Return the last crop (C,) of environment `b`'s first worker in each camera."""
        return []

    def look_of(self, b: int) -> Look | None:
        """Return the appearance of environment `b`'s episode, or None for the default one."""
        return None

    def schedule_of(self, b: int) -> Schedule | None:
        """Return the camera schedule of environment `b`'s episode, or None without cameras."""
        return None

    def light_of(self, b: int) -> float:
        """Return the light intensity in environment `b`'s episode, relative to the default."""
        return 1.0

    def suspected_cameras(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of the possibly miscalibrated cameras of environments `ids`."""
        return np.zeros((len(ids), 0), np.bool_)

    def vacancy(self, ids: Ints) -> Vacancy | None:
        """Return the state of the floor of environments `ids`, or None if there are no cameras."""
        return None

    def close(self) -> None:
        """Release threads and graphics contexts."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackingSetup:
    """The cameras, the people and the settings of a tracker."""

    cameras: tuple[PinholeCamera, ...]
    """Cameras of the rig, with their calibrated poses and lenses."""
    n_workers: int
    """Maximum number W of tracked people."""
    coverage: Coverage
    """Patches of floor, and the cameras in which a person on each patch would be visible."""
    dt_s: float
    """Default time between two updates [s]."""
    association: AssociationConfig = field(default_factory=AssociationConfig)
    """Settings of the assignment of detected poses to workers."""
    calibration: Calibration = field(default_factory=read_calibration)
    """Calibration of the errors of the joints detected by the network."""
    is_calibrated: bool = False
    """Whether bounds on the errors of the estimates are calibrated (`safety.error_bounds`)."""
    every: int = 1
    """Number of steps from one image that a camera uses to the next (`DetectorConfig`)."""
    in_turns: bool = False
    """Whether the cameras use images in turns."""


def make_setup(scene: Scene, config: HRCConfig, is_calibrated: bool = False) -> TrackingSetup:
    """Return the setup for tracking the workers of a scene.

    Args:
        scene: the scene with the rig's cameras.
        config: settings of the environment.
        is_calibrated: whether bounds on the errors of the estimates are calibrated.
    """
    return TrackingSetup(
        cameras=scene.cameras,
        n_workers=scene.n_workers,
        coverage=coverage(scene),
        dt_s=config.ctrl_dt,
        association=config.association,
        calibration=config.emulator.make_calibration(),
        is_calibrated=is_calibrated,
        every=config.detector.every,
        in_turns=config.detector.in_turns,
    )


MAX_MEAN_MISFIT = 4.0
"""Mean squared distance of measurements from the estimate above which they disagree, in standard
deviations squared. It is about 0.5 in a settled track, and 10 in one that faces the wrong way."""


class PoseTracking(PerceptionPipeline):
    """A pipeline that tracks people with cameras.

    In each step it predicts the workers, detects them, updates the estimator, and estimates which
    workers are present.

    Args:
        batch: number of environments.
        setup: cameras, people and settings.
        tracker: the estimator.
        sensor: the cameras.
    """

    CHANGES = (
        "state", "keypoints", "sensor", "steps", "disagrees", "frozen", "monitored", "presence",
    )  # fmt: skip
    N_IMAGES = IMAGES
    """Number of whole images without people that prove absence (see `searched_cameras`)."""

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
        self.disagrees = np.zeros(batch, np.bool_)
        """(B,) whether the last measurements of a tracked worker disagree with the estimate."""
        self.presence = Presence(batch, n_workers, setup.coverage)
        self.axes = np.array([(*camera.K[:2, 2], camera.K[0, 0]) for camera in setup.cameras])
        """(C, 3) principal point (x, y) and focal length of each camera [px]."""

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Delete the tracks and the images of environments `ids`."""
        self.tracker.reset(self.state, ids, tracker_rngs)
        forget_monitor(self.monitored, ids)
        forget_frozen(self.frozen, ids)
        self.presence.forget(ids)
        self.sensor.reset(ids, sensor_rngs)
        self.steps[ids], self.disagrees[ids] = 0, False

    def perceive(
        self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Return the belief about the workers in environments `ids` after the default time step."""
        return self.track(ids, self.setup.dt_s, sensor_rngs, tracker_rngs)

    def track(
        self, ids: Ints, dt_s: float, sensor_rngs: Generators, tracker_rngs: Generators
    ) -> PoseEstimate:
        """Predict the workers, detect them, and update the estimator.

        Args:
            ids: (B,) indices of environments.
            dt_s: time since their last update [s].
            sensor_rngs: one generator for each of `ids`.
            tracker_rngs: one generator for each of `ids`.

        Returns:
            Belief about the workers (B, W, ...), including which slots are tracked or unknown.
        """
        whole = len(ids) == len(self.keypoints.px)
        state = self.state if whole else rows(self.state, ids)
        self.tracker.predict(state, dt_s, tracker_rngs)
        expected = self.drop_given_up(ids, self.tracker.estimate(state))
        due = self._find_due_cameras(ids, expected)
        found = pinhole_keypoints(self.detect(ids, expected, due, sensor_rngs), self.setup.cameras)
        self.steps[ids] += 1
        if found.time_s is not None:
            leave_out_frozen(self.frozen, ids, found)
        keypoints = self._associate(found, expected)
        self.tracker.update(state, keypoints, tracker_rngs)
        if whole:
            self.keypoints = keypoints
        else:
            write_rows(self.keypoints, ids, keypoints)
            write_rows(self.state, ids, state)
        estimate = self.tracker.estimate(state)
        age_s = self._age_s(ids, keypoints)
        monitor(self.monitored, ids, keypoints, age_s, estimate, self.P, self.axes)
        whole_images = self.searched_cameras(ids, age_s) & find_live_cameras(self.frozen, ids)
        shown = find_unexplained(keypoints, age_s, estimate, self.P, self.axes[:, 2])
        shown.unexplained[:] |= whole_images & self.cameras_with_others(ids)
        looks = ImageSearches(whole_images, age_s, self.N_IMAGES, shown, self.others(ids))
        estimate = add_agreement(estimate, keypoints, age_s, self.P, self.axes[:, 2])
        if self.setup.every > 1:
            self._compare_measurements(ids, estimate, keypoints)
        if self.setup.is_calibrated:
            calibrated = np.ones(estimate.tracked.shape, np.bool_)
            estimate = change_fields(estimate, calibrated=calibrated)
        ours, config = our_joints(estimate, self.setup.calibration), self.tracker.config
        return self.presence.update(ids, ours, found, keypoints, looks, dt_s, config)

    def cameras_with_others(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of cameras that found people besides workers in the last search.

        The mask of the base class is False, because its keypoints contain all people.
        """
        return np.zeros((len(ids), len(self.setup.cameras)), np.bool_)

    def drop_given_up(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return a prediction without tracks in slots that are being reassigned.

        The base class keeps all tracks.
        """
        return expected

    def others(self, ids: Ints) -> Others:
        """Return the people that are not assigned to a slot; there are none in the base class."""
        return no_others(len(ids))

    def vacancy(self, ids: Ints) -> Vacancy:
        """Return the state of the floor of environments `ids`."""
        return self.presence.vacancy(ids)

    def searched_cameras(self, ids: Ints, age_s: Floats) -> Bools:
        """Return a mask (B, C) of the cameras with a whole image that was searched for people.

        Args:
            ids: (B,) indices of environments.
            age_s: (B, C) ages of the images [s]; NaN for cameras without an image.
        """
        return np.isfinite(age_s)

    def forecast(self, now: PoseEstimate, ids: Ints, horizon_s: float) -> PoseEstimate:
        """Return the estimator's forecast, which retains the present belief about presence."""
        whole = len(ids) == len(self.keypoints.px)
        state = self.state if whole else rows(self.state, ids)
        later = our_joints(self.tracker.forecast(state, horizon_s), self.setup.calibration)
        kept = {name: getattr(now, name) for name in ("unknown", "unobserved_s", "seen_world")}
        return change_fields(later, **kept)

    def detect(
        self, ids: Ints, expected: PoseEstimate, due: Bools, sensor_rngs: Generators
    ) -> Keypoints:
        """Detect the keypoints of people, in image pixels and without association to workers.

        Args:
            ids: (B,) indices of environments.
            expected: (B, W, ...) prediction of the tracker.
            due: (B, C) mask of the cameras whose images are used.
            sensor_rngs: one generator for each of `ids`.
        """
        raise NotImplementedError

    def _compare_measurements(
        self, ids: Ints, estimate: PoseEstimate, keypoints: Keypoints
    ) -> None:
        """Note whether new measurements of tracked workers disagree with the estimate."""
        n_measured = (keypoints.confidence > 0.0).sum((1, 3))
        misfit = estimate.misfit.sum(-1) / np.maximum(n_measured, 1)
        disagrees = (estimate.tracked & (misfit > MAX_MEAN_MISFIT)).any(1)
        is_new = n_measured.any(1)
        self.disagrees[ids] = np.where(is_new, disagrees, self.disagrees[ids])

    def _find_due_cameras(self, ids: Ints, expected: PoseEstimate) -> Bools:
        """Return a mask (B, C) of the cameras whose images are used in this step.

        They are all cameras while a possibly present worker is not tracked, and while measurements
        disagree with an estimate, as at the start of a track that faces the wrong way.
        """
        n_cameras = len(self.setup.cameras)
        if self.setup.every == 1:
            return np.ones((len(ids), n_cameras), np.bool_)
        c = np.arange(n_cameras) * self.setup.in_turns
        due = (self.steps[ids, None] + c) % self.setup.every == 0
        is_known = expected.tracked | self.presence.slots["absent"][ids]
        return due | ~np.all(is_known, axis=1, keepdims=True) | self.disagrees[ids, None]

    def _associate(self, keypoints: Keypoints, expected: PoseEstimate) -> Keypoints:
        """Assign keypoints to the workers. If there is one worker, it is assigned all of them."""
        if self.setup.n_workers < 2:
            return keypoints
        return associate(self.P, keypoints, expected, self.setup.association).keypoints

    def suspected_cameras(self, ids: Ints) -> Bools:
        """Return a mask (B, C) of the possibly miscalibrated cameras of environments `ids`."""
        return self.monitored["suspected"][ids] | self.presence.find_contradicting_cameras(ids)

    def _age_s(self, ids: Ints, keypoints: Keypoints) -> Floats:
        """Return the ages (B, C) of the images from their timestamps [s]; NaN without an image."""
        if keypoints.time_s is None:
            return np.zeros(keypoints.px.shape[:2])
        return self.steps[ids, None] * self.setup.dt_s - keypoints.time_s

    @property
    def measurements(self) -> Keypoints:
        """Last keypoints (B, C, W, J) that the estimator received."""
        return self.keypoints

    @property
    def now_s(self) -> Floats:
        """(B,) present time by the clock of `Keypoints.time_s` [s]."""
        return self.steps * self.setup.dt_s

    def last_detections(self, b: int) -> Detections:
        """Return the last keypoints of environment `b`."""
        return Detections(rows(self.keypoints, np.array([b])), [])


def leave_out_cameras(keypoints: Keypoints, due: Bools, now_s: Floats) -> Keypoints:
    """Return keypoints (B, C, W, ...) without those of cameras that are not due.

    Args:
        keypoints: the keypoints.
        due: (B, C) mask of the cameras whose images are used.
        now_s: (B,) time of images without a timestamp [s].
    """
    if due.all():
        return keypoints
    taken_s = np.repeat(now_s[:, None], due.shape[1], 1)
    taken_s = taken_s if keypoints.time_s is None else keypoints.time_s
    out, none = ~due[:, :, None, None], no_keypoints(*keypoints.px.shape[:3])
    return Keypoints(
        np.where(out[..., None], none.px, keypoints.px),
        np.where(out, none.confidence, keypoints.confidence),
        np.where(out, none.sigma_px, keypoints.sigma_px),
        np.where(due, taken_s, np.nan),
    )


def no_keypoints(batch: int, n_cameras: int, n_workers: int) -> Keypoints:
    """Return keypoints without any detected joint."""
    shape = (batch, n_cameras, n_workers, N_JOINTS)
    return Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf))
