"""Data sets in folders: belief and truth apart, images and keypoints; nothing is lost."""

import json

import gymnasium
import numpy as np
import pytest
from commands import hrc

import hrc_env
from hrc_env.agents import recording

WORDS = ["--agent", "scripted", "--num-envs", "2", "--episodes", "3"]
CAMERAS = ["--cameras", "0", "1"]


def record(folder, *words: str, task: str = "HRCReachGoal-v0"):
    return hrc("record", task, *WORDS, "--folder", str(folder), *words)


def said(done) -> str:
    return " ".join((done.stdout + done.stderr).split())


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A data set with all that can be kept, without images."""
    folder = tmp_path_factory.mktemp("sets") / "reach"
    words = ["--infos", "safety/*", "reward/*", "--poses", "--keypoints", "--seed", "7"]
    done = record(folder, *words)
    assert done.returncode == 0, done.stderr
    assert f'hrc_env.load_episodes("{folder}")' in said(done)
    return hrc_env.load_episodes(folder)


def test_an_episode_is_what_the_single_environment_plays(whole):
    env = gymnasium.make("HRCReachGoal-v0", **whole.metadata["environment"])
    episode = whole[1]
    observation, info = env.reset(seed=episode.seed)
    for t in range(len(episode)):
        for name, value in observation.items():
            np.testing.assert_array_equal(episode.observations[name][t], value)
        now = env.unwrapped.simulation
        np.testing.assert_array_equal(episode.belief["joints_world"][t], now.estimate.mean_world[0])
        np.testing.assert_array_equal(episode.keypoints.px[t], now.pipeline.measurements.px[0])
        for name in ("cost", "safety/min_separation_m"):
            assert episode.truth[name][t] == info[name]
        observation, reward, *_, info = env.step(episode.actions[t])
        assert episode.rewards[t] == reward
    assert episode.belief["reward/proximity"][-1] == info["reward/proximity"]
    assert episode.truncations[-1]
    assert episode.truth["is_success"][-1] == info["is_success"]


def test_belief_and_truth_have_names_of_their_own(whole):
    episode = whole[0]
    assert all(name.startswith(("reward/", "joints_", "age", "tracked", "unknown"))
               for name in episode.belief)  # fmt: skip
    of_truth = ("safety/", "cost", "is_success", "joints_world", "present")
    assert all(name.startswith(of_truth) for name in episode.truth)
    assert not np.array_equal(episode.belief["joints_world"], episode.truth["joints_world"])


def test_a_data_set_says_what_it_is_made_by(whole):
    about = whole.metadata
    assert about["command"].startswith("python -m hrc_env record HRCReachGoal-v0")
    assert "--poses --keypoints" in about["command"]
    assert about["seeds"] == [7, 8, 9] == [each.seed for each in whole]
    assert about["versions"]["mujoco"]
    assert about["hrc_env"] == hrc_env.__version__
    P = np.array([each["P"] for each in about["cameras"]])
    joints = whole[0].truth["joints_world"][50, 0]
    seen = P @ np.c_[joints, np.ones(15)].T
    px = (seen[:, :2] / seen[:, 2:]).swapaxes(1, 2)
    assert np.nanmedian(np.abs(px - whole[0].keypoints.px[50, :, 0])) < 10


def test_a_set_is_a_sequence(whole):
    assert len(whole) == len(list(whole)) == 3
    assert [each.seed for each in whole[1:]] == [8, 9]
    assert whole[-1].seed == 9
    with pytest.raises(IndexError, match="has 3 episodes"):
        whole[3]


def test_images_are_what_the_cameras_see(tmp_path, pixels):
    words = [*CAMERAS, "--observe-images", "32", "48", "--episodes", "1", "--num-envs", "1"]
    assert record(tmp_path / "set", *words).returncode == 0
    (episode,) = hrc_env.load_episodes(tmp_path / "set")
    first, second = (episode.observations[f"image_camera_{k}"] for k in (1, 2))
    assert first.shape == (len(episode) + 1, 32, 48, 3)
    assert first.dtype == np.uint8
    assert (first[0] != first[-1]).any()
    assert (first != second).any()


DRAWN = '{"max_shift_m": 0.2, "max_rotation_rad": 0.05, "n_cameras": [2, 3]}'


def test_drawn_rigs_are_kept_with_their_keypoints(tmp_path):
    """Frames at once and late, of each episode as its own cameras saw them."""
    late = '{"kind": "late", "cameras": ["camera_1"], "amount": [0.1, 0.2]}'
    words = ["--cameras", DRAWN, "--faults", late, "--keypoints", "--poses"]
    done = record(tmp_path / "set", *words, "--infos", "episode/*", task="HRCReach-v0")
    assert done.returncode == 0, done.stderr
    episodes = hrc_env.load_episodes(tmp_path / "set")
    env = gymnasium.make("HRCReach-v0", **episodes.metadata["environment"])
    for episode in episodes:
        hung = np.isfinite(episode.P).all((1, 2))
        env.reset(seed=episode.seed)
        rig = env.unwrapped.rig
        assert hung.sum() == len(rig) == episode.truth["episode/n_cameras"][0]
        assert np.isnan(episode.keypoints.px[:, ~hung]).all()
        assert np.isnan(episode.keypoints.time_s[:, ~hung]).all()
        assert (episode.keypoints.confidence[:, ~hung] == 0).all()
        P = np.stack([each.P for each in hrc_env.make_cameras(rig)])
        np.testing.assert_array_equal(episode.P[hung], P)
        joints = episode.truth["joints_world"][50, 0]
        seen = episode.P[hung] @ np.c_[joints, np.ones(15)].T
        px = (seen[:, :2] / seen[:, 2:]).swapaxes(1, 2)
        off_px = np.abs(px - episode.keypoints.px[50, hung, 0])
        assert np.nanmax(episode.keypoints.time_s[50, hung]) == pytest.approx(51 * 0.04)
        assert np.nanmedian(off_px) < 15
    assert len({each.P.tobytes() for each in episodes}) == len(episodes)


def test_drawn_rigs_differ_between_environments_of_a_batch():
    """Each sees what it sees alone."""
    faults = [{"kind": "late", "cameras": ["camera_1"], "amount": [0.1, 0.2]}]
    options = [{}, {"cameras": ["camera_3", "camera_1"]}, {"faults": faults}]
    envs = hrc_env.HRCVectorEnv(3, num_threads=1)
    envs.reset(seed=1, options={"each": options})
    envs.step(np.zeros((3, 6), np.float32))
    together = envs.simulation.pipeline.measurements
    for b, each in enumerate(options):
        env = hrc_env.HRCEnv(perception="keypoints")
        env.reset(seed=1 + b, options=each)
        env.step(np.zeros(6, np.float32))
        alone = env.simulation.pipeline.measurements
        np.testing.assert_array_equal(together.px[b], alone.px[0])
        np.testing.assert_array_equal(together.sigma_px[b], alone.sigma_px[0])
        if alone.time_s is not None:
            np.testing.assert_array_equal(together.time_s[b], alone.time_s[0])
    assert np.isnan(together.time_s[1, [1, 3]]).all()
    np.testing.assert_allclose(together.time_s[1, [0, 2]], 2 * 0.04)


def test_what_is_finished_when_it_is_killed_is_not_played_again(tmp_path, monkeypatch):
    once, plays = recording._play, []

    def counted(asked, first, n):
        plays.append(first)
        if plays == [0, 2]:
            raise KeyboardInterrupt
        return once(asked, first, n)

    monkeypatch.setattr(recording, "_play", counted)
    words = ["--perception", "truth"]
    assert record(tmp_path / "set", *words).returncode == 130
    assert not (tmp_path / "set").exists()
    with pytest.raises(hrc_env.ConfigError, match="the same command continues"):
        hrc_env.load_episodes(tmp_path / "set")
    assert record(tmp_path / "set", *words).returncode == 0
    assert plays == [0, 2, 2]
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
    assert len(hrc_env.load_episodes(tmp_path / "set")) == 3


BAD = {
    "infos that there are not": (["--infos", "safty/*"], "Did you mean 'safety/*'"),
    "images of no size": (["--observe-images", "0", "84"], "height of images [px] must be"),
    "images of 10,000 pixels": (
        ["--observe-images", "84", "10000"], "width of images [px] must be"),
    "images for which there is no memory": (
        ["--num-envs", "9", "--observe-images", "1024", "1024"], "at most 4 are kept in memory"),
    "keypoints without cameras": (
        ["--keypoints", "--perception", "truth"], "--perception truth has none"),
    "two places": (["--out", "hrc/reach-v0"], "A data set needs exactly one destination"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_recorded_is_refused_before_an_episode(name, tmp_path):
    words, expected = BAD[name]
    done = record(tmp_path / "set", *words)
    assert done.returncode == 2
    assert expected in said(done)
    assert list(tmp_path.iterdir()) == []


def test_a_place_is_needed_and_must_be_free(tmp_path):
    done = hrc("record", "HRCReach-v0")
    assert "A data set needs exactly one destination" in said(done)
    assert "exists already" in said(record(tmp_path))


def test_what_is_no_data_set_is_refused_in_words(tmp_path):
    for content, expected in (
        (None, "is not a folder of recorded episodes"),
        ("{", "cannot be read"),
        ("{}", "cannot be read: KeyError"),
        (json.dumps({"format": 9, "hrc_env": "9.0"}), "has format 9"),
    ):
        if content is not None:
            (tmp_path / "dataset.json").write_text(content)
        with pytest.raises(hrc_env.ConfigError, match=expected):
            hrc_env.load_episodes(tmp_path)


def test_an_episode_that_cannot_be_read_is_named(tmp_path):
    (tmp_path / "dataset.json").write_text(json.dumps({"format": 1, "episodes": 1}))
    (tmp_path / "episode_00000.npz").write_text("broken")
    with pytest.raises(hrc_env.HRCError, match=r"episode_00000.npz cannot be read"):
        hrc_env.load_episodes(tmp_path)[0]
