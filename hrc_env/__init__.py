"""Reinforcement learning for robots that work beside people and observe them only by cameras.

Importing this package registers the environments; `gymnasium.make("hrc_env:HRCReach-v0")` imports
the package and makes an environment. `PUBLIC` lists the names of the public interface and the
modules that define them; a name is imported when it is first used. Everything else may change
without notice.
"""

import difflib
import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from hrc_env.registration import adopt, import_files, register_environment
from hrc_env.tasks import BUILT_IN

if TYPE_CHECKING:  # the names in `PUBLIC`, for type checkers and editors
    from hrc_env.agents.callbacks import ProximityRamp as ProximityRamp
    from hrc_env.agents.env_info import Agent as Agent
    from hrc_env.agents.env_info import EnvInfo as EnvInfo
    from hrc_env.agents.env_info import env_info as env_info
    from hrc_env.agents.learner_settings import RECIPES as RECIPES
    from hrc_env.agents.learner_settings import PPOSettings as PPOSettings
    from hrc_env.agents.learner_settings import SACSettings as SACSettings
    from hrc_env.agents.registry import make_agent as make_agent
    from hrc_env.belief import Belief as Belief
    from hrc_env.belief import standard_deviation_m as standard_deviation_m
    from hrc_env.config import HRCConfig as HRCConfig
    from hrc_env.config import save_config as save_config
    from hrc_env.core.errors import ConfigError as ConfigError
    from hrc_env.core.errors import HRCError as HRCError
    from hrc_env.core.records import Keypoints as Keypoints
    from hrc_env.core.records import PoseEstimate as PoseEstimate
    from hrc_env.core.records import Roi as Roi
    from hrc_env.core.results import Metric as Metric
    from hrc_env.core.skeleton import BLAZEPOSE_INDEX as BLAZEPOSE_INDEX
    from hrc_env.core.skeleton import JOINTS as JOINTS
    from hrc_env.core.skeleton import MIRROR as MIRROR
    from hrc_env.env import HRCEnv as HRCEnv
    from hrc_env.env_config import EnvConfig as EnvConfig
    from hrc_env.evaluation.dataset import Episode as Episode
    from hrc_env.evaluation.dataset import EpisodeSet as EpisodeSet
    from hrc_env.evaluation.dataset import load_episodes as load_episodes
    from hrc_env.evaluation.episodes import Score as Score
    from hrc_env.evaluation.episodes import evaluate as evaluate
    from hrc_env.evaluation.episodes import evaluate_episodes as evaluate_episodes
    from hrc_env.evaluation.intervals import Comparison as Comparison
    from hrc_env.evaluation.intervals import compare_means as compare_means
    from hrc_env.evaluation.intervals import compare_paired as compare_paired
    from hrc_env.evaluation.intervals import compare_rates as compare_rates
    from hrc_env.evaluation.intervals import estimate_mean as estimate_mean
    from hrc_env.evaluation.intervals import estimate_rate as estimate_rate
    from hrc_env.evaluation.intervals import estimate_share as estimate_share
    from hrc_env.evaluation.rollout import Transition as Transition
    from hrc_env.evaluation.rollout import rollout as rollout
    from hrc_env.experiments import columns as columns
    from hrc_env.experiments.runner import run_experiment as run_experiment
    from hrc_env.experiments.setups import PerceptionSetup as PerceptionSetup
    from hrc_env.experiments.study import Row as Row
    from hrc_env.experiments.study import Study as Study
    from hrc_env.geometry.camera_config import CameraConfig as CameraConfig
    from hrc_env.geometry.camera_config import read_rig as read_rig
    from hrc_env.geometry.camera_config import write_rig as write_rig
    from hrc_env.geometry.lens import Lens as Lens
    from hrc_env.geometry.reach import ReachTarget as ReachTarget
    from hrc_env.mocap.read import read_recording as read_recording
    from hrc_env.mocap.retarget import retarget as retarget
    from hrc_env.motion.clip import Clip as Clip
    from hrc_env.motion.clip import load_clip as load_clip
    from hrc_env.motion.clip import save_clip as save_clip
    from hrc_env.motion.config import PeopleConfig as PeopleConfig
    from hrc_env.observations import ObservationTerm as ObservationTerm
    from hrc_env.perception.blazepose import crop_window as crop_window
    from hrc_env.perception.blazepose import load_blazepose as load_blazepose
    from hrc_env.perception.detector import DetectorConfig as DetectorConfig
    from hrc_env.perception.faults.fault import FaultConfig as FaultConfig
    from hrc_env.perception.searching import ImageSource as ImageSource
    from hrc_env.pipeline.pose_tracker import PoseTracker as PoseTracker
    from hrc_env.registration import IDS as IDS
    from hrc_env.registration import import_files as import_files
    from hrc_env.registration import register_detector as register_detector
    from hrc_env.registration import register_estimator as register_estimator
    from hrc_env.registration import register_robot as register_robot
    from hrc_env.registration import register_shield as register_shield
    from hrc_env.registration import register_task as register_task
    from hrc_env.render.views import Views as Views
    from hrc_env.reset_options import ResetOptions as ResetOptions
    from hrc_env.rewards import RewardConfig as RewardConfig
    from hrc_env.rewards import RewardTerm as RewardTerm
    from hrc_env.safety.config import ShieldConfig as ShieldConfig
    from hrc_env.safety.shield import Shield as Shield
    from hrc_env.sb3 import HRCSubprocVecEnv as HRCSubprocVecEnv
    from hrc_env.sb3 import HRCVecEnv as HRCVecEnv
    from hrc_env.scene.camera_images import ImageConfig as ImageConfig
    from hrc_env.scene.domain_randomization import AppearanceConfig as AppearanceConfig
    from hrc_env.scene.rig import make_cameras as make_cameras
    from hrc_env.scene.rig_distribution import RigDistribution as RigDistribution
    from hrc_env.scene.rigs import RIGS as RIGS
    from hrc_env.scene.robot import ROBOTS as ROBOTS
    from hrc_env.scene.robot import Hand as Hand
    from hrc_env.scene.robot import Robot as Robot
    from hrc_env.scene.robot import Suction as Suction
    from hrc_env.scene.robot_import import robot_from_mjcf as robot_from_mjcf
    from hrc_env.tasks.goal import Goal as Goal
    from hrc_env.tasks.task import Task as Task
    from hrc_env.tasks.task import find_task as find_task
    from hrc_env.tasks.task import with_rewards as with_rewards
    from hrc_env.tracking.config import TrackerConfig as TrackerConfig
    from hrc_env.tracking.estimators import EstimatorSpec as EstimatorSpec
    from hrc_env.tracking.estimators import make_estimator as make_estimator
    from hrc_env.tracking.forecast import forecast as forecast
    from hrc_env.tracking.interface import Estimator as Estimator
    from hrc_env.tracking.smoother import smooth as smooth
    from hrc_env.vector.env import HRCVectorEnv as HRCVectorEnv
    from hrc_env.vector.make import make_vector as make_vector
    from hrc_env.vector.six_tuple import CostEnv as CostEnv
    from hrc_env.vector.six_tuple import CostVectorEnv as CostVectorEnv
    from hrc_env.world import Effects as Effects
    from hrc_env.world import TaskScene as TaskScene
    from hrc_env.world import Weld as Weld
    from hrc_env.world import WorkerSignal as WorkerSignal
    from hrc_env.world import Workplace as Workplace
    from hrc_env.world import World as World

