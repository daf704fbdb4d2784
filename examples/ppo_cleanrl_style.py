"""PPO in one plain file over the vector environment: python examples/ppo_cleanrl_style.py

Everything from the first reset to the last gradient step stands below, in the style of CleanRL
(arXiv:2111.08819): no learner's library, only PyTorch. Proximal policy optimisation is Schulman
et al. 2017, arXiv:1707.06347. Two things are easily done wrong, and marked where they are done:

    the reset step   In gymnasium's mode NEXT_STEP the step after the end of an episode only
                     starts the next one: its action is ignored and its reward is 0. It is no
                     experience, so it is left out of every gradient.
    truncation       An episode that the time limit cuts has a future, which the value of its
                     last observation stands for; one that fails has none.
"""

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import torch
import tyro
from rich.progress import Progress, TextColumn
from torch import Tensor, nn
from torch.distributions import Normal

import hrc_env  # noqa: F401  registers the ids


@dataclass(frozen=True)
class Arguments:
    """Learn HRCReach-v0 by PPO."""

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
    n_epochs: int = 5
    """Passes over a rollout."""
    batch_size: int = 1024
    """Samples in a gradient step."""
    learning_rate: float = 5e-4
    """Adam's step size."""
    gamma: float = 0.98
    """Discount per step; 0.98 looks about 2 s ahead."""
    gae_lambda: float = 0.95
    """Bias against variance of the advantage."""
    clip_range: float = 0.2
    """How far the policy may move in an update."""
    max_grad_norm: float = 0.5
    """Gradients are shortened to this length."""
    value_weight: float = 0.5
    """Weight of the value's loss beside the policy's."""


class Policy(nn.Module):
    """Normal actions and the value of an observation, by two small networks."""

    def __init__(self, n_observed: int, n_actions: int) -> None:
        super().__init__()
        self.mean = network(n_observed, n_actions, last_gain=0.01)
        self.value = network(n_observed, 1, last_gain=1.0)
        self.log_std = nn.Parameter(torch.full((n_actions,), -0.5))

    def actions(self, observation: Tensor) -> Normal:
        """Distribution of the actions (..., A), before they are clipped to [-1, 1]."""
        return Normal(self.mean(observation), self.log_std.exp())


def network(n_in: int, n_out: int, last_gain: float) -> nn.Sequential:
    """Two hidden layers of 128 tanh units with orthogonal weights."""
    layers: list[nn.Module] = []
    for size_in, size_out, gain in ((n_in, 128, 2**0.5), (128, 128, 2**0.5)):
        layers += [linear(size_in, size_out, gain), nn.Tanh()]
    return nn.Sequential(*layers, linear(128, n_out, last_gain))


def linear(n_in: int, n_out: int, gain: float) -> nn.Linear:
    """A layer with orthogonal weights and no bias to begin with."""
    layer = nn.Linear(n_in, n_out)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class ReturnScale:
    """The spread of discounted returns so far, by which rewards are divided."""

    def __init__(self, num_envs: int, gamma: float) -> None:
        self.gamma, self.returns = gamma, np.zeros(num_envs)
        self.n, self.mean, self.squares = 1e-4, 0.0, 1e-4

    def __call__(self, reward: np.ndarray, done: np.ndarray) -> np.ndarray:
        """Rewards (B,) of one step, scaled."""
        self.returns = self.gamma * self.returns + reward
        off = self.returns - self.mean
        self.n += len(reward)
        self.mean += off.sum() / self.n
        self.squares += (off * (self.returns - self.mean)).sum()
        self.returns[done] = 0.0
        return np.clip(reward / np.sqrt(self.squares / self.n), -10.0, 10.0)


class Rollout:
    """Transitions of T steps of B environments; row t is the step from observation t."""

    def __init__(self, n_steps: int, num_envs: int, n_observed: int, n_actions: int) -> None:
        shape = (n_steps, num_envs)
        self.observation = torch.zeros(*shape, n_observed)
        self.action = torch.zeros(*shape, n_actions)
        self.log_prob, self.value, self.reward = (torch.zeros(shape) for _ in range(3))
        self.terminated, self.done, self.is_reset = (
            torch.zeros(shape, dtype=torch.bool) for _ in range(3)
        )

    def advantages(self, last_value: Tensor, gamma: float, gae_lambda: float) -> Tensor:
        """Return generalised advantage estimates (T, B); those of reset steps are to be ignored.

        Row t + 1 begins with the observation after step t, which is the *final* observation where
        an episode ended: so V(t + 1) bootstraps a truncated episode, but not a terminated one.
        """
        advantage = torch.zeros_like(self.reward)
        next_value, carried = last_value, torch.zeros_like(last_value)
        for t in reversed(range(len(self.reward))):
            future = gamma * next_value * ~self.terminated[t]
            error = self.reward[t] + future - self.value[t]
            carried = error + gamma * gae_lambda * carried * ~self.done[t]
            advantage[t], next_value = carried, self.value[t]
        return advantage


