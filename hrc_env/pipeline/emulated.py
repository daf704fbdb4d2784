"""Perception level `keypoints`: projections of the true joints with the detector's errors."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import one, rows, write_rows
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception import emulator
from hrc_env.perception.dimness import Quality, picture_quality
from hrc_env.perception.emulator import EmulatorState
from hrc_env.perception.faults.fault import IMAGE
from hrc_env.perception.faults.schedule import History, Schedule
from hrc_env.pipeline.sensor_input import Generators, TrueSensorInput, TrueState, require_truth
from hrc_env.pipeline.tracking import PoseTracking, leave_out_cameras, make_setup, no_keypoints
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, draw_look
from hrc_env.tracking.estimators import Estimator


class _Exposure(NamedTuple):
    """The scene of a step, and the conditions under which the detector works."""

    now: TrueSensorInput
    """The scene with the true states of the workers."""
    expected: PoseEstimate
    """Prediction of the tracker for this step."""
    dim: Quality | None
    """(B, C) quality of the images; None in normal light."""


class EmulatedCameras(TrueState):
    """An emulator of cameras and detector that computes keypoints from the true poses.

    Args:
        scene: the scene with the rig's cameras.
        batch: number B of environments.
        config: settings of the environment.
        schedule: schedule of the cameras' images and faults.
    """

    CHANGES = ("history", "emulator", "light", "blank")

    def __init__(self, scene: Scene, batch: int, config: HRCConfig, schedule: Schedule) -> None:
        self.scene, self.config, self._batch = scene, config.emulator, batch
        self.history = None if schedule.is_plain else History(batch, schedule)
        self.appearance, self.schedule = config.appearance, schedule
        self.light = np.ones(batch)
        """(B,) light intensity in the present episode of each environment, relative to the
        default."""
        self.blank = np.zeros((batch, len(scene.cameras)), np.bool_)
        """(B, C) mask of the cameras with a blank present image."""
        self.emulator = emulator.make_state(
            batch, len(scene.cameras), scene.n_workers, config.ctrl_dt, config.emulator
        )

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Delete the images of environments `ids`; sample new faults, light and lasting errors."""
        if self.history is not None:
            self.history.reset(ids, rngs)
        if self.appearance != AS_BUILT:
            for b in ids:
                self.light[b] = draw_look(self.appearance, self.scene.n_workers, rngs[b]).light
        emulator.reset(self.emulator, ids, rngs)

    def keypoints(self, expected: PoseEstimate, rngs: Generators) -> Keypoints:
        """Return the keypoints of the present scene; see `emulator.emulate`.

        Args:
            expected: (B, W, ...) prediction of the tracker.
            rngs: one generator for each environment.
        """
        ids = self.now.ids
        exposure = _Exposure(require_truth(self.now), expected, self._picture_quality(ids))
        is_whole = len(ids) == self._batch
        state = self.emulator if is_whole else rows(self.emulator, ids)
        if self.history is None:
            keypoints = self._emulate(exposure, state, rngs, self.scene.cameras)
        else:
            keypoints = self._emulate_frames(exposure, state, rngs, self.history)
        if not is_whole:
            write_rows(self.emulator, ids, state)
        return keypoints

    def _emulate(
        self,
        exposure: _Exposure,
        state: EmulatorState,
        rngs: Generators,
        cameras: tuple[PinholeCamera, ...],
    ) -> Keypoints:
        """Return the keypoints of a scene in these cameras, and advance the state of the errors."""
        now = exposure.now
        keypoints = emulator.emulate(
            state,
            rngs,
            now.truth,
            self.scene.surroundings(now.qpos, now.motion.held),
            cameras,
            self.config,
            exposure.expected,
            exposure.dim,
        )
        if self.scene.n_workers < 2:
            return keypoints
        return emulator.shuffle_workers(keypoints, rngs)

    def _picture_quality(self, ids: Ints) -> Quality | None:
        """Return the quality (B, C) of the images taken now, or None in normal light."""
        if self.appearance == AS_BUILT and not any(f.group == IMAGE for f in self.schedule.faults):
            return None
        steps = np.zeros(len(ids), int) if self.history is None else self.history.steps[ids] + 1
        shape = (len(ids), len(self.scene.cameras))
        dim = Quality(np.ones(shape), np.zeros(shape), np.zeros(shape, np.bool_))
        for row, (b, step) in enumerate(zip(ids.tolist(), steps.tolist(), strict=True)):
            light = self.light[b]
            schedule = self.schedule if self.history is None else self.history.schedule_of(b)
            for c in range(shape[1]):
                faults = schedule.faults_of(IMAGE, c, step)
                amounts = [each.fault.max_amount for each in faults]
                for array, value in zip(dim, picture_quality(float(light), amounts), strict=True):
                    array[row, c] = value
        self.blank[ids] = dim.blank
        return dim

    def _emulate_frames(
        self, exposure: _Exposure, state: EmulatorState, rngs: Generators, history: History
    ) -> Keypoints:
        """Return the keypoints of the images that are available at the present step.

        A camera may have delivered the present image, an older one, or none.
        """
        rig, ids = self.scene.cameras, exposure.now.ids.tolist()
        actual = [
            history.schedule_of(b).actual_cameras(rig, history.seeds[b], history.begin_step(b))
            for b in ids
        ]
        if all(cameras is rig for cameras in actual):
            taken = self._emulate(exposure, state, rngs, rig)
        else:
            taken = no_keypoints(len(ids), len(rig), self.scene.n_workers)
            for row, cameras in enumerate(actual):
                here = np.array([row])
                part = rows(state, here)
                seen = self._emulate(rows(exposure, here), part, [rngs[row]], cameras)
                write_rows(state, here, part)
                write_rows(taken, here, seen)
        came = no_keypoints(len(ids), len(rig), self.scene.n_workers)
        time_s = np.full(came.px.shape[:2], np.nan)
        for row, b in enumerate(ids):
            records, time_s[row] = history.exchange(b, one(taken, row))
            for c, record in enumerate(records):
                if record is not None:
                    write_rows(one(one(came, row), c), ..., one(record, c))
        return replace(came, time_s=time_s)


class EmulatorPipeline(PoseTracking):
    """The pipeline of level `keypoints`, which uses an emulator of the detector."""

    def __init__(
        self,
        scene: Scene,
        batch: int,
        tracker: Estimator,
        config: HRCConfig,
        schedule: Schedule,
        is_calibrated: bool,
    ) -> None:
        self.cameras = EmulatedCameras(scene, batch, config, schedule)
        super().__init__(batch, make_setup(scene, config, is_calibrated), tracker, self.cameras)

    def searched_cameras(self, ids: Ints, age_s: Floats) -> Bools:
        """Return a mask (B, C) of the cameras with an available image that is not blank."""
        return super().searched_cameras(ids, age_s) & ~self.cameras.blank[ids]

    def schedule_of(self, b: int) -> Schedule:
        """Return the schedule of environment b's cameras in its episode."""
        history = self.cameras.history
        return self.cameras.schedule if history is None else history.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the relative light intensity in environment b's episode."""
        return float(self.cameras.light[b])

    def detect(
        self, ids: Ints, expected: PoseEstimate, due: Bools, sensor_rngs: Generators
    ) -> Keypoints:
        """Return the keypoints of the emulated cameras in environments `ids`."""
        now_s = (self.steps[ids] + 1) * self.setup.dt_s
        return leave_out_cameras(self.cameras.keypoints(expected, sensor_rngs), due, now_s)
