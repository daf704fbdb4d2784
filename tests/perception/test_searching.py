"""Looking for people nobody has told of."""

import numpy as np
import pytest

from hrc_env.core.batching import one
from hrc_env.core.records import Roi
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.cameras import project, projections
from hrc_env.motion import generator
from hrc_env.perception.detector import PoseDetector
from hrc_env.perception.lensed import Lensed
from hrc_env.perception.searching import changed
from hrc_env.scene.build import build
from hrc_env.scene.render import CropRenderer
from hrc_env.worker.body import load_body, worker_truth

WINDOW = Roi((640.0, 360.0), 512.0, 0.0)
HIPS = [JOINT["left_hip"], JOINT["right_hip"]]


def picture(*things):
    """A grey picture with dark rectangles: left, top, width, height."""
    image = np.full((256, 256, 3), 128, np.uint8)
    for left, top, width, height in things:
        image[top : top + height, left : left + width] = 40
    return image


def test_windows_are_laid_round_what_has_changed():
    (place,) = changed(picture((100, 60, 20, 50)), picture(), WINDOW)
    np.testing.assert_allclose(place.centre_px, (640 - 256 + 2 * 110, 360 - 256 + 2 * 85), atol=3)
    assert 1.5 * 100 < place.side_px < 2.2 * 100


def test_parts_of_one_thing_make_one_window_and_far_things_several():
    assert len(changed(picture((100, 60, 20, 25), (102, 88, 20, 25)), picture(), WINDOW)) == 1
    assert len(changed(picture((20, 60, 20, 50), (180, 60, 20, 50)), picture(), WINDOW)) == 2


def test_noise_is_no_person_and_a_change_of_everything_is_looked_at_as_a_whole():
    rng = np.random.default_rng(0)
    noisy = np.clip(picture() + rng.normal(0, 8, (256, 256, 3)), 0, 255).astype(np.uint8)
    assert changed(noisy, picture(), WINDOW) == []
    assert changed(picture((0, 0, 256, 256)), picture(), WINDOW) == [WINDOW]


@pytest.mark.parametrize("name", ["lab", "site"])
def test_a_worker_far_away_is_found(weights, name):
    """On the site nobody is a quarter of the image high."""
    scene = build(name=name, n_workers=1)
    state = generator.make_state(
        1, 1, load_body("worker_1"), generator.MotionConfig(), scene.grounds
    )
    generator.reset(state, np.arange(1), [np.random.default_rng(3)])
    motion = one(generator.current(state), 0)
    renderer = CropRenderer(scene)
    detector, source = PoseDetector(scene.cameras), Lensed(renderer, scene.cameras)
    renderer.draw(scene.home_q, motion)
    found = detector.search(source)
    joints = worker_truth(load_body("worker_1"), motion).joints_world
    hips = project(projections(scene.cameras), joints)[0][0][:, HIPS].mean(1)
    seen = [
        any(np.hypot(*(np.array(w.centre_px) - hip)) < 0.3 * w.side_px for w in windows)
        for windows, hip in zip(found, hips, strict=True)
    ]
    assert sum(seen) >= 2
    detector.close()
    renderer.close()
