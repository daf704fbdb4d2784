"""Feature extractor that represents each entry of an observation at two scales."""

import math
from typing import Any

from gymnasium import spaces

from hrc_env.core.errors import ConfigError, learner
from hrc_env.observations import IMAGE
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .network import NEAR

with learner():
    import torch
    from stable_baselines3.common.torch_layers import BaseFeaturesExtractor


class NearAndFar(BaseFeaturesExtractor):
    """Feature extractor that returns each entry x and sign(x) log(1 + NEAR |x|) / log(1 + NEAR).

    With these features, a network with inputs in metres can position objects to within millimetres.
    Parts of an observation are concatenated in their order; if goals are separate, the difference
    between desired and achieved goal is appended.
    """

    def __init__(self, observation_space: spaces.Space[Any]) -> None:
        parts = observation_space.spaces if isinstance(observation_space, spaces.Dict) else ()
        if images := [name for name in parts if name.startswith(IMAGE)]:
            raise ConfigError(
                f"This policy supports no images, but the observation contains {images}: leave out "
                "observe_images, or train with PPO without demonstrations, whose policy has "
                "convolutional layers."
            )
        n = spaces.flatdim(observation_space)
        if isinstance(observation_space, spaces.Dict):
            n += spaces.flatdim(observation_space[ACHIEVED])
        super().__init__(observation_space, 2 * n)

    def forward(self, observations: Any) -> torch.Tensor:
        """Return features (B, 2 n) of observations (B, n)."""
        parts = [observations]
        if isinstance(observations, dict):
            parts = [*observations.values(), observations[DESIRED] - observations[ACHIEVED]]
        flat = torch.cat([part.flatten(1) for part in parts], dim=1)
        near = torch.sign(flat) * torch.log1p(NEAR * flat.abs()) / math.log1p(NEAR)
        return torch.cat([flat, near], dim=1)
