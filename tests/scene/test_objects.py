"""Loose objects: as capsules, in the fingers, on cups; part of the robot that carries them."""

import itertools

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import HandState
from hrc_env.geometry.chains import robot_path, tool_frame
from hrc_env.scene.build import HARD, SceneConfig, build
from hrc_env.scene.cups import find_sealed
from hrc_env.scene.objects import attach_objects, find_held, fit_capsules, place_parts
from hrc_env.scene.physics import Physics, make_empty_path
from hrc_env.scene.places import SCENES
from hrc_env.world import FOOT_WORLD, Effects, TaskScene, Weld

TABLE = '<body pos="0.7 0 -0.02"><geom type="box" size="0.3 0.3 0.02" contype="1"/></body>'
BLOCK = (
    '<body name="block" pos="0.7 0 0.05"><freejoint name="block"/><geom type="box" mass="0.5" '
    'size="0.02 0.1 0.05" contype="16" conaffinity="17"/>'
    '<site name="top" pos="0 0 0.05" quat="0 1 0 0"/></body>'
)
THINGS = TaskScene(f"<mujoco><worldbody>{TABLE}{BLOCK}</worldbody></mujoco>")
FINE = SceneConfig(sim_dt=0.004)
T = 10


def scene(robot="ur10e_gripper", task_scene=THINGS):
    return build(FINE, robot=robot, task_scene=task_scene)


def test_capsules_stand_for_a_box_to_a_centimetre():
    rng = np.random.default_rng(0)
    for half in ((0.019, 0.15, 0.0445), (0.3, 0.6, 0.00625), (0.02, 0.02, 0.2)):
        half = np.array(half)
        rods = fit_capsules(np.zeros(3), half)
        # Points at arm's length of a limb round the box: a limb is no thinner than 4 cm.
        points = rng.uniform(-1, 1, (4000, 3)) * (half + 0.06)
        out = np.maximum(np.abs(points) - half, 0.0)
        away_m = np.linalg.norm(out, axis=1)
        near = (away_m > 0.035) & (away_m < 0.05)
        found = np.min([_to_rod(points, *rod) for rod in rods], axis=0)
        assert np.abs(found - away_m)[near].max() < 0.0185
        assert np.median(np.abs(found - away_m)[near]) < 0.01


def _to_rod(points, ends, radius):
    along = ends[1] - ends[0]
    share = np.clip((points - ends[0]) @ along / max(along @ along, 1e-12), 0.0, 1.0)
    return np.linalg.norm(points - ends[0] - share[:, None] * along, axis=1) - radius


def test_what_lies_rests_and_hides():
    place = scene()
    physics = Physics(place, 2)
    for _ in range(25):
        physics.step(np.zeros((2, 6)), make_empty_path(2, T))
    at = place.objects.poses(physics.qpos)[:, 0]
    np.testing.assert_allclose(at[:, :3], np.array([[-0.05, 0.0, 0.80]] * 2), atol=1e-3)
    assert place_parts(place.objects, physics.qpos).shape[:2] == (2, 1)
    still = place.surroundings(physics.qpos)
    assert still.moving.shape[1] == 1


@pytest.mark.parametrize("inside", [True, False])
def test_fingers_hold_what_is_between_them(inside):
    place = scene()
    qpos = np.tile(place.model.qpos0, (1, 1))
    point = np.array([[-0.05, 0.02, 0.80 if inside else 0.90]])
    for closed in (True, False):
        hand = HandState(np.array([0.02]), np.array([200.0]), np.array([closed]))
        assert find_held(place.objects, qpos, point, hand)[0, 0] == (inside and closed)


def test_what_is_carried_is_part_of_the_robot():
    place = scene()
    physics = Physics(place, 1)
    path = physics.qpos[:, None]
    robot, arm = robot_path(place.chain, path[..., :6], physics.qd)
    for held, near in ((True, True), (False, False)):
        loaded, along = attach_objects(robot, arm, place.objects, path, np.array([[held]]))
        n = along.shape[2] - arm.shape[2]
        assert n == place.objects.capsule_radius_m.size
        assert (np.abs(loaded.capsules_world[0, -n:]) < 2.0).all() == near
        np.testing.assert_array_equal(loaded.capsules_world, along[:, -1])


def test_an_object_must_be_of_boxes_round_its_origin():
    ball = '<body name="ball"><freejoint/><geom type="sphere" size="0.1" contype="16"/></body>'
    off = (
        '<body name="off"><freejoint/><geom type="box" size="0.1 0.1 0.1" pos="0.2 0 0" '
        'contype="16"/></body>'
    )
    for body, said in ((ball, "must be of boxes"), (off, "center at its origin")):
        with pytest.raises(ConfigError, match=said):
            scene(task_scene=TaskScene(f"<mujoco><worldbody>{body}</worldbody></mujoco>"))


