"""Agents, checkpoints, policies and runs that are wrong in one thing only are refused."""

import hashlib
import json
import shutil
import sys
import zipfile
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from hrc_env import __version__
from hrc_env.agents import acting, policies
from hrc_env.agents.callbacks import Ramp
from hrc_env.agents.env_info import EnvInfo, env_info
from hrc_env.agents.experts import make_expert
from hrc_env.agents.recording import _check_same_request
from hrc_env.agents.registry import find_control, make_agent
from hrc_env.agents.requests import RecordingRequest, TrainingRequest
from hrc_env.agents.training import read_arguments, restore_arguments
from hrc_env.core.errors import CheckpointError, ConfigError
from hrc_env.env import HRCEnv
from hrc_env.evaluation.episodes import evaluate
from hrc_env.tasks.goal import ACHIEVED

MAJOR, MINOR, *_ = __version__.split(".")
NEXT = int(MINOR) + 1
KEPT = next(name for name in policies.list_names() if name.startswith("hrc://HRCReach-v0/"))


@pytest.fixture(scope="module")
def here() -> EnvInfo:
    """What an agent may know of an environment as the task is made for."""
    return env_info(HRCEnv("HRCReach-v0", perception="truth").simulation)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A copy of a policy that comes with the package."""
    path = policies.find_path(KEPT)
    for each in (path, path.with_suffix(".json")):
        shutil.copy(each, tmp_path)
    return tmp_path / path.name


def made(meta: dict[str, object] | None, path: Path) -> Path:
    """Write a checkpoint that says this of itself; None: it says nothing."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", "{}")
        if meta is not None:
            archive.writestr("hrc_env.json", json.dumps(meta))
    return path


def read_meta(**changes: object) -> dict[str, object]:
    """Return what a checkpoint for 7 entries and 3 actions says of itself."""
    sizes = {"observation_size": 7, "action_size": 3}
    return {"hrc_env": __version__, "num_timesteps": 512, **sizes} | changes


@pytest.mark.parametrize(
    ("changes", "size", "said"),
    [
        ({}, 7, ""),
        ({"hrc_env": f"{MAJOR}.{MINOR}.99"}, 7, ""),
        ({"hrc_env": f"{MAJOR}.{NEXT}.0"}, 7, "was made with hrc_env"),
        ({"hrc_env": f"{int(MAJOR) + 1}.{MINOR}.0"}, 7, "was made with hrc_env"),
        ({"observation_size": 8}, 7, "expects observations 8 and actions 3"),
        ({"action_size": 4}, 7, "expects observations 7 and actions 4"),
        ({"observation_size": {"observation": 7}}, 7, "expects observations"),
        ({"observation_size": {"observation": 7}}, {"observation": 7}, ""),
        ({"observation_size": {"observation": 7}}, {"observation": 7, "goal": 3}, "expects obs"),
    ],
)
def test_a_checkpoint_fits_what_it_was_made_for(changes, size, said):
    meta = read_meta(**changes)
    if not said:
        acting.check_fits(Path("it.zip"), meta, size, 3)
        return
    with pytest.raises(CheckpointError, match=rf"it\.zip {said}"):
        acting.check_fits(Path("it.zip"), meta, size, 3)


def test_what_is_no_checkpoint_says_so(tmp_path):
    assert acting.describe(made(read_meta(), tmp_path / "good.zip")) == read_meta()
    with pytest.raises(CheckpointError, match=r"none\.zip\. Train one"):
        acting.describe(tmp_path / "none.zip")
    (tmp_path / "junk.zip").write_text("junk")
    for path in (tmp_path / "junk.zip", made(None, tmp_path / "other.zip")):
        with pytest.raises(CheckpointError, match=f"{path.name} is not a checkpoint of hrc_env"):
            acting.describe(path)


def test_a_run_goes_on_where_there_is_more_to_learn(tmp_path):
    with pytest.raises(CheckpointError, match=r"contains no training run: .*run\.json is missing"):
        read_arguments(tmp_path)
    (tmp_path / "run.json").write_text(json.dumps({"arguments": {"timesteps": 512, "seed": 3}}))
    assert (read_arguments(tmp_path).timesteps, read_arguments(tmp_path).seed) == (512, 3)
    made(read_meta(), tmp_path / "policy.zip")
    assert restore_arguments(TrainingRequest(timesteps=513), tmp_path).timesteps == 513
    for wanted in (512, 1, None):
        with pytest.raises(CheckpointError, match="was already trained for 512 steps"):
            restore_arguments(TrainingRequest(timesteps=wanted), tmp_path)
    made(read_meta(num_timesteps=511), tmp_path / "policy.zip")
    assert restore_arguments(TrainingRequest(), tmp_path).timesteps == 512
    (tmp_path / "run.json").write_text(json.dumps({"arguments": {"timesteps": None}}))
    made(read_meta(num_timesteps=0), tmp_path / "policy.zip")
    with pytest.raises(CheckpointError, match="was already trained for 0 steps"):
        restore_arguments(TrainingRequest(), tmp_path)


