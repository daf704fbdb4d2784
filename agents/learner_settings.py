"""Training recipes of tasks and settings of learners, which can be imported without a learner."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hrc_env.core.mapping import answer_unknown_fields


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PPOSettings:
    """Settings of PPO for the built-in tasks: keywords of `stable_baselines3.PPO`.

    They assume environments in different phases of their episodes, normalized rewards (observations
    are scaled already), and a proximity term with a growing weight: with the full weight from the
    first step, a learner learns to stay away from people before it finds a goal. The `train`
    command provides all three. In your own code:

        env = VecNormalize(HRCVecEnv(64, stagger=True), norm_obs=False, gamma=0.98)
        model = PPO("MlpPolicy", env, **PPOSettings().keywords())
        model.learn(1_000_000, callback=ProximityRamp(400_000))
    """

    n_steps: int = 64
    """Number of steps of each environment between updates."""
    batch_size: int = 1024
    """Number of samples in a gradient step."""
    n_epochs: int = 5
    """Number of passes over a rollout."""
    learning_rate: float = 5e-4
    """Learning rate of Adam."""
    gamma: float = 0.98
    """Discount factor per step; 0.98 corresponds to a horizon of about 2 s."""
    gae_lambda: float = 0.95
    """Lambda of generalized advantage estimation, which trades bias for variance."""
    clip_range: float = 0.2
    """Clipping range of the probability ratio of new and old policy."""
    hidden: tuple[int, ...] = (128, 128)
    """Sizes of the hidden layers of policy and value network, which use tanh."""
    log_std_init: float = -0.5
    """Initial log standard deviation of actions."""
    near_and_far: bool = False
    """Whether each entry of an observation is represented at two scales (`agents.features`); the
    hidden layers then use ReLU.
    """

    def keywords(self) -> dict[str, Any]:
        """Return keyword arguments for `stable_baselines3.PPO`; this imports torch."""
        import torch

        values = asdict(self)
        near = values.pop("near_and_far")
        policy = {
            "net_arch": list(values.pop("hidden")),
            "activation_fn": torch.nn.ReLU if near else torch.nn.Tanh,
            "log_std_init": values.pop("log_std_init"),
            **_make_features(near),
        }
        return {**values, "policy_kwargs": policy}


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class SACSettings:
    """Settings of SAC for the built-in tasks: keywords of `stable_baselines3.SAC`.

    If goals are separate from the observation, hindsight replay (HER) is used, with `relabelled` as
    its `n_sampled_goal`.
    """

    buffer_size: int = 200_000
    """Total number of transitions of all environments in the replay buffer."""
    batch_size: int = 256
    """Number of samples in a gradient step."""
    gradient_steps: int = 16
    """Gradient steps after each step of all environments."""
    learning_rate: float = 1e-3
    """Learning rate of Adam."""
    gamma: float = 0.95
    """Discount factor per step; 0.95 corresponds to a horizon of about 1 s."""
    tau: float = 0.05
    """Coefficient of the soft update of the target networks in each gradient step."""
    ent_coef: str = "auto_0.05"
    """Weight of the entropy; "auto_0.05" adapts it during training, starting from 0.05."""
    hidden: tuple[int, ...] = (128, 128)
    """Sizes of the hidden layers of actor and critics, which use ReLU."""
    near_and_far: bool = True
    """Whether each entry of an observation, and the difference from the goal, is represented at two
    scales (`agents.features`).

    With hindsight replay, the reaching task was learnt in 800 gradient steps; without these
    features, no goal was found in 5,000.
    """
    relabelled: int = 4
    """Number of transitions with a goal achieved later in their episode, per transition with its
    original goal, if hindsight replay is used.
    """

    def keywords(self) -> dict[str, Any]:
        """Return keyword arguments for `stable_baselines3.SAC`; this imports torch."""
        values = asdict(self)
        del values["relabelled"]
        hidden = list(values.pop("hidden"))
        policy = {"net_arch": hidden, **_make_features(values.pop("near_and_far"))}
        return {**values, "policy_kwargs": policy}


def _make_features(near_and_far: bool) -> dict[str, Any]:
    if not near_and_far:
        return {}
    from .features import NearAndFar  # here: it imports torch

    return {"features_extractor_class": NearAndFar}


IMITATOR = PPOSettings(hidden=(256, 256), near_and_far=True, learning_rate=5e-5, gamma=0.99)
"""Settings of PPO after behaviour cloning, which preserve most of the cloned behaviour."""

IMITATION: Mapping[str, Any] = {"control": "twist", "demonstrations": 256, "timesteps": 0}
"""Recipe of tasks that PPO alone does not learn: behaviour cloning without further training, which
did not improve picking and delivering.
"""
RECIPES: Mapping[str, Mapping[str, Any]] = {
    "HRCReachGoal-v0": {"algorithm": "sac", "control": "tool", "timesteps": 60_000},
    "HRCPickPlace-v0": {**IMITATION, "demonstrations": 512},
    "HRCPickPlaceGoal-v0": {**IMITATION, "demonstrations": 512},
    "HRCHandover-v0": IMITATION,
    "HRCDrywall-v0": IMITATION,
    "HRCDelivery-v0": {**IMITATION, "control": "joint", "demonstrations": 1024},
}
"""Default training recipe of each task: arguments of `python -m hrc_env train`, by the task's id.

Other tasks use PPO, control "joint", no demonstrations and 1,000,000 steps. The settings of the
learners are `PPOSettings` and `SACSettings`.
"""

COST_LIMITS: Mapping[str, float] = {
    "HRCReach-v0": 10.0,
    "HRCReachGoal-v0": 3.5,
    "HRCPickPlace-v0": 2.5,
    "HRCPickPlaceGoal-v0": 2.5,
    "HRCHandover-v0": 12.0,
    "HRCDrywall-v0": 0.1,
    "HRCDelivery-v0": 1.0,
}
"""Budget of each built-in task, by id: the default of `--cost-limit`, the maximum mean cost of an
episode [control steps]. `python -m benchmarks budgets` measures the costs from which it was chosen.
"""
