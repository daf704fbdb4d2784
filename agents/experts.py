"""Scripted agents (experts) for the built-in tasks."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.observations import split
from hrc_env.tasks.task import ancestor_of

from .delivery import Deliverer
from .drywall import BoardHolder
from .env_info import Agent, EnvInfo, Observation
from .handover import Bringer
from .pick_place import PickPlacer
from .scripted import Reacher, Yielding

Terms = dict[str, NDArray[np.float64]]
PLACED_M = 0.008
"""Distance from its target within which a released piece counts as placed [m]."""


def read_reach_goal(terms: Terms) -> Terms:
    """Compute the terms that `Reacher` needs from the achieved and desired goals."""
    return {"goal_from_tool": terms["desired_goal"] - terms["achieved_goal"]}


def read_pick_place_goal(terms: Terms) -> Terms:
    """Compute the terms that `PickPlacer` needs from the achieved and desired goals."""
    way = terms["desired_goal"] - terms["achieved_goal"]
    off_m = np.linalg.norm(way.reshape(*way.shape[:-1], -1, 3), axis=-1)
    placed = (off_m < PLACED_M) & (terms["object_held"] < 0.5)
    return {"place_from_object": way, "object_placed": placed.astype(float)}


class GoalReader:
    """Wrapper of a scripted agent for tasks with goals that are separate from the observation."""

    def __init__(self, expert: Reacher | PickPlacer, read: Callable[[Terms], Terms]) -> None:
        self.expert, self.read = expert, read

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return the actions (..., A) of the scripted agent."""
        terms = split(observation, self.expert.env_info.layout)
        return self.expert.act_on({**terms, **self.read(terms)})


EXPERTS: dict[str, Callable[[EnvInfo, Yielding | None], Agent]] = {
    "HRCReach-v0": Reacher,
    "HRCPickPlace-v0": PickPlacer,
    "HRCDelivery-v0": Deliverer,
    "HRCDrywall-v0": BoardHolder,
    "HRCHandover-v0": Bringer,
    "HRCReachGoal-v0": lambda info, y: GoalReader(Reacher(info, y), read_reach_goal),
    "HRCPickPlaceGoal-v0": lambda info, y: GoalReader(PickPlacer(info, y), read_pick_place_goal),
}
"""Functions that create the scripted agents, by the id of their task."""


def make_expert(env_info: EnvInfo, yielding: Yielding | None = None) -> Agent:
    """Return the scripted agent for a task, or for the task that it derives from.

    Args:
        env_info: information about the environment.
        yielding: parameters of slowing down near people; None to ignore them.

    Raises:
        ConfigError: there is no scripted agent for the task.
    """
    task = ancestor_of(env_info.task, EXPERTS)
    if task not in EXPERTS:
        raise ConfigError(
            f"There is no scripted agent for {env_info.task}, only for {', '.join(EXPERTS)}. The "
            "agent 'random' and checkpoints work with every task."
        )
    return EXPERTS[task](env_info, yielding)
