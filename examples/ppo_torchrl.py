"""PPO by TorchRL over the vector environment: python examples/ppo_torchrl.py

TorchRL (arXiv:2306.00577) is no dependency of hrc_env: pip install -c constraints.txt ".[torchrl]".
Its collector resets the environments with a mask of the finished episodes, so the vector
environment is made with `autoreset_mode="Disabled"`: no step is lost to a reset, and the last
observation of an episode is the one that the step returned.
"""

import time
from collections import deque
from dataclasses import dataclass

import gymnasium
import torch
import tyro
from rich.progress import Progress, TextColumn
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper, RewardScaling, RewardSum, TransformedEnv
from torchrl.modules import MLP, NormalParamExtractor, ProbabilisticActor, ValueOperator
from torchrl.modules.distributions import TanhNormal
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import hrc_env  # noqa: F401  registers the ids


@dataclass(frozen=True)
class Arguments:
    """Learn HRCReach-v0 by TorchRL's PPO."""

    timesteps: int = 1_000_000
    """Environment steps in all."""
    num_envs: int = 64
    """Environments that step together."""
    n_steps: int = 64
    """Steps of each environment between updates."""
    perception: str = "keypoints"
    """Perception level: keypoints (camera emulator), truth or none."""
    seed: int = 0
    """Seed of environments and learner."""


def make_env(arguments: Arguments) -> TransformedEnv:
    """Return the vector environment for TorchRL, with scaled rewards and sums over episodes."""
    envs = gymnasium.make_vec(
        "HRCReach-v0",
        num_envs=arguments.num_envs,
        perception=arguments.perception,
        autoreset_mode="Disabled",
    )
    env = TransformedEnv(GymWrapper(envs), RewardScaling(loc=0.0, scale=0.1))
    env.append_transform(RewardSum())
    env.set_seed(arguments.seed)
    return env


def make_policy(n_observed: int, n_actions: int) -> tuple[ProbabilisticActor, ValueOperator]:
    """Squashed normal actions, and the value of an observation."""
    shape = {"in_features": n_observed, "num_cells": [128, 128], "activation_class": nn.Tanh}
    body = nn.Sequential(MLP(out_features=2 * n_actions, **shape), NormalParamExtractor())
    actor = ProbabilisticActor(
        TensorDictModule(body, ["observation"], ["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=TanhNormal,
        return_log_prob=True,
    )
    return actor, ValueOperator(MLP(out_features=1, **shape), in_keys=["observation"])


def update(data: TensorDict, losses: ClipPPOLoss, optimiser: torch.optim.Optimizer) -> None:
    """Five passes over a rollout in batches of about 1024."""
    samples = data.reshape(-1)
    for _ in range(5):
        for ids in torch.randperm(len(samples)).chunk(max(len(samples) // 1024, 1)):
            terms = losses(samples[ids])
            optimiser.zero_grad()
            (terms["loss_objective"] + terms["loss_critic"] + terms["loss_entropy"]).backward()
            nn.utils.clip_grad_norm_(losses.parameters(), 0.5)
            optimiser.step()


def main(arguments: Arguments) -> None:
    """Learn, with the progress and the rewards of episodes in sight."""
    torch.manual_seed(arguments.seed)
    env = make_env(arguments)
    actor, critic = make_policy(env.observation_spec["observation"].shape[-1], 6)
    per_rollout = arguments.num_envs * arguments.n_steps
    n_updates = -(-arguments.timesteps // per_rollout)
    collector = Collector(
        env,
        actor,
        frames_per_batch=per_rollout,
        total_frames=n_updates * per_rollout,
        auto_register_policy_transforms=False,
    )
    advantage = GAE(gamma=0.98, lmbda=0.95, value_network=critic, average_gae=True)
    losses = ClipPPOLoss(actor, critic, entropy_coeff=1e-4)
    optimiser = torch.optim.Adam(losses.parameters(), lr=5e-4)
    returns: deque[float] = deque(maxlen=arguments.num_envs)
    started_s = time.monotonic()
    with Progress(*Progress.get_default_columns(), TextColumn("{task.fields[note]}")) as progress:
        task = progress.add_task("learning", total=n_updates, note="")
        for data in collector:
            with torch.no_grad():
                advantage(data)
            update(data, losses, optimiser)
            ended = data["next", "done"][..., 0]
            returns.extend(data["next", "episode_reward"][ended][:, 0].tolist())
            note = f"reward of an episode {10 * sum(returns) / max(len(returns), 1):.1f}"
            progress.update(task, advance=1, note=note)
    seconds = time.monotonic() - started_s
    print(f"{n_updates * per_rollout} steps in {seconds:.0f} s; {note}")
    collector.shutdown()


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
