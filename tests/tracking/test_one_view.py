"""A track that one camera begins: where, how surely, and what becomes of it."""

import numpy as np
import pytest
from crossing import poses, standing
from simulated import DT, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.core.records import Keypoints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.people.association import associate

CHI2_95_3D = 7.815
ALONE = LAB[:1]
AT_ONCE = ParticleConfig(one_view_wait_updates=0)
eight = range(40, 48)


def people(n_frames, sizes=None):
    """(T, B, J, 3) eight walkers, of sizes about the usual one."""
    joints = np.stack([walk(seed, n_frames) for seed in eight], 1)
    sizes = np.linspace(0.9, 1.1, 8) if sizes is None else sizes
    ground = joints.mean(2, keepdims=True) * [1, 1, 0]
    return ground + (joints - ground) * np.reshape(sizes, (8, 1, 1))


def seen(joints, n_alone, P=LAB):
    """(T, B, C, J, 2) pixels: camera 1 alone for so many frames, then all."""
    each = [detections(joints[:, k], Damage(), seed, P) for k, seed in enumerate(eight)]
    px = np.stack(each, 1)
    px[:n_alone, :, 1:] = np.nan
    return px


def off_m(estimate, joints):
    return np.linalg.norm(estimate.mean_world[:, 0] - joints, axis=-1)


def inside(estimate, joints):
    """(B, J) whether a joint is within the reported 95 % region."""
    off = (estimate.mean_world[:, 0] - joints)[..., None]
    return (off * np.linalg.solve(estimate.cov_world[:, 0], off)).sum((-2, -1)) < CHI2_95_3D


@pytest.mark.parametrize("name", ["particle", "kalman"])
def test_a_rig_of_one_camera_follows_from_the_first_frame_and_says_how_surely(name):
    joints = people(26)
    estimates = track(make_estimator(name, ALONE, DT), seen(joints, 26, ALONE))
    assert all(e.tracked.all() for e in estimates)
    assert np.median([off_m(e, j) for e, j in zip(estimates, joints, strict=True)]) < 0.3
    assert np.mean([inside(e, j) for e, j in zip(estimates, joints, strict=True)]) > 0.9


def test_the_uncertainty_lies_along_the_ray():
    joints = people(5)
    estimate = track(make_estimator("particle", ALONE, DT), seen(joints, 5, ALONE))[-1]
    ray = joints[-1] + np.linalg.solve(LAB[0, :, :3], LAB[0, :, 3])
    depth = np.linalg.norm(ray, axis=-1)
    values, vectors = np.linalg.eigh(estimate.cov_world[:, 0])
    along = np.abs((vectors[..., -1] * ray).sum(-1)) / depth
    assert np.median(along) > 0.95
    assert (np.sqrt(values[..., -1]) > 0.05 * depth).all()
    assert np.median(np.sqrt(values[..., 0])) < 0.06


def test_a_second_view_is_waited_for_and_begins_as_if_the_first_had_never_been():
    joints = people(12)
    px = seen(joints, 12)
    waiting = track(
        make_estimator("particle", LAB, DT, ParticleConfig(one_view_wait_updates=5)), px
    )
    assert [bool(e.tracked.all()) for e in waiting] == [False] * 5 + [True] * 7
    assert not any(e.tracked.any() for e in waiting[:5])
    px[4:] = seen(joints, 0)[4:]
    joined = track(make_estimator("particle", LAB, DT), px)[4]
    np.testing.assert_array_equal(
        joined.mean_world, track(make_estimator("particle", LAB, DT), px[4:])[0].mean_world
    )


def test_views_that_come_later_make_good_at_once_what_the_first_one_got_wrong():
    joints = people(40)
    px = seen(joints, 30)
    begun = track(make_estimator("particle", LAB, DT, AT_ONCE), px)
    fresh = track(make_estimator("particle", LAB, DT, AT_ONCE), px[30:])
    assert np.median(off_m(begun[29], joints[29])) > 0.05
    for k in (30, 34, 39):
        ours, theirs = (np.median(off_m(e, joints[k])) for e in (begun[k], fresh[k - 30]))
        assert ours < 1.2 * theirs + 0.002


def test_a_view_now_and_then_is_not_a_view_for_a_while():
    px = seen(people(30), 30)
    px[np.arange(30) % 3 > 0] = np.nan
    assert not any(e.tracked.any() for e in track(make_estimator("particle", LAB, DT), px))


def test_points_anywhere_in_a_box_are_no_body():
    px = np.full((1, 200, 1, 15, 2), np.nan)
    px[0, :, 0] = np.random.default_rng(0).uniform([600, 200], [900, 800], (200, 15, 2))
    assert track(make_estimator("particle", ALONE, DT), px)[0].tracked.mean() < 0.02


def test_the_floor_tells_the_size_where_people_are_said_to_stand_on_it():
    joints = people(1, np.linspace(0.85, 1.15, 8))
    px, error = seen(joints, 1, ALONE), {}
    for initial_foot_height_std_m in (0.05, 0.0):
        config = ParticleConfig(initial_foot_height_std_m=initial_foot_height_std_m)
        estimate = track(make_estimator("particle", ALONE, DT, config), px)[0]
        assert inside(estimate, joints[0]).mean() > 0.8
        error[initial_foot_height_std_m] = np.sqrt((off_m(estimate, joints[0]) ** 2).mean())
    assert error[0.05] < 0.7 * error[0.0]


def test_a_forecast_is_as_unsure_of_the_depth_as_the_estimate():
    e, px, rngs = make_estimator("particle", ALONE, DT), seen(people(3), 3, ALONE), generators(8)
    state = e.init(8, 1)
    for frame in px:
        e.predict(state, DT, rngs)
        e.update(state, keypoints(frame), rngs)
    now, later = (np.trace(x.cov_world[:, 0], axis1=-2, axis2=-1)
                  for x in (e.estimate(state), e.forecast(state, 0.2)))  # fmt: skip
    assert (later > 0.7 * now).all()


def test_two_people_before_the_only_camera_get_a_track_each():
    joints = standing([(0.3, -1.2), (1.2, 0.9)], 8)
    given = poses(joints, 1)
    e, rngs = make_estimator("particle", ALONE, DT), generators(1)
    state = e.init(1, 2)
    for t in range(8):
        e.predict(state, DT, rngs)
        found = Keypoints(*(getattr(given, name)[t][None, :1] for name in FIELDS))
        e.update(state, associate(ALONE, found, e.estimate(state)).keypoints, rngs)
    estimate = e.estimate(state)
    assert estimate.tracked.all()
    apart = np.linalg.norm(estimate.mean_world[0][:, None] - joints[-1][None], axis=-1).mean(-1)
    assert sorted(apart.argmin(1)) == [0, 1]
    assert apart.min(1).max() < 0.5


FIELDS = ("px", "confidence", "sigma_px")
