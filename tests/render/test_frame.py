"""A film's frame: legend, belief, goals, separation."""

import numpy as np
import pytest

from hrc_env.env import HRCEnv
from hrc_env.render import overlay
from hrc_env.render.frame import LEGEND_HEIGHT, MOMENT, RIGHT_X, TITLE_Y, compose, legend, strip


def colours(image: np.ndarray) -> set[tuple[int, ...]]:
    return set(map(tuple, image.reshape(-1, 3).tolist()))


def a_diary(n_steps: int = 20) -> np.ndarray:
    return np.full(n_steps, np.array((0.8, 0.7, 0.0, 0.0), MOMENT))


def test_the_legend_names_what_a_level_shows():
    at = {level: colours(legend(level)) for level in ("pixels", "keypoints", "truth")}
    for level in at:
        assert {overlay.LEFT, overlay.RIGHT, overlay.BELIEF, overlay.GOAL} <= at[level]
    assert overlay.WINDOW in at["pixels"]
    assert overlay.WINDOW not in at["keypoints"]
    assert overlay.DETECTED in at["keypoints"]
    assert overlay.DETECTED not in at["truth"]


def test_the_strip_counts_goals_and_marks_steps_that_cost():
    plain = strip(a_diary(), {}, 0.04, 0.15)
    scored = strip(a_diary(), {"goals reached": 3.0, "goals missed": 1.0}, 0.04, 0.15)
    assert not np.array_equal(plain[:, :280], scored[:, :280])
    np.testing.assert_array_equal(plain[:, 280:], scored[:, 280:])
    costly = a_diary()
    costly["cost"][-1] = 1.0
    assert not np.array_equal(plain[:, 280:], strip(costly, {}, 0.04, 0.15)[:, 280:])


@pytest.mark.parametrize("level", ["keypoints", "none"])
def test_a_frame_is_full_at_levels_without_crops(level):
    env = HRCEnv(perception=level)
    env.reset(seed=7)
    env.step(np.zeros(6))
    frame = compose(env.views, a_diary(1), {})
    env.close()
    assert frame.shape == (900, 1600, 3)
    for x in (RIGHT_X, RIGHT_X + 404):
        belief = frame[TITLE_Y + 60 : TITLE_Y + 230, x : x + 400]
        assert belief.std() > 3
        assert overlay.ARM in colours(belief)
    assert frame[716 - LEGEND_HEIGHT : 716, :300].std() > 10
