"""A search: people whom several cameras agree on, and nobody else."""

import numpy as np

from hrc_env.core.records import Roi
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.perception.plausibility import has_body, is_standing
from hrc_env.perception.searching import agreed_windows, exclude_people, propose_people
from hrc_env.tracking.tree.state import STANDING_M

CAMERAS = tuple(
    pinhole(f"camera_{k}", np.array([x, y, 2.45]), np.array([0.2, 0, 1.0]), 90, 1920, 1080)
    for k, (x, y) in enumerate([(2.9, 2.6), (-2.9, 2.6), (-2.9, -2.6), (2.9, -2.6)])
)
ANNA, BEN = np.array([0.9, 0.3, 0.95]), np.array([1.2, -1.3, 0.95])


def seen(*people, side_m=2.3):
    """(C, people) windows round the hips of people at these places, so large in the world."""
    px, depth_m = project(projections(CAMERAS), np.array([people]))
    return [
        [
            Roi((u, v), side_m * camera.K[0, 0] / far_m, 0.0)
            for (u, v), far_m in zip(places, depths, strict=True)
        ]
        for camera, places, depths in zip(CAMERAS, px[0], depth_m[0], strict=True)
    ]


def test_one_person_is_found_by_all_cameras():
    candidates = seen(ANNA)
    assert agreed_windows(candidates, CAMERAS) == [found[0] for found in candidates]


def test_a_mistake_of_one_camera_is_left_out():
    candidates = seen(ANNA)
    candidates[1] = [Roi((100.0, 200.0), 400.0, 0.0)]
    windows = agreed_windows(candidates, CAMERAS)
    assert windows[1] is None
    assert windows[0] == candidates[0][0]


def test_of_two_people_all_cameras_choose_the_same():
    """Two cameras have one of them first, two the other."""
    both = seen(ANNA, BEN)
    candidates = [both[0], both[1][::-1], both[2], both[3][::-1]]
    windows = agreed_windows(candidates, CAMERAS)
    anna, ben = ([found[k] for found in both] for k in (0, 1))
    assert windows in (anna, ben)


def test_somebody_already_followed_is_not_found_again():
    both = seen(ANNA, BEN)
    anna, ben = ([found[k] for found in both] for k in (0, 1))
    assert agreed_windows(exclude_people(both, [anna]), CAMERAS) == ben


def test_a_camera_that_is_alone_is_believed_and_one_of_several_is_not():
    alone = seen(ANNA)[:1]
    assert agreed_windows(alone, CAMERAS[:1]) == [alone[0][0]]
    assert agreed_windows([*alone, [], [], []], CAMERAS) == [None] * 4


def test_a_contradiction_is_nobody():
    contradiction = [seen(ANNA)[0], [Roi((100.0, 200.0), 400.0, 0.0)], [], []]
    assert agreed_windows(contradiction, CAMERAS) == [None] * 4


def test_what_is_not_as_large_as_a_person_is_nobody():
    """A robot's wrist that all cameras take for somebody."""
    for side_m in (0.4, 5.0):
        assert agreed_windows(seen(ANNA, side_m=side_m), CAMERAS) == [None] * 4
    kneeling = seen(ANNA, side_m=1.3)
    assert agreed_windows(kneeling, CAMERAS) == [found[0] for found in kneeling]


def test_an_empty_room_has_nobody():
    assert agreed_windows([[]] * 4, CAMERAS) == [None] * 4


def test_whom_several_cameras_agree_on_comes_before_whom_only_one_has_found():
    candidates = [list(found) for found in seen(ANNA)]
    candidates[2] = [Roi((100.0, 200.0), 400.0, 0.0)]
    together, *alone = propose_people(candidates, CAMERAS)
    assert [window is not None for window in together] == [True, True, False, True]
    assert alone == [[None, None, candidates[2][0], None]]


UPRIGHT = STANDING_M + np.array([*ANNA[:2], 1.2])


def keypoints(joints_world, n_cameras=4):
    """What the first cameras see of joints (J, 3), to the pixel."""
    px, _ = project(projections(CAMERAS), joints_world[None])
    shape = len(CAMERAS), len(joints_world)
    px = np.where(np.arange(len(CAMERAS))[:, None, None] < n_cameras, px[0], np.nan)
    return px, np.full(shape, 0.9), np.full(shape, 3.0)


def test_a_person_is_a_body_and_what_has_other_bones_is_not():
    rng = np.random.default_rng(0)
    assert has_body(*keypoints(UPRIGHT), CAMERAS)
    assert has_body(*keypoints(UPRIGHT, 2), CAMERAS)
    assert not has_body(*keypoints(UPRIGHT, 1), CAMERAS)
    shrunk = ANNA + 0.5 * (UPRIGHT - ANNA)
    scattered = ANNA + rng.uniform(-0.6, 0.6, UPRIGHT.shape)
    for nobody in (shrunk, scattered):
        assert not has_body(*keypoints(nobody), CAMERAS)


def test_one_camera_is_believed_of_who_stands_on_the_floor():
    sure, floor_world = np.full(len(UPRIGHT), 0.9), np.array([[*ANNA[:2], 0.0]])
    half, above = UPRIGHT * [1, 1, 0.5], UPRIGHT + np.array([0, 0, 1.0])
    px = {name: keypoints(body)[0][0] for name, body in
          (("upright", UPRIGHT), ("half", half), ("above", above))}  # fmt: skip
    assert is_standing(px["upright"], sure, CAMERAS[0], floor_world)
    assert not is_standing(px["half"], sure, CAMERAS[0], floor_world)
    assert not is_standing(px["above"], sure, CAMERAS[0], floor_world)
    assert not is_standing(px["upright"], sure, CAMERAS[0], floor_world + np.array([2.0, 0, 0]))
    assert not is_standing(px["upright"], 0.5 * sure, CAMERAS[0], floor_world)
    assert not is_standing(px["upright"] * np.nan, sure, CAMERAS[0], floor_world)
