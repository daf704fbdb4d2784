"""PPO that keeps a limit: Stable-Baselines3's PPO, of which only the collection is another.

A multiplier weighs the advantage of the cost against that of the reward (Ray et al. 2019,
"Benchmarking Safe Exploration in Deep Reinforcement Learning"). It follows the error by proportion
and integral (Stooke et al. 2020, arXiv:2007.03964). Costs are those of `info["cost"]`, which are
counted on the truth.
"""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.errors import check_fields, learner
from hrc_env.core.typing import Floats

with learner():
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.buffers import RolloutBuffer
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.running_mean_std import RunningMeanStd
    from stable_baselines3.common.torch_layers import create_mlp
    from stable_baselines3.common.utils import obs_as_tensor
    from stable_baselines3.common.vec_env import VecEnv

CRITIC_RATE, CRITIC_PASSES, CRITIC_BATCH = 1e-3, 4, 1024
"""How the critic of the cost learns: step size, passes over a rollout, samples a gradient step."""


@dataclass(slots=True)
class Multiplier:
    """Compute lambda = clip(integral + kp error), after each rollout.

    The integral changes by a share of itself, so that it finds lambdas of any size, and leaves
    large ones as fast as it came to them. It rests while lambda is at an end that the error pushes
    it beyond, and the error counts no more than 1: policies take hundreds of rollouts to follow.
    """

    limit: float
    """Of the cost of an episode."""
    kp: float = 8.0
    ki: float = 0.02
    smoothing: float = 0.1
    """Share by which `cost` follows that of the latest rollout."""
    most: float = 20.0
    cost: float = float("nan")
    """Of an episode, smoothed."""
    integral: float = 0.0
    value: float = 0.0
    """The multiplier lambda."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "limit", "smoothing", "most")

    def update(self, cost: float, share: float = 1.0) -> None:
        """A rollout cost so much an episode, while limit / share was what it was to cost."""
        new = 1.0 if np.isnan(self.cost) else self.smoothing
        self.cost = cost if new == 1.0 else (1 - new) * self.cost + new * cost
        error = min(share * self.cost / self.limit - 1, 1.0)
        integral = max(self.integral + self.ki * (1 + self.integral) * error, 0.0)
        wanted = integral + self.kp * error
        self.value = float(np.clip(wanted, 0.0, self.most))
        if wanted == self.value:
            self.integral = integral


class PPOLagrangian(PPO):
    """PPO whose advantages are (A_reward - lambda A_cost) / (1 + lambda), each normalised.

    The cost has a critic of its own. Its targets are in units of the running deviation of the
    discounted cost: raw ones, of 15 to 50, it would never catch up with.

    Args:
        limit: of the cost of an episode.
        episode_steps: that an episode lasts; what a rollout costs is counted by the step.
    """

    def __init__(
        self, *args: Any, limit: float = 30.0, episode_steps: int = 250, **kwargs: Any
    ) -> None:
        self.multiplier, self.episode_steps = Multiplier(limit), episode_steps
        self.share = 1.0
        """The limit in force is limit / share: while it is wide, the task is learnt first."""
        self.spread, self.discounted = RunningMeanStd(), np.zeros(1)
        super().__init__(*args, **kwargs)

    def _setup_model(self) -> None:
        super()._setup_model()
        policy = self.policy
        hidden = policy.net_arch if isinstance(policy.net_arch, list) else policy.net_arch["vf"]
        seen = policy.make_features_extractor()
        layers = create_mlp(seen.features_dim, 1, hidden, policy.activation_fn)
        self.cost_critic = torch.nn.Sequential(seen, *layers)
        self.cost_optimizer = torch.optim.Adam(self.cost_critic.parameters(), CRITIC_RATE)

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        names, variables = super()._get_torch_save_params()
        return [*names, "cost_critic", "cost_optimizer"], variables

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_costs", "_beyond"]

    def collect_rollouts(
        self,
        env: VecEnv,
        callback: BaseCallback,
        rollout_buffer: RolloutBuffer,
        n_rollout_steps: int,
    ) -> bool:
        """As PPO does; then the multiplier and the critic learn what it cost, and the advantages
        count it."""
        self._costs: list[Floats] = []
        self._beyond: list[Floats] = []
        if not super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps):
            return False
        costs = np.array(self._costs)
        self.multiplier.update(float(costs.mean()) * self.episode_steps, self.share)
        judged = self._judged(costs, rollout_buffer)
        loss = self._learn(judged)
        value = self.multiplier.value
        mixed = _normalised(rollout_buffer.advantages) - value * _normalised(judged.advantages)
        rollout_buffer.advantages = (mixed / (1 + value)).astype(np.float32)
        told = {"multiplier": value, "cost": self.multiplier.cost, "critic_loss": loss}
        for name, number in {**told, "limit": self.multiplier.limit}.items():
            self.logger.record(f"lagrangian/{name}", number)
        return True

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: Any = None) -> None:
        """Called with the infos of every step: keeps the costs, and what lies beyond a time limit,
        by the critic."""
        super()._update_info_buffer(infos, dones)
        beyond = np.zeros(len(infos))
        for k, info in enumerate(infos):
            if info.get("TimeLimit.truncated"):
                seen = self.policy.obs_to_tensor(info["terminal_observation"])[0]
                beyond[k] = self._values(seen).item()
        self._costs.append(np.array([info["cost"] for info in infos]))
        self._beyond.append(beyond)

    def _judged(self, costs: Floats, rollout: RolloutBuffer) -> RolloutBuffer:
        """The rollout with costs (T, E) as its rewards: their returns and advantages."""
        sums, now = [], np.broadcast_to(self.discounted, costs.shape[1:])
        for cost, begins in zip(costs, rollout.episode_starts, strict=True):
            now = now * self.gamma * (1 - begins) + cost
            sums.append(now)
        self.discounted = now
        self.spread.update(np.concatenate(sums))
        judged = copy.copy(rollout)
        scaled = costs / np.sqrt(self.spread.var + 1e-8)
        judged.rewards = (scaled + self.gamma * np.array(self._beyond)).astype(np.float32)
        flat = _flat(rollout.observations)
        judged.values = self._values(flat).reshape(costs.shape).numpy()
        judged.advantages = np.zeros_like(judged.rewards)
        last = self._values(obs_as_tensor(self._last_obs, self.device))  # type: ignore[arg-type]
        judged.compute_returns_and_advantage(last, self._last_episode_starts)  # type: ignore[arg-type]
        return judged

    def _values(self, observations: Any) -> torch.Tensor:
        with torch.no_grad():
            return self.cost_critic(observations)

    def _learn(self, judged: RolloutBuffer) -> float:
        """Fit the critic to the returns; its mean loss in the last pass."""
        seen, returns = _flat(judged.observations), torch.as_tensor(judged.returns.reshape(-1, 1))
        losses = []
        for _ in range(CRITIC_PASSES):
            losses.clear()
            for batch in torch.randperm(len(returns)).split(CRITIC_BATCH):
                values = self.cost_critic(_rows(seen, batch))
                loss = torch.nn.functional.mse_loss(values, returns[batch])
                self.cost_optimizer.zero_grad()
                loss.backward()
                self.cost_optimizer.step()
                losses.append(loss.item())
        return float(np.mean(losses))


def _flat(observations: Any) -> Any:
    """Of all environments one after the other, (T, E, n) as (T E, n), also by name."""
    if isinstance(observations, dict):
        return {name: _flat(part) for name, part in observations.items()}
    return torch.as_tensor(observations.reshape(-1, observations.shape[-1]))


def _rows(observations: Any, ids: torch.Tensor) -> Any:
    if isinstance(observations, dict):
        return {name: part[ids] for name, part in observations.items()}
    return observations[ids]


def _normalised(advantages: Floats) -> Floats:
    return (advantages - advantages.mean()) / (advantages.std() + 1e-8)
