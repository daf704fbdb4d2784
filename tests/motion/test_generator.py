"""The worker as the rest of the package sees them: a smooth, reproducible, plausible body."""

import copy
import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import started, watched

from assets.rotations import matrix_from_quaternion
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import WorkerMotion
from hrc_env.motion import anatomy, generator
from hrc_env.worker.body import PARENT, SEGMENT, SEGMENTS, load_body, worker_truth

HANDS = [SEGMENT["left_hand"], SEGMENT["right_hand"]]
BASE = np.array(generator.OPEN_FLOOR.robot_xy_m)


def saved(state):
    arrays = {
        field.name: getattr(state, field.name).copy()
        for field in dataclasses.fields(state)
        if isinstance(getattr(state, field.name), np.ndarray)
    }
    return dataclasses.replace(state, **arrays)


def speed(motion, name):
    return np.linalg.norm(motion.velocity_world[..., SEGMENT[name], :], axis=-1)


def test_a_side_of_the_body_is_numbered_as_the_kinematics_count_it():
    assert SEGMENTS[anatomy.LEFT + anatomy.HAND] == "left_hand"
    assert SEGMENTS[anatomy.LEFT + anatomy.SIDE_STRIDE + anatomy.TOES] == "right_toes"
    assert (SEGMENTS[anatomy.CHEST], SEGMENTS[anatomy.HEAD]) == ("chest", "head")


def test_bones_keep_their_length_whatever_the_worker_does(shift):
    rest = load_body().rest_position
    position = shift.motion.position_world[:, ::25]
    for child, parent in enumerate(PARENT):
        if parent >= 0:
            length = np.linalg.norm(position[..., child, :] - position[..., parent, :], axis=-1)
            expected = np.linalg.norm(rest[child] - rest[parent])
            assert np.allclose(length, expected, atol=1e-6), SEGMENTS[child]


def test_quaternions_are_unit_and_carry_the_bones(shift):
    rest = load_body().rest_position
    q = shift.motion.quaternion_wxyz[:, ::50]
    assert np.allclose(np.linalg.norm(q, axis=-1), 1.0)
    rotation, position = matrix_from_quaternion(q), shift.motion.position_world[:, ::50]
    upper, fore = SEGMENT["right_upper_arm"], SEGMENT["right_forearm"]
    elbow = position[..., upper, :] + rotation[..., upper, :, :] @ (rest[fore] - rest[upper])
    assert np.allclose(elbow, position[..., fore, :], atol=1e-6)


def test_nothing_jumps_in_200_seconds(shift):
    velocity = shift.motion.velocity_world
    assert all(np.isfinite(array).all() for array in vars(shift.motion).values())
    acceleration = np.linalg.norm(np.diff(velocity, axis=1), axis=-1) / shift.dt_s
    trunk = [SEGMENT[name] for name in ("pelvis", "chest", "head")]
    assert acceleration[..., trunk].max() < 50.0  # m/s^2; a head when its owner kneels down
    assert np.percentile(acceleration[..., HANDS], 99.9) < 62.0  # as in real clips
    assert np.percentile(acceleration[..., SEGMENT["left_foot"]], 99.9) < 51.0
    moved = np.diff(shift.motion.position_world, axis=1) / shift.dt_s
    mean_velocity = 0.5 * (velocity[:, 1:] + velocity[:, :-1])
    assert np.abs(moved - mean_velocity).max() < 0.25  # a jump of 5 mm would show


def test_velocities_are_those_of_the_motion():
    state, rngs = started(4, seed=3)
    motion = watched(state, rngs, 1e-4, 2000)
    position, rotation = motion.position_world, matrix_from_quaternion(motion.quaternion_wxyz)
    difference = (position[:, 2:] - position[:, :-2]) / 2e-4
    assert np.abs(difference - motion.velocity_world[:, 1:-1]).max() < 0.01
    turned = (rotation[:, 2:] - rotation[:, :-2]) / 2e-4 @ np.swapaxes(rotation[:, 1:-1], -1, -2)
    spin = np.stack([turned[..., 2, 1], turned[..., 0, 2], turned[..., 1, 0]], -1)
    assert np.abs(spin - motion.angular_velocity_world[:, 1:-1]).max() < 0.05


def test_a_poses_velocity_does_not_depend_on_the_step_between_poses():
    fine, coarse = started(2, seed=4), started(2, seed=4)
    many = watched(*fine, 0.005, 200)
    few = watched(*coarse, 0.05, 20)
    assert np.allclose(many.position_world[:, 9::10], few.position_world, atol=1e-6)
    assert np.allclose(many.velocity_world[:, 9::10], few.velocity_world, atol=1e-3)


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 1000), batch=st.integers(2, 5))
def test_a_workers_walk_does_not_depend_on_the_other_environments(seed, batch):
    together, alone = started(batch, seed=seed), started(1, seed=seed)
    for _ in range(4):
        many, _ = generator.advance(*together, 0.1, 20)
        one, _ = generator.advance(*alone, 0.1, 20)
        assert np.array_equal(many.position_world[0], one.position_world[0])


def test_a_copied_state_goes_on_identically():
    state, rngs = started(3, seed=5)
    generator.advance(state, rngs, 0.1, 30)
    other, other_rngs = saved(state), copy.deepcopy(rngs)
    first, _ = generator.advance(state, rngs, 0.05, 400)
    second, _ = generator.advance(other, other_rngs, 0.05, 400)
    assert np.array_equal(first.position_world, second.position_world)


