"""The baked worker: what its numbers promise, and how points ride on moving segments."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from assets.rotations import matrix_from_quaternion, quaternion_from_matrix
from assets.workers.poses import rest_motion
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import WorkerMotion
from hrc_env.core.skeleton import JOINT, MIRROR, N_JOINTS
from hrc_env.geometry.rotations import about_axis
from hrc_env.worker.body import (
    N_SEGMENTS,
    PARENT,
    SEGMENT,
    SEGMENTS,
    assets_dir,
    load_body,
    worker_names,
    worker_truth,
)
from hrc_env.worker.mesh import load_mesh

ANGLES = st.floats(-np.pi, np.pi)
MIRRORED_Y = np.array([1.0, -1.0, 1.0])


def turned(motion: WorkerMotion, rotation: np.ndarray, shift: np.ndarray) -> WorkerMotion:
    """The whole body moved rigidly."""
    turns = rotation @ matrix_from_quaternion(motion.quaternion_wxyz)
    return WorkerMotion(
        motion.position_world @ rotation.T + shift,
        quaternion_from_matrix(turns),
        motion.velocity_world @ rotation.T,
        motion.angular_velocity_world @ rotation.T,
    )


def spinning(time_s: float) -> WorkerMotion:
    """Every segment turns about its own axis at its own rate while its origin drifts."""
    rng = np.random.default_rng(5)
    axis = rng.normal(size=(N_SEGMENTS, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    rate = rng.uniform(-4.0, 4.0, N_SEGMENTS)
    drift = rng.normal(size=(N_SEGMENTS, 3))
    half = rate * time_s / 2
    quaternion = np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
    position = load_body().rest_position + drift * time_s
    return WorkerMotion(position, quaternion, drift, axis * rate[:, None])


def distance_to_capsules(points: np.ndarray, ends: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """(V, K) signed distance of points to capsules, positive outside."""
    axis = ends[:, 1] - ends[:, 0]
    away = points[:, None] - ends[:, 0]
    along = np.clip((away * axis).sum(-1) / (axis * axis).sum(-1), 0.0, 1.0)
    return np.linalg.norm(away - along[..., None] * axis, axis=-1) - radius


def test_every_segment_hangs_on_one_that_comes_before_it():
    assert PARENT[0] == -1
    assert np.all(PARENT[1:] < np.arange(1, N_SEGMENTS))
    assert np.all(PARENT[1:] >= 0)


def test_limbs_hang_on_their_own_side():
    for name in SEGMENTS:
        parent = PARENT[SEGMENT[name]]
        side = name.partition("_")[0]
        if side in ("left", "right") and parent >= 0:
            assert SEGMENTS[parent].startswith(side) or SEGMENTS[parent] in ("chest", "pelvis")


def test_at_rest_joints_are_where_the_rest_pose_has_them():
    body = load_body()
    truth = worker_truth(body, rest_motion(body))
    expected = body.rest_position[body.joint_segment] + body.joint_offset
    np.testing.assert_allclose(truth.joints_world, expected, atol=1e-12)
    np.testing.assert_array_equal(truth.velocity_world, 0.0)


def test_a_worker_stands_on_the_floor_and_is_as_tall_as_a_man_with_boots_and_hat():
    body, looks = load_body(), load_mesh()
    cloth = next(skin for skin in looks.skins if skin.name == "cloth")
    assert abs(cloth.vertices[:, 2].min()) < 1e-3
    crown = looks.hat.vertices[:, 2].max() + body.rest_position[SEGMENT["head"], 2]
    assert body.stature_m < crown < body.stature_m + 0.07


def test_a_worker_faces_x_with_the_left_hand_on_positive_y():
    body = load_body()
    joints = worker_truth(body, rest_motion(body)).joints_world
    assert joints[JOINT["nose"], 0] > joints[JOINT["left_shoulder"], 0]
    assert joints[JOINT["left_wrist"], 1] > 0.3
    assert joints[JOINT["left_foot"], 0] > joints[JOINT["left_ankle"], 0] + 0.1


def test_left_and_right_are_mirror_images():
    body = load_body()
    truth = worker_truth(body, rest_motion(body))
    joints, capsules = truth.joints_world, truth.capsules_world
    np.testing.assert_allclose(joints[MIRROR] * MIRRORED_Y, joints, atol=1e-6)
    for k, name in enumerate(body.capsule_names):
        if name.startswith("left_"):
            twin = body.capsule_names.index(name.replace("left_", "right_"))
            np.testing.assert_allclose(capsules[twin] * MIRRORED_Y, capsules[k], atol=1e-6)
            assert body.capsule_radius_m[twin] == body.capsule_radius_m[k]


@settings(max_examples=20, deadline=None)
@given(yaw=ANGLES, pitch=ANGLES, roll=ANGLES)
def test_moving_all_segments_rigidly_moves_joints_and_capsules_rigidly(yaw, pitch, roll):
    body = load_body()
    rotation = about_axis("z", yaw) @ about_axis("y", pitch) @ about_axis("x", roll)
    shift = np.array([1.0, -2.0, 0.5])
    pose = spinning(0.3)
    before, after = worker_truth(body, pose), worker_truth(body, turned(pose, rotation, shift))
    for field in ("joints_world", "capsules_world"):
        moved = getattr(before, field) @ rotation.T + shift
        np.testing.assert_allclose(getattr(after, field), moved, atol=1e-9)
    velocity = before.velocity_world @ rotation.T
    np.testing.assert_allclose(after.velocity_world, velocity, atol=1e-9)


def test_velocities_are_the_slopes_of_positions():
    body, step = load_body(), 1e-5
    ahead = worker_truth(body, spinning(0.4 + step)).joints_world
    behind = worker_truth(body, spinning(0.4 - step)).joints_world
    slope = (ahead - behind) / (2 * step)
    np.testing.assert_allclose(worker_truth(body, spinning(0.4)).velocity_world, slope, atol=1e-6)


def test_leading_axes_of_any_number_pass_through_and_do_not_mix():
    body = load_body()
    poses = [spinning(time_s) for time_s in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)]
    fields = ("position_world", "quaternion_wxyz", "velocity_world", "angular_velocity_world")
    stacked = WorkerMotion(
        *(np.stack([getattr(pose, field) for pose in poses]).reshape(2, 3, N_SEGMENTS, -1)
          for field in fields)
    )  # fmt: skip
    truth = worker_truth(body, stacked)
    assert truth.joints_world.shape == (2, 3, N_JOINTS, 3)
    assert truth.capsules_world.shape == (2, 3, len(body.capsule_names), 2, 3)
    alone = worker_truth(body, poses[4])
    np.testing.assert_array_equal(truth.joints_world[1, 1], alone.joints_world)
    np.testing.assert_array_equal(truth.velocity_world[1, 1], alone.velocity_world)


def test_nobody_is_a_motion_too():
    body = load_body()
    nobody = WorkerMotion(*(np.zeros((4, 0, N_SEGMENTS, n)) for n in (3, 4, 3, 3)))
    assert worker_truth(body, nobody).joints_world.shape == (4, 0, N_JOINTS, 3)


def test_capsules_hold_the_clothed_surface_closely():
    body, looks = load_body(), load_mesh()
    capsules = worker_truth(body, rest_motion(body)).capsules_world
    hat = looks.hat.vertices + body.rest_position[SEGMENT["head"]]
    points = np.vstack([skin.vertices for skin in looks.skins] + [hat])
    outside = distance_to_capsules(points, capsules, body.capsule_radius_m).min(1)
    assert np.quantile(outside, 0.95) < 0.02, "95 % of the surface at most 2 cm outside"
    assert outside.max() < 0.05, "nothing sticks out far"
    assert np.median(outside) > -0.03, "and the capsules are not fat"


@pytest.mark.parametrize("index", [0, 1])
def test_skins_have_whole_weights_and_faces_that_exist(index):
    skin = load_mesh().skins[index]
    np.testing.assert_allclose(skin.weights.sum(1), 1.0, atol=1e-12)
    assert np.all((skin.weights > 0).sum(1) <= 4)
    assert skin.faces.min() == 0
    assert skin.faces.max() == len(skin.vertices) - 1
    assert np.all((skin.uv >= 0) & (skin.uv <= 1))


def test_a_baked_worker_is_small():
    for name in worker_names():
        assert (assets_dir() / "workers" / f"{name}.npz").stat().st_size < 120_000


def test_a_body_cannot_be_changed_by_who_uses_it():
    with pytest.raises(ValueError, match="read-only"):
        load_body().joint_offset[0] = 0.0


def test_an_unknown_worker_is_answered_with_the_known_ones():
    with pytest.raises(ConfigError, match=r"worker_11.*worker_1"):
        load_body("worker_11")


def test_segments_of_a_wrong_number_are_refused():
    short = WorkerMotion(*(np.zeros((21, n)) for n in (3, 4, 3, 3)))
    with pytest.raises(ConfigError, match="22"):
        worker_truth(load_body(), short)