class Collector:
    """Steps the environments with a policy and counts the goals."""

    def __init__(self, envs: gymnasium.vector.VectorEnv, arguments: Arguments) -> None:
        self.envs = envs
        self.scale = ReturnScale(arguments.num_envs, arguments.gamma)
        limit = gymnasium.spec("HRCReach-v0").max_episode_steps or 1
        rng = np.random.default_rng(arguments.seed)  # episodes that do not run in phase
        phases = {"elapsed_steps": rng.integers(limit, size=envs.num_envs)}
        self.observation, _ = envs.reset(seed=arguments.seed, options=phases)
        self.ended = np.zeros(envs.num_envs, bool)
        self.goals: deque[tuple[float, float]] = deque(maxlen=64)
        """Goals reached and missed in episodes that ended lately."""

    def fill(self, rollout: Rollout, policy: Policy) -> Tensor:
        """Fill a rollout, and return the value (B,) of the observations after it."""
        for t in range(len(rollout.reward)):
            observation = torch.from_numpy(self.observation)
            with torch.no_grad():
                chance = policy.actions(observation)
                action = chance.sample()
                rollout.value[t] = policy.value(observation)[:, 0]
            rollout.observation[t], rollout.action[t] = observation, action
            rollout.log_prob[t] = chance.log_prob(action).sum(-1)
            rollout.is_reset[t] = torch.from_numpy(self.ended)
            self._step(rollout, t, action.clamp(-1.0, 1.0).numpy())
        with torch.no_grad():
            return policy.value(torch.from_numpy(self.observation))[:, 0]

    def _step(self, rollout: Rollout, t: int, action: np.ndarray) -> None:
        self.observation, reward, terminated, truncated, info = self.envs.step(action)
        self.ended = terminated | truncated
        rollout.reward[t] = torch.from_numpy(self.scale(reward, self.ended))
        rollout.terminated[t] = torch.from_numpy(terminated)
        rollout.done[t] = torch.from_numpy(self.ended)
        reached, missed = info["task/goals_reached"], info["task/goals_missed"]
        self.goals.extend(zip(reached[self.ended], missed[self.ended], strict=True))

    def success_rate(self) -> float:
        """Goals reached of goals reached or missed in recent episodes."""
        reached, missed = np.sum(self.goals, axis=0) if self.goals else (0.0, 0.0)
        return float(reached / max(reached + missed, 1.0))


def update(
    policy: Policy, optimiser: torch.optim.Optimizer, rollout: Rollout, last_value: Tensor,
    arguments: Arguments,
) -> None:  # fmt: skip
    """Passes over a rollout in shuffled batches, without its reset steps."""
    advantage = rollout.advantages(last_value, arguments.gamma, arguments.gae_lambda)
    real = ~rollout.is_reset
    columns = (rollout.observation, rollout.action, rollout.log_prob, rollout.value, advantage)
    samples = tuple(column[real] for column in columns)
    for _ in range(arguments.n_epochs):
        for batch in shuffled(samples, arguments.batch_size):
            optimiser.zero_grad()
            loss(policy, arguments, *batch).backward()
            nn.utils.clip_grad_norm_(policy.parameters(), arguments.max_grad_norm)
            optimiser.step()


def shuffled(samples: tuple[Tensor, ...], batch_size: int) -> Iterator[list[Tensor]]:
    """Every sample once, in batches of about the same size."""
    order = torch.randperm(len(samples[0]))
    for ids in order.chunk(max(len(order) // batch_size, 1)):
        yield [column[ids] for column in samples]


def loss(
    policy: Policy, arguments: Arguments, observation: Tensor, action: Tensor, log_prob: Tensor,
    value: Tensor, advantage: Tensor,
) -> Tensor:  # fmt: skip
    """The clipped surrogate of the policy and the squared error of the value."""
    ratio = (policy.actions(observation).log_prob(action).sum(-1) - log_prob).exp()
    near = ratio.clamp(1 - arguments.clip_range, 1 + arguments.clip_range)
    gain = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    surrogate = torch.minimum(ratio * gain, near * gain).mean()
    error = (policy.value(observation)[:, 0] - (value + advantage)).square().mean()
    return arguments.value_weight * error - surrogate


def main(arguments: Arguments) -> None:
    """Learn, with the progress and the goals reached in sight."""
    torch.manual_seed(arguments.seed)
    settings: dict[str, Any] = {"perception": arguments.perception}
    envs = gymnasium.make_vec("HRCReach-v0", num_envs=arguments.num_envs, **settings)
    spaces = envs.single_observation_space, envs.single_action_space
    sizes = [int(np.prod(space.shape or ())) for space in spaces]
    policy = Policy(*sizes)
    optimiser = torch.optim.Adam(policy.parameters(), arguments.learning_rate, eps=1e-5)
    rollout = Rollout(arguments.n_steps, arguments.num_envs, *sizes)
    collector = Collector(envs, arguments)
    per_rollout = arguments.n_steps * arguments.num_envs
    n_updates = -(-arguments.timesteps // per_rollout)
    started_s = time.monotonic()
    with Progress(*Progress.get_default_columns(), TextColumn("{task.fields[note]}")) as progress:
        task = progress.add_task("learning", total=n_updates, note="")
        for _ in range(n_updates):
            update(policy, optimiser, rollout, collector.fill(rollout, policy), arguments)
            note = f"goals {collector.success_rate():.0%}"
            progress.update(task, advance=1, note=note)
    seconds = time.monotonic() - started_s
    print(
        f"{n_updates * per_rollout} steps in {seconds:.0f} s "
        f"({n_updates * per_rollout / seconds:.0f} steps/s); "
        f"goals reached in the last {len(collector.goals)} episodes: {collector.success_rate():.0%}"
    )
    envs.close()


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
