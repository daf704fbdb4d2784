"""Nobody, two or three workers: the same environment, with an axis of another length."""

import dataclasses
import pickle

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from stable_baselines3.common.env_checker import check_env

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import WorkerTruth
from hrc_env.env import HRCEnv
from hrc_env.motion.generator import PeopleConfig, activity_names, current
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tracking.metrics import make_identities, measure_errors
from hrc_env.tracking.oracle import estimate_from_truth
from hrc_env.worker.body import worker_truth

COUNTS = (0, 2, 3)
FAST_LEVELS = ("keypoints", "truth", "none")


def walk(env, n_steps, seed=0):
    """Observations and infos of seeded random actions; the first is the reset's."""
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    seen = [(observation, 0.0, info)]
    for _ in range(n_steps):
        observation, reward, _, _, info = env.step(rng.uniform(-1, 1, 6).astype(np.float32))
        seen.append((observation, reward, info))
    return seen


@pytest.mark.parametrize("level", FAST_LEVELS)
@pytest.mark.parametrize("n_workers", COUNTS)
def test_any_number_of_workers_is_an_environment(n_workers, level):
    """The observation has a block for each, the reward its terms, the cost its truth."""
    env = HRCEnv(perception=level, n_workers=n_workers)
    check_env(env)
    for observation, reward, info in walk(env, 30)[1:]:
        assert env.observation_space.contains(observation)
        parts = env.split_observation(observation)
        assert parts["worker_tracked"].shape == (n_workers,)
        assert parts["worker_joints_from_tool"].shape == (n_workers * 45,)
        terms = [value for name, value in info.items() if name.startswith("reward/")]
        assert reward == pytest.approx(sum(terms), abs=1e-12)
        assert np.isfinite(info["safety/min_separation_m"]) == (n_workers > 0)
        assert info["tracking/mpjpe_measured"] == (n_workers > 0 and level != "none")


@pytest.mark.parametrize("level", FAST_LEVELS)
@pytest.mark.parametrize("n_workers", COUNTS)
def test_pickled_with_its_workers_it_goes_on_the_same(n_workers, level):
    env = HRCEnv(perception=level, n_workers=n_workers)
    walk(env, 12)
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(12):
        a, b = env.step(np.full(6, 0.3)), twin.step(np.full(6, 0.3))
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1:] == b[1:]


@pytest.mark.parametrize("n_workers", COUNTS)
def test_many_environments_are_the_single_one_bit_for_bit(n_workers):
    many = HRCVecEnv(3, n_workers=n_workers, stagger=False, max_episode_steps=9, seed=4)
    one = HRCEnv(perception="keypoints", n_workers=n_workers)
    batch, (alone, _) = many.reset()[2], one.reset(seed=6)
    actions = np.random.default_rng(1).uniform(-1, 1, (20, 3, 6)).astype(np.float32)
    for step, action in enumerate(actions, start=1):
        np.testing.assert_array_equal(alone, batch)
        observation, _, done, _ = many.step(action)
        batch, (alone, *_) = observation[2], one.step(action[2])
        assert done[2] == (step % 9 == 0)
        if done[2]:
            alone, _ = one.reset()


@pytest.mark.parametrize(
    "estimator", ["particle", "kalman", "paper", "paper_restarts", "triangulation"]
)
def test_two_workers_without_names_are_both_followed(estimator):
    """Four seconds of keypoints that each camera reports in an order of its own."""
    for seed in range(3):
        env = HRCEnv(perception="keypoints", estimator=estimator, n_workers=2)
        infos = [info for *_, info in walk(env, 100, seed)][5:]
        assert np.median([info["tracking/mpjpe_m"] for info in infos]) < 0.08
        assert np.mean([info["tracking/lost"] for info in infos]) < 0.05


def test_three_workers_without_names_keep_their_tracks():
    """Eight rooms for six seconds; some of the workers walk through each other's way."""
    env = HRCVecEnv(8, n_workers=3, stagger=False, max_episode_steps=1000, seed=100, num_threads=1)
    env.reset()
    whom = []
    for _ in range(150):
        env.step(np.zeros((8, 6)))
        estimate, motion = env.simulation.estimate, env.simulation.motion
        truth = worker_truth(env.simulation.bodies, current(motion)).joints_world
        apart = np.linalg.norm(estimate.mean_world[:, :, None] - truth[:, None], axis=-1).mean(-1)
        whom.append([linear_sum_assignment(of_room)[1] for of_room in apart])
    assert (np.array(whom)[5:] == whom[5]).all()


def test_the_emulator_does_not_say_who_is_who():
    """What a camera reports first is one worker as often as the other; the pipeline sorts it."""
    env = HRCEnv(perception="keypoints", n_workers=2)
    pipeline, reported, sorted_ = env.simulation.pipeline, [], []
    detect = pipeline.detect
    pipeline.detect = lambda *now: reported.append(detect(*now)) or reported[-1]
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.zeros(6))
        sorted_.append(pipeline.last_detections(0)[0])
    for camera in range(4):
        assert 0.2 < first_is_further_right(reported, camera) < 0.8
        assert first_is_further_right(sorted_, camera) in (0.0, 1.0)


