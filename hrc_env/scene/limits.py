"""Properties of a scene's robot: command limits, masses, loads and object positions."""

import mujoco
import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.geometry.chains import link_frames
from hrc_env.geometry.inertia import LinkInertias
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.scene.build import Scene
from hrc_env.scene.robot import PREFIX
from hrc_env.scene.robot_chain import find_link


def slew_rad_s2(scene: Scene) -> Floats:
    """Return the limits (N,) on the rate of change of the joints' commanded velocities.

    The unit is rad/s^2, or m/s^2 for a slide.
    """
    slew = scene.robot.slew or scene.config.slew_rad_s2
    return np.array(np.broadcast_to(slew, scene.chain.n_joints), float)


def effective_mass_kg(scene: Scene) -> float:
    """Return the effective mass of the robot without a load by the standard's rule [kg].

    It is half the mass of an arm's moving parts (ISO/TS 15066, A.3), or the total mass of a mobile
    base's moving parts.
    """
    model = scene.model
    is_robot = [model.body(b).name.startswith(PREFIX) for b in range(model.nbody)]
    moving_kg = float(model.body_mass[np.array(is_robot) & (model.body_weldid > 0)].sum())
    return moving_kg if scene.robot.drives else 0.5 * moving_kg


def read_inertias(scene: Scene) -> LinkInertias:
    """Return the masses and inertias of the robot's links, as the physics model has them.

    They include the armature of the joints. Fingers count as parts of the last link, at their
    positions in the MJCF.
    """
    model, chain, n = scene.model, scene.chain, scene.chain.n_joints
    joints = [model.joint(PREFIX + name) for name in scene.robot.joints]
    data = mujoco.MjData(model)
    data.qpos[[joint.qposadr[0] for joint in joints]] = 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    links = [int(joint.bodyid[0]) for joint in joints]
    frames = link_frames(chain, np.zeros(n))
    mass, moment, inertia = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    carriers = [find_link(model, links, body) for body in range(model.nbody)]
    for body in np.flatnonzero(np.array(carriers) >= 0):
        mass[carriers[body]] += model.body_mass[body]
        moment[carriers[body]] += model.body_mass[body] * data.xipos[body]
    centre = moment / mass[:, None]
    for body in np.flatnonzero(np.array(carriers) >= 0):
        link, axes = carriers[body], data.ximat[body].reshape(3, 3)
        away = data.xipos[body] - centre[link]
        about_centre = (away @ away) * np.eye(3) - np.outer(away, away)
        inertia[link] += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia[link] += model.body_mass[body] * about_centre
    turn = frames[:, :3, :3]
    return LinkInertias(
        mass_kg=mass,
        centre_m=np.einsum("nji,nj->ni", turn, centre - frames[:, :3, 3]),
        inertia_kg_m2=turn.swapaxes(1, 2) @ inertia @ turn,
        armature_kg_m2=model.dof_armature[[joint.dofadr[0] for joint in joints]].copy(),
    )


def load_kg(scene: Scene) -> Floats:
    """Return the masses (O,) of the task's loose objects [kg]."""
    return scene.model.body_mass[scene.object_bodies].copy()


def robot_model(scene: Scene, fastest_rad_s: Floats) -> RobotModel:
    """Return the constant properties of a scene's robot.

    Args:
        scene: the scene with the robot.
        fastest_rad_s: (N,) maximum velocity of each joint that an action can command [rad/s].
    """
    return RobotModel(
        chain=scene.chain,
        fastest_rad_s=fastest_rad_s,
        slew_rad_s2=slew_rad_s2(scene),
        mass_kg=effective_mass_kg(scene),
        load_kg=load_kg(scene),
        inertias=read_inertias(scene),
        obstacles=scene.obstacles,
    )


def object_targets(scene: Scene) -> list[ReachTarget]:
    """Return the initial positions of loose objects as positions that the tool must reach."""
    loose, size_m = scene.objects, np.linalg.norm(scene.objects.half_size_m, axis=1)
    places = zip(loose.names, scene.model.body_pos[scene.object_bodies], size_m, strict=True)
    return [ReachTarget(f"object {name!r}", at, within_m=size) for name, at, size in places]
