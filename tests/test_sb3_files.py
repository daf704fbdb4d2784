"""Policies of Stable-Baselines3 as agents: to the bit as they were saved, and nothing is run."""

import base64
import io
import json
import pickle
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector.utils import batch_space

from hrc_env import EnvInfo, HRCEnv, env_info, evaluate, make_agent
from hrc_env.core.errors import CheckpointError

torch = pytest.importorskip("torch")
from stable_baselines3 import A2C, DDPG, DQN, PPO, SAC, TD3  # noqa: E402
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize  # noqa: E402

from hrc_env.agents import checkpoints  # noqa: E402
from hrc_env.agents.features import NearAndFar  # noqa: E402

TINY = {"net_arch": [8]}
RELU = {"net_arch": {"pi": [8], "vf": [4]}, "activation_fn": torch.nn.ReLU, "log_std_init": -0.5}
NEAR = {**TINY, "features_extractor_class": NearAndFar}
REACH, GOAL = "HRCReach-v0", "HRCReachGoal-v0"


@cache
def here(task: str = REACH, **kwargs: str) -> EnvInfo:
    return env_info(HRCEnv(task=task, perception="truth", **kwargs))


@cache
def env(task: str = REACH) -> HRCEnv:
    return HRCEnv(task=task, perception="truth")


