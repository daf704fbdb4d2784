"""Reaching: the tool has to touch goals one after another, in a volume shared with a worker."""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints, Points3, Records, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.observations import ObservationTerm, directions
from hrc_env.rewards import RewardTerm
from hrc_env.tasks.task import Task
from hrc_env.world import FOOT_M, World


@dataclass(frozen=True, slots=True)
class TargetConfig:
    """Where goals of the tool appear, and what counts as reaching one."""

    radius_m: float = 0.05
    """A goal is reached when the tool point is nearer than this [m]."""
    base_xy_world: tuple[float, float] = FOOT_M[:2]
    """Axis of the robot's first joint [m]; goals are drawn round it."""
    distance_m: tuple[float, float] = (0.5, 0.95)
    """Range of the goals' horizontal distance from that axis [m]."""
    azimuth_rad: tuple[float, float] = (-1.2, 1.2)
    """Range of the goals' direction from world +X, seen from that axis [rad]."""
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
    """Where goals appear, what counts as reaching one, and what that is worth."""

    time_limit_s: float = 4.0
    """A goal not reached after this long [s] is missed, and the next one appears."""
    progress_per_m: float = 10.0
    """Reward for every metre that the tool comes nearer to its goal."""
    goal_bonus: float = 5.0
    """Reward for reaching a goal."""

    def __post_init__(self) -> None:
        TargetConfig.__post_init__(self)
        check_fields(self, "be positive", "time_limit_s")


REACH = np.dtype(
    [
        ("goal_world", "f8", (3,)),  # [m]
        ("goal_age_s", "f8"),  # since the goal appeared
        ("distance_m", "f8"),  # from the tool point to the goal
        ("n_reached", "i8"),  # goals of this episode
        ("n_missed", "i8"),
    ],
    align=True,
)
"""The task of one environment."""
REACH_STEP = np.dtype(
    [
        ("progress_m", "f8"),  # by how much the tool came nearer to the goal it had
        ("reached", "?"),  # whether that goal was reached in this step
        ("missed", "?"),  # whether it ran out of time in this step
    ],
    align=True,
)
"""What one step brought one environment."""


@dataclass(frozen=True, slots=True)
class ReachView:
    """The robots' view of their task."""

    goal_world: Points3
    """(B, 3) [m]."""
    time_left_s: Floats
    """(B,) until the goal is missed."""


@kernel
def _judge(tool_world, dt_s, radius_m, time_limit_s, state, step):
    """Move the state on and write what it brought; whether any goal is done."""
    done = False
    for b in range(len(state)):
        now, brought = state[b], step[b]
        squared = 0.0
        for i in range(3):
            squared += (now.goal_world[i] - tool_world[b, i]) ** 2
        distance_m = math.sqrt(squared)
        brought.progress_m = now.distance_m - distance_m
        now.distance_m = distance_m
        now.goal_age_s += dt_s
        brought.reached = distance_m < radius_m
        brought.missed = not brought.reached and now.goal_age_s >= time_limit_s - 1e-9
        now.n_reached += brought.reached
        now.n_missed += brought.missed
        done |= brought.reached or brought.missed
    return done


MIDDLE = "the middle of its goals"


def _new_goals(
    state: Records, ids: Ints, rngs: Rngs, tool_world: Points3, config: ReachConfig
) -> None:
    for b, tool in zip(ids.tolist(), tool_world.tolist(), strict=True):
        goal = drawn_goal(rngs[b], config)
        state["goal_world"][b] = goal
        state["goal_age_s"][b] = 0.0
        state["distance_m"][b] = math.dist(goal, tool)


def goal_places(config: TargetConfig) -> list[ReachTarget]:
    """Return the places of the nearest goals, and the middle of all: a robot that is too short for
    that cannot reach most of them."""
    (x, y), (near_m, far_m) = config.base_xy_world, config.distance_m
    (left, right), (low_m, high_m) = config.azimuth_rad, config.height_m
    middle_rad, z, within_m = (left + right) / 2, (low_m + high_m) / 2, (high_m - low_m) / 2

    def at(away_m: float) -> tuple[float, float, float]:
        return x + away_m * math.cos(middle_rad), y + away_m * math.sin(middle_rad), z

    return [
        ReachTarget("the nearest goal", at(near_m), within_m=within_m),
        ReachTarget(MIDDLE, at((near_m + far_m) / 2), within_m=config.radius_m),
    ]


