"""How each task is learnt by default: python -m hrc_env train --task ID"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hrc_env.cli.train import Train


@dataclass(frozen=True, kw_only=True)
class Run(Train):
    """Arguments that leave nothing open: what suits most tasks."""

    algorithm: str = "ppo"
    control: str = "joint"
    demonstrations: int = 0
    timesteps: int = 1_000_000
    proximity: float = 2.0


IMITATION: Mapping[str, Any] = {"control": "twist", "demonstrations": 256, "timesteps": 0}
"""Of what PPO alone does not find; picking and delivering it gained nothing after that."""
RECIPES: Mapping[str, Mapping[str, Any]] = {
    "HRCReachGoal-v0": {"algorithm": "sac", "control": "tool", "timesteps": 60_000},
    "HRCPickPlace-v0": {**IMITATION, "demonstrations": 512},
    "HRCPickPlaceGoal-v0": {**IMITATION, "demonstrations": 512},
    "HRCHandover-v0": IMITATION,
    "HRCDrywall-v0": IMITATION,
    "HRCDelivery-v0": {**IMITATION, "control": "joint", "demonstrations": 1024},
}
"""How each task is learnt by default: arguments of `python -m hrc_env train` by the task's id.

Where they differ from PPO, control "joint", no demonstrations and 1,000,000 steps. The learners'
own settings are `PPOSettings` and `SACSettings`."""


LIMITED: Mapping[str, Any] = {"timesteps": 3_000_000, "proximity": 0.0}
"""With a limit of cost, which then is all that keeps the robot away."""


def filled(arguments: Train) -> Run:
    """The arguments with the recipe of their task for what they leave open."""
    recipe = RECIPES.get(arguments.task, {})
    if arguments.algorithm == "ppo_lagrangian":
        recipe = {**(recipe if recipe.get("algorithm", "ppo") == "ppo" else {}), **LIMITED}
    elif arguments.algorithm not in (None, recipe.get("algorithm", "ppo")):
        recipe = {}  # another learner begins alone
    given = {name: each for name, each in vars(arguments).items() if each is not None}
    return Run(**{**recipe, **given})