def test_a_ramp_takes_no_time_at_the_least():
    assert Ramp(0).at(0) == 1.0
    with pytest.raises(ConfigError, match="0 or more environment steps, got -1"):
        Ramp(-1)


def test_a_record_goes_on_with_the_same_arguments_only(tmp_path):
    asked = RecordingRequest(out="own-v0")
    _check_same_request(asked, tmp_path)
    _check_same_request(asked, tmp_path)
    with pytest.raises(ConfigError, match="were recorded with other arguments"):
        _check_same_request(replace(asked, seed=asked.seed + 1), tmp_path)


def test_an_expert_is_one_of_those_that_are_written(here):
    assert callable(make_expert(here).act)
    with pytest.raises(ConfigError, match="no scripted agent for HRCTend-v0"):
        make_expert(replace(here, task="HRCTend-v0"))


@pytest.fixture
def agents_of_mine(monkeypatch):
    """A module of one's own, with what makes an agent, and what does not."""
    module = ModuleType("agents_of_mine")
    module.good = lambda info: SimpleNamespace(act=lambda observation: info.n_actions)
    module.lame = lambda info: SimpleNamespace(act=3)
    module.none = lambda info: None
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module.__name__


@pytest.mark.parametrize("name", ["random", "scripted", "scripted_slowed", KEPT])
def test_an_agent_is_called_by_its_name(here, name):
    assert callable(make_agent(name, here).act)


def test_an_agent_is_called_by_what_makes_it(here, agents_of_mine):
    assert make_agent(f"{agents_of_mine}:good", here).act(None) == here.n_actions


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("randm", "Did you mean 'random'"),
        ("slowed", "Unknown agent"),
        ("agents_of_mine:gone", "There is no agent 'agents_of_mine:gone'"),
        ("agents_of_yours:good", "There is no agent 'agents_of_yours:good'"),
        ("agents_of_mine:lame", "made SimpleNamespace, which has no act"),
        ("agents_of_mine:none", "made NoneType, which has no act"),
        ("hrc://HRCReach-v0/none", "Unknown policy"),
    ],
)
def test_an_agent_that_there_is_not_is_refused(here, agents_of_mine, name, said):
    with pytest.raises(ConfigError, match=said):
        make_agent(name, here)


@pytest.mark.parametrize("name", ["", " ", None, 3])
def test_an_agent_without_a_name_is_refused(here, name):
    with pytest.raises(ConfigError, match="'scripted_slowed'"):
        make_agent(name, here)


def test_a_folder_is_no_agent_and_that_of_a_run_says_what_is_meant(here, tmp_path):
    with pytest.raises(ConfigError, match=r"is a folder\. Valid: 'random'"):
        make_agent(str(tmp_path), here)
    made(read_meta(), tmp_path / "policy.zip")
    with pytest.raises(ConfigError, match=r"is a folder\. Did you mean '.*policy\.zip'\?"):
        make_agent(str(tmp_path), here)


def test_what_is_called_must_be_a_function(here, agents_of_mine):
    sys.modules[agents_of_mine].number = 3
    with pytest.raises(ConfigError, match="agents_of_mine:number must be a function of an EnvInfo"):
        make_agent(f"{agents_of_mine}:number", here)


