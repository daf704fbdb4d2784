"""The policies that are given other perception: two scripted ones, PPO, which learns here, and
those of the user's own."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.agents.env_info import Agent, env_info
from hrc_env.agents.experts import expert
from hrc_env.agents.registry import control_of, make_agent
from hrc_env.agents.scripted import Yielding
from hrc_env.core.machine import n_cores
from hrc_env.engines.files import carried
from hrc_env.experiments.agents import described, label_of
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.impact.episodes import SLOW_M, STOP_M, MakeAgent
from hrc_env.experiments.stage import PEOPLE
from hrc_env.simulation import Simulation
from hrc_env.tasks import DEFAULT

SCRIPTED, SLOWED, PPO = "scripted", "scripted_slowed", "ppo"
WORDS = {
    SCRIPTED: "drives to its goals whoever is near",
    SLOWED: f"slows down from {SLOW_M:g} m of estimated separation and stands still at "
    f"{STOP_M:g} m",
    PPO: "was trained here on the reference",
}
POLICIES = tuple(WORDS)
"""Those of the study, with a description of each; others are the user's own."""
SEED = 0
"""Of the learner and of the environments that it learns in."""
N_ENVS = 64
PROXIMITY = 2.0
"""Weight of closeness in the reward, as of `train.py`."""
RAMP_SHARE = 0.5
"""In this share of the steps that weight grows from 0."""


@dataclass(frozen=True, slots=True)
class Policy:
    """A policy, and what it adds to the distances that it keeps."""

    name: str
    """One of `POLICIES`, or an agent as `hrc_env.make_agent` takes it."""
    margin_m: float = 0.0

    @property
    def label(self) -> str:
        """As parts and results are called."""
        if self.name not in POLICIES:
            return label_of(self.name, WORDS)
        if self.margin_m == 0:
            return self.name
        return f"{self.name}_plus_{round(1000 * self.margin_m)}mm"


def made_of(policy: Policy, ppo: str) -> dict[str, Any]:
    """Return the settings of a policy that key its rows, besides people and perception, as JSON
    can hold them.

    Args:
        policy: of the rows.
        ppo: digest of the checkpoint that was trained here.
    """
    found = {"policy": asdict(policy), "ppo": ppo if policy.name == PPO else ""}
    own = {} if policy.name in POLICIES else {"agent": described(policy.name)}
    return found | own


def control_for(policy: Policy, control: str | None) -> str | None:
    """Return the control of a policy: that of its file, or else the requested one; PPO has learnt
    with the default one."""
    if policy.name == PPO:
        return None
    return control if policy.name in POLICIES else control_of(policy.name) or control


def maker(policy: Policy, checkpoint: Path, trust: bool = False) -> MakeAgent:
    """What makes the agent for a robot, on any machine."""
    if policy.name == SLOWED:
        return partial(_slowed, policy.margin_m)
    name = str(checkpoint) if policy.name == PPO else policy.name
    return partial(_agent, carried(name), trust)


def _slowed(margin_m: float, part: Simulation) -> Agent:
    """Return the scripted agent that keeps so much more than by itself."""
    return expert(env_info(part), Yielding(STOP_M + margin_m, SLOW_M + margin_m))


def _agent(name: str, trust: bool, part: Simulation) -> Agent:
    return make_agent(name, env_info(part), trust=trust)


def trained(cache: PartCache, n_steps: int, path: Path, key: str, task: str = DEFAULT) -> str:
    """The digest of PPO's checkpoint, which is made anew where it is not what the part says."""
    learn = partial(learn_ppo, n_steps, path, task=task)
    part = cache.part(PPO, learn, key)
    if not path.exists() or _digest(path) != part["sha256"]:
        (cache.folder / f"{PPO}.json").unlink(missing_ok=True)
        part = cache.part(PPO, learn, key)
    return part["sha256"]


def learn_ppo(n_steps: int, path: Path, tick: PartProgress, task: str = DEFAULT) -> dict[str, Any]:
    """Learn on the camera emulator with the default estimator; write the checkpoint."""
    from hrc_env.agents import checkpoints  # here: it imports the learner
    from hrc_env.sb3 import HRCVecEnv

    env = HRCVecEnv(
        N_ENVS, task=task, stagger=True, seed=SEED, perception="keypoints", estimator="particle",
        people=PEOPLE, config={"reward": {"proximity": PROXIMITY}}, num_threads=n_cores(),
    )  # fmt: skip
    learner = taught(env, n_steps, SEED, lambda learner: tick(N_ENVS / n_steps))
    checkpoints.save(learner, path, {"people": PEOPLE, "seed": SEED})
    return {"sha256": _digest(path), "n_steps": learner.num_timesteps}


def taught(env: Any, n_steps: int, seed: int, note: Callable[[Any], None]) -> Any:
    """PPO that has learnt for so many steps on environments, which are closed then; it is noted at
    first and after each of their steps."""
    import torch  # here: a learner takes seconds to import, and need not be there
    from stable_baselines3.common.callbacks import ConvertCallback

    from hrc_env.agents import callbacks, ppo

    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # more are slower in networks as small as these
    try:
        learner = ppo.make_learner(env, ppo.PPOSettings(), seed)
        care = callbacks.Curriculum(callbacks.Ramp(round(RAMP_SHARE * n_steps)), env)
        note(learner)
        noted = ConvertCallback(lambda *_: note(learner) is None)
        learner.learn(n_steps, callback=[care, noted])
    finally:
        env.close()
        torch.set_num_threads(threads)
    return learner


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
