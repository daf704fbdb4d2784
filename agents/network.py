"""The mean action of a trained policy by NumPy alone: who only acts needs no learner."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import check_names
from hrc_env.observations import IMAGE
from hrc_env.tasks.goal import ACHIEVED, DESIRED

from .env_info import Observation

NEAR = 100.0
"""Entries that are smaller than 1 / NEAR are spread out."""
ACTIVATIONS = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}
Tensors = dict[str, NDArray[np.float32]]


@dataclass(frozen=True, slots=True)
class Architecture:
    """What a network is, beside its weights."""

    activation: str
    """"tanh" or "relu", after each layer but the last."""
    near_and_far: bool
    """Whether it sees every entry at two scales (`agents.features`)."""
    squashed: bool
    """Whether actions are the tanh of the last layer's output (SAC), not cut at -1 and 1 (PPO)."""

    def __post_init__(self) -> None:
        check_names("activation", [self.activation], ACTIVATIONS)


class Network:
    """Layers one after the other; layer k is "actor.k.weight" (out, in) and "actor.k.bias" (out,).

    Raises:
        KeyError: a layer lacks its weight or bias.
    """

    def __init__(self, tensors: Tensors, architecture: Architecture) -> None:
        n = max(1, len(tensors) // 2)
        self.layers = [(tensors[f"actor.{k}.weight"], tensors[f"actor.{k}.bias"]) for k in range(n)]
        self.architecture = architecture

    @property
    def sizes(self) -> tuple[int, int]:
        """Numbers of its inputs and outputs."""
        n_seen = self.layers[0][0].shape[1]
        return n_seen // (2 if self.architecture.near_and_far else 1), len(self.layers[-1][1])

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A) in [-1, 1] for observations (..., n)."""
        seen, of = flat(observation), self.architecture
        if of.near_and_far:
            seen = near_and_far(observation)
        for weight, bias in self.layers[:-1]:
            seen = ACTIVATIONS[of.activation](seen @ weight.T + bias)
        weight, bias = self.layers[-1]
        said = seen @ weight.T + bias
        return np.tanh(said) if of.squashed else np.clip(said, -1.0, 1.0)


def flat(observation: Observation) -> NDArray[np.float32]:
    """(..., n) without images; where goals stand apart, they come first."""
    if isinstance(observation, Mapping):
        numbers = [name for name in sorted(observation) if not name.startswith(IMAGE)]
        return np.concatenate([observation[name] for name in numbers], axis=-1)
    return observation


def near_and_far(observation: Observation) -> NDArray[np.float32]:
    """(..., 2 n) what `agents.features.NearAndFar` makes of an observation."""
    seen = flat(observation)
    if isinstance(observation, Mapping) and DESIRED in observation:
        seen = np.concatenate([seen, observation[DESIRED] - observation[ACHIEVED]], axis=-1)
    near = np.sign(seen) * np.log1p(NEAR * np.abs(seen)) / math.log1p(NEAR)
    return np.concatenate([seen, near], axis=-1, dtype=np.float32)
