"""Lenses before the renderer and behind the detector."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from hrc_env.core.records import Keypoints, Roi
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import (
    image_from_pinhole,
    pinhole_from_image,
    pinhole_magnification,
    project,
    projections,
    rays,
)
from hrc_env.geometry.lens import Lens
from hrc_env.perception import lenses
from hrc_env.perception.blazepose import to_image
from hrc_env.perception.lenses import LensRenderer, pinhole_keypoints
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.primitives import SOLID
from hrc_env.scene.render import CropRenderer
from hrc_env.scene.rig import LAB_CAMERAS, make_cameras

GOPRO = CameraConfig.from_make("gopro_hero8_wide", "gopro", LAB_CAMERAS[0].eye_world)
BROWN = replace(GOPRO, name="brown", lens=Lens("brown_conrady", (-0.1, 0.01)), hfov_deg=90.0)
BALLS = np.array([[0.2, 0.0, 1.0], [-0.4, -1.8, 0.6], [1.9, -1.6, 1.9], [-1.2, 2.5, 0.4]])
SHIFT_PX = np.array([6.0, -4.0])
"""How far the ball is from the middle of a crop."""


@pytest.fixture(scope="module")
def pattern():
    """Small white balls and nothing else."""
    spec = mujoco.MjSpec()
    spec.visual.headlight.ambient[:] = 1.0
    spec.stat.extent, spec.visual.map.znear = 4.0, 0.01
    for place in BALLS:
        spec.worldbody.add_geom(size=[0.012, 0, 0], pos=place, rgba=[1, 1, 1, 1], group=SOLID)
    return spec.compile()


def found_px(crop: np.ndarray, window: Roi) -> np.ndarray:
    """Image pixels of the middle of what is bright in a crop."""
    weight = crop.max(-1).astype(float)
    rows, columns = np.indices(weight.shape) + 0.5
    middle = np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum()
    return to_image(middle / len(crop), window)


@pytest.mark.parametrize("config", [GOPRO, BROWN], ids=lambda config: config.name)
@pytest.mark.parametrize("rotation_rad", [0.0, 0.7])
def test_a_pattern_through_the_lens_and_back_is_the_pinholes(
    pattern, monkeypatch, config, rotation_rad
):
    """The criterion: 0.3 px between what both find, in pinhole pixels."""
    monkeypatch.setattr("hrc_env.scene.canvas.drawing_model", lambda _: pattern)
    scene = build(SceneConfig(clutter=False, cameras=(config,)))
    camera, renderer = scene.cameras[0], CropRenderer(scene)
    mujoco.mj_forward(renderer._model, renderer._data)
    images = LensRenderer(renderer, scene.cameras)
    for ball in BALLS:
        px = project(projections((camera,)), ball[None])[0][0, 0]
        straight = Roi(tuple(px + SHIFT_PX), 90.0, rotation_rad)
        by_pinhole = found_px(renderer.view(camera, straight), straight)
        bent = Roi(tuple(image_from_pinhole(camera, px) - SHIFT_PX), 80.0, rotation_rad)
        by_lens = pinhole_from_image(camera, found_px(images.view(camera, bent), bent))
        assert np.abs(by_lens - by_pinhole).max() < 0.3
    renderer.close()


class Plain:
    """Draws the direction of the light: red to the right, green downwards."""

    size_px = 64

    def view(self, camera, window):
        middles = (np.arange(64) + 0.5) / 64
        px = to_image(np.stack(np.meshgrid(middles, middles), -1), window)
        ray = rays(replace(camera, lens=None), px)
        return np.clip(np.round(ray * 127 + 127), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("config", [GOPRO, BROWN], ids=lambda config: config.name)
def test_every_pixel_shows_the_light_that_the_lens_brings_there(config):
    (camera,) = make_cameras((config,))
    window = Roi((700.0, 500.0), 620.0, 0.4)
    crop = LensRenderer(Plain(), (camera,)).crop(0, window)
    middles = (np.arange(64) + 0.5) / 64
    light = rays(camera, to_image(np.stack(np.meshgrid(middles, middles), -1), window))
    assert np.abs(crop - (light * 127 + 127)).max() < 2.0


def test_outside_the_image_it_is_black():
    (camera,) = make_cameras((GOPRO,))
    crop = LensRenderer(Plain(), (camera,)).crop(0, Roi((0.0, 540.0), 400.0, 0.0))
    assert (crop[:, :31] == 0).all()
    assert (crop[:, 33:] > 0).any()


def test_where_the_lens_shows_nothing_it_is_black():
    (camera,) = make_cameras((GOPRO,))
    crop = LensRenderer(Plain(), (camera,)).crop(0, Roi((5000.0, 540.0), 400.0, 0.0))
    assert not crop.any()


def test_a_camera_without_lens_is_the_renderers_own():
    (camera,) = make_cameras(LAB_CAMERAS[:1])
    window = Roi((900.0, 500.0), 300.0, 0.3)
    np.testing.assert_array_equal(
        LensRenderer(Plain(), (camera,)).crop(0, window), Plain().view(camera, window)
    )


def test_maps_are_kept_and_not_without_end():
    (camera,) = make_cameras((GOPRO,))
    images = LensRenderer(Plain(), (camera,))
    for k in range(lenses.MAPS_KEPT + 8):
        images.crop(0, Roi((700.0 + k, 500.0), 300.0, 0.0))
    assert lenses._resample.cache_info().currsize == lenses.MAPS_KEPT


def test_keypoints_go_to_the_tracker_in_pinhole_pixels_with_their_deviations_stretched():
    cameras = make_cameras((LAB_CAMERAS[1], GOPRO))
    px = np.random.default_rng(0).uniform([100, 100], [1800, 980], (1, 2, 1, 15, 2))
    px[0, 1, 0, 3] = np.nan
    bent = Keypoints(px, np.ones(px.shape[:-1]), np.full(px.shape[:-1], 3.0))
    straight = pinhole_keypoints(bent, cameras)
    np.testing.assert_array_equal(straight.px[:, 0], px[:, 0])
    np.testing.assert_allclose(image_from_pinhole(cameras[1], straight.px[:, 1]), px[:, 1])
    seen = np.isfinite(px[0, 1, 0, :, 0])
    grown = pinhole_magnification(cameras[1], straight.px[0, 1, 0, seen])
    np.testing.assert_allclose(straight.sigma_px[0, 1, 0, seen], 3.0 * grown)
    assert straight.confidence[0, 1, 0, 3] == 0
    assert np.isinf(straight.sigma_px[0, 1, 0, 3])


def test_without_a_lens_keypoints_are_left_alone():
    found = Keypoints(np.zeros((1, 4, 1, 15, 2)), np.ones((1, 4, 1, 15)), np.ones((1, 4, 1, 15)))
    assert pinhole_keypoints(found, make_cameras(LAB_CAMERAS)) is found