MODELS = {
    "PPO": (REACH, lambda at: PPO("MlpPolicy", at, device="cpu", policy_kwargs={**TINY})),
    "PPO, ReLU": (REACH, lambda at: PPO("MlpPolicy", at, device="cpu", policy_kwargs={**RELU})),
    "PPO, gSDE": (REACH, lambda at: PPO("MlpPolicy", at, device="cpu", use_sde=True)),
    "PPO, goals": (GOAL, lambda at: PPO("MultiInputPolicy", at, device="cpu")),
    "A2C": (REACH, lambda at: A2C("MlpPolicy", at, device="cpu")),
    "SAC": (REACH, lambda at: SAC("MlpPolicy", at, buffer_size=9, device="cpu")),
    "SAC, goals": (
        GOAL,
        lambda at: SAC("MultiInputPolicy", at, buffer_size=9, policy_kwargs={**NEAR}),
    ),
    "TD3": (REACH, lambda at: TD3("MlpPolicy", at, buffer_size=9, policy_kwargs={**TINY})),
    "DDPG": (REACH, lambda at: DDPG("MlpPolicy", at, buffer_size=9, policy_kwargs={**TINY})),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_policy_acts_to_the_bit_as_it_was_saved(name, tmp_path):
    task, make = MODELS[name]
    model, path = make(env(task)), tmp_path / "model.zip"
    model.save(path)
    agent = make_agent(str(path), here(task))
    for space in (model.observation_space, batch_space(model.observation_space, 5)):
        seen = space.sample()
        expected = model.predict(seen, deterministic=True)[0]
        np.testing.assert_array_equal(agent.act(seen), expected)


def test_reading_a_policy_draws_nothing(tmp_path):
    path = saved(tmp_path)
    before = torch.random.get_rng_state()
    make_agent(str(path), here())
    assert torch.equal(torch.random.get_rng_state(), before)


def test_a_policy_is_evaluated_by_its_file(tmp_path):
    score = evaluate(str(saved(tmp_path)), 2, perception="truth")
    assert score.episodes == 2


# Nothing is run


class Trap:
    """What writes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self):
        return Path.write_text, (self.mark, "run")


class Own(BaseFeaturesExtractor):
    def __init__(self, observation_space):
        super().__init__(observation_space, observation_space.shape[0])

    def forward(self, observations):
        return 0.5 * observations


def saved(folder: Path, **kwargs) -> Path:
    path = folder / "model.zip"
    PPO("MlpPolicy", env(), device="cpu", policy_kwargs={**TINY, **kwargs}).save(path)
    return path


def rewritten(path: Path, change, **parts: bytes) -> Path:
    """Change the `data` of a file, and replace other parts of it."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(content["data"])
    change(data)
    content |= {"data": json.dumps(data).encode(), **parts}
    with zipfile.ZipFile(path, "w") as archive:
        for name, each in content.items():
            archive.writestr(name, each)
    return path


def trapped(path: Path, mark: Path) -> Path:
    """Put a trap in place of every pickle of a file."""
    trap = base64.b64encode(pickle.dumps(Trap(mark))).decode()

    def change(data):
        for value in data.values():
            if isinstance(value, dict) and ":serialized:" in value:
                value[":serialized:"] = trap

    return rewritten(path, change)


@pytest.mark.parametrize("is_ours", [False, True])
def test_no_pickle_is_read_of_a_policy_that_is_plain(is_ours, tmp_path):
    path, mark = saved(tmp_path, activation_fn=torch.nn.ReLU), tmp_path / "mark"
    if is_ours:  # a file that says of itself that it is a run's
        checkpoints.save(PPO("MlpPolicy", env(), device="cpu", policy_kwargs={**TINY}), path, {})
    agent = make_agent(str(trapped(path, mark)), here())
    assert agent.act(env().observation_space.sample()).shape == (6,)
    assert not mark.exists()


def test_the_trap_of_these_tests_works(tmp_path):
    pickle.loads(pickle.dumps(Trap(tmp_path / "mark")))
    assert (tmp_path / "mark").exists()


def test_a_network_of_ones_own_wants_trust(tmp_path):
    path, mark = saved(tmp_path, features_extractor_class=Own), tmp_path / "mark"
    with pytest.raises(
        CheckpointError, match=r"features_extractor_class .*Own.*execute arbitrary code.*--trust"
    ):
        make_agent(str(path), here())
    model = PPO.load(path, device="cpu")
    seen = env().observation_space.sample()
    expected = model.predict(seen, deterministic=True)[0]
    agent = make_agent(str(path), here(), trust=True)
    np.testing.assert_array_equal(agent.act(seen), expected)
    with pytest.raises(CheckpointError, match="--trust"):
        make_agent(str(trapped(path, mark)), here())
    assert not mark.exists()
    with pytest.raises(CheckpointError):  # what the trap returns is no record
        make_agent(str(path), here(), trust=True)
    assert mark.exists(), "which is what trust means"


@pytest.mark.parametrize(
    "named",
    [("os", "<function system.__init__ at 0x0>"), ("stable_baselines3.common.policies", "Popen"),
     ("stable_baselines3.common.policies", "<function BasePolicy.__init__ at 0x0>")],
)  # fmt: skip
def test_a_policy_that_only_claims_to_be_known_wants_trust(named, tmp_path):
    def change(data):
        data["policy_class"]["__module__"], data["policy_class"]["__init__"] = named

    with pytest.raises(CheckpointError, match=r"its policy \(.*--trust"):
        make_agent(str(rewritten(saved(tmp_path), change)), here())


def test_weights_that_are_more_than_weights_are_refused_even_with_trust(tmp_path):
    mark = tmp_path / "mark"
    path = rewritten(saved(tmp_path), lambda data: None, **{"policy.pth": pickle.dumps(Trap(mark))})
    with pytest.raises(CheckpointError, match="other objects besides weights"):
        make_agent(str(path), here(), trust=True)
    assert not mark.exists()


# What does not fit


def test_other_spaces_are_said_in_words(tmp_path):
    path = str(saved(tmp_path))
    with pytest.raises(
        CheckpointError, match="for observations of 161 numbers, but this environment h"
    ):
        make_agent(path, here(control="tool"))
    with pytest.raises(CheckpointError, match="this environment has 'achieved_goal': 3 numbers"):
        make_agent(path, here(GOAL))
    SAC("MultiInputPolicy", env(GOAL), buffer_size=9, policy_kwargs={**TINY}).save(path)
    with pytest.raises(
        CheckpointError, match="'observation': 154 numbers, but this environment has 161"
    ):
        make_agent(path, here())


def narrow(data):
    data["action_space"]["low"] = "[-2. -2. -2. -2. -2. -2.]"


def wide(data):
    data["action_space"]["_shape"] = [7]


def unsaid(data):
    del data["observation_space"]


def nameless(data):
    data["policy_class"] = "MlpPolicy"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (narrow, r"different action bounds: its action space has low \[-2"),
        (wide, "for actions of 7 numbers, but this environment has 6 numbers"),
        (unsaid, "does not describe the observations"),
        (nameless, "does not describe its policy"),
    ],
)
def test_a_file_in_which_one_thing_is_wrong_is_refused(change, said, tmp_path):
    with pytest.raises(CheckpointError, match=said):
        make_agent(str(rewritten(saved(tmp_path), change)), here())


