"""Reach a single goal that is separate from the observation, for hindsight replay."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from hrc_env.core.declared import Records1, make_records
from hrc_env.core.typing import Bools, Floats, Ints, Points3, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.goal import Goal
from hrc_env.tasks.reach import TargetConfig, draw_goal, list_targets, make_target
from hrc_env.tasks.task import Task
from hrc_env.world import World


@dataclass(frozen=True, slots=True)
class ReachGoalConfig(TargetConfig):
    """Volume of the goals, and radius within which a goal is reached."""


class ReachGoalState:
    """State of one environment's goal."""

    goal_world: Annotated[Points3, (3,)]
    """Position of the goal [m]."""
    there: bool
    """Whether the tool point is within the goal's radius."""


@dataclass(frozen=True, slots=True)
class ReachGoalView:
    """Information about the task that is available to the robots."""

    goal_world: Points3
    """(B, 3) position of the goal [m]."""


def reward_reaching(achieved: Floats, desired: Floats, config: ReachGoalConfig) -> Floats:
    """Return the reward (...): 0 if positions (..., 3) are within the radius of goals, else -1."""
    off_m = np.sqrt(((achieved - desired) ** 2).sum(-1))
    return np.where(off_m < config.radius_m, 0.0, -1.0)


class ReachGoal(Task[ReachGoalConfig, Records1[ReachGoalState]]):
    """Bring the tool to a goal and keep it there, in a volume shared with a worker."""

    id = "HRCReachGoal-v0"
    config_type = ReachGoalConfig
    achieved = "task/goals_reached"
    failed = "task/goals_missed"
    starts = (
        "The arm is near home, turned anywhere in front of its base. One goal, for the whole "
        "episode."
    )
    ends = "Never terminates. The episode is a success if the tool is at its goal at the end."
    max_episode_steps = BUILT_IN[id].max_episode_steps
    goal = Goal(
        size=3,
        bound=4.0,
        achieved=lambda belief: belief.robot.tool_world,
        desired=lambda belief: belief.task.goal_world,
        reward=reward_reaching,
        doc="0 if the tool point is within `task.radius_m` of its goal, else -1.",
    )

    def make_state(self, batch: int) -> Records1[ReachGoalState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(ReachGoalState, batch)

    def reach_targets(self) -> list[ReachTarget]:
        """Return the positions in the goal volume that the tool must be able to reach."""
        return list_targets(self.config)

    def goal_targets(self, goal: Floats) -> list[ReachTarget]:
        """Return the position (3,) of the episode's goal as a target [m, world]."""
        return [make_target(goal, self.config)]

    def set_goal(
        self, state: Records1[ReachGoalState], ids: Ints, goals: Floats, world: World
    ) -> None:
        """Replace the sampled goals of environments `ids` by given ones."""
        state["goal_world"][ids] = goals
        state["there"][ids] = self._is_there(world.robot.tool_world, goals)

    def reset(self, state: Records1[ReachGoalState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the goal of each of environments `ids`."""
        for b, tool_world in zip(map(int, ids), world.robot.tool_world, strict=True):
            goal_world = np.array(draw_goal(rngs[b], self.config))
            state["goal_world"][b] = goal_world
            state["there"][b] = self._is_there(tool_world, goal_world)

    def advance(
        self, state: Records1[ReachGoalState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[ReachGoalState]:
        """Evaluate the position of the tool, and return a copy of the state."""
        state["there"] = self._is_there(world.robot.tool_world, state["goal_world"])
        return state.copy()

    def _is_there(self, tool_world: Points3, goal_world: Points3) -> Bools:
        """Return a mask (...) of the tool points (..., 3) within the radius of goals (..., 3)."""
        return reward_reaching(tool_world, goal_world, self.config) == 0.0

    def view(self, state: Records1[ReachGoalState], ids: Ints) -> ReachGoalView:
        """Return the goals of environments `ids`."""
        return ReachGoalView(state["goal_world"][ids])

    def info(self, state: Records1[ReachGoalState]) -> dict[str, Floats]:
        """Return whether each tool is at its goal, (B,) by name.

        An episode is a success if the tool is at its goal at the end.
        """
        there = state["there"].astype(float)
        return {
            "task/goals_reached": there,
            "task/goals_missed": 1 - there,
            "is_success": there.copy(),
        }

    def markers(self, view: ReachGoalView) -> Points3:
        """Return the positions (B, 1, 3) of the goals [m]."""
        return view.goal_world[:, None]
