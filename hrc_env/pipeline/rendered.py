"""Level `pixels`: rendered crops through the pose network."""

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import copied, one
from hrc_env.core.typing import Capsules, Floats, Ints
from hrc_env.geometry.chains import robot_state
from hrc_env.perception.faults.camera_film import CameraFilm, Shot
from hrc_env.perception.faults.schedule import Recent, Schedule
from hrc_env.perception.lensed import Lensed
from hrc_env.pipeline.image_tracking import ImageSensor, ImageTracking
from hrc_env.pipeline.looking import Looking
from hrc_env.pipeline.sensor_input import Generators
from hrc_env.pipeline.tracking import setup_in
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig, Look, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rigs import sample_floor
from hrc_env.tracking.estimators import Estimator


class RenderedCameras(ImageSensor):
    """Cameras whose images are drawn of the scene that they are shown, where somebody looks."""

    CHANGES = ("recent", "worn")

    def __init__(
        self, scene: Scene, batch: int, appearance: AppearanceConfig, schedule: Schedule,
        renderer: CropRenderer | None = None,
    ) -> None:  # fmt: skip
        """`renderer`: one of the same scene, whatever its cameras; None: make one."""
        self.scene, self.appearance = scene, appearance
        self.renderer = renderer or CropRenderer(scene)
        self.film = CameraFilm(Lensed(self.renderer, scene.cameras), schedule)
        self.images, self.tells_times = self.film, not schedule.is_plain
        self.recent = Recent(batch, schedule)
        self.worn: list[Look | None] = [None] * batch
        """How each environment looks in its episode; None: as it was built."""

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Forget images; draw faults and looks of environments `ids`."""
        self.recent.reset(ids, rngs)
        if self.appearance != AS_BUILT:
            for b in ids:
                self.worn[b] = draw_look(self.appearance, self.scene.n_workers, rngs[b])

    def robots_world(self) -> Capsules:
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
        self.film.show(shots, recent.seeds[b])
        return times_s


class PixelPipeline(ImageTracking):
    """Level `pixels`: rendered crops through the pose network."""

    def __init__(
        self, scene: Scene, batch: int, tracker: Estimator, config: HRCConfig, schedule: Schedule,
        like: "PixelPipeline | None" = None,
    ) -> None:  # fmt: skip
        """`like`: a pipeline of the same scene and detector with other cameras, whose renderer and
        networks this one uses."""
        setup = setup_in(scene, config)
        known = sample_floor(scene.grounds), setup.calibration.sigma
        looking = Looking(batch, scene.cameras, scene.n_workers, config.detector, *known)
        renderer = None if like is None else like.cameras.renderer
        self.cameras = RenderedCameras(scene, batch, config.appearance, schedule, renderer)
        super().__init__(batch, setup, tracker, self.cameras, looking)
        self._borrows = like is not None
        if like is not None:
            looking.detector.borrow_networks(like.looking.detector)

    def look_of(self, b: int) -> Look | None:
        """How environment b looks in its episode."""
        return self.cameras.worn[b]

    def schedule_of(self, b: int) -> Schedule:
        """Return the schedule of environment b's cameras in its episode."""
        return self.cameras.recent.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the strength of the light in environment b's episode."""
        look = self.cameras.worn[b]
        return 1.0 if look is None else look.light

    def close(self) -> None:
        """Stop the detector's threads and free the graphics context, unless they are borrowed."""
        if self._borrows:
            return
        super().close()
        self.cameras.renderer.close()
