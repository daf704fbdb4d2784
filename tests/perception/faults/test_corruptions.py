"""What faults do to images."""

import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.batching import map_arrays
from hrc_env.core.records import Roi
from hrc_env.perception.faults.camera_film import BLUR_IMAGES, CameraFilm, ScenePose, Shot
from hrc_env.perception.faults.corruptions import CropView, corrupt
from hrc_env.perception.faults.fault import KINDS, FaultConfig
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lenses import LensRenderer
from hrc_env.scene.rig import LAB_CAMERAS, make_cameras
from hrc_env.worker.body import load_body

CAMERA = make_cameras(LAB_CAMERAS[:1])[0]
WHOLE = Roi((960.0, 540.0), 1920.0, 0.0)
CLOSE = Roi((960.0, 540.0), 256.0, 0.0)
SEEDS = (5, 0, 0, 3)
OF_LOOKS = [k for k, each in KINDS.items() if each.group == "image" and k != "motion_blur"]


def spoilt(kind, image, amount=None, window=CLOSE, seeds=SEEDS):
    shown = CropView(image, CAMERA, window, seeds)
    return corrupt(shown, FaultConfig(kind, ("camera_1",), amount))


def grey(level=120, size=256):
    return np.full((size, size, 3), level, np.uint8)


@pytest.mark.parametrize("kind", OF_LOOKS)
@pytest.mark.parametrize(
    "image", [grey(0), grey(255), grey(7, 64)], ids=["black", "white", "small"]
)
def test_whatever_comes_an_image_goes(kind, image):
    low, high = KINDS[kind].bounds
    for amount in (low, None, high):
        for window in (CLOSE, WHOLE, Roi((-900.0, 2000.0), 20.0, 2.0)):
            out = spoilt(kind, image, amount, window)
            assert out.dtype == np.uint8
            assert out.shape == image.shape


@pytest.mark.parametrize("kind", OF_LOOKS)
def test_the_same_numbers_give_the_same_image_and_leave_the_crop_alone(kind):
    image = np.random.default_rng(0).integers(0, 255, (256, 256, 3), np.uint8)
    before = image.copy()
    np.testing.assert_array_equal(spoilt(kind, image), spoilt(kind, image))
    np.testing.assert_array_equal(image, before)


def test_defocus_makes_a_disc_of_a_point():
    image = grey(0)
    image[128, 128] = 255
    out = spoilt("defocus", image, 2.0)[..., 0]
    assert out[128, 128] == pytest.approx(255 / (np.pi * 4), abs=4)
    assert out[128, 132] == 0


def test_noise_has_its_deviation_and_is_new_in_every_image():
    out = spoilt("noise", grey(), 10.0)
    assert out.astype(float).std() == pytest.approx(10.0, abs=0.3)
    assert (out != spoilt("noise", grey(), 10.0, seeds=(5, 0, 0, 4))).any()


def test_dirt_hides_about_its_share_of_the_image_and_stays():
    whole = np.mean(
        [
            (spoilt("dirt", grey(255), 0.2, WHOLE, (seed, 0, 0, 0))[56:200] < 200).mean()
            for seed in range(20)
        ]
    )
    assert whole == pytest.approx(0.2, abs=0.06)
    np.testing.assert_array_equal(
        spoilt("dirt", grey()), spoilt("dirt", grey(), seeds=(5, 0, 0, 99))
    )


def test_a_stop_is_twice_the_light():
    once = spoilt("exposure", grey(100), 1.0)[0, 0, 0]
    assert (once / 100) ** 2.2 == pytest.approx(2.0, abs=0.05)
    assert spoilt("darkness", grey(100), 0.05).mean() < 40


def test_white_balance_turns_grey_to_red():
    assert spoilt("white_balance", grey(100), 0.4)[0, 0].tolist() == [140, 100, 60]


def test_glare_only_brightens():
    out = spoilt("glare", grey(100))
    assert (out > 110).all()


class FakeStage:
    """An image is as bright as the worker is far along x."""

    size_px = 8

    def pose(self, q, motion):
        self.level = motion.position_world[0, 0, 0] * 100

    def view(self, camera, window):
        return np.full((8, 8, 3), round(self.level), np.uint8)


def film(*faults):
    body = load_body("worker_1")
    motions = [map_arrays(rest_motion(body), lambda a: a[None].copy()) for _ in range(2)]
    motions[0].position_world[..., 0], motions[1].position_world[..., 0] = 0.4, 0.8
    rig = make_cameras(LAB_CAMERAS)
    shown = CameraFilm(LensRenderer(FakeStage(), rig), Schedule(LAB_CAMERAS, faults, 0.04))
    q = np.zeros(6)
    before, now = (ScenePose(q, motion) for motion in motions)
    shown.show([Shot(5, now, before, rig), None, None, None], seed=1)
    return shown


def test_without_faults_the_film_shows_the_scene():
    assert (film().crop(0, CLOSE) == 80).all()


def test_a_camera_without_an_image_is_black():
    assert not film().crop(1, CLOSE).any()


def test_an_open_shutter_sees_all_of_the_way():
    shown = film(FaultConfig("motion_blur", ("camera_1",), 0.04))
    expected = np.mean(np.linspace(80, 40, BLUR_IMAGES))
    assert (shown.crop(0, CLOSE) == round(expected)).all()
