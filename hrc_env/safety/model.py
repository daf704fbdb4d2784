"""What a scene's robot knows of itself for good."""

from hrc_env.control import ControlConfig, fastest
from hrc_env.safety.robot import RobotModel
from hrc_env.scene.build import Scene
from hrc_env.scene.limits import hitting_kg, load_kg, slew_rad_s2


def robot_model(scene: Scene, control: str, config: ControlConfig) -> RobotModel:
    """Of the robot in a scene, commanded by actions of this kind."""
    chain = scene.chain
    most = fastest(control, chain, config)
    return RobotModel(chain, most, slew_rad_s2(scene), hitting_kg(scene), load_kg(scene))
