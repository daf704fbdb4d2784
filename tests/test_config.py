"""One way to configure: keyword arguments for what is chosen often, `config=` for the rest."""

from dataclasses import fields, replace
from functools import partial
from inspect import signature

import gymnasium
import pytest

from hrc_env.__main__ import main
from hrc_env.config import HRCConfig, save_config
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.env_config import EnvConfig
from hrc_env.motion.clip import Clip
from hrc_env.motion.config import PEOPLE
from hrc_env.motion.schedule import WORK
from hrc_env.scene.domain_randomization import APPEARANCES
from hrc_env.scene.rigs import RIGS
from hrc_env.settings import resolve_settings
from hrc_env.vector.env import HRCVectorEnv

ODD = {
    "people": "hurried",
    "cameras": "lab_gopro",
    "appearance": "varied",
    "faults": [{"kind": "lost", "cameras": ["all"], "end_s": 2.5}],
    "config": {"worker": ["worker_1", "worker_2"], "motion": {"motions": ['a "b"\\.npz']}},
}


@pytest.mark.parametrize("estimator", ["particle", "paper", "triangulation"])
def test_a_config_that_is_saved_and_loaded_is_the_same(estimator, tmp_path):
    config = resolve_settings(estimator=estimator, **ODD).config
    save_config(config, tmp_path / "mine.toml")
    assert resolve_settings(estimator=estimator, config=tmp_path / "mine.toml").config == config


def test_a_file_may_hold_a_few_changes_and_names_of_presets(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('appearance = "varied"\n[motion]\npeople = "unaware"\n[reward]\neffort = 1\n')
    config = HRCEnv(perception="pixels", config=str(path)).config
    assert config.appearance == APPEARANCES["varied"]
    assert config.motion.people == PEOPLE["unaware"]
    assert config.reward == replace(HRCConfig().reward, effort=1.0)


def test_a_keyword_argument_is_the_field_of_the_config_that_it_stands_for():
    by_keyword = resolve_settings(
        **{name: value for name, value in ODD.items() if name != "config"}
    ).config
    by_config = resolve_settings(
        config={
            "scene": {"cameras": RIGS["lab_gopro"]},
            "motion": {"people": "hurried"},
            "faults": ODD["faults"],
            "appearance": "varied",
        }
    ).config
    assert by_keyword == by_config


def test_a_clip_in_memory_is_not_written(tmp_path):
    clip = object.__new__(Clip)
    object.__setattr__(clip, "source", "walk")
    config = replace(HRCConfig(), motion=replace(HRCConfig().motion, motions=(clip,)))
    with pytest.raises(ConfigError, match="'walk' is held in memory and cannot be written"):
        save_config(config, tmp_path / "mine.toml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[reward]\nproximty = 1\n", "'reward.proximty'. Did you mean 'reward.proximity'"),
        ('ctrl_dt = "fast"\n', "ctrl_dt must be a finite number, got 'fast'"),
        ("reward = [", "is not valid TOML"),
        ('[motion]\npeople = "hurrid"\n', "motion.people 'hurrid'. Did you mean 'hurried'"),
        ("appearance = 3\n", "appearance must be a name ('as_built'"),
        ('[motion]\njobs = "lowwork"\n', "motion.jobs 'lowwork'. Did you mean 'low_work'"),
        ("[motion]\njobs = 3\n", "motion.jobs must be a name ('framing', 'low_work'"),
    ],
)
def test_a_file_that_cannot_be_is_answered_with_what_would_do(text, said, tmp_path):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ConfigError) as refused:
        resolve_settings(config=tmp_path / "mine.toml")
    assert said in str(refused.value)


def test_the_list_shows_the_configuration_that_arguments_make(tmp_path, capsys):
    assert main(["list", "--config", "reward.proximity=0.5", "--people", "hurried"]) == 0
    (tmp_path / "mine.toml").write_text(capsys.readouterr().out)
    said = resolve_settings(people="hurried", config={"reward": {"proximity": 0.5}}).config
    assert resolve_settings(config=tmp_path / "mine.toml").config == said
    assert main(["list", "--config", "motion.jobs=low_work"]) == 0
    (tmp_path / "mine.toml").write_text(capsys.readouterr().out)
    assert resolve_settings(config=tmp_path / "mine.toml").config.motion.jobs == WORK["low_work"]
    assert main(["list", "--config"]) == 0
    (tmp_path / "mine.toml").write_text(capsys.readouterr().out)
    assert resolve_settings(config=tmp_path / "mine.toml").config == resolve_settings().config


def test_the_environment_takes_the_fields_of_its_config():
    parameters = signature(HRCEnv).parameters
    assert {name: each.default for name, each in parameters.items()} == {
        each.name: each.default for each in fields(EnvConfig)
    }


def test_an_environment_is_made_of_its_arguments_from_a_file(tmp_path):
    asked = EnvConfig(
        perception="keypoints", n_workers=(1, 2), people="hurried", shield={"kind": "ssm"},
        faults=[{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}],
        config={"reward": {"proximity": 0.5}, "task": {"radius_m": 0.1}},
    )  # fmt: skip
    asked.save(tmp_path / "env.toml")
    loaded = EnvConfig.load(tmp_path / "env.toml")
    assert loaded.arguments() == {**asked.arguments(), "n_workers": [1, 2]}
    one, other = HRCEnv(**asked.arguments()), HRCEnv(**loaded.arguments())
    assert one.simulation.settings == other.simulation.settings
    assert one.config.reward.proximity == 0.5


@pytest.mark.parametrize(
    "make",
    [
        EnvConfig,
        HRCEnv,
        resolve_settings,
        partial(HRCVectorEnv, 2),
        partial(gymnasium.make, "HRCReach-v0"),
        partial(gymnasium.make_vec, "HRCReach-v0", num_envs=2),
    ],
)
def test_an_argument_that_there_is_not_is_answered_with_the_nearest(make):
    with pytest.raises(ConfigError, match=r"'percepton'. Did you mean 'perception'"):
        make(percepton="none")


def test_a_setting_that_there_is_not_is_answered_with_the_nearest():
    with pytest.raises(ConfigError, match=r"'rewrd'. Did you mean 'reward'"):
        HRCConfig(rewrd=None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("percepton = 3\n", "'percepton'. Did you mean 'perception'"),
        ("[task]\nradius_m = 0.1\n", r"settings of the task belong in \[config.task\]"),
        ("people = 'hurrid'\n", "Did you mean 'hurried'"),
        ("[shield]\nknd = 'qp'\n", "Did you mean 'shield.kind'"),
    ],
)
def test_a_file_of_arguments_that_cannot_be_is_answered(text, said, tmp_path):
    (tmp_path / "env.toml").write_text(text)
    with pytest.raises(ConfigError, match=said):
        HRCEnv(**EnvConfig.load(tmp_path / "env.toml").arguments())
