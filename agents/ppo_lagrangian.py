"""PPO with a cost limit (PPO-Lagrangian), based on Stable-Baselines3's PPO.

A Lagrange multiplier weighs the advantage of the cost against that of the reward (Ray et al. 2019,
"Benchmarking Safe Exploration in Deep Reinforcement Learning"). It is updated by a PI controller of
the constraint violation (Stooke et al. 2020, arXiv:2007.03964). Costs are those of `info["cost"]`,
which are computed from the true state. The delivered policy acts with the mean actions, which cost
more or less than the exploring ones; the multiplier is therefore updated from the cost of mean
actions in environments of their own (`PPOLagrangian.watch_mean_actions`).
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
"""Learning rate of the cost critic, passes over a rollout, and samples in a gradient step."""


@dataclass(slots=True)
class Multiplier:
    """The Lagrange multiplier lambda = clip(integral + kp error), updated after each rollout.

    The rate of change of the integral is proportional to 1 + integral, so that lambda can reach any
    magnitude and decreases as fast as it grew. The integral does not change while lambda is clipped
    (anti-windup). The error is limited to 1, since policies take hundreds of rollouts to respond.
    """

    limit: float
    """Maximum mean cost of an episode."""
    kp: float = 8.0
    """Gain of the proportional term."""
    ki: float = 0.02
    """Gain of the integral term."""
    smoothing: float = 0.1
    """Weight of the latest rollout in the exponential moving average `cost`."""
    most: float = 20.0
    """Maximum value of lambda."""
    cost: float = float("nan")
    """Exponential moving average of the cost of an episode; NaN before the first rollout."""
    integral: float = 0.0
    """Integral term of the controller."""
    value: float = 0.0
    """Current value of the multiplier lambda."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "limit", "smoothing", "most")

    def update(self, cost: float, share: float = 1.0) -> None:
        """Update lambda after a rollout.

        Args:
            cost: mean cost of an episode in the rollout.
            share: number in (0, 1] by which the limit is divided; smaller numbers relax the limit.
        """
        new = 1.0 if np.isnan(self.cost) else self.smoothing
        self.cost = cost if new == 1.0 else (1 - new) * self.cost + new * cost
        error = min(share * self.cost / self.limit - 1, 1.0)
        integral = max(self.integral + self.ki * (1 + self.integral) * error, 0.0)
        wanted = integral + self.kp * error
        self.value = float(np.clip(wanted, 0.0, self.most))
        if wanted == self.value:
            self.integral = integral