def test_a_module_in_the_working_folder_is_found(here, tmp_path, monkeypatch):
    """Also where the command is a script, whose own folder is the first of the path."""
    (tmp_path / "agents_of_the_folder.py").write_text(
        "class Still:\n    def act(self, observation):\n        return 0\n"
        "def make(info):\n    return Still()\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [each for each in sys.path if each])
    assert make_agent("agents_of_the_folder:make", here).act(None) == 0


@pytest.mark.parametrize(
    ("agent", "said"),
    [("scriptd", "Did you mean 'scripted'"), ("none_of_mine:make", "There is no agent")],
)
def test_an_evaluation_takes_names_and_refuses_those_that_there_are_not(agent, said):
    with pytest.raises(ConfigError, match=said):
        evaluate(agent, 1, perception="none")
    with pytest.raises(ConfigError, match="evaluate takes a function"):
        evaluate(None, 1)
    with pytest.raises(ConfigError, match="n_episodes must be a whole number"):
        evaluate("random", 0)
    assert evaluate("random", 1, perception="none").episodes == 1


@pytest.mark.parametrize("name", ["none.zip", "none.safetensors"])
def test_a_file_that_is_not_there_is_refused(here, tmp_path, name):
    with pytest.raises(CheckpointError, match=rf"(No .*{name}|{name} is missing)"):
        make_agent(str(tmp_path / name), here)


def test_a_file_of_another_ending_is_read_as_a_checkpoint(here, tmp_path):
    (tmp_path / "policy").write_text("junk")
    with pytest.raises(CheckpointError, match="neither a checkpoint"):
        make_agent(str(tmp_path / "policy"), here)


def test_what_actions_are_is_said_by_files_only(tmp_path):
    assert find_control("random") is None
    assert find_control(KEPT) == policies.read(policies.find_path(KEPT))[0].control
    told = made(read_meta(environment={"control": "tool"}), tmp_path / "own.zip")
    assert find_control(str(told)) == "tool"
    assert find_control(str(made(read_meta(), tmp_path / "own.zip"))) is None


def spoilt(path: Path, content: bytes | None = None, **changes: object) -> Path:
    """Change a policy's card, or its weights with what the card says of them."""
    card = path.with_suffix(".json")
    if content is not None:
        path.write_bytes(content)
        changes = {"sha256": hashlib.sha256(content).hexdigest(), **changes}
    card.write_text(json.dumps(json.loads(card.read_text()) | changes))
    return path


@pytest.mark.parametrize("name", policies.list_names())
def test_the_packages_policies_are_taken(name):
    """Of tasks with goals apart from the observation, too: their networks see more than it."""
    card, network = policies.read(policies.find_path(name))
    n_seen = sum(term.entries for term in card.observation)
    near_and_far = card.architecture.near_and_far
    goal = next((term.entries for term in card.observation if term.name == ACHIEVED), 0)
    assert network.sizes == (n_seen + near_and_far * goal, card.n_actions)


def test_a_copy_of_a_policy_is_taken(own):
    card, network = policies.read(own)
    assert network.sizes[1] == card.n_actions


@pytest.mark.parametrize(
    ("content", "changes", "said"),
    [
        (b"\x80junk", {}, "is a pickle"),
        (b"PKjunk", {}, "is a pickle"),
        (b"P", {}, "is not a policy"),
        (b"QKjunk", {}, "is not a policy"),
        (b"", {}, "is not a policy"),
        (None, {"sha256": "0" * 64}, "is damaged or does not belong to its model card"),
        (None, {"n_actions": 99}, "its card describes"),
        (None, {"n_actions": "six"}, "is not a model card of a policy"),
        (None, {"more": 1}, "is not a model card of a policy"),
    ],
)
def test_a_policy_in_which_one_thing_is_wrong_is_refused(own, content, changes, said):
    spoilt(own, content, **changes)
    with pytest.raises(CheckpointError, match=said):
        policies.read(own)


def test_a_card_of_more_or_fewer_entries_is_refused(own):
    terms = [asdict(term) for term in policies.read(own)[0].observation]
    for by in (1, -1):
        other = [*terms[:-1], terms[-1] | {"entries": terms[-1]["entries"] + by}]
        spoilt(own, observation=other)
        with pytest.raises(CheckpointError, match="its card describes"):
            policies.read(own)


@pytest.mark.parametrize("suffix", [".json", ".safetensors"])
def test_half_a_policy_is_none(own, suffix):
    own.with_suffix(suffix).unlink()
    with pytest.raises(CheckpointError, match=rf"\{suffix} is missing: a policy consists"):
        policies.read(own)


def test_a_card_that_is_no_mapping_is_none(own):
    for text in ("[]", "{", "3"):
        own.with_suffix(".json").write_text(text)
        with pytest.raises(CheckpointError, match="is not a model card of a policy"):
            policies.read(own)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"task": "HRCReachGoal-v0"}, "its task is"),
        ({"control": "other"}, "its control is"),
        ({"n_actions": 99}, "its number of actions is"),
    ],
)
def test_a_policy_acts_where_it_was_made_for(here, changes, said):
    path = policies.find_path(KEPT)
    assert callable(policies.load(path, here).act)
    with pytest.raises(CheckpointError, match=f"does not fit this environment: {said}"):
        policies.load(path, replace(here, **changes))
