"""A worker in a MuJoCo model: posed by writing mocap rows, drawn by skins, felt by capsules."""

import mujoco
import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.records import WorkerMotion
from hrc_env.scene.worker import add_worker, capsule_geom_ids, mocap_ids
from hrc_env.scene.worker_visuals import add_visuals
from hrc_env.worker.body import SEGMENT, SEGMENTS, load_body, worker_truth
from hrc_env.worker.mesh import load_mesh

PREFIX = "worker_1/"


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    add_worker(spec, load_body(), PREFIX)
    add_visuals(spec, load_body(), load_mesh(), PREFIX)
    return spec.compile()


def posed(model: mujoco.MjModel, motion: WorkerMotion) -> mujoco.MjData:
    data = mujoco.MjData(model)
    rows = mocap_ids(model, PREFIX)
    data.mocap_pos[rows] = motion.position_world
    data.mocap_quat[rows] = motion.quaternion_wxyz
    mujoco.mj_forward(model, data)
    return data


def drawn_skins(model: mujoco.MjModel, data: mujoco.MjData) -> list[np.ndarray]:
    """Vertices of the skins as the renderer would draw them."""
    scene = mujoco.MjvScene(model, maxgeom=100)
    mujoco.mjv_updateScene(
        model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(),
        mujoco.mjtCatBit.mjCAT_ALL.value, scene,
    )  # fmt: skip
    vertices = np.array(scene.skinvert).reshape(-1, 3)
    ends = np.cumsum(model.skin_vertnum)
    return [vertices[end - n : end] for end, n in zip(ends, model.skin_vertnum, strict=True)]


def test_every_segment_is_a_mocap_body(model):
    rows = mocap_ids(model, PREFIX)
    assert sorted(rows) == list(range(len(SEGMENTS)))


def test_at_rest_the_skin_is_the_baked_surface(model):
    for drawn, skin in zip(drawn_skins(model, posed(model, rest_motion(load_body()))),
                           load_mesh().skins, strict=True):  # fmt: skip
        np.testing.assert_allclose(drawn, skin.vertices, atol=1e-5)


def test_a_pose_moves_the_skin_by_linear_blending(model):
    rest = rest_motion(load_body())
    position = rest.position_world.copy()
    arm = [SEGMENT[f"left_{part}"] for part in ("upper_arm", "forearm", "hand")]
    position[arm] += [0.0, 0.0, 0.3]
    raised = WorkerMotion(position, rest.quaternion_wxyz, np.zeros((22, 3)), np.zeros((22, 3)))
    for drawn, skin in zip(drawn_skins(model, posed(model, raised)), load_mesh().skins,
                           strict=True):  # fmt: skip
        share = skin.weights[:, arm].sum(1)
        np.testing.assert_allclose(drawn[:, 2], skin.vertices[:, 2] + 0.3 * share, atol=1e-5)


def test_capsules_of_the_model_are_the_capsules_of_the_truth(model):
    body = load_body()
    rest = rest_motion(body)
    turn = np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)])
    motion = WorkerMotion(
        rest.position_world + np.array([1.0, 0.5, 0.0]),
        np.tile(turn, (22, 1)),
        np.zeros((22, 3)),
        np.zeros((22, 3)),
    )
    data = posed(model, motion)
    truth = worker_truth(body, motion)
    for k, geom in enumerate(capsule_geom_ids(model, body, PREFIX)):
        axis = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
        ends = data.geom_xpos[geom] + np.array([[-1.0], [1.0]]) * axis
        forward = np.abs(ends - truth.capsules_world[k]).max()
        backward = np.abs(ends[::-1] - truth.capsules_world[k]).max()
        assert min(forward, backward) < 1e-9
        assert model.geom_size[geom, 0] == truth.capsule_radius_m[k]


def test_capsules_are_felt_but_not_seen_and_the_hat_is_seen_but_not_felt(model):
    capsules = capsule_geom_ids(model, load_body(), PREFIX)
    assert np.all(model.geom_group[capsules] == 4)
    assert np.all(model.geom_contype[capsules] == 4)
    assert np.all(model.geom_conaffinity[capsules] == 0)
    hat = model.geom(PREFIX + "worker_1_hat").id
    assert model.geom_contype[hat] == model.geom_conaffinity[hat] == 0
    assert mujoco.MjvOption().geomgroup[4] == 0


def test_a_worker_adds_nothing_that_could_fall_or_swing(model):
    assert model.nv == 0


def test_two_workers_share_a_model_under_their_own_names():
    spec = mujoco.MjSpec()
    for prefix in ("worker_1/", "worker_2/"):
        add_worker(spec, load_body(), prefix)
        add_visuals(spec, load_body(), load_mesh(), prefix)
    model = spec.compile()
    first, second = mocap_ids(model, "worker_1/"), mocap_ids(model, "worker_2/")
    assert len(set(first) | set(second)) == 44
    assert (model.nskin, model.ntex) == (4, 2)
