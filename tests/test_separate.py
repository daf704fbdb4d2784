"""Policies in processes of their own: the same numbers, and nothing of the judge in their reach."""

import hashlib
import os
import socket
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT
from experiments import cheats
from stable_baselines3 import PPO

import hrc_env
from hrc_env.__main__ import main
from hrc_env.agents import confinement, separate
from hrc_env.agents.registry import make_agent
from hrc_env.agents.separate import SeparateAgent, SeparateProcess
from hrc_env.agents.submission import read_submission
from hrc_env.core.errors import AgentError, ConfigError, HRCError
from hrc_env.evaluation.episodes import evaluate_episodes, play_one_by_one

needs_landlock = pytest.mark.skipif(
    not confinement.find_version(), reason="this kernel has no Landlock"
)
SHORT = {"perception": "none", "max_episode_steps": 30}


def play(make, **kwargs):
    """The episodes of an agent, short ones."""
    return evaluate_episodes(make, 3, engine="serial", **{**SHORT, **kwargs})


def apart(policy):
    return SeparateProcess(read_submission(policy))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory, with the cheats and a secret file in the folder beside it."""
    own, secret = tmp_path / "own", tmp_path / "judge" / "secret"
    own.mkdir()
    secret.parent.mkdir()
    secret.write_text("seed 17")
    text = Path(cheats.__file__).read_text().replace("/SECRET", str(secret))
    (own / "cheats.py").write_text(text)
    monkeypatch.chdir(own)
    return secret.parent


@pytest.fixture
def env_info():
    with closing(hrc_env.HRCVectorEnv(2, perception="none")) as env:
        return hrc_env.env_info(env)


@pytest.fixture
def ask(folder, env_info):
    """Lets a cheat act once."""

    def run(name):
        agent = apart(f"cheats:{name}")(env_info)
        try:
            return agent.act(np.zeros((2, len(env_info.layout.low)), np.float32))
        finally:
            agent.close()

    return run


@pytest.mark.parametrize("policy", ["scripted", "random", "hrc://HRCReach-v0/fast"])
def test_numbers_are_those_of_an_agent_in_this_process(policy):
    assert play(apart(policy)) == play(policy)


def test_numbers_of_a_checkpoint_are_the_same(tmp_path):
    PPO("MlpPolicy", hrc_env.HRCVecEnv(2, perception="none"), n_steps=8).save(tmp_path / "a.zip")
    policy = str(tmp_path / "a.zip")
    assert play(apart(policy)) == play(policy)


def test_numbers_are_the_same_with_goals_beside_and_one_by_one():
    task = "HRCReachGoal-v0"
    assert play(apart("scripted"), task=task) == play("scripted", task=task)
    one, two = (
        play_one_by_one(make, 2, 7, task=task, **SHORT)
        for make in (apart("scripted"), lambda info: make_agent("scripted", info))
    )
    assert one == two


def test_a_command_evaluates_separately(capsys):
    words = ["evaluate", "--agent", "random", "--episodes", "2", "--perception", "none"]
    said = []
    for more in ([], ["--separate"]):
        assert main([*words, *more]) == 0
        said.append(capsys.readouterr().out)
    assert said[0] == said[1]
    assert "return_mean" in said[0]


FINDER = """
import numpy as np
from hrc_env.core.kernels.signatures import recorded


class Finder:
    def __init__(self, env_info):
        self.n = env_info.n_actions

    def act(self, observation):
        found = all(each.is_compiled() for each in recorded("none first"))
        return np.full((len(observation), self.n), float(found))