def test_a_policy_of_dqn_is_told_apart(tmp_path):
    import gymnasium

    path = str(tmp_path / "dqn.zip")
    DQN("MlpPolicy", gymnasium.make("CartPole-v1"), buffer_size=9, device="cpu").save(path)
    with pytest.raises(CheckpointError, match="for observations of 4 numbers"):
        make_agent(path, here())

    def change(data):
        seen = json.loads(zipfile.ZipFile(saved(tmp_path)).read("data"))
        data["observation_space"] = seen["observation_space"]

    with pytest.raises(
        CheckpointError, match="for actions of Discrete, but this environment has 6"
    ):
        make_agent(str(rewritten(Path(path), change)), here())


def test_weights_of_another_network_are_refused(tmp_path):
    other = io.BytesIO()
    torch.save({"action_net.weight": torch.zeros(6, 3)}, other)
    path = rewritten(saved(tmp_path), lambda data: None, **{"policy.pth": other.getvalue()})
    with pytest.raises(CheckpointError, match="do not match the policy that it describes"):
        make_agent(str(path), here())


# Observations that were scaled


@pytest.mark.parametrize("name", ["vecnormalize.pkl", "model_vecnormalize.pkl"])
def test_statistics_beside_a_policy_want_trust(name, tmp_path):
    path = saved(tmp_path)
    wrapper = VecNormalize(DummyVecEnv([lambda: Boxed()]), norm_obs=True)
    wrapper.obs_rms.mean[:] = 0.25
    wrapper.save(str(tmp_path / name))
    with pytest.raises(
        CheckpointError, match=rf"{name}.*pickle, which can execute arbitrary code.*--trust.*move"
    ):
        make_agent(str(path), here())
    agent, seen = make_agent(str(path), here(), trust=True), env().observation_space.sample()
    expected = PPO.load(path).predict(wrapper.normalize_obs(seen), deterministic=True)[0]
    np.testing.assert_array_equal(agent.act(seen), expected)


class Boxed(HRCEnv):
    """An environment of the same observations."""

    def __init__(self) -> None:
        super().__init__(perception="none")
        self.observation_space = spaces.Box(-9, 9, env().observation_space.shape, np.float32)


def test_statistics_of_rewards_alone_change_nothing(tmp_path):
    path = saved(tmp_path)
    VecNormalize(DummyVecEnv([Boxed]), norm_obs=False).save(str(tmp_path / "vecnormalize.pkl"))
    seen = env().observation_space.sample()
    expected = PPO.load(path).predict(seen, deterministic=True)[0]
    np.testing.assert_array_equal(make_agent(str(path), here(), trust=True).act(seen), expected)


def test_a_pickle_of_something_else_is_no_statistics(tmp_path):
    path = saved(tmp_path)
    (tmp_path / "vecnormalize.pkl").write_bytes(pickle.dumps([1, 2]))
    with pytest.raises(CheckpointError, match="must contain the statistics of a VecNormalize"):
        make_agent(str(path), here(), trust=True)
