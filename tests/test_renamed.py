"""A former name of a setting is an error that gives the present name; there are no aliases."""

import pytest

import hrc_env
from hrc_env.control import ControlConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import from_mapping
from hrc_env.core.records import PoseEstimate
from hrc_env.env_words import read_cameras
from hrc_env.perception.detector import DetectorConfig
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.rewards import RewardConfig
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.shield import find_shield
from hrc_env.scene.domain_randomization import AppearanceConfig
from hrc_env.scene.rig_distribution import RigDistribution
from hrc_env.scene.robot import Robot
from hrc_env.tracking.config import (
    PaperConfig,
    ParticleConfig,
    TrackerConfig,
    TriangulationConfig,
)
from hrc_env.tracking.people.association import AssociationConfig

RECORDS = (
    AppearanceConfig, AssociationConfig, ControlConfig, DetectorConfig, FaultConfig, PaperConfig,
    ParticleConfig, PoseEstimate, RewardConfig, RigDistribution, Robot, ShieldConfig, TrackerConfig,
    TriangulationConfig,
)  # fmt: skip
"""All records that have fields with former names."""
NAMES = [
    (record, former, present)
    for record in RECORDS
    for former, present in sorted(record.RENAMED.items())
]


@pytest.mark.parametrize(("record", "former", "present"), NAMES)
def test_a_former_name_of_a_field_is_an_error_that_gives_the_present_one(record, former, present):
    assert present in record.__dataclass_fields__
    assert former not in record.__dataclass_fields__
    name = record.__name__
    with pytest.raises(ConfigError, match=f"field of {name} {former} is called {present} now"):
        record(**{former: 0.1})
    with pytest.raises(ConfigError, match=rf"place\.{former} is called place\.{present} now"):
        from_mapping(record, {former: 0.1}, "place.")


def test_former_names_are_answered_wherever_settings_are_given():
    with pytest.raises(ConfigError, match=r"shield\.sigmas is called shield\.n_sigmas now"):
        find_shield({"sigmas": 2.0})
    with pytest.raises(ConfigError, match=r"tracker\.forget_s is called tracker\.lost_relax"):
        hrc_env.HRCEnv(config={"tracker": {"forget_s": 2.0}})
    with pytest.raises(
        ConfigError, match=r"faults\[0\]\.from_s is called faults\[0\]\.start_s now"
    ):
        hrc_env.HRCEnv(faults=[{"kind": "lost", "cameras": ["all"], "from_s": 1.0}])
    with pytest.raises(ConfigError, match=r"cameras\.place_m is called cameras\.max_shift_m now"):
        hrc_env.HRCEnv(cameras=read_cameras(['{"place_m": 0.1}']))
