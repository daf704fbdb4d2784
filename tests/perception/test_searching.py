"""Looking for people nobody has told of."""

import inspect

import numpy as np
import pytest

from hrc_env.core.batching import one
from hrc_env.core.records import WorkerMotion
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.cameras import image_from_pinhole, inside_image, project, projections
from hrc_env.motion import generator
from hrc_env.perception.detector import PoseDetector
from hrc_env.perception.lenses import LensRenderer
from hrc_env.perception.searching import FITTING, ImageSource, search_windows
from hrc_env.scene.build import build
from hrc_env.scene.domain_randomization import APPEARANCES, draw_look
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rigs import sample_floor
from hrc_env.worker.body import load_body, worker_truth

HIPS = [JOINT["left_hip"], JOINT["right_hip"]]


def moment(scene, seed):
    """A worker of a scene at the beginning of an episode: (1, S, ...)."""
    body = load_body("worker_1")
    state = generator.make_state(1, 1, body, generator.MotionConfig(), scene.grounds)
    generator.reset(state, np.arange(1), [np.random.default_rng(seed)])
    return one(generator.current(state), 0)


class Search:
    """A rig's detector, before a scene drawn with a look of its own."""

    def __init__(self, name):
        self.scene = build(name=name, n_workers=1)
        self.renderer = CropRenderer(self.scene)
        self.source = LensRenderer(self.renderer, self.scene.cameras)
        self.detector = PoseDetector(self.scene.cameras, None, sample_floor(self.scene.grounds))

    def detect(self, q, motion, look=None):
        self.renderer.randomize(look)
        self.renderer.pose(q, motion)
        return self.detector.detect(self.source, [None] * len(self.scene.cameras))

    def close(self):
        self.detector.close()
        self.renderer.close()


@pytest.fixture(scope="module", params=["lab", "site"])
def search(request, weights):
    made = Search(request.param)
    yield made
    made.close()


def moved(motion, metres):
    return WorkerMotion(
        motion.position_world + metres, motion.quaternion_wxyz, motion.velocity_world,
        motion.angular_velocity_world,
    )  # fmt: skip


def seeing(search, motion, sight):
    """How many cameras have found the worker where they are."""
    cameras = search.scene.cameras
    joints = worker_truth(load_body("worker_1"), motion).joints_world
    hips = project(projections(cameras), joints)[0][0][:, HIPS].mean(1)
    return sum(
        window is not None and np.hypot(*(np.array(window.centre_px) - hip)) < 0.3 * window.side_px
        for window, hip in zip(sight.windows, hips, strict=True)
    )


def test_a_source_of_images_gives_windows_of_them_and_nothing_else():
    given = [name for name, _ in inspect.getmembers(ImageSource, inspect.isfunction)]
    assert [name for name in given if not name.startswith("_")] == ["crop"]


@pytest.mark.parametrize("name", ["lab", "site"])
def test_whoever_stands_on_the_floor_is_inside_a_window_that_fits(name):
    scene = build(name=name, n_workers=1)
    feet = sample_floor(scene.grounds)
    for camera in scene.cameras:
        windows = search_windows(camera, feet)
        people = feet + np.array([0, 0.875, 1.75])[:, None, None] * np.array([0, 0, 1.0])
        px, depth_m = project(camera.P[None], people[None])
        low, middle, high = image_from_pinhole(camera, px[0, 0])
        for foot, hip, head in np.stack([low, middle, high], 1)[(depth_m[0, 0] > 0).all(0)]:
            height = np.hypot(*(head - foot))
            assert not inside_image(camera, hip) or any(
                FITTING[0] * height <= w.side_px <= FITTING[1] * height
                and np.abs(hip - w.centre_px).max() + height / 2 <= w.side_px / 2 + 1e-6
                for w in windows
            )
        assert len(windows) < 30


def test_a_worker_far_away_is_found_in_any_light(search):
    """On the site nobody is a quarter of the image high."""
    motion = moment(search.scene, 3)
    for k in range(3):
        look = draw_look(APPEARANCES["varied"], 1, np.random.default_rng(k))
        assert seeing(search, motion, search.detect(search.scene.home_q, motion, look)) >= 2


def test_a_worker_at_the_robot_is_found(search):
    """Half a metre from its pedestal, in front."""
    motion, grounds = moment(search.scene, 3), search.scene.grounds
    front = np.array([1.0, 0.0, 0.0])
    joints = worker_truth(load_body("worker_1"), motion).joints_world[0]
    at = np.append(grounds.robot_xy_m, 0.0) + (grounds.robot_clearance_m + 0.1) * front
    motion = moved(motion, (at - joints[HIPS].mean(0)) * [1, 1, 0])
    assert seeing(search, motion, search.detect(search.scene.home_q, motion)) >= 2


def test_the_robot_is_nobody(search):
    """Eight attitudes and lights: the detector stage takes it for people in most of them."""
    far = moved(moment(search.scene, 3), np.array([0.0, 0.0, -100.0]))
    rng = np.random.default_rng(1000)
    for _ in range(8):
        q = search.scene.home_q + rng.uniform(-1.5, 1.5, len(search.scene.home_q))
        sight = search.detect(q, far, draw_look(APPEARANCES["varied"], 1, rng))
        assert not sight.confidence.any()
