"""What a scene's robot can do: how it can be commanded, how hard it hits, what it has to reach."""

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.geometry.reach import ReachTarget
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.scene.build import Scene
from hrc_env.scene.robot import PREFIX


def slew_rad_s2(scene: Scene) -> Floats:
    """(N,) fastest change of each joint's commanded velocity [rad/s^2], of a slide [m/s^2]."""
    own = scene.robot.slew or scene.config.slew_rad_s2
    return np.array(np.broadcast_to(own, scene.chain.n_joints), float)


def hitting_kg(scene: Scene) -> float:
    """Effective mass of the robot where it hits without a load: half of an arm's parts that move
    (ISO/TS 15066, A.3), all of what drives [kg]."""
    model = scene.model
    its = [model.body(b).name.startswith(PREFIX) for b in range(model.nbody)]
    moving_kg = float(model.body_mass[np.array(its) & (model.body_weldid > 0)].sum())
    return moving_kg if scene.robot.drives else 0.5 * moving_kg


def load_kg(scene: Scene) -> Floats:
    """(O,) masses of what is loose."""
    return scene.model.body_mass[scene.object_bodies].copy()


def robot_model(scene: Scene, fastest_rad_s: Floats) -> RobotModel:
    """Return what the scene's robot knows of itself for good.

    Args:
        scene: with the robot.
        fastest_rad_s: (N,) the greatest velocity that an action asks of each joint [rad/s].
    """
    slew, hits_kg, carries_kg = slew_rad_s2(scene), hitting_kg(scene), load_kg(scene)
    return RobotModel(scene.chain, fastest_rad_s, slew, hits_kg, carries_kg)


def object_targets(scene: Scene) -> list[ReachTarget]:
    """Return where loose objects lie at first, for the robot's tool to get to."""
    loose, size_m = scene.objects, np.linalg.norm(scene.objects.half_size_m, axis=1)
    places = zip(loose.names, scene.model.body_pos[scene.object_bodies], size_m, strict=True)
    return [ReachTarget(f"object {name!r}", at, within_m=size) for name, at, size in places]
