"""Properties of a scene's robot: command limits, effective mass, loads and object positions."""

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.scene.build import Scene
from hrc_env.scene.robot import PREFIX


def slew_rad_s2(scene: Scene) -> Floats:
    """Return the limits (N,) on the rate of change of the joints' commanded velocities.

    The unit is rad/s^2, or m/s^2 for a slide.
    """
    slew = scene.robot.slew or scene.config.slew_rad_s2
    return np.array(np.broadcast_to(slew, scene.chain.n_joints), float)


def effective_mass_kg(scene: Scene) -> float:
    """Return the effective mass of the robot in a contact without a load [kg].

    It is half the mass of an arm's moving parts (ISO/TS 15066, A.3), or the total mass of a mobile
    base's moving parts.
    """
    model = scene.model
    is_robot = [model.body(b).name.startswith(PREFIX) for b in range(model.nbody)]
    moving_kg = float(model.body_mass[np.array(is_robot) & (model.body_weldid > 0)].sum())
    return moving_kg if scene.robot.drives else 0.5 * moving_kg


def load_kg(scene: Scene) -> Floats:
    """Return the masses (O,) of the task's loose objects [kg]."""
    return scene.model.body_mass[scene.object_bodies].copy()


def robot_model(scene: Scene, fastest_rad_s: Floats) -> RobotModel:
    """Return the constant properties of a scene's robot.

    Args:
        scene: the scene with the robot.
        fastest_rad_s: (N,) maximum velocity of each joint that an action can command [rad/s].
    """
    slew, mass_kg, loads_kg = slew_rad_s2(scene), effective_mass_kg(scene), load_kg(scene)
    return RobotModel(scene.chain, fastest_rad_s, slew, mass_kg, loads_kg)


def object_targets(scene: Scene) -> list[ReachTarget]:
    """Return the initial positions of loose objects as positions that the tool must reach."""
    loose, size_m = scene.objects, np.linalg.norm(scene.objects.half_size_m, axis=1)
    places = zip(loose.names, scene.model.body_pos[scene.object_bodies], size_m, strict=True)
    return [ReachTarget(f"object {name!r}", at, within_m=size) for name, at, size in places]
