"""Frames that arrive late, out of step, twice or from nowhere: used at their time, or left out."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from simulated import DT, HARD, LAB, Damage, detections, generators, keypoints, walk

from hrc_env.core.errors import ConfigError
from hrc_env.tracking.config import PaperConfig
from hrc_env.tracking.estimators import ESTIMATORS, make_estimator
from hrc_env.tracking.out_of_sequence import IGNORED

LATE = PaperConfig(max_delay_s=0.5, n_particles=200)
every = pytest.mark.parametrize("name", sorted(ESTIMATORS))
FIELDS = ("mean_world", "cov_world", "velocity_world", "age_s", "tracked")


def walks(n, n_frames, damage=HARD):
    """Joints (T, B, J, 3) and pixels (T, B, C, J, 2)."""
    joints = np.stack([walk(seed, n_frames) for seed in range(n)], 1)
    return joints, np.stack([detections(joints[:, k], damage, k) for k in range(n)], 1)


def arrivals(px, delays):
    """Keypoints step by step; those of camera c come `delays` (B, C) steps late."""
    n_cameras = px.shape[2]
    for t in range(len(px)):
        frame, time_s = np.full(px.shape[1:], np.nan), np.full(delays.shape, np.nan)
        for b, c in np.ndindex(px.shape[1], n_cameras):
            if t >= delays[b, c]:
                frame[b, c] = px[t - delays[b, c], b, c]
                time_s[b, c] = (t + 1 - delays[b, c]) * DT
        yield replace(keypoints(frame), time_s=time_s)


def follow(estimator, arriving, batch):
    """(state, estimates) after keypoints that arrive one a step."""
    rngs, state, estimates = generators(batch), estimator.init(batch, 1), []
    estimator.reset(state, np.arange(batch), rngs)
    for frame in arriving:
        estimator.predict(state, DT, rngs)
        estimator.update(state, frame, rngs)
        estimates.append(estimator.estimate(state))
    return state, estimates


def late(name="kalman", config=LATE, P=LAB):
    return make_estimator(name, P, DT, config)


def error_m(estimates, joints):
    mean = np.stack([e.mean_world[:, 0] for e in estimates])
    return np.sqrt(((mean - joints) ** 2).sum(-1).mean())


def assert_same(ours, theirs):
    for a, b in zip(ours, theirs, strict=True):
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(a, field), getattr(b, field))


@every
def test_frames_of_now_are_used_as_if_there_were_no_memory(name):
    _, px = walks(2, 30)
    plain = make_estimator(name, LAB, DT, replace(LATE, max_delay_s=0.0))
    _, expected = follow(plain, map(keypoints, px), 2)
    for arriving in (map(keypoints, px), arrivals(px, np.zeros((2, 4), int))):
        state, estimates = follow(late(name), arriving, 2)
        assert_same(estimates, expected)
        assert not state.ignored.any()


def test_with_equal_delays_what_is_known_is_what_was_known_then_and_predicted():
    _, px = walks(2, 40)
    plain, steps = make_estimator("kalman", LAB, DT), 4
    state, _ = follow(plain, map(keypoints, px[:-steps]), 2)
    for _ in range(steps):
        plain.predict(state, DT, generators(2))
    _, estimates = follow(late(), arrivals(px, np.full((2, 4), steps)), 2)
    assert_same(estimates[-1:], [plain.estimate(state)])


def test_once_all_have_arrived_their_order_of_arrival_does_not_matter():
    _, px = walks(2, 40)
    delays = np.array([[0, 3, 1, 6], [5, 0, 2, 2]])
    rngs, e = generators(2), late()
    state, _ = follow(e, arrivals(px, delays), 2)
    inner, expected = follow(make_estimator("kalman", LAB, DT), map(keypoints, px), 2)
    for k in range(1, 7):  # what is still on its way, without time passing
        frame, time_s = np.full(px.shape[1:], np.nan), np.full((2, 4), np.nan)
        for b, c in np.argwhere(delays >= k):
            frame[b, c], time_s[b, c] = (
                px[40 - delays[b, c] + k - 1, b, c],
                DT * (40 - delays[b, c] + k),
            )
        e.update(state, replace(keypoints(frame), time_s=time_s), rngs)
    assert_same([e.estimate(state)], expected[-1:])
    np.testing.assert_array_equal(state.now.trees["bone_length"], inner.trees["bone_length"])
    assert not state.ignored.any()


@every
def test_late_frames_are_worth_more_at_their_own_time(name):
    joints, px = walks(4, 80, Damage())
    delays = np.tile([1, 2, 4, 5], (4, 1))
    as_of_now = (replace(frame, time_s=None) for frame in arrivals(px, delays))
    plain = make_estimator(name, LAB, DT, replace(LATE, max_delay_s=0.0))
    naive = error_m(follow(plain, as_of_now, 4)[1][40:], joints[40:])
    ours = error_m(follow(late(name), arrivals(px, delays), 4)[1][40:], joints[40:])
    assert ours < 0.75 * naive


@every
def test_an_environment_does_not_notice_the_delays_of_the_others(name):
    _, px = walks(5, 30)
    delays = np.array([[0, 0, 0, 0], [1, 3, 2, 0], [1, 3, 2, 0], [5, 5, 5, 5], [0, 9, 1, 1]])
    _, together = follow(late(name), arrivals(px, delays), 5)
    _, alone = follow(late(name), arrivals(px[:, :3], delays[:3]), 3)
    for many, few in zip(together, alone, strict=True):
        for field in FIELDS:
            np.testing.assert_array_equal(getattr(many, field)[:3], getattr(few, field))


def test_a_frame_between_two_steps_is_used_at_its_exact_time():
    body = walk(0, 40)
    still = np.repeat(body[:1], 40, 0) + 1.0 * DT * np.arange(40)[:, None, None] * [1.0, 0, 0]
    shifted = still - 0.6 * DT * np.array([1.0, 0, 0])  # a body that goes at 1 m/s, 24 ms before
    px = detections(shifted, Damage(sigma_px=0.3), 0)[:, None]
    time_s = lambda t: np.full((1, 4), (t + 0.4) * DT)  # noqa: E731
    frames = [
        replace(keypoints(p, 0.3), time_s=time_s(t)) if t > 0 else keypoints(p)
        for t, p in enumerate(px)
    ]
    state, estimates = follow(late(), frames, 1)
    offset = (estimates[-1].mean_world[0, 0] - still[-1])[:, 0]
    assert abs(np.median(offset)) < 0.006  # taken as of now it would be 24 mm
    assert not state.ignored.any()


@every
def test_cameras_of_different_rates_that_are_never_in_step_find_and_follow_a_worker(name):
    """Two at 25 Hz, 11 ms apart, one at 12.5, one at 50 Hz; each frame comes with the next step."""
    coarse, t = walk(1, 41), np.arange(8 * 35) / 8
    n = t.astype(int)  # the same walk, eight frames a step
    joints = coarse[n] + (t - n)[:, None, None] * (coarse[n + 1] - coarse[n])
    px = detections(joints, Damage(), 1)
    e, rngs = late(name), generators(1)
    state = e.init(1, 1)
    every_n, first = (8, 8, 16, 4), (0, 2, 5, 1)
    for step in range(35):
        e.predict(state, DT, rngs)
        for part in range(2):  # the camera at 50 Hz has two frames a step
            frame, time_s = np.full((1, 4, 15, 2), np.nan), np.full((1, 4), np.nan)
            for c in range(4):
                n = [t for t in range(8 * step, 8 * step + 8) if t % every_n[c] == first[c]]
                if len(n) > part:
                    frame[0, c], time_s[0, c] = px[n[part], c], (n[part] + 1) * DT / 8
            e.update(state, replace(keypoints(frame), time_s=time_s), rngs)
    estimate = e.estimate(state)
    assert estimate.tracked.all()
    assert not state.ignored.any()
    error = np.linalg.norm(estimate.mean_world[0, 0] - joints[-1], axis=-1)
    assert np.median(error) < 0.06


def with_times(frame, time_s):
    return replace(keypoints(frame), time_s=np.array([time_s]))


def by_camera(frame, c, time_s):
    """Camera c's part of a frame (1, C, J, 2), taken at a time."""
    frame = np.where(np.arange(4)[:, None, None] == c, frame, np.nan)
    return with_times(frame, np.where(np.arange(4) == c, time_s, np.nan))


