"""Every baked worker: as its recipe says, whole, symmetric, held by its capsules, on its feet."""

import dataclasses
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

from assets.rotations import matrix_from_quaternion
from assets.workers.poses import rest_motion
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import WorkerMotion, WorkerPath
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.motion import generator
from hrc_env.motion.anatomy import measure_bodies, measure_body
from hrc_env.worker.body import (
    N_SEGMENTS,
    SEGMENT,
    assets_dir,
    load_bodies,
    load_body,
    worker_capsules,
    worker_names,
    worker_truth,
)
from hrc_env.worker.mesh import SkinMesh, load_mesh

sys.path.insert(0, str(assets_dir() / "workers"))
from recipes import RECIPES

MIRRORED_Y = np.array([1.0, -1.0, 1.0])


def outside_m(points: np.ndarray, ends: np.ndarray, radius_m: np.ndarray) -> np.ndarray:
    """(V,) signed distance of points to the nearest of capsules, positive outside."""
    axis = ends[:, 1] - ends[:, 0]
    away = points[:, None] - ends[:, 0]
    along = np.clip((away * axis).sum(-1) / (axis * axis).sum(-1), 0.0, 1.0)
    return (np.linalg.norm(away - along[..., None] * axis, axis=-1) - radius_m).min(1)


def surface(name: str) -> np.ndarray:
    """(V, 3) everything of a worker that can be seen, at rest."""
    body, looks = load_body(name), load_mesh(name)
    parts = [skin.vertices for skin in looks.skins]
    if looks.hat is not None:
        parts.append(looks.hat.vertices + body.rest_position[SEGMENT["head"]])
    return np.vstack(parts)


def skinned(skin: SkinMesh, rest: np.ndarray, motion: WorkerMotion) -> np.ndarray:
    """(V, 3) vertices moved by segments (S, ...): linear blend skinning, as MuJoCo does it."""
    turn = matrix_from_quaternion(motion.quaternion_wxyz)
    moved = np.einsum("sij,vsj->vsi", turn, skin.vertices[:, None] - rest) + motion.position_world
    return np.einsum("vs,vsi->vi", skin.weights, moved)


def spread_over(skin: SkinMesh) -> np.ndarray:
    """Points on every triangle, at most a third of an edge apart."""
    shares = [(a / 3, b / 3, 1 - (a + b) / 3) for a in range(4) for b in range(4 - a)]
    corners = skin.vertices[skin.faces]
    return np.concatenate([np.einsum("c,fci->fi", share, corners) for share in shares])


@pytest.mark.parametrize("name", worker_names())
def test_a_body_is_as_tall_as_its_recipe_says(name):
    body, head = load_body(name), load_mesh(name).skins[0]
    assert body.stature_m == pytest.approx(RECIPES[name].stature_m, abs=0.01)
    soles_and_hair = head.vertices[:, 2].max() - body.stature_m
    assert 0.0 < soles_and_hair < 0.03
    readme = (assets_dir() / "workers" / "README.md").read_text()
    assert f"| `{name}` | {body.stature_m:.2f} m |" in readme


@pytest.mark.parametrize("name", worker_names())
def test_hat_or_none_is_as_in_the_recipe(name):
    assert (load_mesh(name).hat is not None) == RECIPES[name].hat


@pytest.mark.parametrize("name", worker_names())
def test_a_body_has_all_its_segments_joints_and_the_same_capsules_as_every_other(name):
    body, first = load_body(name), load_body()
    assert body.rest_position.shape == (N_SEGMENTS, 3)
    assert body.joint_offset.shape == (N_JOINTS, 3)
    assert body.capsule_names == first.capsule_names
    np.testing.assert_array_equal(body.capsule_segment, first.capsule_segment)
    np.testing.assert_array_equal(body.joint_segment, first.joint_segment)


@pytest.mark.parametrize("name", worker_names())
def test_joints_lie_inside_the_body(name):
    body = load_body(name)
    truth = worker_truth(body, rest_motion(body))
    deepest = outside_m(truth.joints_world, truth.capsules_world, body.capsule_radius_m)
    assert deepest.max() < 0.0


@pytest.mark.parametrize("name", worker_names())
def test_capsules_hold_skin_clothes_and_hat_closely(name):
    """Signed distances of all vertices at rest to the nearest capsule."""
    body = load_body(name)
    capsules = worker_truth(body, rest_motion(body)).capsules_world
    out = outside_m(surface(name), capsules, body.capsule_radius_m)
    assert np.quantile(out, 0.95) < 0.01
    assert out.max() < 0.04, "nothing sticks out far (the hat's peak is the furthest)"
    assert np.median(out) > -0.03, "and the capsules are not fat"


