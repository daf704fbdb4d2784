"""The policies of the impact study: two scripted ones, PPO, and users' agents."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.agents.env_info import Agent, env_info
from hrc_env.agents.experts import make_expert
from hrc_env.agents.registry import make_agent
from hrc_env.agents.scripted import Yielding
from hrc_env.core.machine import n_cores
from hrc_env.engines.files import carried
from hrc_env.experiments.agents import describe_agent, find_env_arguments, label_agent
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.impact.episodes import SLOW_M, STOP_M, MakeAgent
from hrc_env.experiments.stage import PEOPLE, WORKER
from hrc_env.simulation import Simulation
from hrc_env.tasks import DEFAULT

SCRIPTED, SLOWED, PPO = "scripted", "scripted_slowed", "ppo"
WORDS = {
    SCRIPTED: "drives to its goals and ignores the worker",
    SLOWED: f"slows down below {SLOW_M:g} m of estimated separation and stops at {STOP_M:g} m",
    PPO: "was trained here with the reference",
}
POLICIES = tuple(WORDS)
"""Names of the study's built-in policies."""
SEED = 0
"""Seed of the learner and of its training environments."""
N_ENVS = 64
"""Number of training environments."""
PROXIMITY = 2.0
"""Weight of the proximity term in the reward, as in `train.py`."""
RAMP_SHARE = 0.5
"""Fraction of the training steps in which the weight of the proximity term grows from 0."""


@dataclass(frozen=True, slots=True)
class Policy:
    """A policy, and the margin that it adds to its separation limits."""

    name: str
    """One of `POLICIES`, or an agent as `hrc_env.make_agent` accepts it."""
    margin_m: float = 0.0
    """Distance that the policy adds to its limits [m]."""

    @property
    def label(self) -> str:
        """Label of the policy in the names of parts and results."""
        if self.name not in POLICIES:
            return label_agent(self.name, WORDS)
        if self.margin_m == 0:
            return self.name
        return f"{self.name}_plus_{round(1000 * self.margin_m)}mm"


def describe_policy(policy: Policy, ppo: str) -> dict[str, Any]:
    """Return the settings of a policy as JSON values, for the cache keys of its rows.

    Args:
        policy: the policy.
        ppo: digest of PPO's checkpoint, which is trained in the study.
    """
    settings = {"policy": asdict(policy), "ppo": ppo if policy.name == PPO else ""}
    own = {} if policy.name in POLICIES else {"agent": describe_agent(policy.name)}
    return settings | own


def choose_env_arguments(policy: Policy, control: str | None) -> dict[str, Any]:
    """Return the arguments of the environment that set a policy's control mode and observation.

    Args:
        policy: the policy.
        control: control mode if the policy's file does not name one; None: the default.
    """
    return {} if policy.name == PPO else find_env_arguments(policy.name, control)


def get_maker(policy: Policy, checkpoint: Path, trust: bool = False) -> MakeAgent:
    """Return a picklable function that makes the agent for a simulation."""
    if policy.name == SLOWED:
        return partial(_make_slowed, policy.margin_m)
    name = str(checkpoint) if policy.name == PPO else policy.name
    return partial(_make_agent, carried(name), trust)


def _make_slowed(margin_m: float, part: Simulation) -> Agent:
    """Return the scripted agent with a margin added to its limits."""
    return make_expert(env_info(part), Yielding(STOP_M + margin_m, SLOW_M + margin_m))


def _make_agent(name: str, trust: bool, part: Simulation) -> Agent:
    return make_agent(name, env_info(part), trust=trust)


def train_once(cache: PartCache, n_steps: int, path: Path, key: str, task: str = DEFAULT) -> str:
    """Return the digest of PPO's checkpoint; train PPO first if the file does not match its part.

    Args:
        cache: cache of the study's parts.
        n_steps: number of environment steps for the training.
        path: file of the checkpoint.
        key: key of the part.
        task: id of the environment.
    """
    learn = partial(learn_ppo, n_steps, path, task=task)
    part = cache.make_part(PPO, learn, key)
    if not path.exists() or _hash(path) != part["sha256"]:
        (cache.folder / f"{PPO}.json").unlink(missing_ok=True)
        part = cache.make_part(PPO, learn, key)
    return part["sha256"]


def learn_ppo(n_steps: int, path: Path, tick: PartProgress, task: str = DEFAULT) -> dict[str, Any]:
    """Train PPO on the camera emulator with the default estimator, and write its checkpoint."""
    from hrc_env.agents import checkpoints  # here: it imports the learner
    from hrc_env.sb3 import HRCVecEnv

    env = HRCVecEnv(
        N_ENVS, task=task, stagger=True, seed=SEED, perception="keypoints", estimator="particle",
        people=PEOPLE, config={"worker": WORKER, "reward": {"proximity": PROXIMITY}},
        num_threads=n_cores(),
    )  # fmt: skip
    learner = train(env, n_steps, SEED, lambda learner: tick(N_ENVS / n_steps))
    checkpoints.save(learner, path, {"people": PEOPLE, "worker": WORKER, "seed": SEED})
    return {"sha256": _hash(path), "n_steps": learner.num_timesteps}


def train(env: Any, n_steps: int, seed: int, on_step: Callable[[Any], None]) -> Any:
    """Train PPO and return the learner.

    Args:
        env: the environments, which are closed after the training.
        n_steps: number of environment steps for the training.
        seed: seed of the learner.
        on_step: callback that receives the learner before the training and after each step.
    """
    import torch  # here: it takes seconds to import and is optional
    from stable_baselines3.common.callbacks import ConvertCallback

    from hrc_env.agents import callbacks, ppo

    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # more are slower in networks as small as these
    try:
        learner = ppo.make_learner(env, ppo.PPOSettings(), seed)
        ramp = callbacks.Curriculum(callbacks.Ramp(round(RAMP_SHARE * n_steps)), env)
        on_step(learner)
        callback = ConvertCallback(lambda *_: on_step(learner) is None)
        learner.learn(n_steps, callback=[ramp, callback])
    finally:
        env.close()
        torch.set_num_threads(threads)
    return learner


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