@pytest.mark.parametrize(
    ("time_s", "reason"),
    [
        (np.nan, "no time"),
        (np.inf, "no time"),
        (-np.inf, "no time"),
        (21 * DT, "future"),
        (1e300, "future"),
        (20 * DT, "not newer"),
        (19.5 * DT, "not newer"),
        (-1e300, "not newer"),
    ],
)
def test_frames_with_impossible_times_are_left_out_and_counted(time_s, reason):
    _, px = walks(1, 21, Damage())
    e, rngs = late(), generators(1)
    state, before = follow(e, map(keypoints, px[:20]), 1)
    e.update(state, by_camera(px[20], 0, time_s), rngs)
    expected = [int(reason == each) for each in IGNORED]
    np.testing.assert_array_equal(state.ignored[0], expected)
    assert_same([e.estimate(state)], before[-1:])


def test_a_frame_older_than_the_memory_is_left_out_and_one_at_its_edge_is_used():
    _, px = walks(1, 40, Damage())
    blind = px.copy()
    blind[:, :, 3] = np.nan
    for delay, too_old in [(0.5, False), (0.54, True), (1.4, True)]:
        e, rngs = late(), generators(1)
        state = e.init(1, 1)
        for frame in blind:
            e.predict(state, DT, rngs)
            now_s = [*np.repeat(state.clock_s[0], 3), np.nan]
            e.update(state, with_times(frame, now_s), rngs)
        before = e.estimate(state)
        e.update(state, by_camera(px[39], 3, 40 * DT - delay), rngs)
        assert state.ignored[0, IGNORED.index("too old")] == too_old
        assert (e.estimate(state).mean_world != before.mean_world).any() != too_old


