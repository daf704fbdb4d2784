"""Level `pixels`: rendered crops through the pose network."""

from dataclasses import replace

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import copied, one
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Capsules, Floats, Image, Ints
from hrc_env.core.vacancy import Others
from hrc_env.geometry.chains import robot_state
from hrc_env.perception.faults.camera_film import CameraFilm, Shot
from hrc_env.perception.faults.schedule import Recent, Schedule
from hrc_env.perception.lensed import Lensed
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.sensor_input import Generators, Sensor, Windows
from hrc_env.pipeline.tracking import PoseTracking, no_keypoints
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig, Look, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rigs import floor
from hrc_env.tracking.estimators import Estimator
from hrc_env.tracking.presence import SEARCHES


class RenderedCameras(Sensor):
    """Cameras whose images are drawn of the scene that they are shown, where somebody looks."""

    CHANGES = ("recent", "worn")

    def __init__(
        self, scene: Scene, batch: int, appearance: AppearanceConfig, schedule: Schedule,
        renderer: CropRenderer | None = None,
    ) -> None:  # fmt: skip
        """`renderer`: one of the same scene, whatever its cameras; None: make one."""
        self.scene, self.appearance = scene, appearance
        self.renderer = renderer or CropRenderer(scene)
        self.images = CameraFilm(Lensed(self.renderer, scene.cameras), schedule)
        """An `ImageSource` of what `show` has made present."""
        self.recent = Recent(batch, schedule)
        self.worn: list[Look | None] = [None] * batch
        """How each environment looks in its episode; None: as it was built."""

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Forget images; draw faults and looks of environments `ids`."""
        self.recent.reset(ids, rngs)
        if self.appearance != AS_BUILT:
            for b in ids:
                self.worn[b] = draw_look(self.appearance, self.scene.n_workers, rngs[b])

    def robot_world(self) -> Capsules:
        """Return (B, K, 2, 3) the robots' capsules by their encoders [m]."""
        chain = self.scene.chain
        q = self.now.qpos[:, : chain.n_joints]
        return robot_state(chain, q, np.zeros_like(q)).capsules_world

    def show(self, b: int) -> Floats:
        """Make the images present that have come of environment b. (C,) when each was taken [s], by
        the clock of `Keypoints.time_s`; NaN: there is none."""
        row, recent = self.now.ids.tolist().index(b), self.recent
        pose = self.now.qpos[row].copy(), copied(one(self.now.motion, row))
        step = recent.begin(b)
        before = recent.at(b, step - 1)
        actual = recent.schedule_of(b).actual(self.scene.cameras, recent.seeds[b], step)
        last = pose if before is None else (before.q, before.motion)
        shots, times_s = recent.arrived(b, Shot(step, *pose, last, actual))
        self.renderer.randomize(self.worn[b])
        self.images.show(shots, recent.seeds[b])
        return times_s


class PixelPipeline(PoseTracking):
    """Level `pixels`: rendered crops through the pose network."""

    CHANGES = (*PoseTracking.CHANGES, "looking")
    LOOKS = SEARCHES

    def __init__(
        self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig, schedule: Schedule,
        like: "PixelPipeline | None" = None,
    ) -> None:  # fmt: skip
        """`like`: a pipeline of the same scene and detector with other cameras, whose renderer and
        networks this one uses."""
        renderer = None if like is None else like.cameras.renderer
        self.cameras = RenderedCameras(scene, batch, config.appearance, schedule, renderer)
        super().__init__(batch, scene, tracker, config, self.cameras)
        known = floor(scene.grounds), self.calibration.sigma
        self.looking = Looking(batch, scene.cameras, scene.n_workers, config.detector, *known)
        self._borrows = like is not None
        if like is not None:
            self.looking.detector.borrow_networks(like.looking.detector)

    def detect(self, ids: Ints, expected: PoseEstimate, sensor_rngs: Generators) -> Keypoints:
        """Landmarks of crops round the expected workers, or of a search where there are none."""
        seen = no_keypoints(len(ids), len(self.scene.cameras), self.scene.n_workers)
        time_s, images = np.zeros(seen.px.shape[:2]), self.cameras.images
        capsules_world = self.cameras.robot_world()
        for row, b in enumerate(ids.tolist()):
            time_s[row] = self.cameras.show(b)
            has_image = np.isfinite(time_s[row]).tolist()
            known, robot_world = one(expected, row), capsules_world[row]
            self.looking.look(images, known, b, has_image, one(seen, row), robot_world)
        return replace(seen, time_s=None if self.cameras.recent.schedule.is_plain else time_s)

    def looked(self, ids: Ints, age_s: Floats) -> Bools:
        """(B, C) which cameras' whole images have been searched."""
        return self.looking.looked(ids)

    def strangers(self, ids: Ints) -> Bools:
        """Return (B, C) the cameras whose last search found people beside the workers."""
        return self.looking.unexplained[ids]

    def followed(self, ids: Ints, expected: PoseEstimate) -> PoseEstimate:
        """Return what is expected of the workers who are to be followed."""
        return self.looking.followed(ids, expected)

    def others(self, ids: Ints) -> Others:
        """Return the people beyond the slots."""
        return self.looking.bystanders.others(ids, self.dt_s)

    def reset(self, ids: Ints, sensor_rngs: Generators, tracker_rngs: Generators) -> None:
        """Forget the tracks, and who was followed."""
        super().reset(ids, sensor_rngs, tracker_rngs)
        for b in ids:
            self.looking.forget(int(b))

    def last_detections(self, b: int) -> tuple[Keypoints | None, Windows]:
        """The keypoints of environment `b` and the windows they were found in."""
        return super().last_detections(b)[0], self.looking.windows[b]

    def crops(self, b: int) -> list[Image | None]:
        """What the network was given of the first worker of environment `b`."""
        return self.looking.crops(b)

    def look_of(self, b: int) -> Look | None:
        """How environment b looks in its episode."""
        return self.cameras.worn[b]

    def close(self) -> None:
        """Stop the detector's threads and free the graphics context, unless they are borrowed."""
        if self._borrows:
            return
        self.looking.detector.close()
        self.cameras.renderer.close()
