"""Train a policy, evaluate it, plot its curve and film it; `agents/training.py` does the work."""

import math
from dataclasses import dataclass

from hrc_env.agents.requests import TrainingRequest
from hrc_env.cli.checks import check_at_least, check_writable_folder
from hrc_env.core.errors import ConfigError, check_names

ALGORITHMS = ("ppo", "ppo_lagrangian", "sac")
ENGINES = ("sb3", "ray")


@dataclass(frozen=True, kw_only=True)
class Train(TrainingRequest):
    """Train a policy, evaluate it on fixed seeds, plot its learning curve and record a video.

    Ctrl-C saves the policy and prints the command that continues the training. Existing files are
    never overwritten: a second run with --out runs/quick writes to runs/quick-2. To see learning
    curves, type tensorboard --logdir runs.
    """

    def run(self) -> int:
        """Train the policy; return the exit status.

        Raises:
            ConfigError: an option has an invalid value, or options contradict each other.
        """
        from hrc_env.agents.recipes import fill_in  # here: --help imports no simulator

        for name in ("num_envs", "threads", "episodes"):
            check_at_least(f"--{name.replace('_', '-')}", getattr(self, name), 1)
        for name in ("seed", "proximity", "shield_change", "ramp", "demonstrations"):
            check_at_least(f"--{name.replace('_', '-')}", getattr(self, name), 0)
        mine = fill_in(self)
        check_at_least("--timesteps", mine.timesteps, 0 if mine.demonstrations else 1)
        check_names("algorithm", [mine.algorithm], ALGORITHMS)
        _check_limit(mine.cost_limit, mine.algorithm, mine.task)
        self._check_shield()
        if self.her and mine.algorithm != "sac":
            raise ConfigError(
                f"--her relabels the goals in a replay buffer, but {mine.algorithm} has no replay "
                "buffer: use --algorithm sac --her True, or leave out --her."
            )
        self._check_engine(mine.algorithm)
        from hrc_env.agents import training  # here: it imports the learner

        check_writable_folder(
            self.resume or self.out, "--out" if self.resume is None else "--resume"
        )
        return training.run(self)

    def _check_shield(self) -> None:
        """Raise `ConfigError` for an option about the shield without a shield."""
        options = {"--observe-shield": self.observe_shield, "--shield-change": self.shield_change}
        given = [name for name, value in options.items() if value]
        if given and self.shield is None and self.resume is None:
            raise ConfigError(
                f"{given[0]} requires a shield, since commands are not changed without one: add "
                "--shield qp, or leave out the option."
            )

    def _check_engine(self, algorithm: str) -> None:
        """Raise `ConfigError` for options that the engine does not support."""
        check_names("engine", [self.engine], ENGINES)
        if self.engine == "ray":
            if algorithm != "ppo":
                raise ConfigError(
                    f"--engine ray supports only ppo, and {algorithm} requires Stable-Baselines3: "
                    "use --algorithm ppo or --engine sb3."
                )
            if self.workers is not None:
                check_at_least("--workers", self.workers, 1)
            return
        for name in ("workers", "address"):
            if getattr(self, name) is not None:
                raise ConfigError(f"--{name} requires --engine ray.")
        if self.perception == "pixels":
            raise ConfigError(
                "--perception pixels is too slow for training on one machine: train with "
                "--perception keypoints, which emulates it, and play the policy with pixels; or "
                "use --engine ray."
            )


def _check_limit(limit: float | None, algorithm: str, task: object) -> None:
    """Raise `ConfigError` for a cost limit that is not positive, missing or ignored."""
    from hrc_env.agents.learner_settings import COST_LIMITS  # here: it imports the agents

    has_limit = algorithm == "ppo_lagrangian"
    if limit is not None and not (math.isfinite(limit) and limit > 0):
        default = COST_LIMITS.get(str(task))
        budget = "" if default is None else f"The default of {task} is {default:g}. "
        raise ConfigError(
            f"--cost-limit must be above 0, got {limit:g}. {budget}A shield reduces the cost "
            "further."
        )
    if limit is not None and not has_limit:
        raise ConfigError(
            f"--cost-limit requires ppo_lagrangian, and {algorithm} ignores cost: use --algorithm "
            "ppo_lagrangian, or leave out the limit."
        )
    if has_limit and limit is None:
        raise ConfigError(
            f"--algorithm ppo_lagrangian requires a limit, and {task} has no default: use, for "
            "example, --cost-limit 10."
        )