def given_target(goal: Floats, config: TargetConfig) -> list[ReachTarget]:
    """Return the place of a goal that a user gives; `ConfigError` if it is no place."""
    place = np.asarray(goal, float)
    if place.shape != (3,) or not np.isfinite(place).all() or place[2] < 0.0:
        raise ConfigError(
            "The goal of a reset must be a place (x, y, z) above the floor [m, world], "
            f"got {goal!r}."
        )
    return [ReachTarget("the goal", place, within_m=config.radius_m)]


def drawn_goal(rng: np.random.Generator, config: TargetConfig) -> tuple[float, float, float]:
    """A place for the tool [m]."""
    x, y = config.base_xy_world
    limits = config.distance_m, config.azimuth_rad, config.height_m
    distance_m, azimuth_rad, z = (
        low + (high - low) * share
        for (low, high), share in zip(limits, rng.random(3).tolist(), strict=True)
    )
    return x + distance_m * math.cos(azimuth_rad), y + distance_m * math.sin(azimuth_rad), z


class Reach(Task[ReachConfig, Records]):
    """Touch goals one after another with the tool, in a volume shared with a worker."""

    id = "HRCReach-v0"
    config_type = ReachConfig
    observations = (
        ObservationTerm(
            "goal_from_tool", 3, "m", "world", 3.0, 0.5,
            "From the tool point to the goal.",
            lambda now: now.task.goal_world - now.robot.tool_world,
        ),
        ObservationTerm(
            "goal_direction", 3, "-", "world", 1.0, 1.0,
            "The same, divided by its length plus 5 cm.",
            lambda now: directions(now.task.goal_world - now.robot.tool_world, 0.05),
        ),
        ObservationTerm(
            "goal_time_left", 1, "s", "-", 10.0, 4.0,
            "Time until the goal is missed.",
            lambda now: now.task.time_left_s,
        ),
    )  # fmt: skip
    rewards = (
        RewardTerm(
            "progress",
            "Metres that the tool came nearer to its goal, times `task.progress_per_m`.",
            lambda now, step, previous, config: config.progress_per_m * step["progress_m"],
        ),
        RewardTerm(
            "goal",
            "`task.goal_bonus` in the step in which a goal is reached.",
            lambda now, step, previous, config: np.multiply(config.goal_bonus, step["reached"]),
        ),
    )
    achieved = "task/goals_reached"
    failed = "task/goals_missed"
    starts = (
        "The arm is near home, turned anywhere in front of its base. A first goal appears; the "
        "next one when it is reached, or missed after `task.time_limit_s`."
    )
    ends = "Not before the time is up. A success: every goal so far, and at least one, was reached."

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, REACH)

    def reach_targets(self) -> list[ReachTarget]:
        return goal_places(self.config)

    def goal_targets(self, goal: Floats) -> list[ReachTarget]:
        """A place (3,) [m, world]: the first goal of the episode."""
        return given_target(goal, self.config)

    def set_goal(self, state: Records, ids: Ints, goals: Floats, world: World) -> None:
        state["goal_world"][ids] = goals
        off_m = np.linalg.norm(goals - world.robot.tool_world, axis=-1)
        state["distance_m"][ids] = off_m

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Start environments `ids` anew with a first goal each."""
        state["n_reached"][ids] = state["n_missed"][ids] = 0
        _new_goals(state, ids, rngs, world.robot.tool_world, self.config)

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge the tool's new place and replace goals that are done; (B,) of `REACH_STEP`."""
        tool_world, step = world.robot.tool_world, np.zeros(len(state), REACH_STEP)
        if _judge(tool_world, dt_s, self.config.radius_m, self.config.time_limit_s, state, step):
            done = np.flatnonzero(step["reached"] | step["missed"])
            _new_goals(state, done, rngs, tool_world[done], self.config)
        return step

    def view(self, state: Records, ids: Ints) -> ReachView:
        return ReachView(
            state["goal_world"][ids], self.config.time_limit_s - state["goal_age_s"][ids]
        )

    def info(self, state: Records) -> dict[str, Floats]:
        """Return how many goals were reached and missed, (B,) each.

        It is a success if every goal, and at least one, was reached in time.
        """
        succeeded = (state["n_reached"] > 0) & (state["n_missed"] == 0)
        return {
            "task/goals_reached": state["n_reached"].astype(float),
            "task/goals_missed": state["n_missed"].astype(float),
            "is_success": succeeded.astype(float),
        }

    def markers(self, view: ReachView) -> Points3:
        return view.goal_world[:, None]
