"""A former name of a setting or info is an error that gives the present one; none is an alias."""

import pickle
import re
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

import hrc_env
from hrc_env import observations
from hrc_env.__main__ import main
from hrc_env.agents import policies
from hrc_env.agents.env_info import env_info
from hrc_env.control import ControlConfig
from hrc_env.core import infos
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


@pytest.mark.parametrize(
    ("command", "former", "present"),
    [("lab", "--folded", "--folded-network"), ("price", "--eyes", "--setups")],
)
def test_a_former_option_of_a_command_is_an_error_that_gives_the_present_one(
    command, former, present, capsys
):
    assert main(["experiment", command, former, "heavy"]) == 2
    assert f"The option {former} is called {present} now." in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["experiment", command, "--help"])
    shown = capsys.readouterr().out
    assert f"{present} " in shown
    assert f"{former} " not in shown


def test_a_former_component_of_the_cost_is_an_error_that_gives_the_present_one():
    with pytest.raises(ConfigError, match="'too_near' is called 'separation_violated' now"):
        hrc_env.HRCEnv(config={"cost": {"components": ["too_near"]}})


@pytest.mark.parametrize(("former", "present"), sorted(infos.RENAMED.items()))
def test_a_former_key_of_infos_is_an_error_that_gives_the_present_one(former, present):
    flags = [entry.flag for entry in infos.ENTRIES.values()]
    assert present in infos.ENTRIES or present in flags or present.startswith("cost_")
    assert former not in infos.ENTRIES
    expected = f"The info key {former!r} is called {present!r} now."
    info = pickle.loads(pickle.dumps(infos.InfoDict({present: 1.0})))
    assert info[present] == 1.0
    assert former not in info
    with pytest.raises(KeyError, match=re.escape(expected)):
        info[former]
    with pytest.raises(KeyError, match=r"^'other'$"):
        info["other"]
    with pytest.raises(KeyError, match=f"did you mean '{present}'"):
        info[present[:-1]]
    with pytest.raises(KeyError, match=re.escape(expected)):
        info.get(former)
    assert info.get("other", 2.0) == 2.0
    with pytest.raises(ConfigError, match=re.escape(expected)):
        infos.match_keys([former], [present])


@pytest.mark.parametrize(("former", "present"), sorted(observations.RENAMED.items()))
def test_a_former_observation_term_is_an_error_that_gives_the_present_one(former, present):
    with closing(hrc_env.HRCEnv("HRCDelivery-v0", perception="truth")) as env:
        terms = env.split_observation(env.reset(seed=0)[0])
        slices = env.simulation.layout.slices
    for named in (terms, slices):
        assert present in named
        with pytest.raises(KeyError, match=f"observation term '{former}' is called '{present}'"):
            named[former]
        with pytest.raises(KeyError, match=f"observation term '{former}' is called '{present}'"):
            named.get(former)


def test_a_policy_with_a_former_observation_term_is_refused_with_the_present_one():
    with closing(hrc_env.HRCEnv(perception="truth")) as env:
        here = env_info(env)
    card = policies.read(policies.FOLDER / "HRCReach-v0" / "fast.safetensors")[0]
    former = [
        replace(term, name="worker_blind") if term.name == "worker_unobserved_time" else term
        for term in card.observation
    ]
    assert policies.list_differences(replace(card, observation=tuple(former)), here) == [
        "The observation term 'worker_blind' is called 'worker_unobserved_time' now"
    ]


def test_infos_of_resets_and_steps_answer_former_keys():
    with closing(hrc_env.HRCEnv(perception="truth")) as env:
        _, reset_info = env.reset(seed=0)
        step_info = env.step(np.zeros(env.action_space.shape, np.float32))[-1]
    with closing(hrc_env.HRCVectorEnv(2, perception="truth")) as envs:
        _, vector_reset_info = envs.reset(seed=0)
        vector_info = envs.step(np.zeros(envs.action_space.shape, np.float32))[-1]
    given = (reset_info, step_info, vector_reset_info, vector_info)
    for info in given:
        assert dict(info) == info
        with pytest.raises(KeyError, match="is called 'safety/separation_violated' now"):
            info["safety/too_near"]
