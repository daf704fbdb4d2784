"""Physics of a batch: the arm obeys, results depend on nothing but their own environment."""

import pickle

import mujoco
import numpy as np
import pytest

from assets.workers.poses import rest_motion
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.records import WorkerPath
from hrc_env.scene.build import build
from hrc_env.scene.physics import Physics, make_empty_path
from hrc_env.worker.body import load_body

LAB = build()
T = 5
DT = T * LAB.config.sim_dt


def standing(batch: int, xy: tuple[float, float], n_substeps: int = T) -> WorkerPath:
    rest = rest_motion(load_body())
    lead = (batch, n_substeps, 1)
    arrays = (rest.position_world + np.array([*xy, 0.0]), rest.quaternion_wxyz)
    return WorkerPath(*(np.broadcast_to(array, (*lead, *array.shape)) for array in arrays))


def commands(batch: int, n_steps: int = 12) -> np.ndarray:
    return np.random.default_rng(3).uniform(-0.8, 0.8, (n_steps, batch, 6))


def run(physics: Physics, sequence: np.ndarray) -> np.ndarray:
    still = make_empty_path(physics.batch, T)
    return np.stack([physics.step(command, still) for command in sequence])


def test_the_arm_moves_as_fast_as_it_is_told():
    physics = Physics(LAB, 1)
    for _ in range(15):
        physics.step(np.full((1, 6), 0.4), make_empty_path(1, T))
    np.testing.assert_allclose(physics.qd, 0.4, atol=5e-3)


def test_no_command_means_no_motion():
    physics = Physics(LAB, 2)
    run(physics, np.zeros((10, 2, 6)))
    np.testing.assert_allclose(physics.q, np.tile(LAB.home_q, (2, 1)), atol=1e-6)


def test_the_trace_ends_where_the_arm_is():
    physics = Physics(LAB, 3)
    trace = physics.step(commands(3)[0], make_empty_path(3, T))
    assert trace.shape == (3, T, 6)
    np.testing.assert_array_equal(trace[:, -1], physics.q)


def test_a_sudden_command_is_slewed():
    physics = Physics(LAB, 1)
    physics.step(np.full((1, 6), 2.0), make_empty_path(1, T))
    assert np.abs(physics.qd).max() < 1.15 * LAB.config.slew_rad_s2 * DT


def test_the_arm_stops_before_the_end_of_a_joint():
    physics = Physics(LAB, 1)
    near = LAB.home_q.copy()
    near[5] = LAB.chain.range_rad[5, 1] - 0.5
    physics.reset(np.array([0]), near[None])
    for _ in range(40):
        physics.step(np.array([[0, 0, 0, 0, 0, 3.0]]), make_empty_path(1, T))
    assert LAB.chain.range_rad[5, 1] - 0.05 < physics.q[0, 5] < LAB.chain.range_rad[5, 1]
    assert abs(physics.qd[0, 5]) < 1e-3


def test_commands_that_are_not_numbers_count_as_zero():
    physics = Physics(LAB, 1)
    physics.step(np.full((1, 6), np.nan), make_empty_path(1, T))
    np.testing.assert_allclose(physics.q[0], LAB.home_q, atol=1e-6)


def test_neighbours_change_no_bit():
    sequence = commands(8)
    whole = run(Physics(LAB, 8), sequence)
    alone = run(Physics(LAB, 1), sequence[:, 5:6])
    np.testing.assert_array_equal(whole[:, 5], alone[:, 0])


def test_a_saved_state_continues_bit_for_bit_even_after_pickling():
    first, sequence = Physics(LAB, 2), commands(2)
    run(first, sequence[:6])
    state = pickle.loads(pickle.dumps(first.get_state()))
    second = Physics(LAB, 2)
    second.set_state(state)
    np.testing.assert_array_equal(run(first, sequence[6:]), run(second, sequence[6:]))
    np.testing.assert_array_equal(first.get_state(), second.get_state())


def test_physics_itself_can_be_pickled_in_the_middle():
    physics, sequence = Physics(LAB, 2), commands(2)
    run(physics, sequence[:6])
    twin = pickle.loads(pickle.dumps(physics))
    assert twin.scene is not None
    np.testing.assert_array_equal(run(physics, sequence[6:]), run(twin, sequence[6:]))


def test_a_reset_forgets_everything_and_leaves_the_others_alone():
    physics = Physics(LAB, 3)
    run(physics, commands(3))
    before = physics.get_state()
    physics.reset(np.array([1]), LAB.home_q[None])
    after = physics.get_state()
    np.testing.assert_array_equal(after[[0, 2]], before[[0, 2]])
    np.testing.assert_array_equal(after[1], Physics(LAB, 1).get_state()[0])


