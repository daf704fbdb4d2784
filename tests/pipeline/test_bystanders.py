"""More people than slots: they are remembered, make slots unknown, and get one if nearest."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env.core.records import Roi
from hrc_env.core.vacancy import MOST_OTHERS
from hrc_env.geometry.cameras import pinhole, project
from hrc_env.perception.searching import sightings
from hrc_env.pipeline.bystanders import ALONE, BESIDE, EVERY, GIVEN_UP, MISSES, Bystanders

EYES = [(3.0, 3.0, 2.4), (-3.0, 3.0, 2.4), (3.0, -3.0, 2.4), (-3.0, -3.0, 2.4)]
RIG = tuple(
    pinhole(f"c{k}", np.array(eye), np.array([0.0, 0.0, 1.0]), 90.0, 1280, 960)
    for k, eye in enumerate(EYES)
)
ROBOT = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.2]]])
NEAR, FAR = np.array([0.6, 0.0, 0.9]), np.array([-1.6, 0.4, 0.9])
NOBODY = np.full((1, 3), np.nan)


def shown(*hips_world, cameras=(0, 1, 2, 3)):
    """What a search of these cameras finds of people with their hips there."""
    found = [[] for _ in RIG]
    for c in cameras:
        px, depth_m = project(RIG[c].P[None], np.array(hips_world)[None])
        for (x, y), depth in zip(px[0, 0], depth_m[0, 0], strict=True):
            found[c].append(Roi((float(x), float(y)), 2.4 * RIG[c].K[0, 0] / float(depth), 0.0))
    return found


def windows(hips_world):
    """Where cameras look at a worker."""
    return [found[0] for found in shown(hips_world)]


def searched(bystanders, found, taken=(), hips_world=NOBODY, robot_world=ROBOT):
    """Whom the environment has more than it has slots, after one more step and search."""
    bystanders.tick(0)
    bystanders.update(0, found, list(taken), hips_world, robot_world)
    others = bystanders.others(np.array([0]), 0.04)
    return others.hips_world[0][np.isfinite(others.age_s[0])]


def test_people_are_placed_where_lines_of_sight_meet_or_by_their_size():
    both = sightings(shown(NEAR, FAR), RIG)
    assert [one.n_cameras for one in both] == [4, 4]
    for hips in (NEAR, FAR):
        assert min(np.linalg.norm(one.hips_world - hips) for one in both) < 0.05
    alone = sightings(shown(FAR, cameras=[2]), RIG)
    assert [one.n_cameras for one in alone] == [1]
    assert np.linalg.norm(alone[0].hips_world - FAR) < 0.5


def test_who_is_not_followed_counts_as_soon_as_two_cameras_agree():
    bystanders = Bystanders(1, 1, RIG)
    found = searched(bystanders, shown(NEAR, FAR), [windows(NEAR)], NEAR[None])
    assert np.linalg.norm(found - FAR, axis=-1).max() < 0.05
    assert len(found) == 1


def test_whom_one_camera_alone_shows_counts_once_it_goes_on():
    bystanders, seen = Bystanders(1, 1, RIG), shown(FAR, cameras=[1])
    counts = [len(searched(bystanders, seen, [windows(NEAR)], NEAR[None])) for _ in range(ALONE)]
    assert counts == [0] * (ALONE - 1) + [1]


def test_one_camera_need_not_show_them_in_every_search():
    bystanders, nobody = Bystanders(1, 1, RIG), shown(NEAR, cameras=[0, 2])
    counts = []
    for k in range(2 * ALONE):
        found = shown(FAR, cameras=[1]) if k % 2 == 0 else nobody
        counts.append(len(searched(bystanders, found, [windows(NEAR)], NEAR[None])))
    assert counts[2 * ALONE - 2] == 1
    assert not any(counts[: 2 * ALONE - 2])


def test_two_people_shoulder_to_shoulder_are_two():
    bystanders, beside = Bystanders(1, 1, RIG), NEAR + np.array([0.0, 0.4, 0.0])
    found = searched(bystanders, shown(NEAR, beside), [windows(NEAR)], NEAR[None])
    assert len(found) == 1
    assert np.linalg.norm(found[0] - beside) < 0.05


@pytest.mark.parametrize("whom", ["worker", "robot"])
def test_the_workers_themselves_and_the_robot_are_nobody_else(whom):
    hips = NEAR if whom == "worker" else np.array([0.05, 0.0, 0.8])
    bystanders, aside = Bystanders(1, 1, RIG), hips + np.array([0.1, 0.1, 0.0])
    for _ in range(2 * ALONE):
        assert len(searched(bystanders, shown(aside), [windows(NEAR)], NEAR[None])) == 0


@pytest.mark.parametrize("camera", range(len(RIG)))
@pytest.mark.parametrize(("share", "somebody"), [(0.9, 0), (1.1, 1)])
def test_whom_one_camera_shows_close_beside_a_worker_in_its_image_is_that_worker(
    camera, share, somebody
):
    """Of two workers, neither of whom that camera detects where they are."""
    workers = np.array([NEAR, FAR])
    taken = [windows(each) for each in workers]
    window, found = taken[1][camera], [[] for _ in RIG]
    (x, y), other_x = window.centre_px, taken[0][camera].centre_px[0]
    off_px = np.sign(x - other_x) * share * BESIDE * window.side_px
    found[camera] = [replace(window, centre_px=(x + off_px, y))]
    bystanders = Bystanders(1, 2, RIG)
    counts = [len(searched(bystanders, found, taken, workers)) for _ in range(ALONE)]
    assert counts[-1] == somebody


def test_of_more_people_than_are_remembered_those_who_count_stay():
    bystanders, places = Bystanders(1, 1, RIG), np.linspace(-1.6, 1.6, MOST_OTHERS)
    alone = shown(*(np.array([x, -1.5, 0.9]) for x in places), cameras=[3])
    for found in (shown(FAR), alone):
        others = searched(bystanders, found, [windows(NEAR)], NEAR[None])
    assert len(bystanders.people[0]) == MOST_OTHERS
    assert len(others) == 1
    assert np.linalg.norm(others[0] - FAR) < 0.05


def test_who_is_followed_from_now_on_is_nobody_else_any_more():
    bystanders = Bystanders(1, 1, RIG)
    assert len(searched(bystanders, shown(FAR), (), NEAR[None])) == 1
    assert len(searched(bystanders, shown(FAR), [windows(FAR)], FAR[None])) == 0


def test_who_is_hidden_is_remembered_for_a_while_and_then_forgotten():
    bystanders, hips = Bystanders(1, 1, RIG), NEAR[None]
    searched(bystanders, shown(FAR), (), hips)
    left = [len(searched(bystanders, shown(NEAR), [windows(NEAR)], hips)) for _ in range(MISSES)]
    assert left == [1] * (MISSES - 1) + [0]


def test_cameras_search_more_often_while_there_are_others():
    bystanders = Bystanders(1, 1, RIG)

    def next_search():
        for step in range(1, 2 * EVERY):
            bystanders.tick(0)
            if bystanders.is_search_due(0, 5):
                return step
        return None

    assert next_search() == EVERY
    searched(bystanders, shown(FAR), (), NEAR[None])
    assert next_search() == 5


def test_the_slot_goes_to_whoever_is_clearly_nearer_to_the_robot():
    bystanders = Bystanders(1, 1, RIG)
    searched(bystanders, shown(NEAR), [windows(FAR)], FAR[None])
    assert bystanders.given_up[0, 0] == GIVEN_UP
    bystanders = Bystanders(1, 1, RIG)
    searched(bystanders, shown(NEAR - [0.05, 0.4, 0.0]), [windows(NEAR)], NEAR[None])
    assert bystanders.given_up[0, 0] == 0
    bystanders = Bystanders(1, 1, RIG)
    searched(bystanders, shown(NEAR), [windows(FAR)], FAR[None], robot_world=None)
    assert bystanders.given_up[0, 0] == 0


def test_of_more_people_than_vacant_slots_the_nearest_are_proposed():
    bystanders, found = Bystanders(1, 1, RIG), shown(FAR, NEAR)
    nearest = bystanders.select_nearest(found, 1, ROBOT)
    assert [row[0] for row in nearest] == windows(NEAR)
    assert bystanders.select_nearest(found, 2, ROBOT) == found
    assert bystanders.select_nearest(found, 1, None) == found


def test_their_state_is_brought_back():
    bystanders = Bystanders(1, 1, RIG)
    searched(bystanders, shown(FAR), (), NEAR[None])
    state = bystanders.get_state()
    bystanders.forget(0)
    bystanders.set_state(state)
    assert len(bystanders.people[0]) == 1
