"""Behaviour cloning: a policy learns to do what the scripted agent would do where it goes itself.

The scripted agents have no memory, so that they can be asked about any observation: rounds of
DAgger (Ross et al. 2011, arXiv:1011.0686), in which policy and expert act by turns, so that what
comes late in an episode is seen, too; in the first round it is the expert alone, now and then
disturbed. What is learnt is always what the expert would do.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import learner
from hrc_env.sb3 import HRCVecEnv

from .env_info import Observation, env_info
from .experts import expert

with learner():
    import torch
    from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy

Arrays = dict[str, NDArray[np.float32]]
LEAST_SPREAD = 0.05
"""Of a policy's actions, as a standard deviation, when it has been taught."""
FLAT = ""
"""The name of an observation that has no parts."""


@dataclass(frozen=True, slots=True)
class CloningSettings:
    """How much is shown, and how it is learnt."""

    rounds: int = 4
    """Of gathering and learning."""
    steps: int = 2000
    """Gradient steps of each round, over all that has been gathered; three times as many in the
    last."""
    batch_size: int = 256
    """Observations in a gradient step."""
    learning_rate: float = 1e-3
    """Adam's step size; it falls to nothing within each round."""
    stretch: float = 25.0
    """Mean number of steps after which policy and expert take turns in an environment."""
    disturbance: float = 0.3
    """In the first round, what is added to the expert's actions where it is the policy's turn:
    standard deviation."""


def clone(
    policy: BasePolicy,
    env: HRCVecEnv,
    n_episodes: int,
    settings: CloningSettings,
    seed: int,
    tick: Callable[[float], None] = lambda share: None,
) -> list[float]:
    """Teach a policy what the task's scripted agent does, without yielding: care comes later.

    Args:
        policy: of a learner of Stable-Baselines3; its mean action is taught.
        env: where it is gathered; it is seeded and reset.
        n_episodes: of the task's length, of all rounds together.
        settings: of the learning.
        seed: of episodes, disturbances and the order of what is learnt.
        tick: told by how much the share that is done grew.

    Returns:
        The mean error of actions after each round.
    """
    rng, simulation = np.random.default_rng(seed), env.simulation
    teacher = expert(env_info(simulation))
    n_steps = -(-n_episodes * env.env.max_episode_steps // (settings.rounds * env.num_envs))
    env.seed(seed)
    observation, shown, errors = env.reset(), [], []
    alone = rng.random(env.num_envs) < 0.5
    for k in range(settings.rounds):
        for _ in range(n_steps):
            told = np.clip(teacher.act(observation), -1, 1)
            shown.append((_named(observation), told))
            alone ^= rng.random(env.num_envs) < 1 / settings.stretch
            if k == 0:
                own = told + settings.disturbance * rng.standard_normal(told.shape)
            else:
                own = policy.predict(observation, deterministic=True)[0]  # type: ignore[arg-type]
            acts = np.where(alone[:, None], own, told)
            env.step_async(np.clip(acts, -1, 1).astype(np.float32))
            observation = env.step_wait()[0]
            tick(1 / (settings.rounds * n_steps))
        n = settings.steps if k < settings.rounds - 1 else 3 * settings.steps
        errors.append(_learn(policy, _stacked(shown), n, settings, rng))
    if isinstance(policy, ActorCriticPolicy):  # it tries no more than it is unsure of
        policy.log_std.data.fill_(math.log(max(errors[-1], LEAST_SPREAD)))
    return errors


def _learn(
    policy: BasePolicy,
    shown: tuple[Arrays, NDArray[np.float32]],
    n_steps: int,
    settings: CloningSettings,
    rng: np.random.Generator,
) -> float:
    """Fit the mean action in so many gradient steps; its mean error in the last tenth of them."""
    seen, told = shown
    optimiser = torch.optim.Adam(policy.parameters(), settings.learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, n_steps)
    policy.set_training_mode(True)
    errors = []
    for _ in range(n_steps):
        batch = rng.integers(len(told), size=settings.batch_size)
        tensors: Any = {name: torch.as_tensor(part[batch]) for name, part in seen.items()}
        meant = policy._predict(tensors.get(FLAT, tensors), deterministic=True)
        off = (meant - torch.as_tensor(told[batch])).abs()
        loss = (off + off.square()).mean()  # small motions matter, and the few moments to switch
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
        errors.append(off.mean().item())
    policy.set_training_mode(False)
    return float(np.mean(errors[-max(n_steps // 10, 1) :]))


def _named(observation: Observation) -> Arrays:
    return dict(observation) if isinstance(observation, Mapping) else {FLAT: observation}


def _stacked(shown: list[tuple[Arrays, Any]]) -> tuple[Arrays, NDArray[np.float32]]:
    parts = {name: np.concatenate([seen[name] for seen, _ in shown]) for name in shown[0][0]}
    return parts, np.concatenate([told for _, told in shown])
