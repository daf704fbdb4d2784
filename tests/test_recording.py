"""Episodes as a Minari data set: they load back as they were played, and nothing is lost."""

import sys

import gymnasium
import numpy as np
import pytest

from hrc_env.__main__ import main
from hrc_env.agents import recording
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent

minari = pytest.importorskip("minari", reason='Minari is not installed: pip install ".[minari]"')
pytest.importorskip("h5py", reason='h5py is not installed: pip install ".[minari]"')

NAME = "hrc/reach/scripted-v0"
WORDS = ["--agent", "scripted", "--perception", "truth", "--num-envs", "2", "--episodes", "3"]


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """Where Minari keeps data sets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "sets"))
    return tmp_path / "sets"


def record(task: str, *words: str, out: str = NAME) -> int:
    return main(["record", task, *WORDS, *words, "--out", out])


def played(env, seed: int):
    """What an expert's episode is, by the single environment."""
    agent = make_agent("scripted", env_info(env.unwrapped.simulation))
    observation, info = env.reset(seed=seed)
    seen, acts, rewards, costs, over = [observation], [], [], [info["cost"]], False
    while not over:
        acts.append(np.clip(agent.act(observation), -1, 1))
        observation, reward, terminated, truncated, info = env.step(acts[-1])
        seen.append(observation), rewards.append(reward), costs.append(info["cost"])
        over = terminated or truncated
    return seen, acts, rewards, costs, terminated, info["is_success"]


@pytest.mark.parametrize(
    ("task", "words"),
    [("HRCReachGoal-v0", []), ("HRCPickPlace-v0", ["--n-workers", "0", "--control", "twist"])],
)
def test_what_was_played_loads_back(task, words, root, capsys):
    """Of ends by success, at different times, and of time limits; goals apart, too."""
    assert record(task, *words, "--seed", "7") == 0
    assert f'minari.load_dataset("{NAME}")' in capsys.readouterr().out
    found = minari.load_dataset(NAME)
    assert found.total_episodes == 3
    env = found.recover_environment()
    for k, episode in enumerate(found.iterate_episodes()):
        seen, acts, rewards, costs, terminated, success = played(env, 7 + k)
        assert len(episode) == len(rewards)
        np.testing.assert_array_equal(episode.actions, acts)
        np.testing.assert_array_equal(episode.rewards, rewards)
        np.testing.assert_array_equal(episode.infos["cost"], costs)
        assert episode.infos["is_success"][-1] == success
        assert (episode.terminations[-1], episode.truncations[-1]) == (terminated, not terminated)
        assert not episode.terminations[:-1].any()
        parts = seen[0] if isinstance(seen[0], dict) else {"": seen[0]}
        for name in parts:
            whole = np.stack([each[name] if name else each for each in seen])
            kept = episode.observations[name] if name else episode.observations
            np.testing.assert_array_equal(kept, whole)
    assert list(root.rglob("*.npz")) == []
    assert [path for path in root.rglob("*") if "draft" in path.name] == []
    assert list(minari.list_local_datasets()) == [NAME]


def test_what_is_finished_when_it_is_killed_is_not_played_again(root, monkeypatch):
    """Killed in the second pair of episodes, and then while the data set is written."""
    once, plays = recording._play, []

    def counted(asked, first, n):
        plays.append(first)
        if plays == [0, 2]:
            raise KeyboardInterrupt
        return once(asked, first, n)

    monkeypatch.setattr(recording, "_play", counted)
    assert killed(lambda: record("HRCReachGoal-v0"))
    with monkeypatch.context() as patched:
        patched.setattr(minari, "create_dataset_from_buffers", interrupted)
        assert killed(lambda: record("HRCReachGoal-v0"))
    assert plays == [0, 2, 2]
    with pytest.raises(FileNotFoundError):
        minari.load_dataset(NAME)
    assert record("HRCReachGoal-v0") == 0
    assert plays == [0, 2, 2]
    assert minari.load_dataset(NAME).total_episodes == 3


def interrupted(*_, **__):
    raise KeyboardInterrupt


def killed(call) -> bool:
    try:
        return call() == 130
    except KeyboardInterrupt:
        return True


def test_a_data_set_that_there_is_stays_as_it_is(root, capsys):
    assert record("HRCReachGoal-v0") == 0
    before = {path: path.stat().st_mtime_ns for path in root.rglob("*")}
    assert record("HRCReachGoal-v0") == 2
    said = " ".join(capsys.readouterr().err.split())
    assert f"The data set '{NAME}' exists already" in said
    assert "hrc/reach/scripted-v1" in said
    assert {path: path.stat().st_mtime_ns for path in root.rglob("*")} == before


def test_a_draft_of_something_else_is_not_gone_on_with(monkeypatch, capsys):
    with monkeypatch.context() as patched:
        patched.setattr(minari, "create_dataset_from_buffers", interrupted)
        killed(lambda: record("HRCReachGoal-v0"))
    assert record("HRCReachGoal-v0", "--seed", "9") == 2
    assert "recorded with other arguments" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("name", ["scripted", "hrc/reach", "a b-v0", "../up-v0"])
def test_names_that_cannot_be_are_refused_in_words(name, capsys):
    assert record("HRCReachGoal-v0", out=name) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "as hrc/pick-place/scripted-v0" in said
    assert repr(name) in said


def test_without_minari_it_says_what_to_type(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "minari", None)
    assert record("HRCReachGoal-v0") == 2
    assert 'pip install "hrc_env[minari]"' in " ".join(capsys.readouterr().err.split())


def test_pictures_are_not_recorded(capsys):
    assert record("HRCReach-v0", "--perception", "pixels") == 2
    assert "use --perception keypoints" in " ".join(capsys.readouterr().err.split())


def test_the_environment_comes_back_with_its_arguments():
    assert record("HRCReach-v0", "--n-workers", "2", "--control", "tool") == 0
    env = minari.load_dataset(NAME).recover_environment()
    assert isinstance(env, gymnasium.Env)
    simulation = env.unwrapped.simulation
    assert (simulation.control, simulation.settings["n_workers"]) == ("tool", 2)


def test_images_and_drawn_rigs_load_back(root, pixels):
    """What each episode's cameras see, where they hang in it, beside the goals."""
    rigs = '{"max_shift_m": 0.2, "n_cameras": [2, 3]}'
    words = ["--perception", "keypoints", "--cameras", rigs, "--observe-images", "24", "32"]
    words += ["--keypoints", "--num-envs", "1", "--episodes", "2"]
    assert record("HRCReachGoal-v0", *words) == 0
    found = minari.load_dataset(NAME)
    env = found.recover_environment()
    assert env.observation_space == found.observation_space
    for k, episode in enumerate(found.iterate_episodes()):
        seen, _ = env.reset(seed=k)
        for name, value in seen.items():
            np.testing.assert_array_equal(episode.observations[name][0], value)
        hung = np.isfinite(episode.infos["keypoints"]["P"][0]).all((1, 2))
        dark = [not episode.observations[f"image_camera_{c + 1}"].any() for c in range(4)]
        np.testing.assert_array_equal(hung, np.logical_not(dark))
    env.close()
