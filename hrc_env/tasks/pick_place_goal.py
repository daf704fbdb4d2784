"""Picking and placing with goals apart from the observation: the form that HER learns from."""

from dataclasses import dataclass

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import ConfigError, check_fields, needed
from hrc_env.core.typing import Floats
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.goal import Goal
from hrc_env.tasks.pick_place import STUDS, PickPlace, PlacedConfig
from hrc_env.tasks.task import Task

EACH, ALL = "each", "all"
"""How the reward counts pieces."""


@dataclass(frozen=True, slots=True)
class PickPlaceGoalConfig(PlacedConfig):
    """What counts as placed in the end, and what the reward asks of places."""

    goal_m: float = 0.02
    """The reward counts a piece whose middle, as measured, is nearer to its place than this [m]."""
    reward: str = EACH
    """"each": minus the share of pieces that are not there, as environments of several things to do
    count each of them; "all": -1 until all are there, then 0."""

    def __post_init__(self) -> None:
        PlacedConfig.__post_init__(self)
        check_fields(self, "be positive", "goal_m")
        if self.reward not in (EACH, ALL):
            raise ConfigError(f'{type(self).__name__}.reward must be "{EACH}" or "{ALL}", '
                              f"got {self.reward!r}.")  # fmt: skip


def near(achieved: Floats, desired: Floats, config: PickPlaceGoalConfig) -> Floats:
    """(...) minus the share of pieces that are not near where they are to be, or -1 if any is not;
    0 if all are. Places of pieces are (..., 9)."""
    off = (achieved - desired).reshape(*achieved.shape[:-1], STUDS, 3)
    away = np.sqrt((off**2).sum(-1)) >= config.goal_m
    return -(away.any(-1) if config.reward == ALL else away.sum(-1) / STUDS).astype(float)


def _measured(now: Belief) -> Floats:
    return needed(now.objects, "A loose object").position_world.reshape(-1, 3 * STUDS)


def _places(now: Belief) -> Floats:
    return np.broadcast_to(now.task.places_world.ravel(), (len(now.action), 3 * STUDS))


class PickPlaceGoal(PickPlace):
    """Bring pieces of studs from a table to where they are asked for, while a worker takes from
    the same table.
    """

    id = "HRCPickPlaceGoal-v0"
    config_type = PickPlaceGoalConfig
    observations = ()
    rewards = ()
    ends = "Not before the time is up. A success: all pieces rest in their places now."
    max_episode_steps = BUILT_IN[id].max_episode_steps
    goal = Goal(
        size=3 * STUDS,
        bound=4.0,
        achieved=_measured,
        desired=_places,
        reward=near,
        doc="Minus the share of pieces that are not within `task.goal_m` of their places, as "
        'measured; -1 or 0 with `task.reward` "all". A success also asks whether they are let '
        "go and at rest.",
    )
    is_terminal = Task.is_terminal
