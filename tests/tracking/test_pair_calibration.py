"""Two cameras of which one is turned against its calibration: the turns are found, and the body's
uncertain displacement is reported."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulated import DT, HARD, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.geometry.lines_of_sight import cameras_of
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.measurements import make_frame
from hrc_env.tracking.smoother import smooth
from hrc_env.tracking.tree.pair_calibration import (
    TURN_STD_RAD,
    measure_displacement,
    measure_gaps,
    turn_camera,
    write_projections,
)
from hrc_env.tracking.tree.state import PAIR, TREE

TWO = LAB[:2]
FAR_OPPOSITE = projections(
    tuple(
        pinhole(f"camera_{k + 1}", np.array([x, y, 5.0]), np.array([0.0, 0, 1]), 72, 1920, 1080)
        for k, (x, y) in enumerate([(9.6, 9.6), (-9.6, 9.6), (-9.6, -9.6)])
    )
)
"""The first and the last see the middle from opposite sides."""
TILTED = np.radians([2.2, 2.0, 1.0])
"""Mostly downwards: two lines of sight that should meet pass each other by 20 cm."""
SEEDS = range(60, 68)


def turned(camera, turn):
    """A camera (3, 4) that is turned about its centre, by another way than the package's."""
    eye = -np.linalg.solve(camera[:, :3], camera[:, 3])
    left = camera[:, :3] @ Rotation.from_rotvec(turn).as_matrix().T
    return np.column_stack([left, -left @ eye])


def walkers(n_frames):
    """(T, B, J, 3)."""
    return np.stack([walk(seed, n_frames) for seed in SEEDS], 1)


def seen_by(P, joints, damage=None):
    """(T, B, C, J, 2)."""
    each = [detections(joints[:, k], damage or Damage(), s, P) for k, s in enumerate(SEEDS)]
    return np.stack(each, 1)


def followed(px, P=TWO):
    """The last state, and what was reported after each frame."""
    estimator, rngs, estimates = make_estimator("particle", P, DT), generators(px.shape[1]), []
    state = estimator.init(px.shape[1], 1)
    for frame in px:
        estimator.predict(state, DT, rngs)
        estimator.update(state, keypoints(frame), rngs)
        estimates.append(estimator.estimate(state))
    return state, estimates


def off_m(estimate, joints):
    """(B,) of the mean joint."""
    return np.linalg.norm(estimate.mean_world[:, 0] - joints, axis=-1).mean(-1)


def said_m(estimate):
    """(B,) reported deviation of the mean joint."""
    return np.sqrt(np.trace(estimate.cov_world[:, 0], axis1=-2, axis2=-1)).mean(-1)


def pairs(state):
    """Best hypotheses' `PAIR` (B,)."""
    return state.trees["pair"][:, 0, 0]


def test_a_camera_is_turned_as_by_a_rotation_of_its_rays():
    out = np.empty((3, 4))
    turn_camera(cameras_of(LAB)[1], TILTED, out)
    np.testing.assert_allclose(out, turned(LAB[1], TILTED), atol=1e-6)


@pytest.mark.parametrize("name", ["particle", "kalman"])
def test_two_cameras_that_do_not_agree_begin_a_track_that_covers_its_error(name):
    joints = walkers(60)
    tilted = np.stack([TWO[0], turned(TWO[1], TILTED)])
    px = seen_by(tilted, joints)
    estimates = track(make_estimator(name, TWO, DT), px)
    assert not estimates[3].tracked.any()  # they do not agree at first
    for t in (24, 59):
        assert estimates[t].tracked.all()
        assert (off_m(estimates[t], joints[t]) < 0.35).all()
        assert (off_m(estimates[t], joints[t]) < 2.5 * said_m(estimates[t])).all()
    assert said_m(estimates[59]).min() > 0.05