def test_what_is_light_is_not_pressed_into_what_it_lies_on():
    """Half a kilogramme, as hard as an arm pushes: with MuJoCo's defaults it sinks in by 3 mm."""
    place = scene()
    physics = Physics(place, 1)
    for push_n in (0.0, -300.0):
        physics.apply(Effects({}, np.array([[[0.0, 0.0, push_n, 0.0, 0.0, 0.0]]])))
        for _ in range(15):
            physics.step(np.zeros((1, 6)), make_empty_path(1, T))
        sunk_m = FOOT_WORLD[2] + 0.05 - place.objects.poses(physics.qpos)[0, 0, 2]
        assert sunk_m < 1e-3


def test_whatever_meets_pads_or_wood_meets_it_hard():
    model = scene().model
    pairs = [
        {model.geom(row[k]).name for row in (model.pair_geom1, model.pair_geom2)}
        for k in range(model.npair)
    ]
    loose = model.geom(int(model.body("task/block").geomadr[0])).name
    light = [any("_pad" in name or name == loose for name in pair) for pair in pairs]
    assert 0 < sum(light) < len(light)
    assert (model.pair_solimp[light, 1] == HARD["solimp"][1]).all()


CUPS = TaskScene(THINGS.mjcf, (Weld("cups_block", ("task/top", "robot/tool_point")),))


def test_cups_seal_only_where_they_sit():
    place = scene("ur10e_cups", CUPS)
    T_tool = np.diag([1.0, -1.0, -1.0, 1.0])[None]
    poses = np.zeros((1, 1, 7))
    poses[..., 3] = 1.0
    for off_m, turn, holds in ((0.0, 0.0, True), (0.01, 0.0, False), (0.0, 0.1, False)):
        at = T_tool.copy()
        at[0, :3, 3] = 0.0, 0.0, 0.05 + off_m
        c, s = np.cos(turn), np.sin(turn)
        at[0, :3, :3] = at[0, :3, :3] @ [[1, 0, 0], [0, c, -s], [0, s, c]]
        assert find_sealed(place.cups, at, poses)[0, 0] == holds


def test_cups_let_go_of_what_is_vented_and_of_what_is_too_heavy():
    for push_n, vents, holds in ((0.0, False, True), (0.0, True, False), (-900.0, False, False)):
        physics, place = _with_block_on_cups()
        for _ in range(12):
            physics._push[:, place.object_bodies, 2] = push_n
            physics.step(
                np.zeros((1, 6)), make_empty_path(1, T), grip=np.array([-1.0 if vents else 1.0])
            )
        hand = physics.hand_state(np.array([0]))
        assert hand.closed_on[0] == holds
        assert physics.held(np.array([0]), None, hand)[0, 0] == holds


def _with_block_on_cups():
    """The block hangs right below the cups of an arm at rest."""
    place = scene("ur10e_cups", CUPS)
    physics = Physics(place, 1)
    at = tool_frame(place.chain, physics.q)[0]
    turn, R = np.zeros(4), at[:3, :3] @ np.diag([1.0, -1.0, -1.0])
    mujoco.mju_mat2Quat(turn, R.ravel())
    pose = np.concatenate([at[:3, 3] - R @ [0, 0, 0.05], turn])
    physics.reset(np.array([0]), physics.q, poses=pose[None, None])
    return physics, place


def test_a_batch_of_objects_is_so_many_single_ones():
    place = scene()
    rng = np.random.default_rng(3)
    commands = rng.uniform(-1, 1, (8, 3, 6))
    grips = rng.uniform(-1, 1, (8, 3))

    def run(rows):
        physics = Physics(place, len(rows))
        for command, grip in zip(commands, grips, strict=True):
            physics.step(command[rows], make_empty_path(len(rows), T), grip=grip[rows])
        return physics.qpos

    whole = run([0, 1, 2])
    for row in range(3):
        np.testing.assert_array_equal(whole[row], run([row])[0])


def test_states_with_objects_come_back():
    physics = Physics(scene(), 1)
    still, close = make_empty_path(1, T), np.array([1.0])
    physics.step(np.full((1, 6), 0.2), still, grip=close)
    kept = physics.get_state()
    ahead = [physics.step(np.full((1, 6), 0.3), still, grip=close) for _ in range(3)]
    physics.set_state(kept)
    again = [physics.step(np.full((1, 6), 0.3), still, grip=close) for _ in range(3)]
    assert all(np.array_equal(a, b) for a, b in itertools.zip_longest(ahead, again))


def test_tasks_know_where_robots_stand():
    assert all(tuple(FOOT_WORLD) == room.mount_world for room in SCENES.values())
