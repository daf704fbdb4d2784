"""The laboratory: room for the worker, looks that cost physics nothing."""

import pickle

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.geometry.sight import find_hidden
from hrc_env.scene.build import SceneConfig, build, drawing_model
from hrc_env.scene.primitives import DECORATION, OVERHEAD, ROBOT_LOOKS, SOLID
from hrc_env.worker.props import PROPS


def test_an_unknown_scene_is_told_the_valid_ones():
    with pytest.raises(ConfigError, match="lab"):
        build(name="moon")


def test_a_scene_is_compiled_once():
    assert build(SceneConfig(), n_workers=0) is build(SceneConfig(), n_workers=0)


def test_a_scene_is_pickled_as_its_recipe():
    scene = build(cameras=("camera_2",))
    text = pickle.dumps(scene)
    assert len(text) < 2000
    assert [camera.name for camera in pickle.loads(text).cameras] == ["camera_2"]


def test_physics_is_spared_what_only_the_eye_needs():
    groups = build().model.geom_group
    assert not np.isin(groups, [DECORATION, ROBOT_LOOKS, OVERHEAD]).any()
    assert build().model.ntex == build().model.ncam == build().model.nlight == 0


def test_both_models_share_one_state():
    scene = build(n_workers=1)
    drawn = drawing_model(scene)
    assert (drawn.nq, drawn.nu, scene.model.nmocap) == (scene.model.nq, scene.model.nu, 22)
    loads = [name for place in scene.grounds.places for name in place.loads]
    assert drawn.nmocap == 22 + len(PROPS) - 1 + len(loads)
    for segment in ("pelvis", "head", "left_hand"):
        name = f"worker_1/{segment}"
        physics_row = scene.model.body_mocapid[scene.model.body(name).id]
        assert drawn.body_mocapid[drawn.body(name).id] == physics_row


def test_nothing_solid_stands_where_workers_walk():
    model = build().model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for geom in np.flatnonzero(model.geom_group == SOLID):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        x, y = data.geom_xpos[geom, :2]
        reach = model.geom_rbound[geom]
        nearest = np.clip([x, y], [0.25, -2.0], [2.4, 2.0])
        half = model.geom_size[geom, :2].max()
        assert np.abs(nearest - [x, y]).max() > min(half, reach) - 0.35, model.geom(geom).name


def test_the_shared_workspace_is_in_sight_of_every_camera():
    scene = build()
    eyes = np.stack([camera.eye_world for camera in scene.cameras])
    grid = np.stack(np.meshgrid([0.3, 0.8, 1.6], [-1.0, 0.0, 1.0], [0.4, 1.1, 1.6]), -1)
    between = scene.surroundings(scene.home_q[None])
    assert find_hidden(between, eyes, grid.reshape(1, -1, 3)).mean() < 0.1


def test_the_textures_are_the_same_every_time():
    first, second = (drawing_model.__wrapped__(build()) for _ in range(2))
    np.testing.assert_array_equal(first.tex_data, second.tex_data)
