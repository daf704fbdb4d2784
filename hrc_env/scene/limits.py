"""How a scene's robot can be commanded, and how hard it hits."""

import numpy as np

from hrc_env.core.typing import Floats
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
