"""PPO-Lagrangian by FSRL, to validate `train`: python examples/ppo_lagrangian_fsrl.py

FSRL (github.com/liuzuxin/FSRL) reads `info["cost"]` directly, so that no adaptor is needed. It pins
versions that can no longer be installed, and runs with current ones. In an environment of its own,
with hrc_env:

    pip install -c constraints.txt -e ".[train]"
    pip install --no-deps fast-safe-rl==0.1.0 tianshou==0.5.1 gym==0.26.2
    pip install -c constraints.txt h5py pettingzoo prettytable pyrallis pyyaml "wandb>=0.20"

It steps single environments, at a few hundred steps a second, and takes hours where `train` takes
minutes. Both agents are evaluated on the same seeds, as `train` does.
"""

import time
import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import torch
import tyro

warnings.filterwarnings("ignore", module="gym|tianshou|wandb|pyrallis")  # what old libraries say

from fsrl.agent import PPOLagAgent  # noqa: E402
from fsrl.utils import BaseLogger  # noqa: E402
from tianshou.env import DummyVectorEnv  # noqa: E402

from hrc_env import evaluate, make_agent  # noqa: E402  registers the ids, too


@dataclass(frozen=True)
class Arguments:
    """Train HRCReach-v0 with a cost limit by FSRL, and evaluate it beside another agent."""

    timesteps: int = 1_000_000
    """Environment steps in all."""
    cost_limit: float = 10.0
    """Cost limit of an episode."""
    num_envs: int = 4
    """Number of environments, stepped one after the other; each plays an episode between
    updates."""
    perception: str = "keypoints"
    """Perception level of the robot."""
    seed: int = 0
    """Seed of the learner."""
    episodes: int = 128
    """Number of episodes of the evaluation."""
    beside: str = "scripted"
    """Agent to evaluate on the same seeds: a name, or the policy.zip of a run with the same
    limit."""


class Judged:
    """Mean action of FSRL's policy."""

    def __init__(self, actor: Any) -> None:
        self.actor = actor

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Return actions in [-1, 1], as its `action_bound_method="clip"` has them."""
        with torch.no_grad():
            (mean, _), _ = self.actor(observation)
        return np.clip(mean.numpy(), -1.0, 1.0)


def main(arguments: Arguments) -> None:
    """Train, evaluate and print."""
    torch.set_num_threads(1)
    quiet = {"perception": arguments.perception, "config": {"reward": {"proximity": 0.0}}}
    make = partial(gymnasium.make, "HRCReach-v0", **quiet)
    limited = {"cost_limit": arguments.cost_limit, "seed": arguments.seed, "thread": 1}
    agent = PPOLagAgent(make(), BaseLogger(), device="cpu", gamma=0.98, **limited)
    started_s = time.monotonic()
    agent.learn(
        DummyVectorEnv([make] * arguments.num_envs), epoch=1, step_per_epoch=arguments.timesteps,
        episode_per_collect=arguments.num_envs, save_ckpt=False, verbose=False,
        show_progress=False,
    )  # fmt: skip
    (lagrangian,) = agent.policy.lag_optims
    print(f"{arguments.timesteps} steps in {time.monotonic() - started_s:.0f} s, ", end="")
    print(f"lambda {lagrangian.get_lag():.2f}")
    others = {
        "FSRL": lambda _: Judged(agent.policy.actor),
        arguments.beside: lambda at: make_agent(arguments.beside, at),
    }
    for name, other in others.items():
        score = evaluate(other, arguments.episodes, **quiet)
        print(f"{name}: cost {score.cost_per_episode:.1f}, goals/min {score.goals_per_minute:.1f}")


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
