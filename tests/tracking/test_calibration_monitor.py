"""Cameras that are not where they are said to be: named; those that are merely bad: not."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from hrc_env.core.batching import copy_arrays
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import MIRROR
from hrc_env.geometry.cameras import pinhole, project
from hrc_env.geometry.rotations import about_axis
from hrc_env.tracking.calibration_monitor import forget_monitor, make_monitor, monitor

CORNERS = [(2.9, 2.6, 2.4), (-2.9, 2.6, 2.4), (-2.9, -2.6, 2.4), (2.9, -2.6, 2.4)]
RIG = tuple(
    pinhole(f"c{k}", np.array(eye), np.array([0.0, 0.0, 1.0]), 90.0, 1280, 720)
    for k, eye in enumerate(CORNERS)
)
BODY = np.array([
    (0.1, 0, 1.6), (0, 0.2, 1.4), (0, -0.2, 1.4), (0, 0.3, 1.1), (0, -0.3, 1.1), (0.1, 0.3, 0.9),
    (0.1, -0.3, 0.9), (0, 0.1, 0.9), (0, -0.1, 0.9), (0, 0.1, 0.5), (0, -0.1, 0.5), (0, 0.1, 0.1),
    (0, -0.1, 0.1), (0.2, 0.1, 0.05), (0.2, -0.1, 0.05),
])  # fmt: skip
SIGMA_PX, STEPS = 4.0, 200


def where(t):
    """The body walks to and fro, (J, 3), and its velocity."""
    phase = 0.04 * t * 1.2
    place = np.array([np.sin(phase), 0.3 * np.cos(phase), 0.0])
    velocity = np.array([1.2 * np.cos(phase), -0.36 * np.sin(phase), 0.0])
    return BODY + place, np.tile(velocity, (15, 1))


def seen(cameras, joints, rng):
    px, _ = project(np.stack([camera.P for camera in cameras]), joints[None])
    return px[0] + SIGMA_PX * rng.standard_normal(px[0].shape)


def run(
    actual=RIG, n_cameras=4, change=lambda t, px, rng: px, steps=STEPS, until=10**9, seed=0, batch=1
):
    """The state after an episode in which cameras are `actual` until then, and said to be `RIG`."""
    rng, state = np.random.default_rng(seed), make_monitor(batch, n_cameras)
    P = np.stack([camera.P for camera in RIG[:n_cameras]])
    axes = np.array([(*camera.K[:2, 2], camera.K[0, 0]) for camera in RIG[:n_cameras]])
    for t in range(steps):
        joints, velocity = where(t)
        cameras = (actual if t < until else RIG)[:n_cameras]
        px = change(t, seen(cameras, joints, rng), rng)[None, :, None]
        px = np.repeat(px, batch, 0)
        found = Keypoints(px, np.full(px.shape[:-1], 0.9), np.full(px.shape[:-1], SIGMA_PX))
        estimate = PoseEstimate(
            np.tile(joints, (batch, 1, 1, 1)), np.tile(np.eye(3) * 1e-4, (batch, 1, 15, 1, 1)),
            np.tile(velocity, (batch, 1, 1, 1)), np.zeros((batch, 1, 15)),
            np.ones((batch, 1), bool),
        )  # fmt: skip
        monitor(state, np.arange(batch), found, np.zeros((batch, n_cameras)), estimate, P, axes)
    return state


def turned(camera, angle_rad, axis="y"):
    T_world_from_cam = camera.T_world_from_cam.copy()
    T_world_from_cam[:3, :3] @= about_axis(axis, angle_rad)
    return replace(camera, T_world_from_cam=T_world_from_cam)


def moved(camera, to_the_right_m):
    T_world_from_cam = camera.T_world_from_cam.copy()
    T_world_from_cam[:3, 3] += T_world_from_cam[:3, 0] * to_the_right_m
    return replace(camera, T_world_from_cam=T_world_from_cam)


def zoomed(camera, share):
    K = camera.K.copy()
    K[[0, 1], [0, 1]] *= 1 + share
    return replace(camera, K=K)


def named(state):
    return np.flatnonzero(state["suspected"][0]).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_nobody_is_named_where_cameras_are_where_they_are_said_to_be(seed):
    assert named(run(seed=seed)) == []


@pytest.mark.parametrize("c", range(4))
@pytest.mark.parametrize("angle_rad", [0.03, 0.1])
def test_a_turned_camera_is_named_and_no_other(c, angle_rad):
    actual = [turned(camera, angle_rad) if k == c else camera for k, camera in enumerate(RIG)]
    assert named(run(actual)) == [c]


@pytest.mark.parametrize(
    "displaced", [partial(moved, to_the_right_m=0.05), partial(zoomed, share=0.05),
    partial(turned, angle_rad=0.1, axis="z")], ids=["moved", "zoomed", "rolled"],
)  # fmt: skip
def test_a_camera_that_was_displaced_otherwise_is_named_too(displaced):
    assert named(run([RIG[0], displaced(RIG[1]), *RIG[2:]])) == [1]


@pytest.mark.parametrize("c", range(3))
def test_of_three_cameras_no_right_one_is_named(c):
    actual = [turned(camera, 0.05) if k == c else camera for k, camera in enumerate(RIG)]
    assert set(named(run(actual, n_cameras=3))) <= {c}


def test_a_camera_that_is_put_right_is_cleared():
    actual = [turned(RIG[0], 0.1), *RIG[1:]]
    assert named(run(actual, steps=100, until=100)) == [0]
    assert named(run(actual, steps=600, until=100)) == []


def test_exchanged_sides_are_no_displacement():
    def swapped(t, px, rng):
        px[1] = px[1][MIRROR]
        return px

    assert named(run(change=swapped)) == []


def test_a_camera_behind_its_time_is_no_displaced_one():
    def behind(t, px, rng):
        px[2] = seen(RIG, where(t - 2)[0], rng)[2]
        return px

    assert named(run(change=behind)) == []


def test_of_two_cameras_that_contradict_each_other_nobody_is_named():
    assert named(run([turned(RIG[0], 0.1), RIG[1]], n_cameras=2)) == []


def test_nothing_seen_is_no_news():
    def nothing(t, px, rng):
        return np.full_like(px, np.nan)

    state = run(change=nothing)
    assert not state["information"].any()
    assert named(state) == []


def test_a_batch_gives_the_bits_of_one_and_a_copy_goes_on():
    actual = [turned(RIG[0], 0.05), *RIG[1:]]
    one, many = run(actual), run(actual, batch=3)
    np.testing.assert_array_equal(np.repeat(one, 3, 0), many)
    assert copy_arrays(many).tobytes() == many.tobytes()
    forget_monitor(many, np.array([1]))
    assert named(many) == [0]
    assert not many["suspected"][1].any()
    assert many["updates"][:, 0].tolist() == [STEPS, 0, STEPS]