def test_frames_from_before_the_reset_are_too_old():
    _, px = walks(1, 30, Damage())
    e, rngs = late(), generators(1)
    state, _ = follow(e, map(keypoints, px), 1)
    e.reset(state, np.array([0]), rngs)
    e.predict(state, DT, rngs)
    e.update(state, with_times(px[29], [-0.1, -0.2, 0.0, -5.0]), rngs)
    assert state.ignored[0].tolist() == [0, 0, 0, 4]
    assert not e.estimate(state).tracked.any()


def test_a_camera_whose_clock_jumps_back_is_ignored_until_it_has_caught_up():
    joints, px = walks(1, 60, Damage())
    e, rngs = late(), generators(1)
    state = e.init(1, 1)
    for t, frame in enumerate(px):
        e.predict(state, DT, rngs)
        now_s = state.clock_s[0]
        jumped = now_s - 0.2 if 30 <= t < 40 else now_s
        e.update(state, with_times(frame, [now_s, now_s, jumped, now_s]), rngs)
    assert state.ignored[0, IGNORED.index("not newer")] == 5  # then its times are late, not old
    assert error_m([e.estimate(state)], joints[-1]) < 0.03


def test_more_frames_than_the_memory_holds_shorten_it_and_are_data():
    _, px = walks(1, 12, Damage())
    e, rngs = late(config=replace(LATE, max_delay_s=0.08)), generators(1)
    state, _ = follow(e, map(keypoints, px[:10]), 1)
    e.predict(state, DT, rngs)
    for k in range(30):  # camera 0 at 1 kHz
        e.update(state, by_camera(px[10], 0, 10 * DT + 1e-3 * (k + 1)), rngs)
    assert np.isfinite(e.estimate(state).mean_world).all()
    e.update(state, by_camera(px[10], 1, 10 * DT + 1e-3), rngs)
    assert state.ignored[0, :3].sum() == 0
    assert state.ignored[0, IGNORED.index("too old")] > 0


def test_environments_of_different_ages_are_replayed_together():
    _, px = walks(3, 30, Damage())
    delays = np.array([[2, 1, 3, 0]] * 3)
    e, rngs = late(), generators(3)
    state = e.init(3, 1)
    for t, frame in enumerate(arrivals(px, delays)):
        if t == 13:
            e.reset(state, np.array([1]), [rngs[1]])
        e.predict(state, DT, rngs)
        time_s = frame.time_s.copy()
        time_s[1] -= 13 * DT if t >= 13 else 0.0
        e.update(state, replace(frame, time_s=time_s), rngs)
    estimate = e.estimate(state)
    assert estimate.tracked.all()
    _, alone = follow(late(), arrivals(px[:, :1], delays[:1]), 1)
    np.testing.assert_array_equal(estimate.mean_world[:1], alone[-1].mean_world)


def test_a_copied_state_continues_as_the_original_does():
    _, px = walks(1, 40)
    e, frames = late(), list(arrivals(px, np.array([[0, 2, 3, 1]])))
    state, _ = follow(e, frames[:20], 1)
    other = copy.deepcopy(state)
    for s in (state, other):
        for frame in frames[20:]:
            e.predict(s, DT, generators(1))
            e.update(s, frame, generators(1))
    assert_same([e.estimate(state)], [e.estimate(other)])


def test_delays_beyond_a_second_and_times_of_another_rig_are_refused():
    with pytest.raises(ConfigError, match=r"max_delay_s must be in \[0, 1\]"):
        PaperConfig(max_delay_s=1.5)
    _, px = walks(1, 1)
    e = late()
    with pytest.raises(ConfigError, match="time_s must have shape"):
        e.update(e.init(1, 1), replace(keypoints(px[0]), time_s=np.zeros((1, 3))), generators(1))
