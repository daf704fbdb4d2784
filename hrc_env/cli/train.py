"""python -m hrc_env train: learn, evaluate, draw, film. `agents/training.py` does the work."""

import math
from dataclasses import dataclass

from hrc_env.agents.requests import TrainingRequest
from hrc_env.cli.checks import at_least, writable_folder
from hrc_env.core.errors import ConfigError, check_names

ALGORITHMS = ("ppo", "ppo_lagrangian", "sac")
ENGINES = ("sb3", "ray")


@dataclass(frozen=True, kw_only=True)
class Train(TrainingRequest):
    """Train a policy, evaluate it on fixed seeds, draw its curve, film it.

    Ctrl-C saves what has been learnt and says how to go on. What lies in a folder is never
    overwritten: a second run into runs/quick goes to runs/quick-2. Curves: tensorboard --logdir
    runs.
    """

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
        self._check_engine(mine.algorithm)
        from hrc_env.agents import training  # here: it imports the learner

        writable_folder(self.resume or self.out, "--out" if self.resume is None else "--resume")
        return training.run(self)

    def _check_engine(self, algorithm: str) -> None:
        """Raise `ConfigError` for what the engine cannot do."""
        check_names("engine", [self.engine], ENGINES)
        if self.engine == "ray":
            if algorithm != "ppo":
                raise ConfigError(
                    f"--engine ray learns by ppo, and {algorithm} by Stable-Baselines3 only: "
                    "--algorithm ppo, or --engine sb3."
                )
            if self.workers is not None:
                at_least("--workers", self.workers, 1)
            return
        for name in ("workers", "address"):
            if getattr(self, name) is not None:
                raise ConfigError(f"--{name} goes with --engine ray.")
        if self.perception == "pixels":
            raise ConfigError(
                "--perception pixels is too slow to learn on with one machine: learn on keypoints, "
                "which emulates it, and play the policy on pixels; or --engine ray."
            )


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
