"""Reach: the tool touches goals one after another, in a volume shared with a worker."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import ConfigError, check_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints, Points3, Rngs, Vector3
from hrc_env.geometry.reach import ReachTarget
from hrc_env.observations import ObservationTerm, directions
from hrc_env.rewards import RewardTerm
from hrc_env.tasks.task import Task
from hrc_env.world import FOOT_M, World


@dataclass(frozen=True, slots=True)
class TargetConfig:
    """Volume of the goals, and radius within which a goal is reached."""

    radius_m: float = 0.05
    """Distance of the tool point from a goal below which the goal is reached [m]."""
    base_xy_world: tuple[float, float] = FOOT_M[:2]
    """Position of the robot's first joint axis, around which goals are sampled, x and y [m]."""
    distance_m: tuple[float, float] = (0.5, 0.95)
    """Range of the goals' horizontal distance from the axis of the robot's first joint [m]."""
    azimuth_rad: tuple[float, float] = (-1.2, 1.2)
    """Range of the goals' azimuth from world +X about the robot's first joint [rad]."""
    height_m: tuple[float, float] = (0.8, 1.45)
    """Range of the goals' height above the floor [m]."""

    def __post_init__(self) -> None:
        for name in ("distance_m", "azimuth_rad", "height_m"):
            low, high = getattr(self, name)
            if not low < high:
                field = f"{type(self).__name__}.{name}"
                raise ConfigError(f"{field} must be (low, high), got {(low, high)}.")
        check_fields(self, "be positive", "radius_m")


@dataclass(frozen=True, slots=True)
class ReachConfig(TargetConfig):
    """Volume of the goals, their time limit and their rewards."""

    time_limit_s: float = 4.0
    """Time after which a goal counts as missed, and the next one appears [s]."""
    progress_per_m: float = 10.0
    """Reward for every metre by which the tool approaches its goal."""
    goal_bonus: float = 5.0
    """Reward for reaching a goal."""

    def __post_init__(self) -> None:
        TargetConfig.__post_init__(self)
        check_fields(self, "be positive", "time_limit_s")


class ReachState:
    """State of one environment's goals."""

    goal_world: Annotated[Points3, (3,)]
    """Position of the current goal [m]."""
    goal_age_s: float
    """Time since the current goal appeared [s]."""
    distance_m: float
    """Distance of the tool point from the current goal [m]."""
    n_reached: int
    """Number of goals that were reached in this episode."""
    n_missed: int
    """Number of goals that were missed in this episode."""


class ReachStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Decrease of the distance from the goal [m]."""
    reached: bool
    """Whether the goal was reached in this step."""
    missed: bool
    """Whether the goal's time limit expired in this step."""


REACH = dtype_of(ReachState)
REACH_STEP = dtype_of(ReachStep)


@dataclass(frozen=True, slots=True)
class ReachView:
    """Information about the task that is available to the robots."""

    goal_world: Points3
    """(B, 3) position of the current goal [m]."""
    time_left_s: Floats
    """(B,) remaining time until the current goal is missed [s]."""


@kernel
def _judge_goals(
    tool_world: Points3,
    dt_s: float,
    radius_m: float,
    time_limit_s: float,
    states: Records1[ReachState],
    steps: Records1[ReachStep],
) -> bool:
    """Advance the goals by one control step, and return whether any was reached or missed.

    Args:
        tool_world: (B, 3) tool points of the robots [m].
        dt_s: duration of the step [s].
        radius_m: distance below which a goal is reached [m].
        time_limit_s: age at which a goal is missed [s].
        states: (B,) states, in which all fields except `goal_world` are written.
        steps: (B,) output, which is filled.
    """
    any_done = False
    for b in range(len(states)):
        state, step = states[b], steps[b]
        squared = 0.0
        for i in range(3):
            squared += (state.goal_world[i] - tool_world[b, i]) ** 2
        distance_m = math.sqrt(squared)
        step.progress_m = state.distance_m - distance_m
        state.distance_m = distance_m
        state.goal_age_s += dt_s
        step.reached = distance_m < radius_m
        step.missed = not step.reached and state.goal_age_s >= time_limit_s - 1e-9
        state.n_reached += step.reached
        state.n_missed += step.missed
        any_done |= step.reached or step.missed
    return any_done


MIDDLE = "the center of its goals"
"""Name of the second target that `list_targets` returns."""


def _draw_goals(
    state: Records1[ReachState], ids: Ints, rngs: Rngs, tool_world: Points3, config: ReachConfig
) -> None:
    """Sample a new goal for each of environments `ids`.

    Args:
        state: state of all environments; rows `ids` are written.
        ids: (n,) indices of the environments.
        rngs: random generators, one for each environment of the batch.
        tool_world: (n, 3) tool points of the robots in these environments [m].
        config: volume of the goals.
    """
    for b, tool in zip(map(int, ids), tool_world.tolist(), strict=True):
        goal = draw_goal(rngs[b], config)
        state["goal_world"][b] = goal
        state["goal_age_s"][b] = 0.0
        state["distance_m"][b] = math.dist(goal, tool)


def list_targets(config: TargetConfig) -> list[ReachTarget]:
    """Return the positions of the nearest goal and of the centre of the goal volume as targets.

    A robot that cannot reach the centre cannot reach most of the goals.
    """
    (x, y), (near_m, far_m) = config.base_xy_world, config.distance_m
    (left, right), (low_m, high_m) = config.azimuth_rad, config.height_m
    middle_rad, z, within_m = (left + right) / 2, (low_m + high_m) / 2, (high_m - low_m) / 2

    def place_at(away_m: float) -> Vector3:
        return Vector3(x + away_m * math.cos(middle_rad), y + away_m * math.sin(middle_rad), z)

    return [
        ReachTarget("the nearest goal", place_at(near_m), within_m=within_m),
        ReachTarget(MIDDLE, place_at((near_m + far_m) / 2), within_m=config.radius_m),
    ]


