"""Reaching one goal, which stands apart from the observation: the form that HER learns from."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.typing import Floats, Ints, Points3, Records, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.goal import Goal
from hrc_env.tasks.reach import TargetConfig, drawn_goal, given_target, goal_places
from hrc_env.tasks.task import Task
from hrc_env.world import World


@dataclass(frozen=True, slots=True)
class ReachGoalConfig(TargetConfig):
    """Where the goal is, and what counts as reaching it."""


REACH_GOAL = np.dtype(
    [
        ("goal_world", "f8", (3,)),  # [m]
        ("there", "?"),  # whether the tool point is within the radius now
    ],
    align=True,
)
"""The task of one environment."""


@dataclass(frozen=True, slots=True)
class ReachGoalView:
    """The robots' view of their task."""

    goal_world: Points3
    """(B, 3) [m]."""


def reached(achieved: Floats, desired: Floats, config: ReachGoalConfig) -> Floats:
    """(...) 0 where places (..., 3) are nearer to each other than the radius, else -1."""
    off_m = np.sqrt(((achieved - desired) ** 2).sum(-1))
    return np.where(off_m < config.radius_m, 0.0, -1.0)


class ReachGoal(Task[ReachGoalConfig, Records]):
    """Bring the tool to a goal and keep it there, in a volume shared with a worker."""

    id = "HRCReachGoal-v0"
    config_type = ReachGoalConfig
    achieved = "task/goals_reached"
    failed = "task/goals_missed"
    starts = (
        "The arm is near home, turned anywhere in front of its base. One goal, for the whole "
        "episode."
    )
    ends = "Not before the time is up. A success: the tool is at its goal now."
    max_episode_steps = BUILT_IN[id].max_episode_steps
    goal = Goal(
        size=3,
        bound=4.0,
        achieved=lambda now: now.robot.tool_world,
        desired=lambda now: now.task.goal_world,
        reward=reached,
        doc="0 while the tool point is within `task.radius_m` of its goal, else -1.",
    )

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, REACH_GOAL)

    def reach_targets(self) -> list[ReachTarget]:
        return goal_places(self.config)

    def goal_targets(self, goal: Floats) -> list[ReachTarget]:
        """A place (3,) [m, world]: the goal of the episode."""
        return given_target(goal, self.config)

    def set_goal(self, state: Records, ids: Ints, goals: Floats, world: World) -> None:
        state["goal_world"][ids] = goals
        state["there"][ids] = reached(world.robot.tool_world, goals, self.config) == 0.0

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Give environments `ids` a goal each."""
        for b, tool_world in zip(ids.tolist(), world.robot.tool_world, strict=True):
            goal_world = np.array(drawn_goal(rngs[b], self.config))
            there = reached(tool_world, goal_world, self.config) == 0.0
            state["goal_world"][b], state["there"][b] = goal_world, there

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge where the tool is; a copy of the state."""
        state["there"] = reached(world.robot.tool_world, state["goal_world"], self.config) == 0.0
        return state.copy()

    def view(self, state: Records, ids: Ints) -> ReachGoalView:
        return ReachGoalView(state["goal_world"][ids])

    def info(self, state: Records) -> dict[str, Any]:
        """Whether the tool is at its goal, (B,) each; what counts is where it is at the end."""
        there = state["there"].astype(float)
        return {
            "task/goals_reached": there,
            "task/goals_missed": 1 - there,
            "is_success": there.copy(),
        }

    def markers(self, view: ReachGoalView) -> Points3:
        return view.goal_world[:, None]
