"""Workers who are not where their track sends the cameras are looked for elsewhere."""

import numpy as np

from hrc_env.core.records import Roi
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.pipeline.reacquisition import FOLLOWED, PATIENCE, Reacquisition

CAMERAS = tuple(
    pinhole(f"camera_{k}", np.array([x, y, 2.45]), np.array([0.2, 0, 1.0]), 90, 1920, 1080)
    for k, (x, y) in enumerate([(2.9, 2.6), (-2.9, 2.6), (-2.9, -2.6), (2.9, -2.6)])
)
HAS_IMAGE = [True] * 4
WORKER, EXPECTED, OTHER = (0.9, 0.3, 0.95), (1.4, -1.2, 0.95), (0.3, 1.2, 0.95)


def windows(place, side_m=2.3) -> list[Roi | None]:
    """A window a camera round the hips of somebody at a place."""
    px, depth_m = project(projections(CAMERAS), np.array([[place]]))
    return [
        Roi((*px[0, c, 0].tolist(),), side_m * camera.K[0, 0] / depth_m[0, c, 0], 0.0)
        for c, camera in enumerate(CAMERAS)
    ]


def astray(shown: list[bool], n_steps: int = PATIENCE) -> Reacquisition:
    """One worker whom these cameras have shown in each of so many steps."""
    strays = Reacquisition(1, 1, CAMERAS[: len(shown)])
    for _ in range(n_steps):
        strays.count(0, 0, np.array(shown))
    return strays


def people(which: list[int], place=WORKER):
    """What a search of these cameras gives."""
    return [[windows(place)[c]] if c in which else [] for c in range(4)]


def test_cameras_that_have_long_shown_nobody_are_searched():
    assert astray([False] * 4).blind_cameras(0, 0, HAS_IMAGE) == [0, 1, 2, 3]
    assert astray([True, False, False, False]).blind_cameras(0, 0, HAS_IMAGE) == [1, 2, 3]
    assert astray([False] * 4).blind_cameras(0, 0, [True, True, False, True]) == [0, 1, 3]


def test_two_cameras_that_show_the_worker_are_enough_and_one_of_one():
    assert astray([True, True, False, False]).blind_cameras(0, 0, HAS_IMAGE) == []
    assert astray([True]).blind_cameras(0, 0, [True]) == []
    assert astray([False]).blind_cameras(0, 0, [True]) == [0]


def test_it_takes_patience_and_one_sight_begins_it_anew():
    strays = astray([False] * 4, PATIENCE - 1)
    assert strays.blind_cameras(0, 0, HAS_IMAGE) == []
    strays.count(0, 0, np.array([True, True, False, False]))
    strays.count(0, 0, np.array([False] * 4))
    assert strays.blind_cameras(0, 0, HAS_IMAGE) == []


def test_who_is_found_elsewhere_is_looked_at_there_for_a_while():
    strays, expected = astray([False] * 4), windows(EXPECTED)
    strays.learn(0, 0, people([0, 1, 2]), expected, [])
    there = windows(WORKER)
    for _ in range(FOLLOWED):
        assert strays.blind_cameras(0, 0, HAS_IMAGE) == []
        assert strays.choose_windows(0, 0, expected) == [*there[:3], expected[3]]
    assert strays.choose_windows(0, 0, expected) == expected


def test_what_one_camera_finds_alone_and_whom_others_follow_changes_nothing():
    expected = windows(EXPECTED)
    for found, others in ((people([2]), []), (people([0, 1, 2], OTHER), [windows(OTHER)])):
        strays = astray([False] * 4)
        strays.learn(0, 0, found, expected, others)
        assert strays.choose_windows(0, 0, expected) == expected
        assert strays.blind_cameras(0, 0, HAS_IMAGE) == []  # and the next search is not at once


def test_a_camera_that_shows_the_worker_helps_to_find_them():
    """One camera still shows the worker; a blind one finds the same hips: two that agree."""
    strays, expected = astray([True, False, False, False]), windows(EXPECTED)
    expected[0] = windows(WORKER)[0]
    strays.learn(0, 0, people([1]), expected, [])
    assert strays.choose_windows(0, 0, expected)[:2] == windows(WORKER)[:2]
    strays.reset(0, 0)
    assert strays.choose_windows(0, 0, expected) == expected
