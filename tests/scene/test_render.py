"""Pictures: the renderer and the pinhole camera agree on every pixel convention."""

import os
import pickle
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.batching import map_arrays
from hrc_env.core.errors import ConfigError, RenderingError
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.geometry.cameras import project, projections, rays
from hrc_env.scene import build as building
from hrc_env.scene import gl
from hrc_env.scene.build import SceneConfig, build
from hrc_env.scene.canvas import Canvas
from hrc_env.scene.render import CROP_QUALITY, CropRenderer, PictureRenderer
from hrc_env.worker.body import load_body

BALLS = np.array([[0.6, 0.2, 1.2], [0.1, -0.5, 1.6], [1.4, 0.9, 0.7]])


@pytest.fixture(scope="module")
def balls():
    """A scene with nothing but the cameras and one bright ball at a time."""
    scene = build(SceneConfig(clutter=False))
    spec = mujoco.MjSpec()
    spec.visual.headlight.ambient[:] = 1.0
    spec.stat.extent, spec.visual.map.znear = 4.0, 0.01
    for place in BALLS:
        ball = spec.worldbody.add_body(mocap=True, pos=place)
        ball.add_geom(size=[0.03, 0, 0], rgba=[1, 1, 1, 1])
    return scene, spec.compile()


def centroid(image: np.ndarray) -> np.ndarray:
    """Of the bright pixels; pixel centres lie at half-integers."""
    rows, columns = np.nonzero(image.max(-1) > 40)
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5])


def crop_px(window: Roi, px: np.ndarray) -> np.ndarray:
    """Full-image pixels to pixels of the 256 px crop."""
    c, s = np.cos(window.rotation_rad), np.sin(window.rotation_rad)
    d = (px - np.array(window.centre_px)) / window.side_px * 256
    return np.array([c * d[0] + s * d[1], c * d[1] - s * d[0]]) + 128


@pytest.mark.parametrize("camera_index", range(4))
@pytest.mark.parametrize(
    ("shift", "side_px", "rotation_rad"),
    [((0, 0), 200, 0.0), ((30, -25), 180, 0.0), ((-20, 35), 220, 0.6), ((5, 5), 160, -2.5)],
)
def test_a_rendered_ball_is_where_the_camera_projects_it(
    balls, monkeypatch, camera_index, shift, side_px, rotation_rad
):
    scene, model = balls
    monkeypatch.setattr("hrc_env.scene.canvas.drawing_model", lambda _: model)
    camera = scene.cameras[camera_index]
    canvas = Canvas(scene, 256, 256, CROP_QUALITY | {"numslices": 40, "numstacks": 40})
    canvas.groups((0,))
    for index, ball in enumerate(BALLS):
        canvas._data.mocap_pos[:] = [0, 0, -50]
        canvas._data.mocap_pos[index] = ball
        mujoco.mj_forward(canvas._model, canvas._data)
        canvas._fresh.clear()
        px = project(projections((camera,)), ball[None])[0][0, 0]
        window = Roi(tuple(px + shift), side_px, rotation_rad)
        canvas.show()
        canvas.aim(camera, window, side_px)
        error = centroid(canvas.paint()) - crop_px(window, px)
        assert np.abs(error).max() < 0.5
    canvas.close()


@pytest.fixture(scope="module")
def lab():
    return build(n_workers=1)


@pytest.fixture(scope="module")
def person() -> WorkerMotion:
    rest = rest_motion(load_body())
    moved = replace(rest, position_world=rest.position_world + np.array([0.9, 0.3, 0.0]))
    return map_arrays(moved, lambda array: array[None])


@pytest.fixture(scope="module")
def crops(lab):
    renderer = CropRenderer(lab)
    yield renderer
    renderer.close()


WINDOW = Roi((900.0, 560.0), 500.0, 0.1)


def test_a_crop_is_a_picture_of_the_asked_size_and_not_empty(lab, person, crops):
    crops.pose(lab.home_q, person)
    crop = crops.crop(0, WINDOW)
    assert crop.shape == (256, 256, 3)
    assert crop.dtype == np.uint8
    assert crop.std() > 20


def test_drawing_twice_gives_the_same_bits(lab, person, crops):
    other = CropRenderer(lab)
    for renderer in (other, crops):
        renderer.pose(lab.home_q, person)
    np.testing.assert_array_equal(other.crop(1, WINDOW), crops.crop(1, WINDOW))
    other.close()


@pytest.mark.parametrize("place", ["lab", "site"])
def test_a_kept_background_changes_no_pixel(place, person):
    """Twelve poses, four cameras, windows upright, turned, and beyond the image's border."""
    scene = build(name=place, n_workers=1)
    fresh, keeping = CropRenderer(scene), CropRenderer(scene)
    windows = [
        WINDOW,
        Roi((1700.0, 800.0), 620.0, -0.7),
        Roi((700.0, 300.0), 300.0, 2.0),
    ]
    for look, turn in enumerate(np.linspace(0.0, 1.1, 12)):
        shift = np.array([-turn, 0.4 * turn, 0.0])
        moved = replace(person, position_world=person.position_world + shift)
        for renderer in (fresh, keeping):
            renderer.pose(scene.home_q + turn, moved)
        fresh._kept.clear()
        window = windows[look % 3]
        for camera in range(4):
            direct, laid_over = fresh.crop(camera, window), keeping.crop(camera, window)
            np.testing.assert_array_equal(direct, laid_over)
    assert len(keeping._kept) == 12
    assert None not in keeping._kept.values()
    fresh.close()
    keeping.close()