def make_target(goal: Floats, config: TargetConfig) -> ReachTarget:
    """Return the position of a user-defined goal as a target.

    Raises:
        ConfigError: the goal is not a position (x, y, z) above the floor.
    """
    place = np.asarray(goal, float)
    if place.shape != (3,) or not np.isfinite(place).all() or place[2] < 0.0:
        raise ConfigError(
            "The goal of a reset must be a point (x, y, z) above the floor [m, world], got "
            f"{goal!r}."
        )
    return ReachTarget("the goal", place, within_m=config.radius_m)


def draw_goal(rng: np.random.Generator, config: TargetConfig) -> Vector3:
    """Sample the position of a goal in the world frame [m]."""
    x, y = config.base_xy_world
    limits = config.distance_m, config.azimuth_rad, config.height_m
    distance_m, azimuth_rad, z = (
        low + (high - low) * share
        for (low, high), share in zip(limits, rng.random(3).tolist(), strict=True)
    )
    dx, dy = distance_m * math.cos(azimuth_rad), distance_m * math.sin(azimuth_rad)
    return Vector3(x + dx, y + dy, z)


class Reach(Task[ReachConfig, Records1[ReachState]]):
    """Touch goals one after another with the tool, in a volume shared with a worker."""

    id = "HRCReach-v0"
    config_type = ReachConfig
    observations = (
        ObservationTerm(
            name="goal_from_tool",
            size=3,
            unit="m",
            frame="world",
            bound=3.0,
            scale=0.5,
            doc="Position of the goal, relative to the tool point.",
            function=lambda belief: belief.task.goal_world - belief.robot.tool_world,
        ),
        ObservationTerm(
            name="goal_direction",
            size=3,
            unit="-",
            frame="world",
            bound=1.0,
            scale=1.0,
            doc="The same vector, divided by its length plus 5 cm.",
            function=lambda belief: directions(
                belief.task.goal_world - belief.robot.tool_world, 0.05
            ),
        ),
        ObservationTerm(
            name="goal_time_left",
            size=1,
            unit="s",
            frame="-",
            bound=10.0,
            scale=4.0,
            doc="Time until the goal's time limit expires.",
            function=lambda belief: belief.task.time_left_s,
        ),
    )
    rewards = (
        RewardTerm(
            name="progress",
            doc="Decrease of the distance from the tool to its goal [m], times "
            "`task.progress_per_m`.",
            function=lambda belief, step, previous, config: (
                config.progress_per_m * step["progress_m"]
            ),
        ),
        RewardTerm(
            name="goal",
            doc="`task.goal_bonus` in the step in which a goal is reached.",
            function=lambda belief, step, previous, config: np.multiply(
                config.goal_bonus, step["reached"]
            ),
        ),
    )
    achieved = "task/goals_reached"
    failed = "task/goals_missed"
    starts = (
        "The arm is near home, turned anywhere in front of its base. The first goal appears; when "
        "it is reached, or missed after `task.time_limit_s`, the next one appears."
    )
    ends = (
        "Never terminates. The episode is a success if at least one goal was reached and none "
        "was missed."
    )

    def make_state(self, batch: int) -> Records1[ReachState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(ReachState, batch)

    def reach_targets(self) -> list[ReachTarget]:
        """Return the positions in the goal volume that the tool must be able to reach."""
        return list_targets(self.config)

    def goal_targets(self, goal: Floats) -> list[ReachTarget]:
        """Return the position (3,) of the episode's first goal as a target [m, world]."""
        return [make_target(goal, self.config)]

    def set_goal(self, state: Records1[ReachState], ids: Ints, goals: Floats, world: World) -> None:
        """Replace the sampled goals of environments `ids` by given ones."""
        state["goal_world"][ids] = goals
        off_m = np.linalg.norm(goals - world.robot.tool_world, axis=-1)
        state["distance_m"][ids] = off_m

    def reset(self, state: Records1[ReachState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the first goal of each of environments `ids`."""
        state["n_reached"][ids] = state["n_missed"][ids] = 0
        _draw_goals(state, ids, rngs, world.robot.tool_world, self.config)

    def advance(
        self, state: Records1[ReachState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[ReachStep]:
        """Evaluate the goals, replace finished ones, and return the results (B,) of the step."""
        tool_world, step = world.robot.tool_world, make_records(ReachStep, len(state))
        radius_m, time_limit_s = self.config.radius_m, self.config.time_limit_s
        if _judge_goals(tool_world, dt_s, radius_m, time_limit_s, state, step):
            done = np.flatnonzero(step["reached"] | step["missed"])
            _draw_goals(state, done, rngs, tool_world[done], self.config)
        return step

    def view(self, state: Records1[ReachState], ids: Ints) -> ReachView:
        """Return the goals of environments `ids` and the remaining time to reach them."""
        return ReachView(
            state["goal_world"][ids], self.config.time_limit_s - state["goal_age_s"][ids]
        )

    def info(self, state: Records1[ReachState]) -> dict[str, Floats]:
        """Return the numbers (B,) of reached and missed goals by name.

        An episode is a success if at least one goal was reached and none was missed.
        """
        succeeded = (state["n_reached"] > 0) & (state["n_missed"] == 0)
        return {
            "task/goals_reached": state["n_reached"].astype(float),
            "task/goals_missed": state["n_missed"].astype(float),
            "is_success": succeeded.astype(float),
        }

    def markers(self, view: ReachView) -> Points3:
        """Return the positions (B, 1, 3) of the current goals [m]."""
        return view.goal_world[:, None]
