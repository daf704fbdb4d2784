"""Policies as files: they act as their learner did, need none, and what does not fit is refused."""

import hashlib
import json
import pickle
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tyro
from commands import ROOT, called
from safetensors.numpy import load, save
from stable_baselines3 import PPO, SAC
from test_extras import WITHOUT

from hrc_env.__main__ import main
from hrc_env.agents import checkpoints, policies, ppo, sac
from hrc_env.agents.env_info import env_info
from hrc_env.agents.export import extract_network, format_command
from hrc_env.agents.network import Architecture, Network
from hrc_env.agents.recipes import fill_in
from hrc_env.agents.registry import make_agent
from hrc_env.agents.requests import TrainingRequest
from hrc_env.cli.options import normalize_words
from hrc_env.core.errors import CheckpointError, ConfigError
from hrc_env.env import HRCEnv
from hrc_env.safety.shield import SHIELDS
from hrc_env.sb3 import HRCVecEnv

pytestmark = pytest.mark.slow  # a learner is trained

NEAR_QP = '{"kind": "qp", "margin_m": 0.1}'
TINY = ["--perception", "truth", "--num-envs", "4", "--episodes", "2", "--no-film"]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A run of two rollouts."""
    folder = tmp_path_factory.mktemp("run") / "tiny"
    done = called(ROOT / "train.py", *TINY, "--timesteps", 512, "--seed", 3, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def exported(run) -> Path:
    """Its policy as a file."""
    words = ["export", str(run), "--name", "tiny", "--episodes", "3", "--shields", "none"]
    assert main([*words, "--out", str(run / "policies")]) == 0
    return run / "policies" / "HRCReach-v0" / "tiny.safetensors"


@pytest.fixture
def own(exported, tmp_path) -> Path:
    """A copy to spoil."""
    for each in (exported, exported.with_suffix(".json")):
        shutil.copy(each, tmp_path)
    return tmp_path / exported.name


def here(**kwargs):
    env = HRCEnv(**{"perception": "truth", **kwargs})
    return env_info(env.simulation)


def asked_by(line: str) -> TrainingRequest:
    """What a command line asks for."""
    words = shlex.split(line.removeprefix("python -m hrc_env train"))
    words = normalize_words(TrainingRequest, words, "train")
    return tyro.cli(TrainingRequest, args=words, config=(tyro.conf.OmitArgPrefixes,))


def spoil(path: Path, **fields: object) -> None:
    """Write other fields into a card."""
    card = json.loads(path.with_suffix(".json").read_text())
    path.with_suffix(".json").write_text(json.dumps({**card, **fields}))


def test_a_policy_acts_as_its_checkpoint(run, exported):
    env = HRCEnv(perception="truth")
    seen = np.stack([env.reset(seed=seed)[0] for seed in range(3)])
    policy, trained = (
        make_agent(str(path), here()).act(seen) for path in (exported, run / "policy.zip")
    )
    np.testing.assert_allclose(policy, trained, atol=1e-5)
    assert policy.dtype == np.float32
    assert exported.stat().st_size < 1e6


def test_its_card_says_what_made_it_and_what_it_is_worth(run, exported):
    card, _ = policies.read(exported)
    asked = asked_by(card.command)
    assert (asked.perception, asked.num_envs, asked.timesteps, asked.seed) == ("truth", 4, 512, 3)
    assert (card.task, card.control, card.seed, card.timesteps) == ("HRCReach-v0", "joint", 3, 512)
    assert card.commit == json.loads((run / "run.json").read_text())["git"]
    (worth,) = card.worth
    assert (worth.shield, worth.episodes, worth.cost_per_episode.n) == ("none", 3, 3)
    assert np.isnan(worth.cost_per_episode.low), "three episodes have no interval"


def test_who_learnt_under_a_shield_is_judged_under_it_and_without(tmp_path, monkeypatch):
    """The shield lets nothing move, and is there after a pause, too."""
    monkeypatch.setitem(SHIELDS, "still", lambda now, wanted, dt_s: (0 * wanted, {}))
    run, words = tmp_path / "run", [*TINY, "--people", "headlong", "--timesteps"]
    assert main(["train", *words, "256", "--shield", "still", "--out", str(run)]) == 0
    assert main(["train", *TINY, "--resume", str(run), "--timesteps", "512"]) == 0
    assert checkpoints.describe(run / "policy.zip")["environment"]["shield"] == "still"
    out = ["--episodes", "8", "--shields", "none", NEAR_QP, "--out", str(tmp_path)]
    assert main(["export", str(run), "--name", "tame", *out]) == 0
    card, _ = policies.read(tmp_path / "HRCReach-v0" / "tame.safetensors")
    still, free, near = card.worth
    assert (still.shield, free.shield, near.shield) == ("still", "none", NEAR_QP)
    assert still.cost_per_episode != free.cost_per_episode
    assert "--shield still" in card.command


def test_the_command_of_a_card_asks_for_the_same():
    asked = TrainingRequest(
        n_workers=("1", "2"), cost_limit=30.0, algorithm="ppo_lagrangian", film=False,
        config=("reward.effort=0.1", "tracker.lost_after_s=1"),
    )  # fmt: skip
    said = format_command(asked)
    assert asked_by(said) == replace(asked, film=True)
    assert format_command(TrainingRequest()) == "python -m hrc_env train"


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCReachGoal-v0"])
@pytest.mark.parametrize("kind", ["ppo", "ppo near and far", "sac"])
def test_networks_of_every_kind_act_as_their_learners(task, kind):
    env = HRCVecEnv(4, task=task, perception="none", n_workers=0, control="tool")
    settings = ppo.PPOSettings(near_and_far="far" in kind, hidden=(16, 16))
    if kind == "sac":
        learner: PPO | SAC = sac.make_learner(env, sac.SACSettings(hidden=(16, 16)), 0)
    else:
        learner = ppo.make_learner(env, settings, 0)
    for layer in learner.policy.parameters():
        layer.data *= 4
    observation = env.reset()
    network = Network(*extract_network(learner))
    expected = learner.predict(observation, deterministic=True)[0]
    np.testing.assert_allclose(network.act(observation), expected, atol=2e-5)
    assert np.abs(expected).max() > 0.05


def test_a_policy_needs_no_learner(exported, process):
    code = "from hrc_env.__main__ import main; sys.exit(main())"
    words = ["play", "--perception", "truth", "--agent", str(exported)]
    done = process("-c", WITHOUT + code, *words, cwd=ROOT)
    assert done.returncode == 0, done.stderr


def test_an_address_is_a_file_of_the_package(exported, tmp_path, monkeypatch):
    monkeypatch.setattr(policies, "FOLDER", exported.parent.parent)
    assert policies.list_names() == ("hrc://HRCReach-v0/tiny",)
    assert isinstance(make_agent("hrc://HRCReach-v0/tiny", here()), Network)
    with pytest.raises(ConfigError, match="Did you mean 'hrc://HRCReach-v0/tiny'"):
        make_agent("hrc://HRCReach-v0/tony", here())
    with pytest.raises(ConfigError, match="'hrc://HRCReach-v0/tiny'"):
        make_agent("hrc://HRCReach-v0/../../x", here())
    monkeypatch.setattr(policies, "FOLDER", tmp_path)
    with pytest.raises(ConfigError, match="The package contains no policies yet"):
        make_agent("hrc://HRCReach-v0/tiny", here())


@pytest.mark.parametrize(
    ("kwargs", "says"),
    [
        ({"task": "HRCPickPlace-v0"}, "its task is HRCReach-v0, but here it is HRCPickPlace-v0"),
        ({"control": "tool"}, "its control is joint, but here it is tool"),
        ({"n_workers": 2}, "worker_joints_from_tool has 45 entries of 1, but here 90 entries of 1"),
        ({"n_workers": 0}, "worker_joints_from_tool has 45 entries of 1, but here no entries"),
        (
            {"config": {"forecast_s": [0.2]}},
            "worker_joints_forecast has no entries, but here 45 entries",
        ),
    ],
)
def test_a_policy_for_another_environment_is_refused_in_words(exported, kwargs, says):
    with pytest.raises(CheckpointError, match="does not fit this environment") as refused:
        make_agent(str(exported), here(**kwargs))
    assert says in str(refused.value)
    assert "trained by: python -m hrc_env train" in str(refused.value)


def test_another_order_or_scale_of_terms_is_refused(exported):
    card, info = policies.read(exported)[0], here()
    assert policies.list_differences(card, info) == []
    turned = replace(card, observation=card.observation[::-1])
    assert policies.list_differences(turned, info) == [
        "the terms of its observation have a different order"
    ]
    finer = replace(card.observation[0], scale=0.5), *card.observation[1:]
    (said,) = policies.list_differences(replace(card, observation=finer), info)
    assert "6 entries of 0.5, but here 6 entries of 1" in said


def test_a_damaged_file_is_refused(own):
    content = bytearray(own.read_bytes())
    content[-1] ^= 1
    own.write_bytes(content)
    with pytest.raises(CheckpointError, match="is damaged or does not belong to its model card"):
        make_agent(str(own), here())


def test_a_pickled_file_is_not_read(own, run):
    class Bad:
        def __reduce__(self):
            return pytest.fail, ("it was run",)

    for content in (pickle.dumps(Bad()), (run / "policy.zip").read_bytes()):
        own.write_bytes(content)
        with pytest.raises(
            CheckpointError, match="is a pickle, which could execute arbitrary code"
        ):
            make_agent(str(own), here())


def test_files_that_are_no_policies_say_so(own, tmp_path):
    with pytest.raises(CheckpointError, match=r"missing\.safetensors is missing"):
        make_agent(str(tmp_path / "missing.safetensors"), here())
    whole = own.read_bytes()
    for content, says in (
        (b"junk of no form", "is not a policy"),
        (save({"other": np.zeros(3, "f4")}), "is not a policy: 'actor.0.weight'"),
        (save({k: v[..., :-1].copy() if k == "actor.0.weight" else v
               for k, v in load(whole).items()}), "its card describes"),
    ):  # fmt: skip
        own.write_bytes(content)
        spoil(own, sha256=hashlib.sha256(content).hexdigest())
        with pytest.raises(CheckpointError, match=says):
            make_agent(str(own), here())
    spoil(own, n_actions="six")
    with pytest.raises(
        CheckpointError, match="is not a model card of a policy: Config field n_actions"
    ):
        make_agent(str(own), here())
    own.with_suffix(".json").unlink()
    with pytest.raises(CheckpointError, match=r"tiny\.json is missing"):
        make_agent(str(own), here())


def test_an_activation_that_nobody_knows_is_refused():
    with pytest.raises(ConfigError, match="Unknown activation 'gelu'"):
        Architecture("gelu", near_and_far=False, squashed=False)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["RUN", "--name", "Tiny"], "must consist of lowercase letters, digits and _"),
        (["RUN", "--name", "tiny"], "exists already; choose another --name"),
        (["nowhere", "--name", "tiny"], "contains no training run"),
        (["RUN", "--name", "tiny", "--episodes", "0"], "--episodes must be 1 or more"),
        (["RUN", "--name", "other", "--shields", "qq"], "Unknown shield 'qq'"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_words(words, says, run, exported, capsys):
    words = [str(run) if word == "RUN" else word for word in words]
    assert main(["export", *words, "--out", str(run / "policies")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_policies_of_the_package_are_whole_and_small():
    for address in policies.list_names():
        path = policies.find_path(address)
        card, _ = policies.read(path)
        assert card.task == path.parent.name
        assert path.stat().st_size < 1.5e6
        assert card.worth
        kwargs = fill_in(asked_by(card.command)).keywords()
        del kwargs["num_threads"]
        assert policies.list_differences(card, here(**kwargs)) == []


def test_who_plays_a_policy_need_not_say_what_its_actions_are(capsys):
    policy = "hrc://HRCDrywall-v0/cloned"
    command = ["play", "HRCDrywall-v0", "--perception", "truth", "--agent", policy]
    assert main(command) == 0
    assert "screws driven" in capsys.readouterr().out
    assert main([*command, "--control", "joint"]) == 2
    assert "its control is twist, but here it is joint" in capsys.readouterr().err
