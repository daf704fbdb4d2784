"""Unknown is not absent: what looks say of slots in which nobody is tracked."""

import numpy as np
import pytest

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.tracking import oracle
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.presence import IMAGES, forget_presence, make_presence, with_presence

DT, CONFIG = 0.04, TrackerConfig()
LOST_AFTER = round(CONFIG.lost_after_s / DT)


def belief(*tracked: bool, age_s: float = 0.0) -> PoseEstimate:
    shape = (1, len(tracked), N_JOINTS)
    return PoseEstimate(
        np.zeros((*shape, 3)), np.zeros((*shape, 3, 3)), np.zeros((*shape, 3)),
        np.full(shape, age_s), np.array([tracked]),
    )  # fmt: skip


def shown(people: list[list[bool]]) -> Keypoints:
    """Workers (C, W) whom cameras show."""
    confidence = np.repeat(np.array([people], float)[..., None], N_JOINTS, -1)
    return Keypoints(np.zeros((*confidence.shape, 2)), confidence, np.ones(confidence.shape))


class Watch:
    """One environment: a look after the other."""

    def __init__(self, n_workers: int = 1, n_cameras: int = 4) -> None:
        self.known, self.shape = make_presence(1, n_workers, n_cameras), (n_cameras, n_workers)

    def look(self, tracked=(False,), cameras=None, people=None, found=None, age_s=0.0):
        """Whether each slot is unknown, and for how long nobody said anything of it."""
        looked = np.ones((1, self.shape[0]), bool)
        if cameras is not None:
            looked[:] = np.isin(np.arange(self.shape[0]), cameras)
        own = shown(np.zeros(self.shape, bool).tolist() if people is None else people)
        all_found = own if found is None else shown(found)
        said = with_presence(
            self.known, np.arange(1), belief(*tracked), (all_found, own),
            (looked, np.full(looked.shape, age_s), IMAGES), DT, CONFIG,
        )  # fmt: skip
        assert not (said.unknown & said.tracked).any()
        return said.unknown[0].tolist(), said.blind_s[0]


def test_an_empty_place_is_known_to_be_empty_after_enough_looks_of_several_cameras():
    for n_cameras in (4, 2):
        watch = Watch(n_cameras=n_cameras)
        told = [watch.look() for _ in range(IMAGES)]
        first = IMAGES // n_cameras
        assert [unknown for unknown, _ in told] == [[k < first - 1] for k in range(IMAGES)]
        assert told[first - 2][1] == pytest.approx((first - 1) * DT)
        assert told[-1][1] == 0.0


def test_one_camera_alone_never_says_that_nobody_is_there():
    alone, left = Watch(n_cameras=1), Watch()
    assert all(alone.look()[0] == [True] for _ in range(100))
    assert all(left.look(cameras=[2])[0] == [True] for _ in range(100))


def test_who_is_tracked_is_known_and_who_was_lost_may_hide_until_that_is_forgotten():
    watch = Watch()
    assert watch.look((True,))[0] == [False]
    told = [watch.look() for _ in range(round(6.0 / DT) + 1)]
    assert [unknown for unknown, _ in told] == [[True]] * (len(told) - 2) + [[False]] * 2
    assert told[50][1] == pytest.approx(51 * DT)
    assert watch.look((True,))[0] == [False]


def test_where_somebody_was_seen_last_is_kept_until_it_is_known_that_nobody_is_there():
    known, nobody = make_presence(1, 1, 4), shown(np.zeros((4, 1), bool).tolist())
    ages_s, seen = [None, 0.0, 0.0, DT, 2 * DT, 1.0, *[None] * round(6.0 / DT)], []
    for k, age_s in enumerate(ages_s):
        now = belief(age_s is not None, age_s=age_s or 0.0)
        now.mean_world[:] = k
        looks = np.full((1, 4), k > 0), np.zeros((1, 4)), IMAGES
        said = with_presence(known, np.arange(1), now, (nobody, nobody), looks, DT, CONFIG)
        seen.append(said.seen_world[0, 0, 0, 0])
    gone = np.flatnonzero(np.isnan(seen))
    assert gone[0] == 0
    assert seen[1 : gone[1]] == [1.0] + [2.0] * (gone[1] - 2)
    assert gone[1:].tolist() == list(range(gone[1], len(ages_s)))
    assert not said.unknown.any()


def test_a_lost_worker_whom_one_camera_still_shows_stays_unknown():
    watch, seen = Watch(), [[True], [False], [False], [False]]
    watch.look((True,))
    assert all(watch.look(people=seen)[0] == [True] for _ in range(500))


def test_absence_is_forgotten_when_cameras_give_no_images():
    watch = Watch()
    for _ in range(IMAGES):
        watch.look()
    told = [watch.look(cameras=[]) for _ in range(LOST_AFTER + 3)]
    unknown = [each[0][0] for each in told]
    assert unknown == [False] * (LOST_AFTER - 1) + [True] * 4
    assert told[-1][1] == pytest.approx((LOST_AFTER + 3) * DT)
    assert [watch.look()[0] for _ in range(2)] == [[True], [False]]


def test_images_are_as_old_as_they_say():
    watch = Watch()
    assert watch.look(age_s=0.2)[0] == [True]
    assert watch.look(age_s=0.2)[1] == pytest.approx(0.2)
    old = Watch()
    assert all(old.look(age_s=1.2)[0] == [True] for _ in range(50))


def test_somebody_whom_a_camera_shows_beside_those_who_are_tracked_is_unknown():
    watch, both = Watch(2), [[True, True]] + 3 * [[True, False]]
    own = 4 * [[True, False]]
    for _ in range(IMAGES):
        assert watch.look((True, False), people=own)[0][0] is False
    assert watch.look((True, False), people=own)[0] == [False, False]
    assert watch.look((True, False), people=own, found=both)[0] == [False, True]


def test_a_reset_forgets_what_was_known_of_its_environment():
    known = make_presence(2, 1, 4)
    looked, nobody = np.ones((2, 4), bool), shown(np.zeros((4, 1), bool).tolist())
    both = Keypoints(*(np.repeat(a, 2, 0) for a in (nobody.px, nobody.confidence, nobody.sigma_px)))
    two = oracle.prior(2, 1, CONFIG)
    ids, times = np.arange(2), (looked, np.zeros(looked.shape), IMAGES)
    for _ in range(2):
        said = with_presence(known, ids, two, (both, both), times, DT, CONFIG)
    assert not said.unknown.any()
    forget_presence(known, np.array([1]))
    said = with_presence(known, ids, two, (both, both), times, DT, CONFIG)
    assert said.unknown[:, 0].tolist() == [False, True]


def test_an_estimate_of_which_nobody_says_more_calls_unknown_whoever_has_no_track():
    said = belief(True, False, age_s=0.3)
    assert said.unknown.tolist() == [[False, True]]
    assert said.blind_s.tolist() == [[0.3, 0.3]]