@pytest.mark.parametrize("name", worker_names())
def test_left_and_right_measure_the_same(name):
    body = load_body(name)
    truth = worker_truth(body, rest_motion(body))
    joints, capsules = truth.joints_world, truth.capsules_world
    np.testing.assert_allclose(joints[MIRROR] * MIRRORED_Y, joints, atol=1e-6)
    for k, capsule in enumerate(body.capsule_names):
        twin = body.capsule_names.index(capsule.replace("left_", "right_"))
        if capsule.startswith("left_"):
            np.testing.assert_allclose(capsules[twin] * MIRRORED_Y, capsules[k], atol=1e-6)


@pytest.mark.parametrize("name", worker_names())
def test_what_one_sees_is_symmetric_to_some_millimetres(name):
    for skin in load_mesh(name).skins:
        points = spread_over(skin)
        away, _ = cKDTree(points).query(points * MIRRORED_Y)
        assert np.quantile(away, 0.95) < 0.012, "the points lie up to 2 cm apart"


@pytest.mark.parametrize("name", worker_names())
def test_a_worker_of_this_body_has_the_soles_on_the_floor(name):
    body = load_body(name)
    boots = load_mesh(name).skins[1]
    state = generator.make_state(3, 1, body, generator.MotionConfig())
    generator.reset(state, np.arange(3), [np.random.default_rng(seed) for seed in range(3)])
    everyone = generator.current(state)
    for b in range(3):
        one = WorkerMotion(
            everyone.position_world[b, 0], everyone.quaternion_wxyz[b, 0],
            everyone.velocity_world[b, 0], everyone.angular_velocity_world[b, 0],
        )  # fmt: skip
        vertices = skinned(boots, body.rest_position, one)
        feet = {side: _of_foot(boots, side) for side in ("left", "right")}
        for foot in feet.values():
            assert abs(vertices[foot, 2].min()) < 0.005


def _of_foot(boots: SkinMesh, side: str) -> np.ndarray:
    mine = [SEGMENT[f"{side}_{part}"] for part in ("foot", "toes")]
    return boots.weights[:, mine].sum(1) > 0.5


def shaken(n_steps: int, seed: int) -> WorkerMotion:
    """Two environments of three workers, segments (2, 3, S, ...) anyhow; (2, T, 3, ...) for T."""
    rng = np.random.default_rng(seed)
    lead = (2, n_steps, 3, N_SEGMENTS) if n_steps else (2, 3, N_SEGMENTS)
    turn = rng.normal(size=(*lead, 4))
    turn /= np.linalg.norm(turn, axis=-1, keepdims=True)
    return WorkerMotion(*(turn if n == 4 else rng.normal(size=(*lead, n)) for n in (3, 4, 3, 3)))


WHICH = np.array([[0, 2, 1], [2, 0, 0]])


def test_in_a_stack_every_worker_is_as_if_alone():
    bodies, motion = load_bodies(worker_names()[:3]), shaken(0, 1)
    truth = worker_truth(bodies, dataclasses.replace(motion, body=WHICH))
    for b, w in np.ndindex(WHICH.shape):
        body = load_body(bodies.names[WHICH[b, w]])
        alone = worker_truth(body, motion)
        np.testing.assert_array_equal(truth.joints_world[b, w], alone.joints_world[b, w])
        np.testing.assert_array_equal(truth.velocity_world[b, w], alone.velocity_world[b, w])
        np.testing.assert_array_equal(truth.capsules_world[b, w], alone.capsules_world[b, w])
        np.testing.assert_array_equal(truth.capsule_radius_m[b, w], body.capsule_radius_m)


def test_a_path_of_a_stack_has_each_workers_own_capsules_at_all_times():
    bodies, motion = load_bodies(worker_names()[:3]), shaken(4, 2)
    path = WorkerPath(motion.position_world, motion.quaternion_wxyz)
    capsules = worker_capsules(bodies, path, WHICH)
    for b, w in np.ndindex(WHICH.shape):
        alone = worker_capsules(load_body(bodies.names[WHICH[b, w]]), path)
        np.testing.assert_array_equal(capsules[b, :, w], alone[b, :, w])


def test_anatomies_of_a_stack_are_those_of_its_bodies():
    together = measure_bodies(load_bodies(worker_names()))
    for row, name in enumerate(worker_names()):
        alone = measure_body(load_body(name))
        np.testing.assert_array_equal(together.offset[row], alone.offset)
        np.testing.assert_array_equal(together.frame[row], alone.frame)
        np.testing.assert_array_equal(together.lengths[row], alone.lengths)


@pytest.mark.parametrize("which", [np.full((2, 3), 3), np.full((2, 3), -1)])
def test_rows_that_a_stack_does_not_have_are_refused(which):
    with pytest.raises(ConfigError, match="rows 0 to 2"):
        worker_truth(load_bodies(worker_names()[:3]), dataclasses.replace(shaken(0, 1), body=which))


def test_a_stack_of_nobody_is_refused():
    with pytest.raises(ConfigError, match="at least one"):
        load_bodies(())