def test_a_disagreement_too_small_to_end_a_track_is_noticed_and_the_body_put_right():
    joints = walkers(120)
    px = seen_by(np.stack([TWO[0], turned(TWO[1], 0.35 * TILTED)]), joints)
    state, estimates = followed(px)
    assert estimates[0].tracked.all()
    plain = np.mean([off_m(e, j) for e, j in zip(estimates[:3], joints[:3], strict=True)])
    assert pairs(state)["is_misaligned"].all()
    assert np.median(off_m(estimates[-1], joints[-1])) < plain
    assert (off_m(estimates[-1], joints[-1]) < 2.5 * said_m(estimates[-1])).all()


@pytest.mark.parametrize("damage", [Damage(), HARD])
def test_cameras_that_hang_as_is_said_are_not_turned(damage):
    state, estimates = followed(seen_by(TWO, walkers(100), damage))
    assert not pairs(state)["is_misaligned"].any()
    assert not state.trees["displaced_m2"].any()
    assert estimates[-1].tracked.all()


def test_three_cameras_that_agree_begin_anew_without_any_turn():
    joints = walkers(60)
    rig = np.stack([TWO[0], turned(TWO[1], TILTED), LAB[2]])
    px = seen_by(rig, joints)
    px[:40, :, 2] = np.nan
    state, estimates = followed(px, LAB[:3])
    assert off_m(estimates[39], joints[39]).min() > 0.05
    assert not pairs(state)["is_misaligned"].any()
    assert (off_m(estimates[-1], joints[-1]) < 0.05).all()
    assert (said_m(estimates[-1]) < 0.05).all()


def test_where_a_third_camera_sees_them_too_two_are_not_doubted_for_what_the_detector_does():
    """Errors of one kind, which a turn would explain as well, and now and then a third view."""
    joints = walkers(90)
    rig = np.stack([TWO[0], turned(TWO[1], 0.3 * TILTED), LAB[2]])
    px = seen_by(rig, joints)
    alone = px.copy()
    alone[:, :, 2] = np.nan
    assert pairs(followed(alone, LAB[:3])[0])["is_misaligned"].all()
    px[np.arange(90) % 15 > 0, :, 2] = np.nan
    state, estimates = followed(px, LAB[:3])
    assert not pairs(state)["is_misaligned"].any()
    assert (off_m(estimates[-1], joints[-1]) < 0.05).all()


def test_who_is_followed_is_not_begun_anew_where_turned_cameras_would_not_say_where_they_are():
    """Opposite ones do not: their lines of sight lie in one plane, and turns move along it."""
    joints, far = walkers(120), FAR_OPPOSITE
    px = seen_by(np.stack([far[0], far[1], turned(far[2], TILTED)]), joints)
    px[25:, :, 1] = np.nan
    _, estimates = followed(px, far)
    assert (off_m(estimates[-1], joints[-1]) < 0.5).all()
    assert (said_m(estimates[-1]) < 0.5).all()


def test_two_cameras_that_see_two_people_are_not_taken_for_askew():
    one, other = walkers(100), np.roll(walkers(100), 1, axis=1)
    px = np.stack([seen_by(TWO, one)[:, :, 0], seen_by(TWO, other)[:, :, 1]], 2)
    shares = []
    for t in range(40, 101, 20):
        state, _ = followed(px[:t])
        shares.append(pairs(state)["is_misaligned"].mean())
    assert np.mean(shares) < 0.25


def test_who_is_followed_is_reported_as_wide_as_the_turns_are_unknown_and_smoothed_so_too():
    joints = walkers(40)
    px = seen_by(np.stack([TWO[0], turned(TWO[1], TILTED)]), joints)
    state, estimates = followed(px)
    best = state.trees[:, 0, 0]
    least = np.trace(best["displaced_m2"], axis1=-2, axis2=-1)
    reported = np.trace(estimates[-1].cov_world[:, 0], axis1=-2, axis2=-1)
    assert (least > 0.01).all()
    assert (reported >= least[:, None]).all()
    smoothed = smooth(TWO, [keypoints(frame) for frame in px], DT)
    middle = np.trace(smoothed.cov_world[20, :, 0], axis1=-2, axis2=-1)
    assert (middle > 0.01).all()


