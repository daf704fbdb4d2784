"""python -m hrc_env train: learn, evaluate, draw, film. `agents/training.py` does the work."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.cli.environment import EnvironmentArguments
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import merge

ALGORITHMS = ("ppo", "ppo_lagrangian", "sac")


@dataclass(frozen=True, kw_only=True)
class Train(EnvironmentArguments):
    """Train a policy, evaluate it on fixed seeds, draw its curve, film it.

    Ctrl-C saves what has been learnt and says how to go on. What lies in a folder is never
    overwritten: a second run into runs/quick goes to runs/quick-2. Curves: tensorboard --logdir
    runs.
    """

    out: Path = Path("runs/quick")
    """Folder for checkpoints, curves, TensorBoard logs and the film."""
    algorithm: str | None = None
    """ppo; ppo_lagrangian, which keeps a limit of cost; or sac, which learns with hindsight (HER)
    where the task has goals apart. This, control, demonstrations and timesteps are what suits the
    task if not given (agents/recipes.py)."""
    cost_limit: float | None = None
    """With ppo_lagrangian: what an episode may cost (info["cost"], counted on the truth) [control
    steps]."""
    her: bool | None = None
    """With sac: True or False, whether transitions are judged by other goals, too; by default where
    there are goals."""
    demonstrations: int | None = None
    """Episodes of the scripted agent that the policy learns to imitate before it learns itself."""
    timesteps: int | None = None
    """Environment steps in all (with --resume: counted from the start); 0: it only imitates."""
    num_envs: int = 64
    """Environments that step together."""
    seed: int = 0
    """Seed of the environments and of the learner."""
    perception: str = "keypoints"
    """What the robot learns on: keypoints (camera emulator), truth or none."""
    proximity: float | None = None
    """Weight of closeness to the estimated body in the reward; 0 trains without it. 2 if not given,
    but 0 with a limit, which then is all that keeps the robot away."""
    ramp: int = 400_000
    """Environment steps in which that weight grows from 0, and a limit narrows: the task first,
    then care. 0: all of it from the start; the policy learns several times slower, and is more
    careful in the end."""
    threads: int | None = None
    """How many ranges the environments are stepped in at once; all cores by default."""
    episodes: int = 128
    """Episodes of the evaluation at the end."""
    film: bool = True
    """Film the trained policy at the end (needs OpenGL)."""
    resume: Path | None = None
    """A folder of an earlier run to go on with; its environment and seed stay what they were."""

    def run(self) -> int:
        """Train; a `ConfigError` for a number or a name that cannot be learnt with."""
        from hrc_env.agents.recipes import filled  # here: --help imports no simulator

        for name in ("num_envs", "threads", "episodes"):
            at_least(f"--{name.replace('_', '-')}", getattr(self, name), 1)
        for name in ("seed", "proximity", "ramp", "demonstrations"):
            at_least(f"--{name}", getattr(self, name), 0)
        mine = filled(self)
        at_least("--timesteps", mine.timesteps, 0 if mine.demonstrations else 1)
        check_names("algorithm", [mine.algorithm], ALGORITHMS)
        _check_limit(self.cost_limit, mine.algorithm)
        if self.her and mine.algorithm != "sac":
            raise ConfigError(
                f"--her judges what a replay buffer holds by other goals, and {mine.algorithm} has "
                "no such buffer: --algorithm sac --her True, or leave it out."
            )
        if self.perception == "pixels":
            raise ConfigError(
                "--perception pixels is too slow to learn on: learn on keypoints, which emulates "
                "it, and play the policy on pixels."
            )
        from hrc_env.agents import training  # here: it imports the learner

        writable_folder(self.resume or self.out, "--out" if self.resume is None else "--resume")
        return training.run(self)

    def keywords(self) -> dict[str, Any]:
        """Keyword arguments of the environment that a run learns and is judged in."""
        given = super().keywords()
        safety = {} if self.proximity is None else {"reward": {"proximity": self.proximity}}
        config = merge(safety, given.get("config", {}))
        return {**given, "config": config, "num_threads": self.threads}


def _check_limit(limit: float | None, algorithm: str) -> None:
    keeps = algorithm == "ppo_lagrangian"
    if limit is not None and not (math.isfinite(limit) and limit > 0):
        raise ConfigError(
            f"--cost-limit must be above 0, got {limit:g}. Where nobody cares an episode costs "
            "about 70; 30 can be kept. What may cost nothing wants a shield."
        )
    if limit is not None and not keeps:
        raise ConfigError(
            f"--cost-limit is kept by ppo_lagrangian only, and {algorithm} knows of no cost: "
            "--algorithm ppo_lagrangian, or leave the limit out."
        )
    if keeps and limit is None:
        raise ConfigError(
            "--algorithm ppo_lagrangian keeps a limit: say which, as --cost-limit 30."
        )