class PPOLagrangian(PPO):
    """PPO with the advantages (A_reward - lambda A_cost) / (1 + lambda), each normalized.

    A separate critic predicts the discounted cost. Its targets are divided by their running
    standard deviation, since the critic does not learn unscaled targets of 15 to 50.

    Args:
        limit: maximum mean cost of an episode.
        episode_steps: number of steps of an episode, by which the mean cost per step is multiplied.
    """

    def __init__(
        self, *args: Any, limit: float = 10.0, episode_steps: int = 250, **kwargs: Any
    ) -> None:
        self.multiplier, self.episode_steps = Multiplier(limit), episode_steps
        self.share = 1.0
        """Number in (0, 1] by which the limit is divided; with a relaxed limit, the policy learns
        the task first.
        """
        self.spread, self.discounted = RunningMeanStd(), np.zeros(1)
        self._watched: VecEnv | None = None
        self._watched_observation: Any = None
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
        own = ("_costs", "_beyond", "_watched", "_watched_observation")
        return [*super()._excluded_save_params(), *own]

    def watch_mean_actions(self, env: "VecEnv | None") -> None:
        """Update the multiplier from the cost of mean actions from the next rollout on.

        After each rollout, the policy acts for as many steps in these environments, which continue
        where they stopped before. Checkpoints do not contain them.

        Args:
            env: environments for this purpose alone, with `cost` in their infos; None: the
                multiplier is updated from the cost of the exploring actions.
        """
        self._watched, self._watched_observation = env, None

    def collect_rollouts(
        self,
        env: VecEnv,
        callback: BaseCallback,
        rollout_buffer: RolloutBuffer,
        n_rollout_steps: int,
    ) -> bool:
        """Collect a rollout as in PPO, and update the multiplier and the cost critic.

        The advantages in the rollout buffer are replaced by those that include the cost.
        """
        self._costs: list[Floats] = []
        self._beyond: list[Floats] = []
        if not super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps):
            return False
        costs = np.array(self._costs)
        exploring = float(costs.mean()) * self.episode_steps
        delivered = self._measure_mean_actions() * self.episode_steps
        self.multiplier.update(exploring if self._watched is None else delivered, self.share)
        cost_rollout = self._evaluate_costs(costs, rollout_buffer)
        loss = self._learn(cost_rollout)
        value = self.multiplier.value
        mixed = _normalize(rollout_buffer.advantages)
        mixed = mixed - value * _normalize(cost_rollout.advantages)
        rollout_buffer.advantages = (mixed / (1 + value)).astype(np.float32)
        metrics = {"multiplier": value, "cost": self.multiplier.cost, "critic_loss": loss}
        metrics["exploring_cost"] = exploring
        for name, number in {**metrics, "limit": self.multiplier.limit}.items():
            self.logger.record(f"lagrangian/{name}", number)
        return True

    def _measure_mean_actions(self) -> float:
        """Act with mean actions for a rollout; return the mean cost of a step, or NaN if unwatched.

        The random numbers of the learner are not used.
        """
        env, costs = self._watched, list[float]()
        if env is None:
            return float("nan")
        if self._watched_observation is None:
            self._watched_observation = env.reset()
        for _ in range(self.n_steps):
            actions, _ = self.policy.predict(self._watched_observation, deterministic=True)
            self._watched_observation, _, _, infos = env.step(actions)
            costs += [info["cost"] for info in infos]
        return float(np.mean(costs))

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: Any = None) -> None:
        """Store the costs of a step, and the cost critic's values of truncated episodes.

        Stable-Baselines3 calls this method in each step.
        """
        super()._update_info_buffer(infos, dones)
        beyond = np.zeros(len(infos))
        for k, info in enumerate(infos):
            if info.get("TimeLimit.truncated"):
                observation = self.policy.obs_to_tensor(info["terminal_observation"])[0]
                beyond[k] = self._predict(observation).item()
        self._costs.append(np.array([info["cost"] for info in infos]))
        self._beyond.append(beyond)

    def _evaluate_costs(self, costs: Floats, rollout: RolloutBuffer) -> RolloutBuffer:
        """Return a copy of the rollout in which scaled costs (T, E) replace the rewards.

        Its values, returns and advantages are those of the cost.
        """
        sums, now = [], np.broadcast_to(self.discounted, costs.shape[1:])
        for cost, begins in zip(costs, rollout.episode_starts, strict=True):
            now = now * self.gamma * (1 - begins) + cost
            sums.append(now)
        self.discounted = now
        self.spread.update(np.concatenate(sums))
        result = copy.copy(rollout)
        scaled = costs / np.sqrt(self.spread.var + 1e-8)
        result.rewards = (scaled + self.gamma * np.array(self._beyond)).astype(np.float32)
        flat = _flatten(rollout.observations)
        result.values = self._predict(flat).reshape(costs.shape).numpy()
        result.advantages = np.zeros_like(result.rewards)
        last = self._predict(obs_as_tensor(self._last_obs, self.device))  # type: ignore[arg-type]
        result.compute_returns_and_advantage(last, self._last_episode_starts)  # type: ignore[arg-type]
        return result

    def _predict(self, observations: Any) -> torch.Tensor:
        with torch.no_grad():
            return self.cost_critic(observations)

    def _learn(self, rollout: RolloutBuffer) -> float:
        """Fit the cost critic to the returns; return its mean loss in the last pass."""
        observations = _flatten(rollout.observations)
        returns = torch.as_tensor(rollout.returns.reshape(-1, 1))
        losses = []
        for _ in range(CRITIC_PASSES):
            losses.clear()
            for batch in torch.randperm(len(returns)).split(CRITIC_BATCH):
                values = self.cost_critic(_select(observations, batch))
                loss = torch.nn.functional.mse_loss(values, returns[batch])
                self.cost_optimizer.zero_grad()
                loss.backward()
                self.cost_optimizer.step()
                losses.append(loss.item())
        return float(np.mean(losses))


def _flatten(observations: Any) -> Any:
    """Reshape observations (T, E, n), or arrays by name, to (T E, n)."""
    if isinstance(observations, dict):
        return {name: _flatten(part) for name, part in observations.items()}
    return torch.as_tensor(observations.reshape(-1, observations.shape[-1]))


def _select(observations: Any, ids: torch.Tensor) -> Any:
    if isinstance(observations, dict):
        return {name: part[ids] for name, part in observations.items()}
    return observations[ids]


def _normalize(advantages: Floats) -> Floats:
    return (advantages - advantages.mean()) / (advantages.std() + 1e-8)
