"""Learning under a shield: what is observed and penalized, and that whoever plays it knows."""

import json
from pathlib import Path

import numpy as np
import pytest

import hrc_env
from hrc_env.__main__ import main
from hrc_env.agents import checkpoints, policies
from hrc_env.agents.env_info import env_info
from hrc_env.agents.interface import Interface, read_interface
from hrc_env.agents.registry import find_interface, make_agent
from hrc_env.agents.submission import read_submission
from hrc_env.agents.training import read_arguments
from hrc_env.core.errors import CheckpointError
from hrc_env.env import HRCEnv
from hrc_env.experiments.impact.episodes import play_row
from hrc_env.experiments.impact.policies import Policy, choose_env_arguments, get_maker
from hrc_env.experiments.leaderboard import make_plan
from hrc_env.experiments.price.episodes import Driver, play_episodes
from hrc_env.experiments.price.setups import find_setups
from hrc_env.experiments.setups import PerceptionSetup

TINY = ["--perception", "truth", "--num-envs", "4", "--threads", "1", "--no-film", "--seed", "3",
        "--episodes", "2"]  # fmt: skip
UNDER = ["--shield", "qp", "--observe-shield", "--forecast-s", "0.2", "0.4", "--shield-change", "3",
         "--proximity", "0"]  # fmt: skip
NEEDED = Interface(forecast_s=(0.2, 0.4), observe_shield=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "shielded"
    assert main(["train", *TINY, *UNDER, "--timesteps", "512", "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def exported(run) -> Path:
    out = ["--episodes", "2", "--out", str(run / "policies")]
    assert main(["export", str(run), "--name", "calm", *out]) == 0
    return run / "policies" / "HRCReach-v0" / "calm.safetensors"


def test_a_run_observes_the_shield_and_forecasts_and_is_penalized(run):
    config = json.loads((run / "run.json").read_text())["config"]
    assert config["observe_shield"]
    assert config["forecast_s"] == [0.2, 0.4]
    assert config["reward"]["shield_change"] == 3.0
    assert config["reward"]["proximity"] == 0.0
    kept = read_arguments(run)
    assert (kept.observe_shield, kept.forecast_s, kept.shield_change) == (True, (0.2, 0.4), 3.0)
    assert main(["train", *TINY, "--resume", str(run), "--timesteps", "768"]) == 0
    assert checkpoints.describe(run / "policy.zip")["num_timesteps"] == 768
    assert json.loads((run / "run.json").read_text())["config"]["observe_shield"]


def test_its_files_say_what_it_observes(run, exported):
    for path in (run / "policy.zip", exported):
        found = find_interface(str(path))
        assert (found.observe_shield, found.forecast_s) == (True, (0.2, 0.4))
        assert read_submission(str(path)).interface == found
    card = policies.read(exported).card
    assert {term.name for term in card.observation} >= {"shield_change", "worker_joints_forecast"}
    for words in ("--observe-shield", "--forecast-s 0.2 0.4", "--shield-change 3.0"):
        assert words in card.command
    assert find_interface("scripted") == Interface()


@pytest.mark.parametrize("command", ["evaluate", "play"])
def test_whoever_plays_it_need_not_say_what_it_observes(command, run, exported, capsys):
    for path in (run / "policy.zip", exported):
        words = ["--agent", str(path), "--perception", "truth", "--episodes", "1", "--seed", "7"]
        assert main([command, *words, "--shield", "qp"]) == 0, capsys.readouterr().err


def test_the_leaderboard_makes_the_environment_that_it_observes(run):
    row = next(iter(make_plan(str(run / "policy.zip"), ["HRCReach-v0"]).make_study().rows.values()))
    assert row.env["config"] == {"forecast_s": (0.2, 0.4), "observe_shield": True}
    scripted = next(iter(make_plan("scripted", ["HRCReach-v0"]).make_study().rows.values()))
    assert "config" not in scripted.env


def test_other_forecasts_than_it_learnt_with_are_refused(run, exported):
    """They have as many entries, but another meaning."""
    config = {"forecast_s": (0.1, 0.3), "observe_shield": True}
    info = env_info(HRCEnv(perception="truth", shield="qp", config=config).simulation)
    with pytest.raises(CheckpointError, match=r"forecasts at \(0\.2, 0\.4\) s"):
        make_agent(str(run / "policy.zip"), info)
    with pytest.raises(CheckpointError, match=r"forecast_s is \(0\.2, 0\.4\), but here it is"):
        make_agent(str(exported), info)
    right = NEEDED.complete({"perception": "truth", "shield": "qp"})
    env = HRCEnv(**right)
    acted = make_agent(str(exported), env_info(env.simulation)).act(env.reset(seed=1)[0])
    trained = make_agent(str(run / "policy.zip"), env_info(env.simulation))
    np.testing.assert_allclose(acted, trained.act(env.reset(seed=1)[0]), atol=1e-5)


def test_what_is_given_takes_precedence():
    given = {"control": "tool", "config": {"forecast_s": [0.1], "ctrl_dt": 0.08}}
    needed = Interface(control="twist", forecast_s=(0.2,), observe_shield=True)
    assert needed.complete(given) == {
        "control": "tool",
        "config": {"forecast_s": [0.1], "observe_shield": True, "ctrl_dt": 0.08},
    }
    assert given["config"] == {"forecast_s": [0.1], "ctrl_dt": 0.08}
    assert Interface().complete({"task": "HRCReach-v0"}) == {"task": "HRCReach-v0"}
    assert needed.complete({"config": "settings.toml"})["config"] == "settings.toml"
    assert read_interface({}) == Interface()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--observe-shield"], "--observe-shield requires a shield"),
        (["--shield-change", "1"], "--shield-change requires a shield"),
        (["--shield", "qp", "--shield-change", "-1"], "--shield-change must be 0 or more"),
        (["--forecast-s", "2.0"], "forecast_s must be in (0, 1] s"),
    ],
)
def test_what_cannot_be_learnt_is_refused_in_words(words, says, tmp_path, capsys):
    assert main(["train", *TINY, *words, "--timesteps", "64", "--out", str(tmp_path / "run")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_studies_make_the_environment_that_it_observes(exported, tmp_path):
    """They refuse a policy whose observation differs from that of the environment."""
    observed = {"config": {"forecast_s": (0.2, 0.4), "observe_shield": True}}
    driver, shield = Driver(str(exported), control="tool"), hrc_env.ShieldConfig()
    assert driver.env_arguments == {"control": "joint", **observed}
    assert Driver("random", control="tool").env_arguments == {"control": "tool"}
    (setup,) = find_setups(["truth"])
    rows = play_episodes(setup, shield, "HRCReach-v0", 4, driver, [1], tick)
    assert len(rows["cost"]) == 1
    policy = Policy(driver.agent)
    arguments = {"task": "HRCReach-v0", "shield": "qp", **choose_env_arguments(policy, None)}
    maker = get_maker(policy, tmp_path / "none.zip")
    rows = play_row(PerceptionSetup("truth"), arguments, [1], 4, maker, 0.0, tick)
    assert {len(values) for values in rows.values()} == {1}


def tick(share):
    """Show no progress."""


def test_its_episodes_are_recorded_with_what_it_observes(exported, tmp_path):
    words = ["--agent", str(exported), "--perception", "truth", "--shield", "qp", "--episodes", "1"]
    assert main(["record", *words, "--folder", str(tmp_path / "episodes")]) == 0
    recorded = hrc_env.load_episodes(tmp_path / "episodes")
    size = sum(term.entries for term in policies.read(exported).card.observation)
    assert recorded[0].observations.shape[1] == size
