"""What an environment was made from survives JSON: gymnasium's `EnvSpec`."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

import hrc_env  # noqa: F401  registers the ids
from hrc_env.config import HRCConfig
from hrc_env.geometry.camera_config import made, write_rig
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import STAND_Z, anatomies
from hrc_env.motion.clip import Clip, save_clip
from hrc_env.motion.config import PeopleConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.scene.domain_randomization import AS_BUILT, AppearanceConfig
from hrc_env.scene.rig import LAB_CAMERAS
from hrc_env.worker.body import load_body

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
        {"cameras": [made("gopro_hero8_wide", f"c{k}", p) for k, p in enumerate(PLACES)]},
        {"cameras": [{"name": f"c{k}", "eye_world": p} for k, p in enumerate(PLACES)]},
        {"n_workers": (0, 2), "estimator": "kalman", "scene": "site", "control": "tool"},
        {"n_workers": np.int64(2)},
        {"config": HRCConfig(worker=("worker_1", "worker_2"), forecast_s=(0.2,))},
        {"config": {"scene": {"cameras": [{"name": "a", "eye_world": PLACES[0]}]}}},
    ],
)
@pytest.mark.filterwarnings("ignore:One camera:UserWarning")
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
    size = anatomies(load_body()).size[0]
    controls = np.zeros((100, c.N_CONTROLS))
    controls[:, c.PELVIS_Z] = size[STAND_Z]
    return Clip(controls, 50.0, np.ones((100, 2), bool), size, "standing")


def test_files_survive_the_spec_and_a_clip_in_memory_does_not(tmp_path):
    write_rig(tmp_path / "mine.toml", LAB_CAMERAS[:2])
    save_clip(clip := standing(), tmp_path / "standing.npz")
    files = {"cameras": tmp_path / "mine.toml", "motions": [tmp_path / "standing.npz"]}
    env = gymnasium.make("HRCReach-v0", perception="keypoints", **files)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert again.unwrapped.config.scene.cameras == LAB_CAMERAS[:2]
    with pytest.raises(TypeError, match="not JSON serializable"):
        gymnasium.make("HRCReach-v0", perception="none", motions=[clip]).spec.to_json()


@pytest.mark.parametrize("appearance", ["varied", AppearanceConfig(tint=0.2), {"tint": 0.2}])
def test_appearances_survive_the_spec(appearance):
    env = gymnasium.make("HRCReach-v0", perception="pixels", appearance=appearance)
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config.appearance == env.unwrapped.config.appearance != AS_BUILT
    env.close(), again.close()
