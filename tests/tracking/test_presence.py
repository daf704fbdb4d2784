"""Unknown is not absent: what looks say of slots in which nobody is tracked."""

import numpy as np
import pytest

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.vacancy import EMPTY, POSSIBLE, PROBABLY_EMPTY, Coverage, no_others
from hrc_env.tracking import oracle
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.contradiction import DetectedPoses
from hrc_env.tracking.presence import AGREED, CONTRADICTED, IMAGES, SEVERAL, ImageSearches, Presence

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


def looks(whole, age_s=0.0, strangers=None):
    """Of one update: which cameras (B, C) looked, and which of them show strangers."""
    whole = np.asarray(whole, bool)
    strange = np.zeros(whole.shape, bool) if strangers is None else strangers
    shown = DetectedPoses(np.zeros_like(whole), strange)
    return ImageSearches(whole, np.full(whole.shape, age_s), IMAGES, shown, no_others(len(whole)))


def floor(cameras):
    """One piece of floor for each set of cameras (G, C)."""
    cameras = np.array(cameras, bool)
    return Coverage(np.zeros((len(cameras), 3)), 0.1, np.arange(len(cameras)), cameras)


def everywhere(n_cameras):
    return floor(np.ones((1, n_cameras)))


class Watch:
    """One environment: a look after the other."""

    def __init__(self, n_workers=1, n_cameras=4, cameras=None) -> None:
        sees = everywhere(n_cameras) if cameras is None else floor(cameras)
        self.known, self.shape = Presence(1, n_workers, sees), (sees.cameras.shape[1], n_workers)

    def estimate(self, tracked=(False,), cameras=None, people=None, found=None, age_s=0.0, odd=()):
        looked = np.ones((1, self.shape[0]), bool)
        if cameras is not None:
            looked[:] = np.isin(np.arange(self.shape[0]), cameras)
        own = shown(np.zeros(self.shape, bool).tolist() if people is None else people)
        all_found = own if found is None else shown(found)
        strange = np.isin(np.arange(self.shape[0]), odd)[None]
        seen = looks(looked, age_s, strange)
        return self.known.update(np.arange(1), belief(*tracked), all_found, own, seen, DT, CONFIG)

    def look(self, *args, **more):
        """Whether each slot is unknown, and for how long nobody said anything of it."""
        said = self.estimate(*args, **more)
        assert not (said.unknown & said.tracked).any()
        return said.unknown[0].tolist(), said.unobserved_s[0]

    @property
    def floor(self):
        """What is known of each group of floor, for the first slot."""
        return self.known.vacancy(np.arange(1)).level[0, 0].tolist()


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
    known, nobody = Presence(1, 1, everywhere(4)), shown(np.zeros((4, 1), bool).tolist())
    ages_s, seen = [None, 0.0, 0.0, DT, 2 * DT, 1.0, *[None] * round(6.0 / DT)], []
    for k, age_s in enumerate(ages_s):
        now = belief(age_s is not None, age_s=age_s or 0.0)
        now.mean_world[:] = k
        seen_now = looks(np.full((1, 4), k > 0))
        said = known.update(np.arange(1), now, nobody, nobody, seen_now, DT, CONFIG)
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
    known, nobody = Presence(2, 1, everywhere(4)), shown(np.zeros((4, 1), bool).tolist())
    both = Keypoints(*(np.repeat(a, 2, 0) for a in (nobody.px, nobody.confidence, nobody.sigma_px)))
    two, ids, seen = oracle.estimate_prior(2, 1, CONFIG), np.arange(2), looks(np.ones((2, 4)))
    for _ in range(2):
        said = known.update(ids, two, both, both, seen, DT, CONFIG)
    assert not said.unknown.any()
    known.forget(np.array([1]))
    assert known.vacancy(ids).level[:, 0, 0].tolist() == [EMPTY, POSSIBLE]
    said = known.update(ids, two, both, both, seen, DT, CONFIG)
    assert said.unknown[:, 0].tolist() == [False, True]


