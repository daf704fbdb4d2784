"""Learners beside PPO on the task that it suits: hindsight, other ids, demonstrations first."""

import json
import shutil
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT, called
from stable_baselines3 import PPO, HerReplayBuffer

from hrc_env.__main__ import main
from hrc_env.agents import checkpoints, cloning, sac
from hrc_env.agents.cloning import CloningSettings, clone
from hrc_env.agents.env_info import env_info
from hrc_env.agents.features import NearAndFar
from hrc_env.agents.recipes import Run, fill_in
from hrc_env.agents.registry import make_agent
from hrc_env.agents.requests import TrainingRequest
from hrc_env.core.errors import CheckpointError, NoGoalError
from hrc_env.env import HRCEnv
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks import BUILT_IN

pytestmark = pytest.mark.slow  # learners are trained

TINY = ["--perception", "truth", "--n-workers", "0", "--num-envs", "4", "--episodes", "2"]
REACH = "HRCReachGoal-v0"


def train(*words: object):
    done = called(ROOT / "train.py", *TINY, "--no-film", *words)
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A short run of SAC with hindsight."""
    folder = tmp_path_factory.mktemp("run") / "sac"
    train("--task", REACH, "--algorithm", "sac", "--timesteps", 440, "--out", folder)
    return folder


def test_sac_leaves_what_ppo_leaves(run):
    names = {path.name for path in run.iterdir()}
    assert names == {
        "policy.zip", "curve.json", "curve.png", "score.json", "run.json", "tensorboard",
    }  # fmt: skip
    meta = checkpoints.describe(run / "policy.zip")
    assert (meta["algorithm"], meta["num_timesteps"]) == ("sac", 440)
    assert meta["observation_size"].keys() == {"achieved_goal", "desired_goal", "observation"}
    assert 0 <= json.loads((run / "score.json").read_text())["success_rate"] <= 1


def test_sac_goes_on_where_it_stopped(run, tmp_path):
    before = checkpoints.load(run / "policy.zip", told(REACH, control="tool"))
    train("--resume", run, "--timesteps", 900)
    assert checkpoints.describe(run / "policy.zip")["num_timesteps"] == 900
    steps = [point["steps"] for point in json.loads((run / "curve.json").read_text())]
    assert steps == sorted(steps)
    after = checkpoints.load(run / "policy.zip", told(REACH, control="tool"))
    env = HRCEnv(REACH, perception="truth", n_workers=0, control="tool")
    observation, _ = env.reset(seed=0)
    assert not np.array_equal(before.act(observation), after.act(observation))


def test_a_resumed_run_acts_as_it_has_learnt_while_its_buffer_fills(run):
    with closing(HRCVecEnv(2, task=REACH, control="tool", perception="truth", n_workers=0)) as env:
        learner = checkpoints.resume(run / "policy.zip", env)
        learner._last_obs = env.reset()
        learner.actor.log_std.weight.data.zero_()
        learner.actor.log_std.bias.data.fill_(-20.0)  # no noise
        action, _ = learner._sample_action(learner.learning_starts, None, 2)
        assert learner.num_timesteps < learner.learning_starts
        expected = learner.predict(learner._last_obs, deterministic=True)[0]
        np.testing.assert_allclose(action, expected, atol=1e-4)


def test_a_resumed_run_says_that_its_buffer_fills_anew(run, tmp_path):
    again = shutil.copytree(run, tmp_path / "again")
    n_steps = checkpoints.describe(again / "policy.zip")["num_timesteps"]
    done = train("--resume", again, "--timesteps", n_steps + 8)
    said = " ".join(done.stdout.split())
    assert "contain no replay buffer: it is filled again by the policy" in said


def told(task: str, **kwargs):
    return env_info(HRCEnv(task, perception="truth", n_workers=0, **kwargs).simulation)


def test_a_policy_for_goals_acts_where_there_are_goals_only(run):
    agent = make_agent(str(run / "policy.zip"), told(REACH, control="tool"))
    env = HRCEnv(REACH, perception="truth", n_workers=0, control="tool")
    action = agent.act(env.reset(seed=0)[0])
    assert action.shape == (3,)
    with pytest.raises(CheckpointError, match="create it with the same task"):
        make_agent(str(run / "policy.zip"), told("HRCReach-v0"))


def test_hindsight_is_for_goals():
    made = {}
    for task in (REACH, "HRCReach-v0"):
        env = HRCVecEnv(2, task=task, perception="truth")
        made[task] = isinstance(
            sac.make_learner(env, sac.SACSettings(), 0).replay_buffer, HerReplayBuffer
        )
    assert made == {REACH: True, "HRCReach-v0": False}
    with pytest.raises(NoGoalError, match="HRCReachGoal-v0, HRCPickPlaceGoal-v0"):
        sac.make_learner(env, sac.SACSettings(), 0, her=True)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--algorithm", "sac", "--her", "True"], "HRCReach-v0 has no goals separate from"),
        (["--her", "True"], "ppo has no replay buffer"),
        (["--algorithm", "scac"], "Did you mean 'sac'"),
        (["--demonstrations", "-1"], "--demonstrations must be 0 or more"),
        (["--timesteps", "0"], "--timesteps must be 1 or more"),
    ],
)
def test_what_cannot_be_learnt_with_is_refused_in_words(words, says, tmp_path, capsys):
    assert main(["train", *TINY, *words, "--out", str(tmp_path / "run")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("task", ["HRCPickPlace-v0", "HRCReachGoal-v0", "HRCPickPlaceGoal-v0"])
def test_ppo_takes_every_id(task, tmp_path):
    folder = tmp_path / "run"
    alone = ["--algorithm", "ppo", "--demonstrations", 0]
    train("--task", task, *alone, "--timesteps", 256, "--out", folder)
    assert checkpoints.describe(folder / "policy.zip")["environment"]["task"] == task


def test_a_policy_learns_from_the_expert_before_it_learns_itself(tmp_path, monkeypatch):
    short = CloningSettings(rounds=2, steps=20)
    monkeypatch.setattr("hrc_env.agents.training.CloningSettings", lambda: short)
    shown = []
    once = cloning._learn
    monkeypatch.setattr(cloning, "_learn", lambda *of: shown.append(len(of[1][1])) or once(*of))
    folder = tmp_path / "run"
    words = ["--task", "HRCReach-v0", "--demonstrations", 4, "--out", folder]
    train(*words, "--timesteps", 256)
    assert shown == [500, 1000]
    train("--resume", folder, "--timesteps", 512)
    assert shown == [500, 1000]


def test_who_only_imitates_can_learn_on_later(tmp_path, monkeypatch):
    short = CloningSettings(rounds=1, steps=20)
    monkeypatch.setattr("hrc_env.agents.training.CloningSettings", lambda: short)
    folder = tmp_path / "run"
    words = ["--task", "HRCReach-v0", "--demonstrations", 4, "--out", folder]
    train(*words, "--timesteps", 0)
    assert checkpoints.describe(folder / "policy.zip")["num_timesteps"] == 0
    took = json.loads((folder / "score.json").read_text())
    assert took["training_s"] > 0
    assert took["processor_s"] > 0
    train("--resume", folder, "--timesteps", 256)
    assert checkpoints.describe(folder / "policy.zip")["num_timesteps"] == 256


def test_every_task_is_learnt_as_suits_it_unless_somebody_says_otherwise():
    by_task = {task: fill_in(TrainingRequest(task=task)) for task in BUILT_IN}
    assert {task: run.algorithm for task, run in by_task.items() if run.algorithm != "ppo"} == {
        REACH: "sac"
    }
    assert [task for task, run in by_task.items() if not run.demonstrations] == [
        "HRCReach-v0", REACH,
    ]  # fmt: skip
    run = fill_in(TrainingRequest(task="HRCPickPlace-v0", demonstrations=7, control="joint"))
    assert (run.demonstrations, run.control, run.algorithm) == (7, "joint", "ppo")
    run = fill_in(TrainingRequest(task="HRCPickPlace-v0", algorithm="sac"))
    assert (run.demonstrations, run.control) == (0, "joint")
    assert fill_in(TrainingRequest(task="Mine-v0")) == Run(task="Mine-v0")


def test_cloning_brings_actions_near_the_experts():
    """And the policy tries no more than it is unsure of."""
    env = HRCVecEnv(8, task="HRCReach-v0", perception="truth", n_workers=0, control="tool")
    learner = PPO(
        "MlpPolicy", env, n_steps=8, seed=0,
        policy_kwargs={"net_arch": [64], "features_extractor_class": NearAndFar},
    )  # fmt: skip
    errors = clone(learner.policy, env, 8, CloningSettings(rounds=2, steps=300), seed=1)
    expert, observation = make_agent("scripted", env_info(env.simulation)), env.reset()
    apart = np.abs(learner.predict(observation, deterministic=True)[0] - expert.act(observation))
    assert apart.mean() < 0.1
    assert errors[-1] < 0.1
    spread = np.exp(learner.policy.log_std.detach().numpy())
    np.testing.assert_allclose(spread, max(errors[-1], cloning.LEAST_SPREAD), rtol=1e-5)


def test_near_and_far_are_both_seen():
    env = HRCEnv(REACH, perception="none")
    flat = NearAndFar(env.observation_space["achieved_goal"])
    import torch

    seen = flat(torch.tensor([[0.001, -0.001, 1.0]]))
    assert seen.shape == (1, 6) == (1, flat.features_dim)
    near, other, far = seen[0, 3:].tolist()
    both = NearAndFar(env.observation_space)
    parts = {k: torch.as_tensor(v[None]) for k, v in env.reset(seed=0)[0].items()}
    way = both(parts)[0, : both.features_dim // 2][-3:]
    assert way.tolist() == (parts["desired_goal"] - parts["achieved_goal"])[0].tolist()
    assert near == pytest.approx(-other)
    assert near > 0.02
    assert far == pytest.approx(1.0)
