"""Perception level `pixels`: the pose network, applied to rendered crops."""

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import copy_arrays, one
from hrc_env.core.typing import Capsules, Floats, Ints
from hrc_env.geometry.chains import robot_state
from hrc_env.perception.faults.camera_film import CameraFilm, ScenePose, Shot
from hrc_env.perception.faults.schedule import History, Schedule
from hrc_env.perception.lenses import LensRenderer
from hrc_env.pipeline.image_tracking import ImageSensor, ImageTracking
from hrc_env.pipeline.sensor_input import Generators
from hrc_env.pipeline.tracking import make_setup
from hrc_env.pipeline.worker_detector import WorkerDetector
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig, Look, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rigs import sample_floor
from hrc_env.tracking.estimators import Estimator


class RenderedCameras(ImageSensor):
    """Simulated cameras, for which only the requested windows of the images are rendered.

    Args:
        scene: the scene with the rig's cameras.
        batch: number of environments.
        appearance: distribution from which the scene's appearance is sampled for each episode.
        schedule: schedule of the cameras' images and faults.
        renderer: a renderer of the same scene with any cameras; if None, a new one is created.
    """

    CHANGES = ("history", "episode_looks")

    def __init__(
        self,
        scene: Scene,
        batch: int,
        appearance: AppearanceConfig,
        schedule: Schedule,
        renderer: CropRenderer | None = None,
    ) -> None:
        self.scene, self.appearance = scene, appearance
        self.renderer = renderer or CropRenderer(scene)
        self.film = CameraFilm(LensRenderer(self.renderer, scene.cameras), schedule)
        self.images, self.has_times = self.film, not schedule.is_plain
        self.history = History(batch, schedule)
        self.episode_looks: list[Look | None] = [None] * batch
        """(B,) appearance of each environment's episode; None for the default appearance."""

    def reset(self, ids: Ints, rngs: Generators) -> None:
        """Delete the images of environments `ids`, and sample new faults and a new appearance."""
        self.history.reset(ids, rngs)
        if self.appearance != AS_BUILT:
            for b in ids:
                self.episode_looks[b] = draw_look(self.appearance, self.scene.n_workers, rngs[b])

    def robots_world(self) -> Capsules:
        """Return the robots' capsules (B, K, 2, 3) according to their joint encoders [m]."""
        chain = self.scene.chain
        q = self.now.qpos[:, : chain.n_joints]
        return robot_state(chain, q, np.zeros_like(q)).capsules_world

    def show(self, b: int) -> Floats:
        """Set `images` to those available in environment b, and return their times (C,) [s]."""
        row, history = self.now.ids.tolist().index(b), self.history
        pose = ScenePose(self.now.qpos[row].copy(), copy_arrays(one(self.now.motion, row)))
        step = history.begin_step(b)
        before: Shot | None = history.record_at(b, step - 1)
        seed = history.seeds[b]
        actual = history.schedule_of(b).actual_cameras(self.scene.cameras, seed, step)
        shot = Shot(step, pose, pose if before is None else before.pose, actual)
        arrivals = history.exchange(b, shot)
        self.renderer.randomize(self.episode_looks[b])
        self.film.show(arrivals.records, seed)
        return arrivals.times_s


class PixelPipeline(ImageTracking):
    """The pipeline of level `pixels`, which runs the pose network on rendered crops.

    Args:
        scene: the scene with the rig's cameras.
        batch: number of environments.
        tracker: the estimator.
        config: settings of the environment.
        schedule: schedule of the cameras' images and faults.
        like: a pipeline of the same scene and detector with other cameras, with a renderer and
            networks to be shared; None to create new ones.
    """

    def __init__(
        self,
        scene: Scene,
        batch: int,
        tracker: Estimator,
        config: HRCConfig,
        schedule: Schedule,
        like: "PixelPipeline | None" = None,
    ) -> None:
        setup = make_setup(scene, config)
        detector = WorkerDetector(
            batch,
            scene.cameras,
            scene.n_workers,
            config.detector,
            sample_floor(scene.grounds),
            setup.calibration.sigma,
        )
        renderer = None if like is None else like.cameras.renderer
        self.cameras = RenderedCameras(scene, batch, config.appearance, schedule, renderer)
        super().__init__(batch, setup, tracker, self.cameras, detector)
        self._borrows = like is not None
        if like is not None:
            detector.pose_detector.borrow_networks(like.worker_detector.pose_detector)

    def look_of(self, b: int) -> Look | None:
        """Return the appearance of environment b's episode, or None for the default one."""
        return self.cameras.episode_looks[b]

    def schedule_of(self, b: int) -> Schedule:
        """Return the schedule of environment b's cameras in its episode."""
        return self.cameras.history.schedule_of(b)

    def light_of(self, b: int) -> float:
        """Return the relative light intensity in environment b's episode."""
        look = self.cameras.episode_looks[b]
        return 1.0 if look is None else look.light

    def close(self) -> None:
        """Stop the detector's threads and free the graphics context, unless they are borrowed."""
        if self._borrows:
            return
        super().close()
        self.cameras.renderer.close()
