"""How tasks are learnt, and settings of the learners: they need no learner to be read."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hrc_env.core.mapping import answer_unknown_fields


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PPOSettings:
    """Settings of PPO that learn the built-in tasks: keywords of `stable_baselines3.PPO`.

    They need episodes out of phase, scaled rewards (observations are scaled already), and a
    proximity term that grows: with the whole term from the first step a learner learns to stay
    away before it finds a goal. `train` has all three:

        env = VecNormalize(HRCVecEnv(64, stagger=True), norm_obs=False, gamma=0.98)
        model = PPO("MlpPolicy", env, **PPOSettings().keywords())
        model.learn(1_000_000, callback=ProximityRamp(400_000))
    """

    n_steps: int = 64
    """Steps of each environment between updates."""
    batch_size: int = 1024
    """Samples in a gradient step."""
    n_epochs: int = 5
    """Passes over a rollout."""
    learning_rate: float = 5e-4
    """Adam's step size."""
    gamma: float = 0.98
    """Discount per step; 0.98 looks about 2 s ahead."""
    gae_lambda: float = 0.95
    """Bias against variance of the advantage."""
    clip_range: float = 0.2
    """How far a policy may move in an update."""
    hidden: tuple[int, ...] = (128, 128)
    """Hidden layers of policy and value network (tanh)."""
    log_std_init: float = -0.5
    """Initial log standard deviation of actions."""
    near_and_far: bool = False
    """Whether it sees every entry at two scales (`agents.features`), through layers of ReLU."""

    def keywords(self) -> dict[str, Any]:
        """Return the keyword arguments of `stable_baselines3.PPO`; torch is imported here."""
        import torch

        values = asdict(self)
        near = values.pop("near_and_far")
        policy = {
            "net_arch": list(values.pop("hidden")),
            "activation_fn": torch.nn.ReLU if near else torch.nn.Tanh,
            "log_std_init": values.pop("log_std_init"),
            **_features(near),
        }
        return {**values, "policy_kwargs": policy}


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class SACSettings:
    """Settings of SAC that learn the built-in tasks: keywords of `stable_baselines3.SAC`.

    With goals apart from the observation hindsight replay (HER) comes beside them, with
    `relabelled` as its `n_sampled_goal`.
    """

    buffer_size: int = 200_000
    """Transitions that are kept, of all environments together."""
    batch_size: int = 256
    """Samples in a gradient step."""
    gradient_steps: int = 16
    """After each step of all environments."""
    learning_rate: float = 1e-3
    """Adam's step size."""
    gamma: float = 0.95
    """Discount per step; 0.95 looks about 1 s ahead."""
    tau: float = 0.05
    """Share by which the target networks follow in a gradient step."""
    ent_coef: str = "auto_0.05"
    """Weight of the entropy: found as it goes, from this on."""
    hidden: tuple[int, ...] = (128, 128)
    """Hidden layers of actor and critics (ReLU)."""
    near_and_far: bool = True
    """Whether it sees every entry at two scales, and the way to its goal (`agents.features`):
    without that, hindsight found no goal of reaching in 5,000 gradient steps; with it, in 800."""
    relabelled: int = 4
    """With hindsight, how many transitions are judged by goals that were achieved later in their
    episode, for each that is judged by its own."""

    def keywords(self) -> dict[str, Any]:
        """Return the keyword arguments of `stable_baselines3.SAC`; torch is imported here."""
        values = asdict(self)
        del values["relabelled"]
        hidden = list(values.pop("hidden"))
        policy = {"net_arch": hidden, **_features(values.pop("near_and_far"))}
        return {**values, "policy_kwargs": policy}


def _features(near_and_far: bool) -> dict[str, Any]:
    if not near_and_far:
        return {}
    from .features import NearAndFar  # here: it imports torch

    return {"features_extractor_class": NearAndFar}


IMITATOR = PPOSettings(hidden=(256, 256), near_and_far=True, learning_rate=5e-5, gamma=0.99)
"""Of who begins with what an expert does, and keeps most of it."""

IMITATION: Mapping[str, Any] = {"control": "twist", "demonstrations": 256, "timesteps": 0}
"""Of what PPO alone does not find; picking and delivering it gained nothing after that."""
RECIPES: Mapping[str, Mapping[str, Any]] = {
    "HRCReachGoal-v0": {"algorithm": "sac", "control": "tool", "timesteps": 60_000},
    "HRCPickPlace-v0": {**IMITATION, "demonstrations": 512},
    "HRCPickPlaceGoal-v0": {**IMITATION, "demonstrations": 512},
    "HRCHandover-v0": IMITATION,
    "HRCDrywall-v0": IMITATION,
    "HRCDelivery-v0": {**IMITATION, "control": "joint", "demonstrations": 1024},
}
"""How each task is learnt by default: arguments of `python -m hrc_env train` by the task's id.

Where they differ from PPO, control "joint", no demonstrations and 1,000,000 steps. The learners'
own settings are `PPOSettings` and `SACSettings`."""