"""


def test_compiled_kernels_are_found_in_the_process_of_a_policy(folder, env_info):
    Path("finder.py").write_text(FINDER)
    agent = apart("finder:Finder")(env_info)
    with closing(agent):
        assert agent.act(np.zeros((2, len(env_info.layout.low)), np.float32)).all()


FORGERS = ("Collector", "FrameWalker", "Patcher")


@pytest.mark.parametrize("name", FORGERS)
def test_a_cheat_does_not_change_the_score(name, folder):
    assert play(apart(f"cheats:{name}")) == play("scripted")


@pytest.mark.parametrize("name", FORGERS)
def test_each_cheat_works_without_a_process_of_its_own(name, folder, process):
    """If not, the test above could not fail."""
    script = (
        "from hrc_env.evaluation.episodes import evaluate_episodes\n"
        f"made = evaluate_episodes('cheats:{name}', 3, engine='serial', **{SHORT!r})\n"
        "print(min(each['r'] for each in made))"
    )
    done = process("-c", script, PYTHONPATH=os.pathsep.join([str(ROOT), os.getcwd()]))
    assert float(done.stdout) > cheats.FORGED / 2, done.stderr


def test_the_process_has_no_object_of_the_judge(ask):
    assert not ask("Searcher").any()


@needs_landlock
@pytest.mark.parametrize(
    "name",
    ["Reader", "Lister", "Writer", "Adder", "Remover", "Spawner", "LinkReader", "RootReader",
     "MemoryReader", "MemoryCaller", "ArgumentReader", "Tracer", "PackageWriter"],
)  # fmt: skip
def test_the_process_reaches_no_file_and_no_memory_of_the_judge(name, ask, folder):
    assert not ask(name).any()
    assert [each.name for each in folder.iterdir()] == ["secret"]
    assert (folder / "secret").read_text() == "seed 17"


@needs_landlock
def test_the_process_reaches_no_server(ask, folder):
    if confinement.find_version() < 4:
        pytest.skip("this kernel's Landlock does not know connections")
    with socket.create_server(("127.0.0.1", 0)) as server:
        path = Path("cheats.py")
        path.write_text(path.read_text().replace("PORT = 0", f"PORT = {server.getsockname()[1]}"))
        assert not ask("Dialer").any()


def test_the_process_knows_no_secret_variable(ask, monkeypatch):
    monkeypatch.setenv("HRC_TEST_SECRET", "17")
    assert not ask("EnvironmentReader").any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Nan", "must be finite, got 1 of 12 numbers"),
        ("Infinite", "must be finite, got 12 of 12 numbers"),
        ("WrongShape", r"numbers of shape \(2, 6\), got <f4 of shape \[3, 6\]"),
        ("Scalar", r"numbers of shape \(2, 6\), got <f8 of shape \[\]"),
        ("Huge", r"numbers of shape \(2, 6\), got <f4 of shape \[100000, 1000\]"),
        ("Words", "it raised ValueError: could not convert string to float"),
        (
            "Raiser",
            r"it raised ValueError: no idea \[31m\. Its last output: .*cheats.py\", line \d+",
        ),
        ("Leaver", "its process ended with status 3. Its last output: leaving now"),
        ("Crasher", "its process ended with SIGSEGV"),
        ("LongHeader", "a header of 4,294,967,295 bytes; at most 65,536"),
        ("NoJson", "its process sent"),
        ("NoObject", "no JSON object but list"),
        ("Nested", "nested too deeply"),
        ("Pickle", "its process sent"),
        ("ObjectKind", r"numbers of shape \(2, 6\), got \|O of shape \[2, 6\]"),
    ],
)
def test_what_a_policy_must_not_do_ends_it_with_words(name, says, ask, folder):
    with pytest.raises(AgentError, match=rf"The policy 'cheats:{name}' failed: .*{says}"):
        ask(name)
    assert [each.name for each in folder.iterdir()] == ["secret"]


@pytest.mark.parametrize("name", ["Sleeper", "Incomplete"])
def test_a_policy_that_does_not_answer_is_ended(name, ask, monkeypatch):
    monkeypatch.setattr(separate, "ANSWER_S", 0.5)
    with pytest.raises(AgentError, match=r"did not answer in time \(0.5 s for an answer"):
        ask(name)


def test_a_policy_that_does_not_start_is_ended(ask, monkeypatch):
    monkeypatch.setattr(separate, "START_S", 3.0)
    with pytest.raises(AgentError, match="did not answer in time"):
        ask("Late")


def test_a_policy_may_talk(ask):
    assert ask("Talker").shape == (2, 6)


def test_a_process_and_its_folder_end_with_the_episodes(folder, monkeypatch):
    started = []
    start = separate._start

    def remember(own, *given):
        started.append((own, start(own, *given)))
        return started[-1][1]

    monkeypatch.setattr(separate, "_start", remember)
    play(apart("scripted"))
    with pytest.raises(AgentError):
        play(apart("cheats:Leaver"))
    assert len(started) == 2
    for own, process in started:
        assert process.returncode is not None
        assert not own.exists()


def test_a_judge_requires_that_processes_can_be_confined(env_info, monkeypatch):
    monkeypatch.setattr(confinement, "find_version", lambda: 0)
    made = SeparateProcess(read_submission("scripted"), must_confine=True)
    with pytest.raises(HRCError, match="which this kernel lacks"):
        made(env_info)
    agent = SeparateAgent(SeparateProcess(read_submission("scripted")), env_info)
    agent.close()


def test_the_digest_is_that_of_the_files(folder):
    content = Path("cheats.py").read_bytes()
    one = read_submission("cheats:Nan")
    assert one.sha256 == hashlib.sha256(content).hexdigest()
    os.makedirs("many")
    Path("many/__init__.py").write_text("from .inner import make\n")
    Path("many/inner.py").write_text("from cheats import Reporter as make\n")
    Path("many/weights.bin").write_bytes(b"\0")
    files = read_submission("many.inner:make").files
    assert sorted(files) == ["many/__init__.py", "many/inner.py", "many/weights.bin"]
    before = read_submission("many:make").sha256
    Path("many/weights.bin").write_bytes(b"\1")
    assert read_submission("many:make").sha256 != before
    Path("many/link.bin").symlink_to("weights.bin")
    with pytest.raises(ConfigError, match=r"many/link.bin must be a file of its own"):
        read_submission("many:make")


def test_reading_a_policy_runs_nothing_of_it(folder):
    Path("loud.py").write_text("raise RuntimeError('imported')\n")
    assert read_submission("loud:make").files == {"loud.py": b"raise RuntimeError('imported')\n"}
    with pytest.raises(ConfigError, match=r"no file nowhere\.py in the working directory"):
        read_submission("nowhere:make")


@pytest.mark.parametrize("version", [0, None], ids=["without Landlock", "with Landlock"])
def test_a_policy_sees_its_own_files_only(version, folder, env_info, monkeypatch):
    """A digest of one file says nothing of another one that it imports."""
    if version is not None:
        monkeypatch.setattr(confinement, "find_version", lambda: version)
    Path("alone.py").write_text("from cheats import Reporter as make\n")
    with pytest.raises(AgentError, match="No module named 'cheats'"):
        apart("alone:make")(env_info)
    os.makedirs("many")
    Path("many/__init__.py").write_text("from .inner import make\n")
    Path("many/inner.py").write_text(Path("cheats.py").read_text() + "\nmake = Reporter\n")
    agent = apart("many:make")(env_info)
    assert not agent.act(np.zeros((2, len(env_info.layout.low)), np.float32)).any()
    agent.close()


def test_a_file_that_changes_after_it_was_read_does_not_act(folder, env_info):
    submission = read_submission("cheats:Reporter")
    Path("cheats.py").write_text("raise RuntimeError('changed')\n")
    SeparateProcess(submission)(env_info).close()