def first_is_further_right(keypoints, camera):
    """In how many of the frames with both workers the first is on the right."""
    hips = np.stack([each.px[0, camera, :, 7, 0] for each in keypoints])
    both = hips[np.isfinite(hips).all(-1)]
    return (both[:, 0] > both[:, 1]).mean()


def test_errors_do_not_depend_on_which_worker_is_called_the_first():
    truth = HRCEnv(perception="truth", n_workers=3)
    truth.reset(seed=0)
    seen = truth.simulation.estimate.mean_world
    all_there, unknown = np.ones((1, 3), bool), make_identities(1, 3)
    reordered = WorkerTruth(seen[:, [2, 0, 1]], seen, np.zeros((1, 3, 1, 2, 3)), np.ones(1))
    found = measure_errors(truth.simulation.estimate, reordered.joints_world, all_there, unknown)
    assert found["mpjpe_m"] == found["lost"] == [0.0]
    doubled = estimate_from_truth(
        WorkerTruth(seen[:, [0, 0, 1]], seen, np.zeros((1, 3, 1, 2, 3)), np.ones(1))
    )
    found = measure_errors(doubled, reordered.joints_world, all_there, unknown)
    assert found["mpjpe_m"] > 0.1  # two tracks on one person


def test_in_pictures_two_different_people_are_found(pixels):
    env = HRCEnv(perception="pixels", n_workers=2)
    seen = walk(env, 6, seed=1)
    info, estimate = seen[-1][2], env.simulation.estimate
    assert estimate.tracked.all()
    assert info["tracking/mpjpe_m"] < 0.08
    hips = estimate.mean_world[0, :, 7:9].mean(1)
    assert np.linalg.norm(hips[0] - hips[1]) > 0.5
    assert env.mosaic().shape == (724, 1284, 3)
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(env.step(np.zeros(6))[0], twin.step(np.zeros(6))[0])
    env.close(), twin.close()


def test_an_empty_room_in_pictures_is_quiet():
    env = HRCEnv(perception="pixels", n_workers=0)
    assert all(info["tracking/lost"] == 0.0 for *_, info in walk(env, 2))
    assert env.mosaic().shape == (724, 1284, 3)
    assert env.views.crops(64, env.views.glance()) == []
    env.close()


def test_who_comes_in_late_is_found_and_nobody_is_taken_for_them(pixels):
    """SearchSchedule for the second worker see the first one only, until the second is there."""
    env = HRCEnv(perception="pixels", n_workers=2)
    renderer = env.simulation.pipeline.cameras.renderer
    pose = renderer.pose
    renderer.pose = lambda q, motion: pose(q, without_the_second(motion))
    env.reset(seed=1)
    for _ in range(5):
        *_, info = env.step(np.zeros(6))
        assert env.simulation.estimate.tracked.sum() == 1
        assert info["tracking/lost"] == 1.0
    renderer.pose = pose
    for _ in range(env.config.detector.search_every + 3):  # a search that has missed somebody rests
        *_, info = env.step(np.zeros(6))
    assert info["tracking/lost"] == 0.0
    assert info["tracking/mpjpe_m"] < 0.08
    env.close()


def without_the_second(motion):
    """The workers (W, S, ...) with the second one far away."""
    away = motion.position_world.copy()
    away[1] += 50.0
    return dataclasses.replace(motion, position_world=away)


@pytest.mark.parametrize("level", FAST_LEVELS)
def test_the_number_of_workers_is_drawn_anew_for_each_episode(level):
    """Shapes stay; who is not there is not tracked, not seen and in nobody's way."""
    env = HRCEnv(perception=level, n_workers=(1, 3))
    counts = set()
    for seed in range(12):
        for _, _, info in walk(env, 6, seed):
            there = [doing != "absent" for doing in env.words(info)["worker/activity"]]
            assert len(there) == 3
            assert info["safety/min_separation_m"] < 20.0
            if level == "truth":
                assert not info["tracking/lost"]
        counts.add(sum(there))
        tracked = env.simulation.estimate.tracked[0]
        assert level == "none" or tracked.sum() <= sum(there)
        if level == "truth":
            np.testing.assert_array_equal(tracked, there)
    assert counts == {1, 2, 3}


@pytest.mark.parametrize("count", [-1, 1.5, (2, 1), (1, 2, 3), True])
def test_a_number_of_workers_that_cannot_be_is_refused(count):
    with pytest.raises(ConfigError, match="n_workers"):
        HRCEnv(perception="none", n_workers=count)


@pytest.mark.parametrize("people", ["hurried", "unaware", PeopleConfig(tempo=0.8)])
def test_people_are_chosen_by_name_or_made(people):
    env = HRCEnv(perception="none", n_workers=2, people=people)
    infos = [info for *_, info in walk(env, 20)]
    assert all(set(env.words(info)["worker/activity"]) <= set(activity_names) for info in infos)
    with pytest.raises(ConfigError, match="attentive"):
        HRCEnv(perception="none", people="atentive")
