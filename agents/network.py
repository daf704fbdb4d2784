"""Policy networks in NumPy, for acting without a learner."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import check_names
from hrc_env.observations import IMAGE
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .env_info import Observation

NEAR = 100.0
"""Factor of the near scale, which resolves entries of magnitude below 1 / NEAR."""
ACTIVATIONS = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}
"""Activation functions by name."""
Tensors = dict[str, NDArray[np.float32]]
"""Weights and biases by name."""


@dataclass(frozen=True, slots=True)
class Architecture:
    """Architecture of a policy's network, without its weights."""

    activation: str
    """Activation function after each layer except the last one: "tanh" or "relu"."""
    near_and_far: bool
    """Whether each entry of an observation is represented at two scales (`agents.features`)."""
    squashed: bool
    """Whether the last layer's output is squashed by tanh (SAC) instead of clipped to [-1, 1]
    (PPO)."""

    def __post_init__(self) -> None:
        check_names("activation", [self.activation], ACTIVATIONS)


class NetworkSizes(NamedTuple):
    """Numbers of inputs and outputs of a network."""

    n_inputs: int
    n_outputs: int


class Network:
    """A feed-forward network with the tensors "actor.k.weight" and "actor.k.bias" of each layer k.

    Their shapes are (out, in) and (out,).

    Raises:
        KeyError: the weight or the bias of a layer is missing.
    """

    def __init__(self, tensors: Tensors, architecture: Architecture) -> None:
        n = max(1, len(tensors) // 2)
        self.layers = [(tensors[f"actor.{k}.weight"], tensors[f"actor.{k}.bias"]) for k in range(n)]
        self.architecture = architecture

    @property
    def sizes(self) -> NetworkSizes:
        """Numbers of inputs and outputs of the network."""
        n_features = self.layers[0][0].shape[1]
        n_inputs = n_features // (2 if self.architecture.near_and_far else 1)
        return NetworkSizes(n_inputs, len(self.layers[-1][1]))

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) in [-1, 1] for observations (..., n)."""
        x, architecture = flatten(observation), self.architecture
        if architecture.near_and_far:
            x = expand_near_and_far(observation)
        for weight, bias in self.layers[:-1]:
            x = ACTIVATIONS[architecture.activation](x @ weight.T + bias)
        weight, bias = self.layers[-1]
        x = x @ weight.T + bias
        return np.tanh(x) if architecture.squashed else np.clip(x, -1.0, 1.0)


def flatten(observation: Observation) -> NDArray[np.float32]:
    """Concatenate the parts of an observation to an array (..., n), without images.

    Separate goals come first.
    """
    if isinstance(observation, Mapping):
        numbers = [name for name in sorted(observation) if not name.startswith(IMAGE)]
        return np.concatenate([observation[name] for name in numbers], axis=-1)
    return observation


def expand_near_and_far(observation: Observation) -> NDArray[np.float32]:
    """Return the same features (..., 2 n) as `agents.features.NearAndFar`."""
    x = flatten(observation)
    if isinstance(observation, Mapping) and DESIRED in observation:
        x = np.concatenate([x, observation[DESIRED] - observation[ACHIEVED]], axis=-1)
    near = np.sign(x) * np.log1p(NEAR * np.abs(x)) / math.log1p(NEAR)
    return np.concatenate([x, near], axis=-1, dtype=np.float32)
