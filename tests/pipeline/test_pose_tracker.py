"""Images of any origin: what they must be, and what those say that show nothing."""

import cv2
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.cameras import pinhole
from hrc_env.pipeline.pose_tracker import PoseTracker
from hrc_env.tracking.presence import SEARCHES

THERE = np.array([0.0, 0.0, 1.0])
RIG = tuple(
    pinhole(f"c{k}", np.array(eye), THERE, 70.0, 640, 480)
    for k, eye in enumerate([(3.0, 3.0, 2.4), (-3.0, 3.0, 2.4)])
)
APART = (RIG[0], pinhole("away", RIG[0].eye_world, 2 * RIG[0].eye_world - THERE, 70.0, 640, 480))
GRID = np.meshgrid([-0.5, 0.0, 0.5], [-0.5, 0.0, 0.5], [0.0])
FLOOR = np.stack([axis.ravel() for axis in GRID], 1)
NOISE = np.random.default_rng(0).integers(0, 255, (256, 256, 3), np.uint8)
ROOM = cv2.normalize(cv2.GaussianBlur(NOISE, (0, 0), 9), None, 40, 200, cv2.NORM_MINMAX)


class Films:
    """Every crop is the same picture of nobody, with a sensor's noise in one pixel."""

    def __init__(self, picture, noise=0):
        self.picture = picture
        if noise:
            self.picture = picture.copy()
            self.picture[0, 0, 0] ^= noise

    def crop(self, camera_index, window):
        return self.picture


def unknown(picture, cameras=RIG, floor_world=None, n_frames=70, stuck=False):
    """Whether somebody may still be there after so many frames."""
    tracker = PoseTracker(cameras, floor_world=floor_world)
    for frame in range(n_frames):
        estimate = tracker.update(Films(picture, 0 if stuck else frame % 8))
    tracker.close()
    assert not estimate.tracked.any()
    return bool(estimate.unknown[0, 0])


@pytest.mark.parametrize("floor_world", [None, FLOOR])
def test_a_place_that_two_cameras_see_and_that_shows_nobody_is_empty_after_enough_searches(
    floor_world,
):
    assert unknown(ROOM, floor_world=floor_world, n_frames=SEARCHES // 2)
    assert not unknown(ROOM, floor_world=floor_world)


def test_cameras_that_are_stuck_never_say_that_a_place_is_empty():
    assert unknown(ROOM, stuck=True)


def test_cameras_that_see_nothing_in_common_or_not_all_of_the_floor_never_say_that_it_is_empty():
    assert unknown(ROOM, cameras=APART)
    assert unknown(ROOM, floor_world=np.append(FLOOR, [[9.0, 9.0, 0.0]], 0))
    assert unknown(ROOM, cameras=RIG[:1])


@pytest.mark.parametrize("colour", [(0, 0, 0), (3, 3, 3), (255, 255, 255), (20, 60, 200)])
def test_pictures_that_show_nothing_say_nothing(colour):
    noise = np.random.default_rng(1).integers(0, 2, (256, 256, 3))
    assert unknown(np.clip(np.array(colour) + noise, 0, 255).astype(np.uint8))


@pytest.mark.parametrize("base", [0, 20, 128])
def test_noise_alone_says_nothing(base):
    """Its standard deviation is that of a picture."""
    noise = np.random.default_rng(1).normal(base, 6.0, (256, 256, 3))
    assert unknown(np.clip(noise, 0, 255).astype(np.uint8))


def test_a_dull_picture_of_nobody_shows_that_nobody_is_there():
    assert not unknown(np.round(40 + 0.2 * ROOM).astype(np.uint8))


@pytest.mark.parametrize(
    ("picture", "says"),
    [
        ((ROOM / 255).astype(np.float32), r"uint8.*camera 0 gave a float32 array.*255 \* image"),
        (ROOM.astype(np.int16), "uint8.*int16"),
        (ROOM[..., 0], r"shape \(256, 256, 3\).*gave \(256, 256\).*grey"),
        (np.concatenate([ROOM, ROOM[..., :1]], 2), r"gave \(256, 256, 4\)"),
        (ROOM[:128], r"gave \(128, 256, 3\)"),
        (ROOM.tolist(), "numpy arrays.*gave a list"),
        (None, "gave a NoneType"),
    ],
)
def test_crops_of_another_kind_are_refused_in_words(picture, says):
    tracker = PoseTracker(RIG)
    with pytest.raises(ConfigError, match=f"(?s){says}"):
        tracker.update(Films(picture))
    tracker.close()
