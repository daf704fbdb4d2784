"""The examples, run as a reader would run them, for a few thousand steps."""

import importlib.util
import re
import sys

import numpy as np
import pytest
import torch
from commands import ROOT, called

import hrc_env

SMALL = ("--num-envs", "8", "--n-steps", "32", "--timesteps", "3000", "--perception", "truth")


def run(name: str, *arguments: str) -> str:
    done = called(ROOT / "examples" / name, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_plain_ppo_runs_and_says_how_many_goals_it_reached():
    said = run("ppo_cleanrl_style.py", *SMALL)
    assert re.search(r"3072 steps in \d+ s", said)
    assert re.search(r"goals reached in the last \d+ episodes: \d+%", said)


def test_the_first_policy_is_trained_compared_and_can_be_played(tmp_path):
    words = ("--timesteps", "1024", "--num-envs", "16", "--episodes", "8", "--perception", "truth")
    printed = run("first_policy.py", *words, "--out", str(tmp_path / "first"))
    interval = r"-?[\d.]+ \(-?[\d.]+ to -?[\d.]+\)"
    rows = re.findall(rf"^(\w[\w, ]+?) {{2,}}{interval} +{interval} +{interval}$", printed, re.M)
    assert rows == ["scripted", "policy", "policy, shield qp"]
    assert len(re.findall(rf"^cost of \(.+\) minus \(.+\): {interval}$", printed, re.M)) == 2
    policy = str(tmp_path / "first" / "policy.zip")
    assert hrc_env.evaluate(policy, 1, perception="truth").episodes == 1


@pytest.mark.parametrize("pretrain", ["0", "256"])
def test_ppo_from_images_runs_and_draws_its_curve(pretrain, tmp_path):
    words = ("--num-envs", "4", "--timesteps", "1100", "--out", str(tmp_path / "run"))
    said = run("ppo_from_images.py", *words, "--pretrain", pretrain)
    assert re.search(r"1280 steps .* goals a minute", said)
    assert ("the convolutions find the tool to" in said) == (pretrain != "0")
    assert (tmp_path / "run" / "curve.png").stat().st_size > 5000


@pytest.mark.skipif(importlib.util.find_spec("torchrl") is None, reason="torchrl is not installed")
def test_the_torchrl_ppo_runs():
    assert re.search(r"3072 steps in \d+ s", run("ppo_torchrl.py", *SMALL))


@pytest.mark.skipif(
    importlib.util.find_spec("fsrl") is None,
    reason="FSRL is not installed: examples/ppo_lagrangian_fsrl.py says how",
)
def test_fsrl_learns_with_our_cost_and_is_judged_as_ours_are():
    words = ("--timesteps", "2000", "--perception", "truth", "--episodes", "2")
    said = run("ppo_lagrangian_fsrl.py", *words, "--cost-limit", "1")
    (value,) = re.findall(r"2000 steps in \d+ s, lambda ([\d.]+)", said)
    assert float(value) > 0
    assert len(re.findall(r"^\w+: cost [\d.]+, goals/min [\d.]+$", said, re.M)) == 2


@pytest.mark.usefixtures("brought")  # so that the estimator is gone afterwards
def test_an_estimator_is_compared_in_accuracy_and_in_safety(tmp_path):
    words = ("--episodes", "8", "--safety-episodes", "8", "--out", str(tmp_path / "report"))
    text = run("compare_estimator.py", *words)
    number = r"(-?[\d.]+) \(-?[\d.]+ to -?[\d.]+\)"
    scores = {name: [float(value) for value in values] for name, *values in re.findall(
        rf"^(\w+) +{number} +{number} +([\d.]+)$", text, re.M)}  # fmt: skip
    assert list(scores) == ["dlt_kalman", "triangulation", "particle"]
    for error_mm, coverage, tracked in scores.values():
        assert 10 < error_mm < 60
        assert 70 < coverage < 100
        assert tracked > 95
    ((error_mm, coverage),) = re.findall(rf"^first - last +{number} +{number}$", text, re.M)
    assert float(error_mm) == pytest.approx(
        scores["dlt_kalman"][0] - scores["particle"][0], abs=0.11
    )
    assert float(coverage) == pytest.approx(
        scores["dlt_kalman"][1] - scores["particle"][1], abs=0.11
    )
    assert (
        len(re.findall(r"^\| (?:dlt_kalman|triangulation|particle) \| [\d.]+ \(", text, re.M)) == 3
    )


def load(name: str):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_advantages_bootstrap_a_truncated_episode_and_not_a_failed_one():
    """Environment 0 is truncated by its second step and 1 fails then; the third step resets."""
    rollout = load("ppo_cleanrl_style").Rollout(4, 2, 1, 1)
    rollout.reward[:] = torch.tensor([[1.0, 1.0], [2.0, 2.0], [0.0, 0.0], [3.0, 3.0]])
    rollout.value[:] = torch.tensor([[10.0, 10.0], [20.0, 20.0], [30.0, 30.0], [40.0, 40.0]])
    rollout.done[1] = True
    rollout.terminated[1, 1] = True
    advantage = rollout.advantages(torch.tensor([50.0, 50.0]), gamma=0.5, gae_lambda=0.5)
    last = [3 + 0.5 * 50 - 40] * 2
    ends = [2 + 0.5 * 30 - 20, 2 + 0.0 - 20]
    first = [1 + 0.5 * 20 - 10 + 0.25 * end for end in ends]
    np.testing.assert_allclose(advantage[[0, 1, 3]], [first, ends, last])


def test_reset_steps_are_no_experience():
    """Whatever stands in the rows of resets, the policy learns the same."""
    ppo = load("ppo_cleanrl_style")
    learnt = []
    for junk in (0.0, 100.0):
        torch.manual_seed(0)
        policy, rollout = ppo.Policy(3, 2), ppo.Rollout(8, 4, 3, 2)
        for column in (rollout.observation, rollout.action, rollout.reward):
            column.normal_()
        rollout.done[3], rollout.is_reset[4] = True, True
        rollout.action[4], rollout.log_prob[4] = junk, junk
        optimiser = torch.optim.Adam(policy.parameters())
        ppo.update(policy, optimiser, rollout, torch.zeros(4), ppo.Arguments(batch_size=8))
        learnt.append(policy.state_dict())
    assert all(torch.equal(learnt[0][name], learnt[1][name]) for name in learnt[0])
