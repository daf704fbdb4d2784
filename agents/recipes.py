"""Default training recipe of each task, for `python -m hrc_env train --task ID`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .learner_settings import COST_LIMITS
from .learner_settings import RECIPES as RECIPES
from .requests import TrainingRequest


@dataclass(frozen=True, kw_only=True)
class Run(TrainingRequest):
    """Training arguments without missing values, with defaults that suit most tasks."""

    algorithm: str = "ppo"
    control: str = "joint"
    demonstrations: int = 0
    timesteps: int = 1_000_000
    proximity: float = 2.0


LIMITED: Mapping[str, Any] = {"timesteps": 3_000_000, "proximity": 0.0}
"""Recipe for training with a cost limit, which replaces the proximity term."""


def fill_in(arguments: TrainingRequest) -> Run:
    """Return the arguments, with those that are None replaced by the recipe of their task."""
    recipe = RECIPES.get(str(arguments.task), {})
    if arguments.algorithm == "ppo_lagrangian":
        budget = {"cost_limit": COST_LIMITS.get(str(arguments.task))}
        ours = recipe if recipe.get("algorithm", "ppo") == "ppo" else {}
        recipe = {**ours, **LIMITED, **budget}
    elif arguments.algorithm not in (None, recipe.get("algorithm", "ppo")):
        recipe = {}  # the recipe is for another learner
    given = {name: each for name, each in vars(arguments).items() if each is not None}
    return Run(**{**recipe, **given})
