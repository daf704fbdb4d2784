"""What moves, laid over what was drawn once, is the picture that all at once would be."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env.env import HRCEnv
from hrc_env.geometry.cameras import PinholeCamera, project
from hrc_env.render.stage import QUALITY, Box, Stage
from hrc_env.scene.render import PictureRenderer, viewpoint_camera

SIZE = (240, 180)


@pytest.fixture(scope="module")
def env():
    env = HRCEnv(perception="truth")
    env.reset(seed=7)
    for _ in range(10):
        env.step(np.full(6, 0.3))
    yield env
    env.close()


@pytest.fixture(scope="module")
def stage(env):
    stage = Stage(env.simulation.scene, *SIZE)
    yield stage
    stage.close()


def camera(name: str = "beside") -> PinholeCamera:
    return viewpoint_camera(name, *SIZE)


def difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a.astype(float) - b).mean())


def test_it_is_the_picture_that_all_at_once_would_be_shadows_included(env, stage):
    quality = {**QUALITY, "offsamples": 4}
    renderer = PictureRenderer(env.simulation.scene, *SIZE, quality)
    stage.pose(*env.views.pose())
    drawn = stage.picture(camera(), shadows=True)
    whole = renderer.picture(*env.views.pose(), "beside")
    unshaded = renderer.picture(*env.views.pose(), "beside", shadows=False)
    renderer.close()
    assert difference(drawn, whole) < 3.0
    assert difference(drawn, whole) < 0.5 * difference(drawn, unshaded)


def test_shadows_of_what_moves_darken_the_floor(env, stage):
    q, motion = env.views.pose()
    away = replace(motion, position_world=motion.position_world + np.array([0.0, 0.0, 20.0]))
    stage.pose(q, away)
    without = stage.picture(camera("top"), shadows=True).astype(int)
    stage.pose(q, motion)
    with_worker = stage.picture(camera("top"), shadows=True).astype(int)
    lit = stage.picture(camera("top")).astype(int)
    darker = ((without - with_worker) > 15).all(-1) & (np.abs(with_worker - lit).max(-1) > 15)
    assert darker.sum() > 20


def test_the_same_pose_is_the_same_picture_whatever_was_drawn_between(env, stage):
    q, motion = env.views.pose()
    stage.pose(q, motion)
    before = stage.picture(camera(), shadows=True)
    stage.pose(q + 0.5, motion)
    other = stage.picture(camera(), shadows=True)
    stage.picture(camera("top"), shadows=True)
    stage.pose(q, motion)
    np.testing.assert_array_equal(stage.picture(camera(), shadows=True), before)
    assert difference(before, other) > 0.5


def test_nothing_that_moves_is_outside_the_box(env):
    layers, here = Stage(env.simulation.scene, *SIZE), camera()
    q, motion = env.views.pose()
    layers.pose(q, motion)
    left, top, right, bottom = layers.find_box(here)
    _, z = layers.draw_moving(here, Box(0, 0, *SIZE))
    layers.pose(q, replace(motion, held=None))
    some_left, some_top, some_right, some_bottom = layers.find_box(here)
    layers.close()
    rows, columns = np.nonzero(z)
    assert len(rows) > 1000
    assert (columns // 2 >= left).all()
    assert (columns // 2 < right).all()
    assert (rows // 2 >= top).all()
    assert (rows // 2 < bottom).all()
    area = (some_right - some_left) * (some_bottom - some_top)  # without the loads that lie about
    assert area < 0.8 * SIZE[0] * SIZE[1]


def test_the_picture_from_the_sun_has_things_where_they_are(env):
    layers = Stage(env.simulation.scene, *SIZE)
    layers.pose(*env.views.pose())
    shade, axes = layers.draw_shade(), layers.sun_axes()
    layers.close()
    assert shade is not None
    assert axes is not None
    head = env.simulation.estimate.mean_world[0, 0, 0] @ axes  # at level truth: the worker's own
    column, row = ((head[:2] - shade.corner) / shade.step_m).astype(int)
    along_m = shade.begin_m + (1 - shade.z[row, column]) * shade.deep_m
    assert head[2] - 0.35 < along_m < head[2] + 0.05


def test_a_viewpoint_sees_what_it_looks_at_in_the_middle():
    px, _ = project(camera().P[None], np.array([[[0.12, 0.0, 0.95]]]))
    np.testing.assert_allclose(px[0, 0, 0], (120, 90), atol=1e-9)
