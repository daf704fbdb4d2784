"""Behaviour cloning of the scripted agent, in states that the policy itself reaches (DAgger).

Scripted agents have no memory and can be queried for any observation, as DAgger requires (Ross et
al. 2011, arXiv:1011.0686). Policy and expert take turns in acting, so that the demonstrations
include late parts of an episode. In the first round the expert acts alone, with occasional
disturbances. The training targets are always the expert's actions.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import learner
from hrc_env.sb3 import HRCVecEnv

from .env_info import Observation, env_info
from .experts import make_expert

with learner():
    import torch
    from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy

Arrays = dict[str, NDArray[np.float32]]
LEAST_SPREAD = 0.05
"""Minimum standard deviation of the policy's action distribution after cloning."""
FLAT = ""
"""Key of an observation that is a single array."""


class Demonstrations(NamedTuple):
    """Observations and the expert's actions for them."""

    observations: Arrays
    """Observations (N, ...) by the name of their part."""
    actions: NDArray[np.float32]
    """Actions of the expert (N, A)."""


@dataclass(frozen=True, slots=True)
class CloningSettings:
    """Settings of behaviour cloning: rounds, optimizer, and how policy and expert alternate."""

    rounds: int = 4
    """Number of rounds; each one collects demonstrations and trains on all of them."""
    steps: int = 2000
    """Number of gradient steps per round; the last round has three times as many."""
    batch_size: int = 256
    """Number of observations in a gradient step."""
    learning_rate: float = 1e-3
    """Learning rate of Adam, which decreases to 0 within each round."""
    stretch: float = 25.0
    """Mean number of steps after which policy and expert take turns in an environment."""
    disturbance: float = 0.3
    """Standard deviation of noise on the expert's actions, in the policy's turns of the first
    round."""


def clone(
    policy: BasePolicy,
    env: HRCVecEnv,
    n_episodes: int,
    settings: CloningSettings,
    seed: int,
    tick: Callable[[float], None] = lambda share: None,
) -> list[float]:
    """Train a policy to imitate the task's scripted agent; return the error of each round.

    The scripted agent does not slow down near people.

    Args:
        policy: policy of a learner of Stable-Baselines3, the mean action of which is trained.
        env: environments for the demonstrations; they are seeded and reset.
        n_episodes: number of episodes of full length, over all rounds.
        settings: settings of the training.
        seed: seed of episodes, disturbances and batches.
        tick: function that is called with the increase of the completed fraction.

    Returns:
        Mean error of actions after each round.
    """
    rng, simulation = np.random.default_rng(seed), env.simulation
    teacher = make_expert(env_info(simulation))
    n_steps = -(-n_episodes * env.env.max_episode_steps // (settings.rounds * env.num_envs))
    env.seed(seed)
    observation, shown, errors = env.reset(), [], []
    alone = rng.random(env.num_envs) < 0.5
    for k in range(settings.rounds):
        for _ in range(n_steps):
            target = np.clip(teacher.act(observation), -1, 1)
            shown.append((_split_parts(observation), target))
            alone ^= rng.random(env.num_envs) < 1 / settings.stretch
            if k == 0:
                own = target + settings.disturbance * rng.standard_normal(target.shape)
            else:
                own = policy.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]
            acts = np.where(alone[:, None], own, target)
            env.step_async(np.clip(acts, -1, 1).astype(np.float32))
            observation = env.step_wait()[0]
            tick(1 / (settings.rounds * n_steps))
        n = settings.steps if k < settings.rounds - 1 else 3 * settings.steps
        errors.append(_learn(policy, _stack(shown), n, settings, rng))
    if isinstance(policy, ActorCriticPolicy):  # the exploration noise is no larger than the error
        policy.log_std.data.fill_(math.log(max(errors[-1], LEAST_SPREAD)))
    return errors


def _learn(
    policy: BasePolicy,
    shown: Demonstrations,
    n_steps: int,
    settings: CloningSettings,
    rng: np.random.Generator,
) -> float:
    """Fit the policy's mean action; return its mean error over the last tenth of the steps."""
    targets = shown.actions
    optimiser = torch.optim.Adam(policy.parameters(), settings.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, n_steps)
    policy.set_training_mode(True)
    errors = []
    for _ in range(n_steps):
        batch = rng.integers(len(targets), size=settings.batch_size)
        parts: Any = {k: torch.as_tensor(v[batch]) for k, v in shown.observations.items()}
        mean = policy._predict(parts.get(FLAT, parts), deterministic=True)
        off = (mean - torch.as_tensor(targets[batch])).abs()
        loss = (off + off.square()).mean()  # small motions and rare switches matter
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        errors.append(off.mean().item())
    policy.set_training_mode(False)
    return float(np.mean(errors[-max(n_steps // 10, 1) :]))


def _split_parts(observation: Observation) -> Arrays:
    return dict(observation) if isinstance(observation, Mapping) else {FLAT: observation}


def _stack(shown: list[tuple[Arrays, Any]]) -> Demonstrations:
    parts = {name: np.concatenate([seen[name] for seen, _ in shown]) for name in shown[0][0]}
    return Demonstrations(parts, np.concatenate([target for _, target in shown]))