def test_a_renderer_survives_pickling(lab, person, crops):
    twin = pickle.loads(pickle.dumps(crops))
    for renderer in (twin, crops):
        renderer.pose(lab.home_q, person)
    np.testing.assert_array_equal(twin.crop(1, WINDOW), crops.crop(1, WINDOW))
    twin.close()


def test_a_turned_window_shows_the_picture_turned(lab, person, crops):
    crops.pose(lab.home_q, person)
    upright = crops.crop(2, Roi((900.0, 560.0), 500.0, 0.0)).astype(int)
    turned = crops.crop(2, Roi((900.0, 560.0), 500.0, np.pi / 2)).astype(int)
    # A window turned clockwise shows its content turned anticlockwise.
    difference = np.abs(np.rot90(upright) - turned).max(-1)
    assert np.median(difference) <= 1
    assert (difference > 40).mean() < 0.02


def test_the_worker_is_in_the_picture(lab, person, crops):
    crops.pose(lab.home_q, person)
    there = crops.crop(3, WINDOW)
    away = replace(person, position_world=person.position_world + np.array([0, 0, -9.0]))
    crops.pose(lab.home_q, away)
    assert (there != crops.crop(3, WINDOW)).any(-1).mean() > 0.02


def test_a_camera_that_does_not_exist_is_told_the_valid_ones(crops):
    with pytest.raises(ConfigError, match="0 to 3"):
        crops.crop(4, WINDOW)


def test_a_closed_renderer_says_so(lab, person):
    renderer = CropRenderer(lab)
    renderer.close()
    renderer.close()
    renderer.pose(lab.home_q, person)
    with pytest.raises(RenderingError, match="closed"):
        renderer.crop(0, WINDOW)


@pytest.fixture(scope="module")
def pictures(lab):
    renderer = PictureRenderer(lab, 320, 180)
    yield renderer
    renderer.close()


@pytest.mark.parametrize("viewpoint", ["room", "top", "outside", "camera_2"])
def test_people_get_pictures_from_named_viewpoints(lab, person, pictures, viewpoint):
    picture = pictures.picture(lab.home_q, person, viewpoint)
    assert picture.shape == (180, 320, 3)
    assert picture.std() > 20


def test_depth_is_how_far_the_floor_is(lab, person, pictures):
    camera = pictures.camera("camera_4")
    depth_m = pictures.picture(lab.home_q, person, "camera_4", depth=True)
    pixel = np.array([160.5, 150.5]) * camera.width_px / 320  # of the camera's own image
    pixel[1] += (camera.height_px - 180 * camera.width_px / 320) / 2
    direction = rays(camera, pixel)
    to_floor = -camera.eye_world[2] / direction[2]
    expected = to_floor * (direction @ camera.T_world_from_cam[:3, 2])
    assert depth_m[150, 160] == pytest.approx(expected, abs=0.02)


def test_an_unknown_viewpoint_is_told_the_valid_ones(lab, person, pictures):
    with pytest.raises(ConfigError, match="Did you mean 'room'"):
        pictures.picture(lab.home_q, person, "rom")


def test_two_renderers_take_turns_without_drawing_into_each_other(lab, person, crops, pictures):
    crops.pose(lab.home_q, person)
    alone = crops.crop(0, WINDOW)
    before = pictures.picture(lab.home_q, person, "room")
    np.testing.assert_array_equal(crops.crop(0, WINDOW), alone)
    np.testing.assert_array_equal(pictures.picture(lab.home_q, person, "room"), before)


def test_this_machine_can_draw_and_says_with_what():
    works, sentence = gl.gl_status()
    assert works, sentence
    assert "OpenGL works" in sentence


def test_a_users_choice_of_backend_is_respected(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    assert gl.choose_backend() == "osmesa"


def test_crops_are_drawn_on_one_thread_unless_the_user_wants_more(lab, monkeypatch):
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)
    CropRenderer(lab)
    assert os.environ["LP_NUM_THREADS"] == "0"
    monkeypatch.setenv("LP_NUM_THREADS", "4")
    CropRenderer(lab)
    assert os.environ["LP_NUM_THREADS"] == "4"


def test_without_opengl_the_message_names_the_remedy(monkeypatch):
    def broken(_: str):
        raise ImportError("no library")

    monkeypatch.setattr(gl, "_context_class", broken)
    works, sentence = gl.gl_status()
    assert not works
    assert "apt-get install" in sentence


def test_rendering_that_is_switched_off_says_how_to_switch_it_on(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    works, sentence = gl.gl_status()
    assert not works
    assert "unset it" in sentence


def test_looks_are_painted_once(lab):
    assert building.drawing_model(lab) is building.drawing_model(lab)