def measured(joints, P):
    """`Frame` of one body (J, 3) without any noise."""
    frame = make_frame(cameras_of(P))
    frame.z[:] = project(P, joints[None])[0][0].swapaxes(0, 1)
    frame.sigma[:], frame.ok[:] = 3.0, True
    return frame


def test_slopes_of_the_gaps_are_their_derivatives():
    joints, tree = walk(1, 1)[0], np.zeros(1, TREE)
    tree["body"][0, :, :3], tree["tracked"] = joints, True
    tree["pair"]["cameras"] = (0, 1)
    frame, step = measured(joints, TWO), 1e-5

    def gaps(turn):
        tree["pair"]["turn"] = turn
        rows, gap, variance = np.empty((15, 6)), np.empty(15), np.empty(15)
        assert measure_gaps(tree[0], frame, rows, gap, variance) == 15
        return rows, gap

    rows, gap = gaps(np.zeros(6))
    np.testing.assert_allclose(gap, 0.0, atol=1e-9)
    for i in range(6):
        up, down = gaps(step * np.eye(6)[i])[1], gaps(-step * np.eye(6)[i])[1]
        np.testing.assert_allclose(rows[:, i], (up - down) / (2 * step), atol=1e-3)


def test_displacement_is_the_spread_of_bodies_triangulated_with_turned_cameras():
    joints, pair, out = walk(1, 1)[0], np.zeros(1, PAIR), np.empty((3, 3))
    pair["cameras"], pair["turn_cov"] = (0, 1), (0.1 * TURN_STD_RAD) ** 2 * np.eye(6)
    measure_displacement(pair[0], cameras_of(TWO), np.column_stack([joints, 0 * joints]), out)
    middle, rng, places = joints.mean(0), np.random.default_rng(0), []
    eyes = [-np.linalg.solve(p[:, :3], p[:, 3]) for p in TWO]
    for turn in rng.normal(0.0, 0.1 * TURN_STD_RAD, (4000, 2, 3)):
        total, right = np.zeros((3, 3)), np.zeros(3)
        for eye, each in zip(eyes, turn, strict=True):
            line = Rotation.from_rotvec(each).apply(middle - eye)
            own = (np.eye(3) - np.outer(line, line) / (line @ line)) / (line @ line)
            total, right = total + own, right + own @ eye
        places.append(np.linalg.solve(total, right))
    np.testing.assert_allclose(out, np.cov(np.array(places).T), atol=0.1 * np.trace(out))


def test_nothing_is_turned_that_does_not_hang_askew():
    pair, frame = np.zeros(1, PAIR), make_frame(cameras_of(LAB))
    pair["cameras"], pair["turn"] = (0, 1), 0.05
    write_projections(pair[0], frame)
    np.testing.assert_array_equal(frame.P, LAB)
    pair["is_misaligned"] = True
    write_projections(pair[0], frame)
    np.testing.assert_allclose(frame.P[1], turned(LAB[1], np.full(3, 0.05)), atol=1e-6)
    np.testing.assert_array_equal(frame.P[2:], LAB[2:])


def test_absurd_pixels_leave_numbers_finite():
    rng = np.random.default_rng(3)
    px = rng.uniform(-2e4, 2e4, (30, 8, 2, 15, 2))
    px[::3] = seen_by(np.stack([TWO[0], turned(TWO[1], TILTED)]), walkers(30))[::3]
    px[5, :, 1] = px[5, :, 0] = 0.0
    state, estimates = followed(px)
    assert all(
        np.isfinite(e.mean_world).all() and np.isfinite(e.cov_world).all() for e in estimates
    )
    assert np.isfinite(pairs(state)["turn"]).all()
