"""What an environment was made from survives JSON: gymnasium's `EnvSpec`."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

import hrc_env  # noqa: F401  registers the ids
from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.geometry.camera_config import CameraConfig, write_rig
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import STAND_Z, measure_bodies
from hrc_env.motion.clip import Clip, save_clip
from hrc_env.motion.config import MotionConfig, PeopleConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.shield import SHIELDS
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig
from hrc_env.scene.rig import LAB_CAMERAS
from hrc_env.scene.robot import ROBOTS
from hrc_env.tasks.task import find_task
from hrc_env.tracking.estimators import ESTIMATORS
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.worker.body import load_body
from tests.tasks.variants import vary

PLACES = [(2.9, 2.6, 2.4), (-2.9, 2.6, 2.4)]


@pytest.mark.parametrize(
    "kwargs",
    [
        {"people": "hurried"},
        {"people": PeopleConfig(tempo=2.0)},
        {"people": {"tempo": 2.0, "pause_s": (0.5, 1.0)}},
        {"faults": [FaultConfig("late", ("camera_1",)), {"kind": "lost", "cameras": (1,)}]},
        {"cameras": (0, "camera_3")},
        {"cameras": np.arange(2)},
        {"cameras": PLACES},
        {"cameras": np.array(PLACES)},
        {"cameras": "lab_gopro"},
        {
            "cameras": [
                CameraConfig.from_make("gopro_hero8_wide", f"c{k}", p) for k, p in enumerate(PLACES)
            ]
        },
        {"cameras": [{"name": f"c{k}", "eye_world": p} for k, p in enumerate(PLACES)]},
        {"n_workers": (0, 2), "estimator": "kalman", "scene": "site", "control": "tool"},
        {"n_workers": np.int64(2)},
        {"config": HRCConfig(worker=("worker_1", "worker_2"), forecast_s=(0.2,))},
        {"config": {"scene": {"cameras": [{"name": "a", "eye_world": PLACES[0]}]}}},
    ],
)
@pytest.mark.filterwarnings("ignore:The rig has a single camera:UserWarning")
def test_every_argument_survives_the_spec(kwargs):
    """As JSON, in both of gymnasium's doors; what it comes to is the same."""
    env = gymnasium.make("HRCReach-v0", perception="keypoints", **kwargs)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    envs = gymnasium.make_vec(
        "HRCReach-v0", 2, perception="keypoints", autoreset_mode=AutoresetMode.SAME_STEP,
        num_threads=1, **kwargs,
    )  # fmt: skip
    envs_again = gymnasium.make_vec(EnvSpec.from_json(envs.spec.to_json()))
    settings = env.unwrapped.simulation.settings
    assert again.unwrapped.simulation.settings == settings
    for each in (envs, envs_again):
        assert each.shards.first.settings == {**settings, "batch": 2}
        assert each.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def standing() -> Clip:
    """A worker who stands for two seconds."""
    size = measure_bodies(load_body()).lengths[0]
    controls = np.zeros((100, c.N_CONTROLS))
    controls[:, c.PELVIS_Z] = size[STAND_Z]
    return Clip(controls, 50.0, np.ones((100, 2), bool), size, "standing")


def test_files_survive_the_spec(tmp_path):
    write_rig(tmp_path / "mine.toml", LAB_CAMERAS[:2])
    save_clip(standing(), tmp_path / "standing.npz")
    files = {"cameras": tmp_path / "mine.toml", "motions": [tmp_path / "standing.npz"]}
    env = gymnasium.make("HRCReach-v0", perception="keypoints", **files)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert again.unwrapped.config.scene.cameras == LAB_CAMERAS[:2]


def own_shield(now, velocities, dt_s):
    return velocities, {}


