"""Cameras may use every n-th image, together or in turns; all while somebody is lost."""

from dataclasses import replace
from typing import NamedTuple

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.perception.detector import PoseDetector
from hrc_env.pipeline import tracking

SETTLED = 14
"""Step from which on the worker is tracked, and measurements agree with the estimate."""


class Played(NamedTuple):
    """What the cameras did in the steps of an episode."""

    shown: np.ndarray
    """(T, C) whether a camera shows a keypoint."""
    used: np.ndarray
    """(T, C) whether a camera's image is used."""
    expected: np.ndarray
    """(T,) whether all workers were tracked before the step."""


def make(level="keypoints", faults=(), n_workers=1, **detector) -> HRCEnv:
    return HRCEnv(
        "HRCReach-v0", perception=level, faults=list(faults), n_workers=n_workers,
        config={"detector": detector},
    )  # fmt: skip


def play(env: HRCEnv, n_steps=30) -> Played:
    env.reset(seed=3)
    shown, used, expected = [], [], []
    for _ in range(n_steps):
        expected.append(env.simulation.belief.estimate.tracked.all())
        env.step(np.zeros(env.action_space.shape))
        seen = env.simulation.pipeline.measurements
        shown.append(seen.confidence[0].max((1, 2)) > 0)
        used.append(np.ones(4, bool) if seen.time_s is None else np.isfinite(seen.time_s[0]))
    env.close()
    return Played(*map(np.array, (shown, used, expected)))


def test_by_default_every_image_is_used():
    played = play(make())
    assert played.used.all()
    assert played.expected[SETTLED:].all()


@pytest.mark.parametrize("every", [2, 3])
def test_all_cameras_use_every_nth_image_in_the_same_step(every):
    played = play(make(every=every))
    assert played.expected[SETTLED:].all()
    used, shown = played.used[SETTLED:], played.shown[SETTLED:]
    assert (used == used[:, :1]).all()
    assert (np.diff(np.flatnonzero(used[:, 0])) == every).all()
    assert not shown[~used].any()
    assert shown[used].mean() > 0.5


def test_in_turns_each_camera_uses_every_nth_image_and_every_step_has_some():
    played = play(make(every=2, in_turns=True))
    used = played.used[SETTLED:]
    assert (used.sum(1) == 2).all()
    assert (used[1:] != used[:-1]).all()


def test_all_images_are_used_while_a_worker_is_not_tracked():
    """While all cameras are lost for a second, the track ends."""
    lost = hrc_env.FaultConfig("lost", ("all",), start_s=0.6, end_s=2.0)
    played = play(make(every=4, faults=[lost]), n_steps=90)
    after = np.flatnonzero(~played.expected & played.used.any(1))
    assert (~played.expected).sum() > 5
    assert len(after) > 0
    assert played.used[after].all()
    assert played.used[played.expected].mean() < 0.5


def test_slots_that_are_known_to_be_vacant_do_not_need_every_image():
    env = make(n_workers=2, every=2)
    env.reset(seed=3)
    pipeline = env.simulation.pipeline
    tracked = np.array([[True, False]])
    expected = replace(env.simulation.belief.estimate, tracked=tracked)
    pipeline.steps[:] = 1
    pipeline.presence.slots["absent"] = [[False, True]]
    assert not pipeline._find_due_cameras(np.array([0]), expected).any()
    pipeline.presence.slots["absent"] = [[False, False]]
    assert pipeline._find_due_cameras(np.array([0]), expected).all()


def test_a_batch_uses_the_images_that_single_environments_use():
    config = {"detector": {"every": 3, "in_turns": True}}
    envs = gymnasium.make_vec("HRCReach-v0", 3, perception="keypoints", config=config)
    single = gymnasium.make("HRCReach-v0", perception="keypoints", config=config)
    batch, _ = envs.reset(seed=[5, 6, 7])
    alone, _ = single.reset(seed=6)
    for _ in range(20):
        np.testing.assert_array_equal(batch[1], alone)
        batch, *_ = envs.step(np.zeros(envs.action_space.shape))
        alone, *_ = single.step(np.zeros(single.action_space.shape))


def test_bounds_on_errors_are_not_those_of_every_image():
    for every, is_calibrated in ((1, True), (2, False)):
        env = make(every=every)
        env.reset(seed=3)
        assert env.simulation.belief.estimate.calibrated.all() == is_calibrated


@pytest.mark.parametrize("every", [0, -1])
def test_an_interval_without_images_is_refused(every):
    with pytest.raises(ConfigError, match=r"every must be positive"):
        make(every=every)


@pytest.mark.slow
def test_networks_rest_between_the_images_that_are_used(monkeypatch):
    calls, detect = [], PoseDetector.detect

    def count(self, *args, **kwargs):
        calls.append(1)
        return detect(self, *args, **kwargs)

    monkeypatch.setattr(PoseDetector, "detect", count)
    env = make("pixels", every=2)
    played = play(env, n_steps=30)
    tracked = played.expected.sum()
    assert tracked > 20
    assert len(calls) <= 31 - tracked // 2
    assert not played.shown[~played.used].any()


def test_every_image_is_used_while_measurements_disagree_with_the_track(monkeypatch):
    """A track that begins facing the wrong way turned too slowly with every second image."""
    env = make(every=2)
    env.reset(seed=3)
    pipeline = env.simulation.pipeline
    action = np.zeros(env.action_space.shape)

    def count_used(n_steps: int) -> int:
        used = 0
        for _ in range(n_steps):
            env.step(action)
            used += bool((pipeline.measurements.confidence > 0).any())
        return used

    count_used(SETTLED)
    assert not pipeline.disagrees.any()
    assert count_used(6) == 3
    monkeypatch.setattr(tracking, "MAX_MEAN_MISFIT", 0.0)  # no measurement agrees
    count_used(2)
    assert pipeline.disagrees.all()
    assert count_used(6) == 6
    monkeypatch.undo()
    count_used(1)
    assert count_used(6) == 3
    env.close()
