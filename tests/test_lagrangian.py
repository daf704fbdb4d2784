"""PPO with a limit of cost: what its multiplier does, that it keeps a limit, and its runs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT, called
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from hrc_env.__main__ import main
from hrc_env.agents import checkpoints
from hrc_env.agents.learner_settings import COST_LIMITS
from hrc_env.agents.ppo_lagrangian import Multiplier, PPOLagrangian
from hrc_env.agents.recipes import fill_in
from hrc_env.agents.requests import TrainingRequest
from hrc_env.cli.train import _check_limit
from hrc_env.core.errors import ConfigError
from hrc_env.sb3 import HRCVecEnv
from hrc_env.tasks import BUILT_IN

pytestmark = pytest.mark.slow  # learners are trained

TINY = ["--perception", "truth", "--num-envs", "4", "--episodes", "2", "--no-film"]
LIMITED = ["--algorithm", "ppo_lagrangian", "--cost-limit", "30"]


def slow(multiplier: Multiplier, rng: np.random.Generator, n: int = 1200) -> np.ndarray:
    """The costs of rollouts of a policy that takes hundreds of them to follow its multiplier."""
    cost, costs = 70.0, []
    for _ in range(n):
        cost += 0.01 * (30 + 40 / (1 + multiplier.value / 3) ** 2 - 20 - cost)
        multiplier.update(cost + rng.normal(0, 8))
        costs.append(cost)
    return np.array(costs)


def test_the_multiplier_brings_a_slow_policy_to_its_limit_and_holds_it_there():
    costs = slow(Multiplier(30.0), np.random.default_rng(0))
    assert costs.min() > 0.8 * 30
    assert np.abs(costs[-400:] / 30 - 1).max() < 0.1


def test_the_integral_rests_while_the_multiplier_is_at_an_end():
    held = Multiplier(30.0, most=2.0)
    for _ in range(1000):
        held.update(300.0)
    assert held.value == 2.0
    assert held.integral == 0.0
    for _ in range(40):
        held.update(3.0)
    assert held.value == 0.0


def test_a_limit_that_is_still_wide_counts_for_less():
    wide, whole = Multiplier(30.0), Multiplier(30.0)
    wide.update(45.0, share=0.5)
    whole.update(45.0)
    assert wide.value == 0.0 < whole.value


def test_no_limit_is_zero_or_less():
    with pytest.raises(ConfigError, match="limit must be positive"):
        Multiplier(0.0)


class Greedy(VecEnv):
    """Who does more earns more, and costs more: actions in [-1, 1], rewards alike, a cost of 0 to 1
    a step; episodes of ten steps."""

    def __init__(self, n: int) -> None:
        box = spaces.Box(-1.0, 1.0, (1,), np.float32)
        super().__init__(n, box, box)
        self.steps = np.arange(n) % 10

    def reset(self):
        return np.zeros((self.num_envs, 1), np.float32)

    def step_async(self, actions):
        self.action = actions[:, 0]

    def step_wait(self):
        self.steps = (self.steps + 1) % 10
        infos = [{"cost": (each + 1) / 2} for each in self.action.tolist()]
        for k in np.flatnonzero(self.steps == 0):
            infos[k] |= {"TimeLimit.truncated": True, "terminal_observation": np.zeros(1, "f4")}
        return self.reset(), self.action.copy(), self.steps == 0, infos

    def close(self): ...

    def get_attr(self, attr_name, indices=None):
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, *_): ...

    def env_method(self, *_, **__): ...

    def env_is_wrapped(self, *_):
        return [False] * self.num_envs


@pytest.mark.parametrize(("limit", "cost"), [(3.0, 3.0), (100.0, 10.0)])
def test_it_earns_what_its_limit_allows_and_no_more(limit, cost):
    learner = PPOLagrangian(
        "MlpPolicy", Greedy(16), n_steps=32, batch_size=256, n_epochs=5, learning_rate=1e-3,
        gamma=0.9, seed=0, limit=limit, episode_steps=10, policy_kwargs={"net_arch": [16]},
    )  # fmt: skip
    costs = []
    learner.learn(200 * 512, callback=lambda *_: costs.append(learner.multiplier.cost) or True)
    assert np.mean(costs[-len(costs) // 3 :]) == pytest.approx(cost, rel=0.1)


class Steep(Greedy):
    """Noise costs: the cost of a step grows with the fourth power of the action."""

    def step_wait(self):
        observation, reward, done, infos = super().step_wait()
        return observation, reward, done, [each | {"cost": each["cost"] ** 4} for each in infos]


def cost_of_mean_actions(learner):
    env = Steep(1)
    actions, _ = learner.predict(env.reset(), deterministic=True)
    env.step_async(actions)
    return 10 * env.step_wait()[3][0]["cost"]


@pytest.mark.parametrize("is_watched", [True, False])
def test_the_limit_is_that_of_the_policy_that_is_delivered(is_watched):
    """Which acts by the mean; exploring actions at the limit say nothing of it."""
    learner = PPOLagrangian(
        "MlpPolicy", Steep(16), n_steps=32, batch_size=256, n_epochs=5, learning_rate=1e-3,
        gamma=0.9, seed=0, limit=1.0, episode_steps=10, policy_kwargs={"net_arch": [16]},
    )  # fmt: skip
    learner.watch_mean_actions(Steep(4) if is_watched else None)
    delivered = []

    def note(*_):
        delivered.append(cost_of_mean_actions(learner))
        return True

    learner.learn(150 * 512, callback=note)
    last = len(delivered) // 3
    assert (np.mean(delivered[-last:]) == pytest.approx(1.0, rel=0.15)) == is_watched
    if is_watched:
        assert 10 * np.mean(learner._costs) > 1.2
    else:
        assert learner.multiplier.cost == pytest.approx(1.0, rel=0.15)


def test_watching_takes_no_random_number_of_the_learner():
    found = []
    for watched in (None, Greedy(2)):
        sizes = {"n_steps": 32, "batch_size": 64}
        learner = PPOLagrangian("MlpPolicy", Greedy(4), **sizes, seed=0, limit=1e9)
        learner.watch_mean_actions(watched)
        learner.learn(512)
        found.append(learner.policy.action_net.weight.tolist())
    assert found[0] == found[1]


def test_what_is_beyond_a_time_limit_counts_as_the_critic_says():
    """The critic of who always costs 1 a step, in episodes that only time ends, is flat."""
    learner = PPOLagrangian(
        "MlpPolicy", Greedy(16), n_steps=40, gamma=0.8, seed=0, limit=1e6, batch_size=640
    )
    learner.policy.action_net.bias.data.fill_(50.0)
    learner.learning_rate = learner.lr_schedule = lambda _: 0.0
    learner.learn(60 * 640)
    value = learner._predict(np_tensor(0.0)).item() * np.sqrt(learner.spread.var)
    assert value == pytest.approx(1 / (1 - 0.8), rel=0.1)


def np_tensor(value: float):
    import torch

    return torch.tensor([[value]])


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "limited"
    done = called(ROOT / "train.py", *TINY, *LIMITED, "--timesteps", 512, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_a_run_says_what_it_costs_and_how_much_that_weighs(run):
    points = json.loads((run / "curve.json").read_text())
    assert all(point["limit"] == 30.0 for point in points)
    assert all(point.keys() >= {"cost", "multiplier"} for point in points)
    assert (run / "curve.png").exists()
    record = json.loads((run / "run.json").read_text())
    assert record["config"]["reward"]["proximity"] == 0
    (folder,) = (run / "tensorboard").iterdir()
    log = EventAccumulator(str(folder))
    log.Reload()
    assert {"lagrangian/multiplier", "lagrangian/cost"} <= set(log.Tags()["scalars"])


def test_multiplier_critic_and_scale_go_on_where_they_were(tmp_path):
    env = HRCVecEnv(16, task="HRCReachGoal-v0", perception="truth", people="unaware", stagger=True)
    learner = PPOLagrangian("MultiInputPolicy", env, n_steps=64, batch_size=64, limit=0.1, seed=0)
    learner.learn(4096)
    checkpoints.save(learner, tmp_path / "policy.zip", {})
    again = checkpoints.resume(tmp_path / "policy.zip", env)
    assert isinstance(again, PPOLagrangian)
    assert again.multiplier == learner.multiplier
    assert again.multiplier.value > 0
    assert again.spread.var == learner.spread.var
    observation = learner.policy.obs_to_tensor(env.reset())[0]
    assert again._predict(observation).tolist() == learner._predict(observation).tolist()
    moments = [each.cost_optimizer.state_dict()["state"][0]["exp_avg"] for each in (again, learner)]
    assert moments[0].tolist() == moments[1].tolist()


def test_a_run_with_a_limit_resumes(run):
    done = called(ROOT / "train.py", *TINY, "--timesteps", 768, "--resume", run)
    assert done.returncode == 0, done.stderr
    assert checkpoints.describe(run / "policy.zip")["algorithm"] == "ppo_lagrangian"
    assert json.loads((run / "curve.json").read_text())[-1]["steps"] == 768


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--cost-limit", "30"], "requires ppo_lagrangian, and ppo ignores cost"),
        (["--algorithm", "sac", "--cost-limit", "30"], "and sac ignores cost"),
        ([*LIMITED[:3], "-3"], "--cost-limit must be above 0, got -3"),
        ([*LIMITED[:3], "0"], "The default of HRCReach-v0 is"),
        ([*LIMITED[:3], "0"], "A shield reduces the cost"),
        ([*LIMITED[:3], "nan"], "--cost-limit must be above 0"),
        (["--shield", "sm"], "Unknown shield 'sm'"),
    ],
)
def test_a_limit_that_cannot_be_is_refused_in_words(words, says, tmp_path, capsys):
    assert main(["train", *TINY, *words, "--out", str(tmp_path / "run")]) == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_every_task_has_a_budget_and_others_need_a_limit():
    assert {*COST_LIMITS} == {*BUILT_IN}
    limited = TrainingRequest(algorithm="ppo_lagrangian", task="HRCDelivery-v0")
    assert fill_in(limited).cost_limit == COST_LIMITS["HRCDelivery-v0"]
    assert fill_in(replace(limited, cost_limit=3.0)).cost_limit == 3.0
    assert fill_in(TrainingRequest()).cost_limit is None
    own = fill_in(replace(limited, task="Own-v0"))
    with pytest.raises(ConfigError, match="requires a limit, and Own-v0 has no default"):
        _check_limit(own.cost_limit, own.algorithm, own.task)


def test_a_limit_that_was_not_kept_is_said_aloud(tmp_path, capsys):
    words = [*LIMITED[:3], "0.001", "--timesteps", "256", "--people", "headlong"]
    words += ["--episodes", "16", "--out", str(tmp_path / "run")]
    words += ["--config", "cost.proximity_m=1.0"]
    assert main(["train", *TINY, *words]) == 0
    assert "The limit of 0.001 is exceeded" in " ".join(capsys.readouterr().out.split())