def test_floor_is_as_empty_as_the_cameras_that_see_it_say():
    watch = Watch(cameras=[[1, 1, 0], [0, 1, 0], [0, 0, 0]])
    assert watch.look(cameras=[2])[0] == [True]
    assert watch.floor == [POSSIBLE] * 3
    for k in range(1, 20):
        assert watch.look()[0] == [True]
        alone = PROBABLY_EMPTY if k >= SEVERAL else POSSIBLE
        both = PROBABLY_EMPTY if 2 * k >= SEVERAL else POSSIBLE
        both = EMPTY if 2 * k >= IMAGES * 2 / 3 else both
        assert watch.floor == [both, alone, POSSIBLE]
    for _ in range(LOST_AFTER - 1):
        watch.look(cameras=[0, 2])
    assert watch.floor == [EMPTY, PROBABLY_EMPTY, POSSIBLE]
    watch.look(cameras=[0, 2])
    assert watch.floor == [PROBABLY_EMPTY, POSSIBLE, POSSIBLE]


def test_a_worker_who_is_seen_leaves_no_floor_empty_and_one_long_lost_may_be_on_what_is_left():
    watch = Watch(cameras=[[1, 1], [0, 0]])
    for _ in range(IMAGES):
        watch.look()
    assert watch.floor == [EMPTY, POSSIBLE]
    watch.look((True,))
    assert watch.floor == [POSSIBLE, POSSIBLE]
    told = [watch.estimate() for _ in range(round(6.0 / DT) + 1)]
    seen = [np.isfinite(each.seen_world).all() for each in told]
    assert all(each.unknown.all() for each in told)
    assert seen == [True] * (len(told) - 2) + [False] * 2
    assert watch.floor == [EMPTY, POSSIBLE]


def test_people_whom_several_cameras_show_and_nothing_explains_are_unknown_and_name_the_cameras():
    watch, ids = Watch(), np.arange(1)
    for _ in range(IMAGES):
        watch.look()
    assert watch.look(odd=[0, 2])[0] == [False]
    for _ in range(CONTRADICTED - 2):
        assert watch.look(odd=[0, 2])[0] == [True]
        assert not watch.known.find_contradicting_cameras(ids).any()
    watch.look(odd=[0, 2])
    assert watch.known.find_contradicting_cameras(ids)[0].tolist() == [True, False, True, False]
    assert all(watch.look()[0] == [True] for _ in range(AGREED))
    assert watch.look()[0] == [False]


def test_one_camera_that_shows_a_stranger_says_of_no_floor_that_it_is_empty_and_stops_nobody():
    watch = Watch(cameras=[[1, 1, 0, 0], [0, 0, 1, 1]])
    for _ in range(50):
        watch.look(odd=[0])
    assert watch.floor == [PROBABLY_EMPTY, EMPTY]
    assert not watch.known.find_contradicting_cameras(np.arange(1)).any()
    assert watch.look((True,), odd=[0])[0] == [False]


def test_a_track_that_several_cameras_contradict_is_not_believed_until_they_agree_again():
    watch = Watch()
    for k in range(1, 2 * CONTRADICTED):
        said = watch.estimate((True,), odd=[1, 3])
        assert said.tracked[0, 0] == (k < CONTRADICTED)
        assert said.unknown[0, 0] == (k >= CONTRADICTED)
        assert np.isnan(said.seen_world).all() == (k >= CONTRADICTED)
    told = [watch.estimate((True,)).tracked[0, 0] for _ in range(AGREED + 1)]
    assert told == [False] * (AGREED - 1) + [True] * 2


def test_an_estimate_of_which_nobody_says_more_calls_unknown_whoever_has_no_track():
    said = belief(True, False, age_s=0.3)
    assert said.unknown.tolist() == [[False, True]]
    assert said.unobserved_s.tolist() == [[0.3, 0.3]]
