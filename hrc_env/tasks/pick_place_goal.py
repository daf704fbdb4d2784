"""Pick and place with goals that are separate from the observation, for hindsight replay."""

from dataclasses import dataclass

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import ConfigError, check_fields, require
from hrc_env.core.typing import Floats
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.goal import Goal
from hrc_env.tasks.pick_place import STUDS, PickPlace, PlacedConfig
from hrc_env.tasks.task import AnyTask

EACH = "each"
"""Kind of reward that counts each piece separately."""
ALL = "all"
"""Kind of reward that counts only whether all pieces are placed."""


@dataclass(frozen=True, slots=True)
class PickPlaceGoalConfig(PlacedConfig):
    """Criteria for placed pieces: `goal_m` for the reward, the other tolerances for the success."""

    goal_m: float = 0.02
    """Measured distance of a piece's centre from its target below which the reward counts the piece
    as placed [m]."""
    reward: str = EACH
    """Kind of reward: "each" for minus the fraction of pieces that are not placed, "all" for -1
    until all pieces are placed and then 0."""

    def __post_init__(self) -> None:
        PlacedConfig.__post_init__(self)
        check_fields(self, "be positive", "goal_m")
        if self.reward not in (EACH, ALL):
            name = type(self).__name__
            raise ConfigError(f'{name}.reward must be "{EACH}" or "{ALL}", got {self.reward!r}.')


def reward_placing(achieved: Floats, desired: Floats, config: PickPlaceGoalConfig) -> Floats:
    """Compute the reward (...) for positions of pieces.

    Args:
        achieved: (..., 9) positions of the three pieces [m].
        desired: (..., 9) target positions of the three pieces [m].
        config: radius `goal_m` and kind of reward.

    Returns:
        Minus the fraction of pieces that are farther than the radius from their targets; if
        `config.reward` is "all", -1 if any piece is, and otherwise 0.
    """
    off = (achieved - desired).reshape(*achieved.shape[:-1], STUDS, 3)
    away = np.sqrt((off**2).sum(-1)) >= config.goal_m
    return -(away.any(-1) if config.reward == ALL else away.sum(-1) / STUDS).astype(float)


def _measured_places(belief: Belief) -> Floats:
    return require(belief.objects, "A loose object").position_world.reshape(-1, 3 * STUDS)


def _target_places(belief: Belief) -> Floats:
    return np.broadcast_to(belief.task.places_world.ravel(), (len(belief.action), 3 * STUDS))


class PickPlaceGoal(PickPlace):
    """Bring pieces of studs to their goals, from a table that a worker also uses."""

    id = "HRCPickPlaceGoal-v0"
    config_type = PickPlaceGoalConfig
    observations = ()
    rewards = ()
    ends = (
        "Never terminates. The episode is a success if all pieces rest at their target "
        "positions at its end."
    )
    max_episode_steps = BUILT_IN[id].max_episode_steps
    goal = Goal(
        size=3 * STUDS,
        bound=4.0,
        achieved=_measured_places,
        desired=_target_places,
        reward=reward_placing,
        doc="Minus the share of pieces whose measured distance from their target positions exceeds "
        '`task.goal_m`; with `task.reward` "all", -1 unless all are within it. For a success, they '
        "must also be released and at rest.",
    )
    is_terminal = AnyTask.is_terminal
