"""Mass matrices and effective masses of robots, against the physics engine."""

import mujoco
import numpy as np
import pytest

from hrc_env.geometry import chains
from hrc_env.geometry.inertia import find_mass_matrices, find_mobility
from hrc_env.scene.build import build
from hrc_env.scene.limits import read_inertias
from hrc_env.scene.robot import PREFIX

ROBOTS = ("ur10e_like", "ur10e_gripper", "ur10e_cups", "mobile_base")


def matrix_of_physics(scene, q):
    """(N, N) the mass matrix that MuJoCo has at these joint positions, fingers held fast."""
    model = scene.model
    data, whole = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    joints = [model.joint(PREFIX + name) for name in scene.robot.joints]
    data.qpos[[joint.qposadr[0] for joint in joints]] = q
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, whole)
    dofs = [joint.dofadr[0] for joint in joints]
    return whole[np.ix_(dofs, dofs)]


def matrices_of(scene, q, load_kg=0.0):
    """(B, N, N) mass matrices at joint positions (B, N)."""
    frames = chains.link_frames(scene.chain, q)
    inertias = read_inertias(scene)
    return find_mass_matrices(scene.chain, inertias, frames, np.full(len(q), load_kg))


def any_poses(scene, n=30, seed=3):
    """(n, N) joint positions."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (n, scene.chain.n_joints))


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_mass_matrix_is_that_of_the_physics_engine(robot):
    scene = build(robot=robot)
    q = any_poses(scene)
    expected = np.stack([matrix_of_physics(scene, each) for each in q])
    np.testing.assert_allclose(matrices_of(scene, q), expected, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_load_is_a_mass_at_the_tool_point(robot):
    """It adds m J^T J, with the Jacobian of the tool point."""
    scene, load_kg = build(robot=robot), 4.0
    q = any_poses(scene, n=8)
    J = chains.jacobian(scene.chain, q)
    more = matrices_of(scene, q, load_kg) - matrices_of(scene, q)
    np.testing.assert_allclose(more, load_kg * J.swapaxes(1, 2) @ J, atol=1e-10)


@pytest.mark.parametrize("robot", ["ur10e_like", "mobile_base"])
def test_a_push_accelerates_a_point_by_force_over_effective_mass(robot):
    """A force along n at the tool point, in the physics engine, without gravity or servos."""
    scene = build(robot=robot)
    model, rng = scene.model, np.random.default_rng(1)
    site = model.site(PREFIX + scene.robot.tool_site).id
    for q in scene.home_q + rng.uniform(-0.5, 0.5, (10, scene.chain.n_joints)):
        n = rng.normal(size=3)
        n[2] *= robot != "mobile_base"
        n /= np.linalg.norm(n)
        inverse = np.linalg.inv(matrices_of(scene, q[None])[0])
        mobility = find_mobility(inverse, n @ chains.jacobian(scene.chain, q))
        data = mujoco.MjData(model)
        joints = [model.joint(PREFIX + name) for name in scene.robot.joints]
        dofs = [joint.dofadr[0] for joint in joints]
        data.qpos[[joint.qposadr[0] for joint in joints]] = q
        mujoco.mj_forward(model, data)
        J, force = np.zeros((3, model.nv)), np.zeros(model.nv)
        mujoco.mj_jacSite(model, data, J, None, site)
        force[dofs], change = (n @ J)[dofs], np.zeros((1, model.nv))
        mujoco.mj_solveM(model, data, change, force[None])
        assert mobility == pytest.approx((n @ J)[dofs] @ change[0, dofs], rel=1e-9)


def test_a_base_pushed_across_its_centre_has_its_whole_mass_and_turns_if_pushed_beside_it():
    scene = build(robot="mobile_base")
    q, inertias = np.array([0.4, -0.3, 0.7]), read_inertias(scene)
    frames = chains.link_frames(scene.chain, q)
    inverse = np.linalg.inv(matrices_of(scene, q[None])[0])
    base = frames[-1, :3, :3] @ inertias.centre_m[-1] + frames[-1, :3, 3]
    along, aside = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.4, 0.0])

    def mass_kg(point, n):
        columns = [chains.lever(frames[i], scene.chain.slides[i], point) for i in range(3)]
        mobility = find_mobility(inverse, np.array(columns) @ n)
        return 1.0 / mobility if mobility else np.inf

    assert mass_kg(base, along) < inertias.mass_kg.sum() + 1e-6
    assert mass_kg(base, along) == pytest.approx(inertias.mass_kg[[0, 2]].sum(), abs=0.2)
    assert mass_kg(base + aside, along) < 0.8 * mass_kg(base, along)
    assert mass_kg(base, np.array([0.0, 0.0, 1.0])) > 1e12