def test_a_worker_stops_the_arm_and_lets_it_go_again():
    scene = build(n_workers=1)
    physics, person = Physics(scene, 1), standing(1, (0.45, 0.0))
    physics.reset(np.array([0]), np.array([[-1.2, -0.9, 1.2, -1.87, -1.57, 0.0]]))
    for _ in range(40):
        physics.step(np.array([[1.0, 0, 0, 0, 0, 0]]), person)
    blocked = physics.q[0, 0]
    assert blocked < 0.0
    assert np.abs(physics.qd).max() < 0.05
    for _ in range(6):
        physics.step(np.array([[-1.0, 0, 0, 0, 0, 0]]), person)
    assert physics.q[0, 0] < blocked - 0.05


def test_workers_do_not_touch_the_floor_nor_each_other():
    scene = build(n_workers=2)
    one = standing(1, (1.5, 0.0))
    both = WorkerPath(*(np.repeat(getattr(one, name), 2, 2) for name in one.__slots__))
    physics = Physics(scene, 1)
    physics.step(np.zeros((1, 6)), both)
    np.testing.assert_allclose(physics.q[0], scene.home_q, atol=1e-6)


def test_motion_of_the_wrong_number_of_workers_is_refused():
    with pytest.raises(ConfigError, match="workers"):
        Physics(LAB, 1).step(np.zeros((1, 6)), standing(1, (1.5, 0.0)))


def test_a_broken_simulation_is_named():
    physics = Physics(build(), 3)
    state = physics.get_state()
    state[1] = 1e12
    physics.set_state(state)
    with pytest.raises(HRCError, match="environment 1 became unstable"):
        physics.step(np.zeros((3, 6)), make_empty_path(3, 5))


def test_an_arm_out_of_reach_moves_as_it_would_alone():
    """Bit for bit, whichever of its neighbours are near, and however that changes."""
    scene = build(n_workers=2, bodies="any")
    away = standing(4, (2.5, 0.0))
    parts = (away.position_world, away.quaternion_wxyz)
    both = WorkerPath(*(np.concatenate([part, part], 2) for part in parts))
    sequence, draw = commands(4), np.random.default_rng(1)
    whole, parted = Physics(scene, 4), Physics(scene, 4)
    for command in sequence:
        apart = draw.random(4) < draw.choice([0.0, 0.5, 1.0])
        expected = whole.step(command, both)
        np.testing.assert_array_equal(parted.step(command, both, apart), expected)
    for name in ("q", "qd"):
        np.testing.assert_array_equal(getattr(parted, name), getattr(whole, name))


SITE = build(name="site", robot="mobile_base")


def test_a_base_drives_as_it_is_told_and_no_harder_than_its_slew():
    physics = Physics(SITE, 1)
    physics.step(np.array([[1.0, -0.5, 0.8]]), make_empty_path(1, T))
    assert np.abs(physics.qd[0, :2]).max() < 1.2 * 1.5 * DT
    for _ in range(40):
        physics.step(np.array([[1.0, -0.5, 0.8]]), make_empty_path(1, T))
    np.testing.assert_allclose(physics.qd, [[1.0, -0.5, 0.8]], atol=5e-3)


def test_a_base_stops_before_the_end_of_its_slides():
    physics = Physics(SITE, 1)
    end_m = SITE.chain.range_rad[1, 1]
    physics.reset(np.array([0]), np.array([[-1.0, end_m - 1.5, 0.0]]))
    for _ in range(80):
        physics.step(np.array([[0.0, 1.5, 0.0]]), make_empty_path(1, T))
    assert end_m - 0.1 < physics.q[0, 1] < end_m
    assert abs(physics.qd[0, 1]) < 1e-2


def test_a_wall_stops_a_base():
    physics = Physics(SITE, 1)
    for _ in range(100):  # to the north, where the stack of boards is
        physics.step(np.array([[-0.35, 1.5, 0.0]]), make_empty_path(1, T))
    assert physics.q[0, 1] < 1.6
    assert np.isfinite(physics.qpos).all()


def test_no_clock_is_read_in_substeps():
    """MuJoCo's profiling clock, which its Python package installs, takes an eighth of the time."""
    Physics(LAB, 1)
    data = mujoco.MjData(LAB.model)
    mujoco.mj_step(LAB.model, data, 10)
    timer = data.timer[mujoco.mjtTimer.mjTIMER_STEP]
    assert timer.number == 10
    assert timer.duration == 0.0