@pytest.mark.parametrize(
    "kwargs",
    [
        {"robot": replace(ROBOTS["ur10e_like"], name="mine", home_q=(0.1, -1.2, 1.4, 0.2, 1.5, 0))},
        {"robot": replace(ROBOTS["ur10e_gripper"], mjcf=Path(ROBOTS["ur10e_gripper"].mjcf))},
        {"robot": ROBOTS["ur10e_cups"], "shield": ShieldConfig("ssm", margin_m=0.3)},
        {"task": "HRCDelivery-v0", "robot": replace(ROBOTS["mobile_base"], base_radius_m=0.4)},
        {"config": HRCConfig(), "estimator": "paper"},
        {"config": HRCConfig(forecast_s=(0.2,)), "task": find_task("HRCReachGoal-v0")},
        {"estimator": ESTIMATORS["kalman"], "shield": SHIELDS["qp"]},
    ],
    ids=lambda kwargs: "-".join(kwargs),
)
def test_objects_come_back_from_json_as_the_same_environment(kwargs):
    env = gymnasium.make("HRCReach-v0", perception="keypoints", **kwargs)
    spec = EnvSpec.from_json(env.spec.to_json())
    assert gymnasium.make(spec).spec.to_json() == env.spec.to_json()
    assert [seen(gymnasium.make(spec))] == [seen(env)]


def seen(env) -> list:
    """Every number that an environment shows at first and of its first step."""
    env.action_space.seed(1)
    observations = env.reset(seed=1)[0], env.step(env.action_space.sample())[0]
    return [gymnasium.spaces.flatten(env.observation_space, each).tolist() for each in observations]


@pytest.mark.parametrize(
    ("kwargs", "said"),
    [
        ({"motions": [standing()]}, r"motions\[0\] is a Clip.*save_clip"),
        (
            {"config": HRCConfig(motion=MotionConfig(motions=(standing(),)))},
            r"config.motion.motions\[0\] is a Clip.*save_clip",
        ),
        ({"config": {"motion": {"motions": [standing()]}}}, r"motions\[0\] is a Clip"),
        ({"task": vary(find_task("HRCReach-v0"), ends="Soon.")}, "hrc_env.register_task"),
        ({"estimator": ParticleEstimator}, "hrc_env.register_estimator"),
        ({"estimator": replace(ESTIMATORS["kalman"], name="x")}, "hrc_env.register_estimator"),
        ({"shield": own_shield}, "shield is a function.*hrc_env.register_shield"),
    ],
)
def test_what_json_cannot_hold_says_so_and_makes_the_same_in_this_process(kwargs, said):
    env = gymnasium.make("HRCReach-v0", perception="none", **kwargs)
    with pytest.raises(ConfigError, match=said):
        env.spec.to_json()
    assert seen(gymnasium.make(env.spec)) == seen(env)


def test_the_spec_of_an_environment_is_that_of_its_id():
    env = gymnasium.make("HRCReach-v0")
    assert env.spec == gymnasium.spec("HRCReach-v0") == EnvSpec.from_json(env.spec.to_json())


def test_a_mapping_that_is_no_robot_is_refused_with_its_field():
    with pytest.raises(ConfigError, match=r"robot.joint'.* Did you mean 'robot.joints'"):
        gymnasium.make("HRCReach-v0", robot={"joint": ["a"]})


def test_environments_in_processes_have_a_spec_as_others(pixels):
    robot = replace(ROBOTS["ur10e_like"], name="mine", mjcf=Path(ROBOTS["ur10e_like"].mjcf))
    envs = gymnasium.make_vec("HRCReach-v0", 2, cameras=np.arange(2), robot=robot)
    again = gymnasium.make_vec(EnvSpec.from_json(envs.spec.to_json()))
    np.testing.assert_array_equal(envs.reset(seed=1)[0], again.reset(seed=1)[0])
    envs.close(), again.close()


@pytest.mark.parametrize("appearance", ["varied", AppearanceConfig(tint=0.2), {"tint": 0.2}])
def test_appearances_survive_the_spec(appearance):
    env = gymnasium.make("HRCReach-v0", perception="pixels", appearance=appearance)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config.appearance == env.unwrapped.config.appearance != AS_BUILT
    env.close(), again.close()
