"""Level `keypoints`: the detector's errors on the projected truth."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import one, rows, write_rows
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception import emulator
from hrc_env.perception.dimness import Quality, quality_of
from hrc_env.perception.faults.fault import IMAGE
from hrc_env.perception.faults.schedule import Recent, Schedule
from hrc_env.pipeline.sensor_input import Generators, TrueSensorInput, TrueState, with_truth
from hrc_env.pipeline.tracking import PoseTracking, no_keypoints, setup_in
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, draw_look
from hrc_env.tracking.estimators import Estimator


class _Look(NamedTuple):
    now: TrueSensorInput
    expected: PoseEstimate
    dim: Quality | None


class EmulatedCameras(TrueState):
    """Cameras and detector in one: what is true goes in, keypoints come out."""

    CHANGES = ("recent", "emulator", "light", "blank")

    def __init__(self, scene: Scene, batch: int, config: HRCConfig, schedule: Schedule) -> None:
        self.scene, self.config, self._batch = scene, config.emulator, batch
        self.recent = None if schedule.is_plain else Recent(batch, schedule)
        self.appearance, self.schedule = config.appearance, schedule
        self.light = np.ones(batch)
        """(B,) the strength of the light in each environment's episode; 1 as it was built."""
        self.blank = np.zeros((batch, len(scene.cameras)), np.bool_)
        """(B, C) whether a camera's picture is blank now."""
        self.emulator = emulator.make_state(
            batch, len(scene.cameras), scene.n_workers, config.ctrl_dt, config.emulator
        )

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Forget images; draw faults, the light and the detector's slow errors."""
        if self.recent is not None:
            self.recent.reset(ids, rngs)
        if self.appearance != AS_BUILT:
            for b in ids:
                self.light[b] = draw_look(self.appearance, self.scene.n_workers, rngs[b]).light
        emulator.reset(self.emulator, ids, rngs)

    def keypoints(self, expected: PoseEstimate, rngs: Generators) -> Keypoints:
        """What is reported of the scene; room, robot and bodies stand in the lines of sight."""
        ids = self.now.ids
        look = _Look(with_truth(self.now), expected, self._dim(ids))
        whole = len(ids) == self._batch
        state = self.emulator if whole else rows(self.emulator, ids)
        if self.recent is None:
            keypoints = self._emulated(look, state, rngs, self.scene.cameras)
        else:
            keypoints = self._arrived(look, state, rngs, self.recent)
        if not whole:
            write_rows(self.emulator, ids, state)
        return keypoints

    def _emulated(
        self, look: _Look, state: Any, rngs: Generators, cameras: tuple[PinholeCamera, ...]
    ) -> Keypoints:
        """What cameras show now; `state` of the errors goes on."""
        now, config = look.now, self.config
        around = self.scene.surroundings(now.qpos, now.motion.held)
        told = look.expected, look.dim
        keypoints = emulator.emulate(state, rngs, now.truth, around, cameras, config, *told)
        if self.scene.n_workers < 2:
            return keypoints
        return emulator.shuffle_workers(keypoints, rngs)

    def _dim(self, ids: Ints) -> Quality | None:
        """Return how well the pictures taken now show people, (B, C); None: as in usual light."""
        if self.appearance == AS_BUILT and not any(f.group == IMAGE for f in self.schedule.faults):
            return None
        steps = np.zeros(len(ids), int) if self.recent is None else self.recent.steps[ids] + 1
        shape = (len(ids), len(self.scene.cameras))
        dim = Quality(np.ones(shape), np.zeros(shape), np.zeros(shape, np.bool_))
        for row, (b, step) in enumerate(zip(ids.tolist(), steps.tolist(), strict=True)):
            light = self.light[b]
            schedule = self.schedule if self.recent is None else self.recent.schedule_of(b)
            for c in range(shape[1]):
                faults = schedule.of(IMAGE, c, step)
                picture = quality_of(float(light), [fault.how_much for _, fault in faults])
                for whole, part in zip(dim, picture, strict=True):
                    whole[row, c] = part
        self.blank[ids] = dim.blank
        return dim

    def _arrived(self, look: _Look, state: Any, rngs: Generators, recent: Recent) -> Keypoints:
        """What has come of every camera: images of now, older ones, or none."""
        rig, ids = self.scene.cameras, look.now.ids.tolist()
        actual = [recent.schedule_of(b).actual(rig, recent.seeds[b], recent.begin(b)) for b in ids]
        if all(cameras is rig for cameras in actual):
            shown = self._emulated(look, state, rngs, rig)
        else:
            shown = no_keypoints(len(ids), len(rig), self.scene.n_workers)
            for row, cameras in enumerate(actual):
                here = np.array([row])
                part = rows(state, here)
                seen = self._emulated(rows(look, here), part, [rngs[row]], cameras)
                write_rows(state, here, part)
                write_rows(shown, here, seen)
        came = no_keypoints(len(ids), len(rig), self.scene.n_workers)
        time_s = np.full(came.px.shape[:2], np.nan)
        for row, b in enumerate(ids):
            records, time_s[row] = recent.arrived(b, one(shown, row))
            for c, record in enumerate(records):
                if record is not None:
                    write_rows(one(one(came, row), c), ..., one(record, c))
        return replace(came, time_s=time_s)


class EmulatorPipeline(PoseTracking):
    """Level `keypoints`: the detector's errors on the projected truth."""

    def __init__(
        self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig, schedule: Schedule
    ) -> None:
        self.cameras = EmulatedCameras(scene, batch, config, schedule)
        super().__init__(batch, setup_in(scene, config), tracker, self.cameras)

    def looked(self, ids: Ints, age_s: Floats) -> Bools:
        """Return (B, C) the cameras whose images have come and are not blank."""
        return super().looked(ids, age_s) & ~self.cameras.blank[ids]

    def schedule_of(self, b: int) -> Schedule:
        """Return the schedule of environment b's cameras in its episode."""
        recent = self.cameras.recent
        return self.cameras.schedule if recent is None else recent.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the strength of the light in environment b's episode."""
        return float(self.cameras.light[b])

    def detect(self, ids: Ints, expected: PoseEstimate, sensor_rngs: Generators) -> Keypoints:
        """What the emulated cameras report of the environments that they were shown."""
        return self.cameras.keypoints(expected, sensor_rngs)
