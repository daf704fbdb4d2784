"""Level `pixels`: rendered crops through the pose network."""

from dataclasses import replace
from typing import Any

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import copied, one
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Floats, Image, Ints
from hrc_env.perception.faults.camera_film import CameraFilm, Shot
from hrc_env.perception.faults.schedule import Recent, Schedule
from hrc_env.perception.lensed import Lensed
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.sensor_input import Generators, SensorInput, Windows
from hrc_env.pipeline.tracking import PoseTracking, no_keypoints
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, Look, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rigs import floor
from hrc_env.tracking.estimators import Estimator


class PixelPipeline(PoseTracking):
    """Level `pixels`: rendered crops through the pose network."""

    CHANGES = (*PoseTracking.CHANGES, "looking", "worn")

    def __init__(
        self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig, schedule: Schedule
    ) -> None:
        super().__init__(batch, scene, tracker, config, schedule)
        self.renderer = CropRenderer(scene)
        self.lensed = Lensed(self.renderer, scene.cameras)
        film = None if schedule.is_plain else CameraFilm(self.renderer, self.lensed, schedule)
        self.images = film or self.lensed
        self.appearance = config.appearance
        self.worn: list[Look | None] = [None] * batch
        """How each environment looks in its episode; None: as it was built."""
        rig, floor_world = scene.cameras, floor(scene.grounds)
        self.looking = Looking(batch, rig, scene.n_workers, config.detector, floor_world)

    def detect(self, now: SensorInput, predicted: Any, sensor_rngs: Generators) -> Keypoints:
        """Landmarks of crops round the predicted worker, or of a search where there is none."""
        seen = no_keypoints(len(now.ids), len(self.scene.cameras), self.scene.n_workers)
        time_s = np.zeros(seen.px.shape[:2])
        expected = self.tracker.estimate(predicted)
        for row, b in enumerate(now.ids.tolist()):
            self.renderer.randomize(self.worn[b])
            if self.recent is None:
                self.renderer.draw(now.q[row], one(now.motion, row))
            else:
                time_s[row] = self._take_images(now, row, b, self.recent)
            has_image = np.isfinite(time_s[row]).tolist()
            self.looking.look(self.images, one(expected, row), b, has_image, one(seen, row))
        return replace(seen, time_s=None if self.recent is None else time_s)

    def _take_images(self, now: SensorInput, row: int, b: int, recent: Recent) -> Floats:
        """Let every camera show what has come of it. (C,) its time; NaN for nothing."""
        step, pose = recent.begin(b), (now.q[row].copy(), copied(one(now.motion, row)))
        before = recent.at(b, step - 1)
        actual = recent.schedule.actual(self.scene.cameras, recent.seeds[b], step)
        last = pose if before is None else (before.q, before.motion)
        shots, times_s = recent.arrived(b, Shot(step, *pose, last, actual))
        if isinstance(self.images, CameraFilm):
            self.images.show(shots, recent.seeds[b])
        return times_s

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks, and who was followed."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            self.looking.forget(int(b))
            if self.appearance != AS_BUILT:
                self.worn[b] = draw_look(self.appearance, self.scene.n_workers, sensor_rngs[b])

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b` and the windows they were found in."""
        return super().last_detections(b)[0], self.looking.windows[b]

    def crops(self, b: int) -> list[Image | None]:
        """What the network was given of the first worker of environment `b`."""
        return self.looking.crops(b)

    def look_of(self, b: int) -> Look | None:
        """How environment b looks in its episode."""
        return self.worn[b]

    def close(self) -> None:
        """Stop the detector's thread and free the graphics context."""
        self.looking.detector.close()
        self.renderer.close()
