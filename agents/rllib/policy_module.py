"""The network of Stable-Baselines3's PPO as an RLlib module, with which policies are exchanged."""

from typing import Any

import torch
from gymnasium.spaces import Dict
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.apis.value_function_api import ValueFunctionAPI
from ray.rllib.core.rl_module.torch.torch_rl_module import TorchRLModule
from stable_baselines3.common.policies import ActorCriticPolicy, MultiInputActorCriticPolicy


class PolicyModule(TorchRLModule, ValueFunctionAPI):
    """RLlib module with an `ActorCriticPolicy` and normally distributed actions.

    `model_config["policy"]` contains the policy's keyword arguments: `net_arch`, `activation_fn`,
    `log_std_init`, and the class of the feature extractor.
    """

    policy: ActorCriticPolicy

    def setup(self) -> None:
        """Create the policy's network."""
        is_dict = isinstance(self.observation_space, Dict)
        kind = MultiInputActorCriticPolicy if is_dict else ActorCriticPolicy
        self.policy = kind(
            self.observation_space,
            self.action_space,
            lambda progress: 0.0,
            **self.model_config["policy"],
        )

    def _forward(self, batch: dict[str, Any], **kwargs: Any) -> dict[str, Any]:
        """Return the mean and the log standard deviation of actions (B, 2 A)."""
        policy, seen = self.policy, batch[Columns.OBS]
        features: Any = policy.extract_features(seen, policy.pi_features_extractor)
        mean = policy.action_net(policy.mlp_extractor.forward_actor(features))
        log_std = self.policy.log_std.expand_as(mean)
        return {Columns.ACTION_DIST_INPUTS: torch.cat([mean, log_std], -1)}

    def compute_values(self, batch: dict[str, Any], embeddings: Any = None) -> torch.Tensor:
        """Return the values of observations (B,)."""
        return self.policy.predict_values(batch[Columns.OBS]).squeeze(-1)
