"""Infos: the same keys from the reset on, NumPy numbers, and words on request."""

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError
from hrc_env.core.infos import ENTRIES, entry_of, publish
from hrc_env.env import HRCEnv
from hrc_env.vector.env import HRCVectorEnv

SETTINGS = (
    {"n_workers": (0, 2)},
    {"n_workers": 0},
    {"shield": "qp", "n_workers": (0, 1)},
    {"shield": "half", "perception": "truth"},
)


@pytest.fixture(autouse=True)
def half():
    """A shield that says something else, or nothing, in other steps."""

    def shield(belief, velocities, dt_s):
        far = np.isinf(belief.separation.distance_m).all(-1)
        return velocities / 2, {"nearness": np.where(far, np.nan, 1.0)}

    hrc_env.register_shield("half", shield)


def episodes(env, n_episodes=3, n_steps=40):
    """The infos of each episode, that of the reset first."""
    for seed in range(n_episodes):
        infos = [env.reset(seed=seed)[1]]
        for _ in range(n_steps):
            infos.append(env.step(env.action_space.sample())[-1])
        yield infos


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("task", list(hrc_env.IDS)[:7])
def test_keys_are_the_same_from_the_reset_on_and_values_numbers(task, settings):
    env = gymnasium.make(task, **{"perception": "keypoints", **settings})
    env.action_space.seed(0)
    infos = [info for episode in episodes(env) for info in episode]
    assert {tuple(info) for info in infos} == {tuple(infos[0])}
    for info in infos:
        assert all(isinstance(value, np.number) for value in info.values())
        assert not any(np.isnan(value) for value in info.values())
        far = {name for name, value in info.items() if np.isinf(value)}
        assert far <= {"safety/min_separation_m", "shield/clearance_m"}
    env.close()


def test_what_was_not_measured_has_a_stand_in_beside_a_key_that_says_so():
    values = {
        name: np.array([np.nan, 2.0]) for name in ENTRIES if ENTRIES[name].stand_in is not None
    }
    told = publish({**values, "shield/own": np.array([np.nan, 1.0])})
    for name, value in values.items():
        entry = ENTRIES[name]
        assert told[name].tolist() == [entry.stand_in, value[1]]
        if entry.flag is not None:
            assert told[entry.flag].tolist() == [0.0, 1.0]
    assert told["shield/own"].tolist() == [0.0, 1.0]
    assert told["shield/own_measured"].tolist() == [0.0, 1.0]
    assert entry_of("reward/goal").stand_in is None


@pytest.mark.parametrize("make", [HRCEnv, lambda **given: HRCVectorEnv(2, **given)])
def test_names_that_come_and_go_are_refused(make):
    def shield(belief, velocities, dt_s):
        return velocities, {} if velocities.any() else {"own": np.zeros(len(velocities))}

    env = make(perception="none", shield=shield)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="missing: shield/own"):
        env.step(np.ones(env.action_space.shape, np.float32))


def test_indices_stand_for_words():
    env = HRCEnv(perception="keypoints", n_workers=(0, 3), people="unaware")
    counts = set()
    for seed in range(8):
        _, info = env.reset(seed=seed)
        words = env.words(info)
        absent = [info[f"worker_{w}/activity"] == -1 for w in range(3)]
        assert [name == "absent" for name in words["worker/activity"]] == absent
        assert [name == "absent" for name in words["worker/body"]] == absent
        counts.add(sum(absent))
        assert words["safety/contact_kind"] == words["perception/miscalibrated"] == ()
    assert len(counts) > 1


def test_a_vector_says_the_words_of_each_environment():
    envs = HRCVectorEnv(3, perception="keypoints", n_workers=2, num_threads=1)
    _, infos = envs.reset(seed=4)
    words = envs.words(infos)
    for b in range(3):
        single = HRCEnv(perception="keypoints", n_workers=2)
        said = single.words(single.reset(seed=4 + b)[1])
        assert {name: each[b] for name, each in words.items()} == said


def test_a_contact_is_told_by_kind_and_region():
    envs = HRCVectorEnv(16, perception="none", people="unaware", num_threads=1)
    agent = make_agent("scripted", env_info(envs.shards.first))
    seen, _ = envs.reset(seed=0)
    n_begun = 0
    for _ in range(150):
        seen, _, _, _, infos = envs.step(agent.act(seen).astype(np.float32))
        words, begins = envs.words(infos), infos["worker_0/contact_kind"] >= 0
        assert ((infos["worker_0/contact_region"] >= 0) == begins).all()
        assert ((infos["safety/contact_severity"] > 0) == begins).all()
        for name in ("safety/contact_kind", "safety/contact_region"):
            assert [len(each) for each in words[name]] == begins.tolist()
        n_begun += int(begins.sum())
    assert n_begun > 3
    envs.close()


def test_a_monitor_writes_every_key(tmp_path):
    monitor = pytest.importorskip("stable_baselines3.common.monitor")
    made = gymnasium.make("HRCReach-v0", perception="keypoints", n_workers=(0, 2),
                          max_episode_steps=10)  # fmt: skip
    keys = tuple(made.reset(seed=0)[1])
    env = monitor.Monitor(made, str(tmp_path / "log"), info_keywords=keys)
    for seed in range(4):
        env.reset(seed=seed)
        for _ in range(10):
            info = env.step(env.action_space.sample())[-1]
        assert set(keys) <= set(info["episode"])
    env.close()