def test_reset_restarts_only_the_named_environments():
    state, rngs = started(3, seed=6)
    before = generator.current(state).position_world
    generator.reset(state, np.array([1]), rngs)
    after = generator.current(state).position_world
    assert np.array_equal(before[[0, 2]], after[[0, 2]])
    assert not np.allclose(before[1], after[1])


def test_random_numbers_are_drawn_only_when_an_activity_ends():
    state, rngs = started(1, seed=7)
    left = float(state.workers["duration_s"][0, 0] - state.workers["time_s"][0, 0])
    before = copy.deepcopy(rngs[0].bit_generator.state)
    generator.advance(state, rngs, 0.9 * left, 1)
    assert rngs[0].bit_generator.state == before
    generator.advance(state, rngs, 0.2 * left, 1)
    assert rngs[0].bit_generator.state != before


def test_current_is_the_last_pose_of_advance():
    state, rngs = started(2, seed=8)
    (path, motion), now = generator.advance(state, rngs, 0.01, 5), generator.current(state)
    assert np.array_equal(path.position_world[:, -1], now.position_world)
    for one, other in ((motion, now), (motion.held, now.held)):
        for field in dataclasses.fields(one):
            if field.name != "held":
                both = getattr(one, field.name), getattr(other, field.name)
                assert np.array_equal(*both), field.name
    second = generator.current(state, np.array([1]))
    assert np.array_equal(second.position_world, now.position_world[1:])


@pytest.mark.parametrize("n_workers", [0, 1, 3])
def test_any_number_of_workers_goes(n_workers):
    state, rngs = started(2, n_workers)
    path, motion = generator.advance(state, rngs, 0.02, 3)
    assert path.position_world.shape == (2, 3, n_workers, 22, 3)
    assert motion.angular_velocity_world.shape == (2, n_workers, 22, 3)
    assert generator.current(state).quaternion_wxyz.shape == (2, n_workers, 22, 4)
    assert generator.activity(state).shape == (2, n_workers)
    assert np.isfinite(path.position_world).all()


def test_workers_begin_apart_from_each_other():
    state, _ = started(40, 2, seed=9)
    pelvis = generator.current(state).position_world[:, :, 0, :2]
    apart = np.linalg.norm(pelvis[:, 0] - pelvis[:, 1], axis=-1)
    assert np.mean(apart > 0.7) > 0.9


def test_hands_move_as_fast_as_hands_do_in_the_recordings(shift):
    hands = np.maximum(speed(shift.motion, "left_hand"), speed(shift.motion, "right_hand"))
    for name, low, high in (("reach", 0.4, 1.6), ("lift", 0.8, 2.1), ("walk", 0.9, 2.7)):
        doing = shift.doing == generator.activity_names.index(name)
        assert low < np.percentile(hands[doing], 95) < high, name
    assert hands.max() < 3.5


def test_workers_do_much_and_are_mostly_at_the_robot(shift):
    assert len(np.unique(shift.doing)) > 8
    pelvis = shift.motion.position_world[:, :, 0, 0, :2]
    near = np.linalg.norm(pelvis - BASE, axis=-1) < 1.45
    assert 0.6 < near.mean() < 0.92


def test_hands_are_in_the_robots_workspace_often_enough_to_matter(shift):
    hands = shift.motion.position_world[:, :, 0, HANDS, :2]
    nearest = np.linalg.norm(hands - BASE, axis=-1).min(-1)
    assert 0.15 < np.mean(nearest < 0.95) < 0.60


def test_bodies_keep_clear_of_the_pedestal_and_of_the_walls(shift):
    pelvis, grounds = shift.motion.position_world[:, :, 0, 0, :2], generator.OPEN_FLOOR
    assert np.linalg.norm(pelvis - BASE, axis=-1).min() > grounds.robot_clearance_m - 0.05
    for axis, (low, high) in enumerate((grounds.walkable_x_m, grounds.walkable_y_m)):
        assert pelvis[..., axis].min() > low - 0.25
        assert pelvis[..., axis].max() < high + 0.25


def test_hands_stay_out_of_the_trunk(shift):
    body = load_body()
    few = WorkerMotion(**{k: v[:, ::20] for k, v in vars(shift.motion).items()})
    truth = worker_truth(body, few)
    capsules, radius = truth.capsules_world, body.capsule_radius_m
    for hand in ("left_hand", "right_hand"):
        middle = capsules[..., body.capsule_names.index(hand), :, :].mean(-2)
        for part in ("chest", "torso", "abdomen"):
            k = body.capsule_names.index(part)
            a, b = capsules[..., k, 0, :], capsules[..., k, 1, :]
            along = ((middle - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
            nearest = a + np.clip(along, 0.0, 1.0)[..., None] * (b - a)
            depth = radius[k] - np.linalg.norm(middle - nearest, axis=-1)
            assert depth.max() < 0.02, (hand, part)


def test_impossible_settings_are_refused_with_what_would_do():
    with pytest.raises(ConfigError, match="near_probability"):
        generator.MotionConfig(near_probability=1.5)
    with pytest.raises(ConfigError, match="sudden_probability"):
        generator.PeopleConfig(sudden_probability=1.5)