__version__ = "0.1.0"

PUBLIC = {
    # environments
    "AppearanceConfig": "hrc_env.scene.domain_randomization",
    "CostEnv": "hrc_env.vector.six_tuple",
    "CostVectorEnv": "hrc_env.vector.six_tuple",
    "EnvConfig": "hrc_env.env_config",
    "FaultConfig": "hrc_env.perception.faults.fault",
    "HRCConfig": "hrc_env.config",
    "HRCEnv": "hrc_env.env",
    "HRCSubprocVecEnv": "hrc_env.sb3",
    "HRCVecEnv": "hrc_env.sb3",
    "HRCVectorEnv": "hrc_env.vector.env",
    "IDS": "hrc_env.registration",
    "ImageConfig": "hrc_env.scene.camera_images",
    "ResetOptions": "hrc_env.reset_options",
    "RigDistribution": "hrc_env.scene.rig_distribution",
    "Views": "hrc_env.render.views",
    "make_vector": "hrc_env.vector.make",
    "save_config": "hrc_env.config",
    # tasks
    "Effects": "hrc_env.world",
    "Goal": "hrc_env.tasks.goal",
    "ObservationTerm": "hrc_env.observations",
    "ReachTarget": "hrc_env.geometry.reach",
    "RewardConfig": "hrc_env.rewards",
    "RewardTerm": "hrc_env.rewards",
    "Task": "hrc_env.tasks.task",
    "TaskScene": "hrc_env.world",
    "Weld": "hrc_env.world",
    "WorkerSignal": "hrc_env.world",
    "Workplace": "hrc_env.world",
    "World": "hrc_env.world",
    "find_task": "hrc_env.tasks.task",
    "register_task": "hrc_env.registration",
    "with_rewards": "hrc_env.tasks.task",
    # robots
    "Hand": "hrc_env.scene.robot",
    "ROBOTS": "hrc_env.scene.robot",
    "Robot": "hrc_env.scene.robot",
    "Suction": "hrc_env.scene.robot",
    "register_robot": "hrc_env.registration",
    "robot_from_mjcf": "hrc_env.scene.robot_import",
    # shields
    "Shield": "hrc_env.safety.shield",
    "ShieldConfig": "hrc_env.safety.config",
    "register_shield": "hrc_env.registration",
    # cameras
    "CameraConfig": "hrc_env.geometry.camera_config",
    "Lens": "hrc_env.geometry.lens",
    "RIGS": "hrc_env.scene.rigs",
    "make_cameras": "hrc_env.scene.rig",
    "read_rig": "hrc_env.geometry.camera_config",
    "write_rig": "hrc_env.geometry.camera_config",
    # detectors
    "BLAZEPOSE_INDEX": "hrc_env.core.skeleton",
    "DetectorConfig": "hrc_env.perception.detector",
    "ImageSource": "hrc_env.perception.searching",
    "JOINTS": "hrc_env.core.skeleton",
    "Keypoints": "hrc_env.core.records",
    "MIRROR": "hrc_env.core.skeleton",
    "Roi": "hrc_env.core.records",
    "crop_window": "hrc_env.perception.blazepose",
    "load_blazepose": "hrc_env.perception.blazepose",
    "register_detector": "hrc_env.registration",
    # belief and estimators
    "Belief": "hrc_env.belief",
    "Estimator": "hrc_env.tracking.interface",
    "EstimatorSpec": "hrc_env.tracking.estimators",
    "PoseEstimate": "hrc_env.core.records",
    "PoseTracker": "hrc_env.pipeline.pose_tracker",
    "TrackerConfig": "hrc_env.tracking.config",
    "forecast": "hrc_env.tracking.forecast",
    "make_estimator": "hrc_env.tracking.estimators",
    "register_estimator": "hrc_env.registration",
    "smooth": "hrc_env.tracking.smoother",
    "standard_deviation_m": "hrc_env.belief",
    # people
    "Clip": "hrc_env.motion.clip",
    "PeopleConfig": "hrc_env.motion.config",
    "load_clip": "hrc_env.motion.clip",
    "read_recording": "hrc_env.mocap.read",
    "retarget": "hrc_env.mocap.retarget",
    "save_clip": "hrc_env.motion.clip",
    # agents and learning
    "Agent": "hrc_env.agents.env_info",
    "EnvInfo": "hrc_env.agents.env_info",
    "PPOSettings": "hrc_env.agents.learner_settings",
    "ProximityRamp": "hrc_env.agents.callbacks",
    "RECIPES": "hrc_env.agents.learner_settings",
    "SACSettings": "hrc_env.agents.learner_settings",
    "env_info": "hrc_env.agents.env_info",
    "make_agent": "hrc_env.agents.registry",
    # evaluation
    "Comparison": "hrc_env.evaluation.intervals",
    "Episode": "hrc_env.evaluation.dataset",
    "EpisodeSet": "hrc_env.evaluation.dataset",
    "Metric": "hrc_env.core.results",
    "Score": "hrc_env.evaluation.episodes",
    "Transition": "hrc_env.evaluation.rollout",
    "compare_means": "hrc_env.evaluation.intervals",
    "compare_paired": "hrc_env.evaluation.intervals",
    "compare_rates": "hrc_env.evaluation.intervals",
    "estimate_mean": "hrc_env.evaluation.intervals",
    "estimate_rate": "hrc_env.evaluation.intervals",
    "estimate_share": "hrc_env.evaluation.intervals",
    "evaluate": "hrc_env.evaluation.episodes",
    "evaluate_episodes": "hrc_env.evaluation.episodes",
    "load_episodes": "hrc_env.evaluation.dataset",
    "rollout": "hrc_env.evaluation.rollout",
    # experiments
    "PerceptionSetup": "hrc_env.experiments.setups",
    "Row": "hrc_env.experiments.study",
    "Study": "hrc_env.experiments.study",
    "columns": "hrc_env.experiments",
    "run_experiment": "hrc_env.experiments.runner",
    # errors and files
    "ConfigError": "hrc_env.core.errors",
    "HRCError": "hrc_env.core.errors",
    "import_files": "hrc_env.registration",
}
"""Module that defines each public name, by name."""
RENAMED = {
    "pinholes": "make_cameras",
    "read_capture": "read_recording",
    "sample_window": "crop_window",
}
"""Current public names of renamed objects, by former name."""
EXTRAS = dict.fromkeys(("HRCSubprocVecEnv", "HRCVecEnv", "ProximityRamp"), "stable_baselines3")
"""Optional package that a public name requires and that an extra installs, by name."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562).

    For a class, `help` and `__doc__` also show the descriptions of its fields.

    Raises:
        AttributeError: the name is unknown, or it is a former name; the error suggests the most
            similar name or the current one.
    """
    if name in PUBLIC:
        value = globals()[name] = getattr(import_module(PUBLIC[name]), name)
        if isinstance(value, type):
            import_module("hrc_env.core.docstrings").show_attributes(value)
        return value
    if name in RENAMED:
        raise AttributeError(_said_of(name))
    lower = {each.lower(): each for each in PUBLIC}
    near = difflib.get_close_matches(name.lower(), lower, n=1)
    hint = f" Did you mean {lower[near[0]]!r}?" if near else ""
    raise AttributeError(
        f"hrc_env has no attribute {name!r}.{hint} dir(hrc_env) lists all public names."
    )


class FormerNames:
    """Finder in `sys.meta_path` that reports the current name for `from hrc_env import FORMER`.

    An `AttributeError` of `__getattr__` would not be shown, because Python then searches for a
    submodule of that name.
    """

    @staticmethod
    def find_spec(fullname: str, path: object = None, target: object = None) -> None:
        """Raise an `ImportError` for a former name; return None for every other name."""
        package, _, name = fullname.partition(".")
        if package == __name__ and name in RENAMED:
            raise ImportError(_said_of(name), name=fullname)


def _said_of(former: str) -> str:
    return f"hrc_env.{former} is called hrc_env.{RENAMED[former]} now."


def __dir__() -> list[str]:
    """List the public names, except those that require an extra that is not installed."""
    here = [name for name in PUBLIC if name not in EXTRAS or find_spec(EXTRAS[name])]
    return [*here, "__version__"]


if not TYPE_CHECKING:  # type checkers read the imports above
    __all__ = __dir__()

sys.meta_path.append(FormerNames)
for _id, _task in BUILT_IN.items():
    register_environment(_id, _task.max_episode_steps)
import_files()
adopt()
