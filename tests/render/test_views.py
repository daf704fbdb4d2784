"""Pictures of an environment: sizes, what they show, and that they change nothing."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.vector.env import HRCVectorEnv


@pytest.mark.parametrize("mode", ["rgb_array", "depth_array"])
def test_pictures_have_the_size_that_was_asked_for(mode):
    env = gymnasium.make("HRCReach-v0", perception="truth", render_mode=mode, width=160, height=90)
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == ((90, 160, 3) if mode == "rgb_array" else (90, 160))
    assert picture.std() > 0.5
    env.close()


def test_pictures_of_many_have_that_size_too():
    env = HRCVectorEnv(
        2, perception="truth", render_mode="rgb_array", width=96, height=64,
        num_threads=2,
    )  # fmt: skip
    env.reset(seed=0)
    assert [picture.shape for picture in env.render()] == [(64, 96, 3)] * 2
    env.close()


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ({"width": 0}, r"width \[px\] must be a whole number from 16 to 4096, got 0"),
        ({"height": -5}, "height"),
        ({"width": 480.0}, "got 480.0"),
        ({"height": 5000}, "got 5000"),
        ({"width": True}, "got True"),
        ({"height": "360"}, "got '360'"),
    ],
)
def test_a_size_that_cannot_be_is_told_what_can(size, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="none", render_mode="rgb_array", **size)
    with pytest.raises(ConfigError, match=said):
        HRCVectorEnv(2, perception="none", render_mode="rgb_array", **size)


def test_who_asks_for_a_window_is_told_how_to_get_one():
    with pytest.raises(ConfigError, match="HumanRendering"):
        HRCEnv(perception="none", render_mode="human")


def test_rendering_changes_nothing_that_happens():
    seen = []
    for mode in (None, "rgb_array"):
        env = HRCEnv(perception="keypoints", render_mode=mode, width=64, height=64)
        env.reset(seed=4)
        rows = []
        for k in range(6):
            rows.append(env.step(np.full(6, 0.1 * k))[0])
            env.render()
        seen.append(np.array(rows))
        env.close()
    np.testing.assert_array_equal(*seen)


def test_a_glance_stays_while_the_environment_goes_on():
    env = HRCEnv(perception="keypoints")
    env.reset(seed=7)
    for _ in range(5):
        env.step(np.zeros(6))
    seen = env.views.glance()
    before = env.views.room(160, 120, seen), env.views.cameras(160, 90, seen)
    for _ in range(10):
        env.step(np.full(6, 0.8))
    after = env.views.room(160, 120, seen), env.views.cameras(160, 90, seen)
    np.testing.assert_array_equal(before[0], after[0])
    np.testing.assert_array_equal(before[1], after[1])
    assert not np.array_equal(env.views.room(160, 120, env.views.glance()), before[0])
    env.close()


def test_what_is_believed_is_drawn_without_the_truth():
    env = HRCEnv(perception="none")
    env.reset(seed=7)
    seen = env.views.glance()
    env.reset(seed=8)  # another worker, of whom nothing is known
    other = replace(env.views.glance(), q=seen.q, markers_world=seen.markers_world)
    assert not np.array_equal(seen.motion.position_world, other.motion.position_world)
    first, second = (env.views.beliefs(200, 110, each) for each in (seen, other))
    for before, after in zip(first, second, strict=True):
        assert before.std() > 3
        np.testing.assert_array_equal(before, after)
    env.close()


def test_crops_are_what_the_network_was_given(weights):
    env = HRCEnv(perception="pixels")
    env.reset(seed=7)
    env.step(np.zeros(6))
    given = env.simulation.pipeline.crops(0)
    windows = env.simulation.pipeline.last_detections(0)[1][0]
    assert [crop is None for crop in given] == [window is None for window in windows]
    assert sum(crop is not None for crop in given) >= 2
    for crop, window, c in zip(given, windows, range(4), strict=True):
        if crop is not None and window is not None:
            again = env.simulation.pipeline.cameras.images.crop(c, window)
            assert np.abs(crop.astype(int) - again).max(-1).mean() < 30  # black outside the image
    pictures = env.views.crops(64, env.views.glance())
    assert [picture.shape for picture in pictures] == [(64, 64, 3)] * 4
    before = env.simulation.get_state()
    env.simulation.pipeline.worker_detector.windows[0][0] = [None] * 4  # as after `set_state`
    assert env.simulation.pipeline.crops(0) == [None] * 4
    env.simulation.set_state(before)
    assert [crop is None for crop in env.simulation.pipeline.crops(0)] == [
        w is None for w in windows
    ]
    env.close()
