"""The learnt policy of the experiment: PPO, always from the same seed, kept in the folder.

The learner's libraries, which take seconds, are imported where somebody learns.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.checkout import agents
from hrc_env.experiments.impact.trial.episodes import PEOPLE
from hrc_env.experiments.study.cache import PartCache, PartProgress

SEED = 0
"""Of the learner and of the environments that it learns in."""
N_ENVS = 64
PROXIMITY = 2.0
"""Weight of closeness in the reward, as of `train.py`."""
RAMP_SHARE = 0.5
"""In this share of the steps that weight grows from 0."""
LABEL = "ppo"


@dataclass(frozen=True, slots=True)
class Learning:
    """How long the policy learns, and where it is kept."""

    n_steps: int
    n_threads: int
    path: Path


def trained(cache: PartCache, learning: Learning) -> Path:
    """The checkpoint: the one that is there, or a new one if it is not what the part says."""
    path = learning.path
    part = cache.part(LABEL, lambda tick: _train(learning, tick))
    if not path.exists() or _digest(path) != part["sha256"]:
        (cache.folder / f"{LABEL}.json").unlink(missing_ok=True)
        cache.part(LABEL, lambda tick: _train(learning, tick))
    return path


def _train(learning: Learning, tick: PartProgress) -> dict[str, Any]:
    """Learn on the camera emulator with the default estimator; write the checkpoint."""
    ppo, curriculum = agents("ppo"), agents("curriculum")
    import torch
    from stable_baselines3.common.callbacks import ConvertCallback

    from hrc_env.sb3 import HRCVecEnv

    def advance(*_: Any) -> bool:
        tick(N_ENVS / learning.n_steps)
        return True

    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # more are slower in networks as small as these
    env = HRCVecEnv(
        N_ENVS, stagger=True, seed=SEED, perception="keypoints", estimator="particle",
        people=PEOPLE, config={"reward": {"proximity": PROXIMITY}}, num_threads=learning.n_threads,
    )  # fmt: skip
    try:
        learner = ppo.make_learner(env, ppo.PPOSettings(), SEED)
        ramp = curriculum.Ramp(round(RAMP_SHARE * learning.n_steps))
        care = curriculum.ProximityCurriculum(ramp, env)
        learner.learn(learning.n_steps, callback=[care, ConvertCallback(advance)])
        ppo.save(learner, learning.path, {"people": PEOPLE, "seed": SEED})
    finally:
        env.close()
        torch.set_num_threads(threads)
    return {"sha256": _digest(learning.path), "n_steps": learner.num_timesteps}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
