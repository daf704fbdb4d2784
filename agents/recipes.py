"""How each task is learnt by default: python -m hrc_env train --task ID"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .learner_settings import RECIPES as RECIPES
from .requests import TrainingRequest


@dataclass(frozen=True, kw_only=True)
class Run(TrainingRequest):
    """Arguments that leave nothing open: what suits most tasks."""

    algorithm: str = "ppo"
    control: str = "joint"
    demonstrations: int = 0
    timesteps: int = 1_000_000
    proximity: float = 2.0


LIMITED: Mapping[str, Any] = {"timesteps": 3_000_000, "proximity": 0.0}
"""With a limit of cost, which then is all that keeps the robot away."""


def filled(arguments: TrainingRequest) -> Run:
    """The arguments with the recipe of their task for what they leave open."""
    recipe = RECIPES.get(arguments.task, {})
    if arguments.algorithm == "ppo_lagrangian":
        recipe = {**(recipe if recipe.get("algorithm", "ppo") == "ppo" else {}), **LIMITED}
    elif arguments.algorithm not in (None, recipe.get("algorithm", "ppo")):
        recipe = {}  # another learner begins alone
    given = {name: each for name, each in vars(arguments).items() if each is not None}
    return Run(**{**recipe, **given})
