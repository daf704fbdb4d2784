"""Goals that are separate from the observation, so that transitions can be relabelled.

Hindsight experience replay (HER; Andrychowicz et al. 2017, arXiv:1707.01495) requires this: the
reward must be a function of the achieved and the desired goal, vectorized over any number of pairs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.belief import Belief, lend_belief
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.lending import call_user_function, is_of_user, read_only
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Bools, Floats, Tensor
from hrc_env.rewards import RewardTerm

ACHIEVED = "achieved_goal"
"""Key of the achieved goal in an observation dictionary."""
DESIRED = "desired_goal"
"""Key of the desired goal in an observation dictionary."""
TERM = "goal"
"""Name of the reward term that depends on the goal."""
Infos = Mapping[str, Any] | Sequence[Mapping[str, Any]] | None
"""Type of infos: that of one step, a sequence with one for each pair of goals, or arrays by name
like those of a vector environment; None for an empty info."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Goal:
    """A goal that is separate from the observation, for hindsight experience replay (HER).

        import numpy as np
        from hrc_env import Goal

        goal = Goal(
            size=3,
            bound=4.0,
            achieved=lambda belief: belief.robot.tool_world,
            desired=lambda belief: belief.task,
            reward=lambda achieved, desired, config: -np.linalg.norm(achieved - desired, axis=-1),
            doc="Minus the distance of the tool from the goal [m].",
        )

    If a task has the attribute `goal`, its observations are dictionaries of `observation`,
    `achieved_goal` and `desired_goal`, and `reward` is a term of the reward. `compute_reward` and
    `train --algorithm sac` can then reward transitions for other goals. All functions work on
    batches (B, ...). The observation must not contain the goal, because a transition that is
    relabelled with another goal would still contain the old one.
    """

    size: int
    """Number of entries of the goal."""
    bound: float
    """Largest magnitude of an entry; larger values are clipped."""
    achieved: Callable[[Belief], Floats]
    """Callable that computes the achieved goals (B, size), as known to the robot, from a belief."""
    desired: Callable[[Belief], Floats]
    """Callable that computes the desired goals (B, size) from a belief."""
    reward: Callable[[Floats, Floats, Any], Floats]
    """Callable that computes the rewards (...) from achieved goals (..., size), desired goals (...,
    size) and the task's settings."""
    doc: str
    """Description of the reward for the environment's documentation page, in one sentence."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a function does not take the expected arguments."""
        for name in ("achieved", "desired"):
            check_arguments(f"Goal.{name}", getattr(self, name), "belief")
        check_arguments("Goal.reward", self.reward, "achieved", "desired", "settings")


class GoalPair(NamedTuple):
    """Achieved and desired goals as finite numbers."""

    achieved: Floats
    """(size,) or (B, size) achieved goals."""
    desired: Floats
    """(size,) or (B, size) desired goals."""


def observe_goal(goal: Goal, belief: Belief) -> dict[str, Tensor]:
    """Return the achieved and desired goals in an observation by name, each (B, size) float32."""
    values = {
        ACHIEVED: _evaluate("Goal.achieved", goal.achieved, belief),
        DESIRED: _evaluate("Goal.desired", goal.desired, belief),
    }
    for name, value in values.items():
        check_shape(name, np.shape(value), (len(belief.action), goal.size), "its `size`")
    clipped = {name: np.clip(value, -goal.bound, goal.bound) for name, value in values.items()}
    return {name: value.astype(np.float32) for name, value in clipped.items()}


def _evaluate(name: str, function: Callable[[Belief], Floats], belief: Belief) -> Floats:
    """Return the value (B, size) of a function; a user's function receives a read-only belief."""
    if is_of_user(function):
        return call_user_function(name, function, lend_belief(belief))
    return function(belief)


def reward_terms(goal: Goal | None) -> tuple[RewardTerm, ...]:
    """Return the reward term of a goal, computed from the observation, or () without a goal."""
    if goal is None:
        return ()

    def function(belief: Belief, step: object, previous: Floats, config: object) -> Floats:
        observed = observe_goal(goal, belief)
        pair = GoalPair(observed[ACHIEVED].astype(float), observed[DESIRED].astype(float))
        return call_user_function("Goal.reward", goal.reward, *read_only(pair), config)

    return (RewardTerm(TERM, goal.doc, function),)


def compute_reward(
    goal: Goal,
    achieved: ArrayLike,
    desired: ArrayLike,
    info: Infos,
    config: object,
    others: Sequence[str] = (),
    factor: float = 1.0,
) -> Floats | float:
    """Return the reward for achieving one goal when another is desired.

    Args:
        goal: the task's goal.
        achieved: (size,) or (B, size) achieved goals.
        desired: (size,) or (B, size) desired goals.
        info: info of the step. Its entries "reward/..." of the `others` are added, so that the sum
            is exactly the reward of the step; a missing entry counts as 0.
        config: settings of the task.
        others: names of the other reward terms, in order.
        factor: factor on the goal's term, as set by `set_reward`.

    Returns:
        The reward: a number, or an array (B,).
    """
    pair = _check_pair(goal, achieved, desired)
    reward = call_user_function("Goal.reward", goal.reward, *read_only(pair), config)
    value = np.zeros(pair.achieved.shape[:-1]) + factor * reward
    for name in others:
        value = value + _read_info(info, f"reward/{name}", value.shape)
    return value if value.ndim else float(value)


def compute_terminated(
    goal: Goal,
    achieved: ArrayLike,
    desired: ArrayLike,
    info: Infos,
    entries: Sequence[str] = (),
) -> Bools | bool:
    """Return whether steps with given infos end their episodes; reaching a goal never ends one.

    Args:
        goal: the task's goal.
        achieved: (size,) or (B, size) achieved goals.
        desired: (size,) or (B, size) desired goals.
        info: info of the step, as for `compute_reward`.
        entries: names in the info; the episode ends if the value of any of them is positive.

    Returns:
        A bool, or an array (B,) of bools.
    """
    shape = _check_pair(goal, achieved, desired).achieved.shape[:-1]
    over = np.zeros(shape, bool)
    for name in entries:
        over = over | (_read_info(info, name, shape) > 0)
    return over if over.ndim else bool(over)


def _check_pair(goal: Goal, achieved: ArrayLike, desired: ArrayLike) -> GoalPair:
    """Return both goals as arrays, or raise `ConfigError` if a shape or value is invalid."""
    pair = GoalPair(_check_numbers(ACHIEVED, achieved), _check_numbers(DESIRED, desired))
    shape = pair.achieved.shape
    if pair.desired.shape != shape or len(shape) not in (1, 2):
        raise ConfigError(
            f"{ACHIEVED} and {DESIRED} must both have shape ({goal.size},) or (B, {goal.size}), "
            f"got {shape} and {pair.desired.shape}."
        )
    check_shape(ACHIEVED, shape[-1:], (goal.size,), "its last axis: entries of a goal")
    return pair


def _check_numbers(name: str, values: ArrayLike) -> Floats:
    """Return values as an array, or raise `ConfigError` if any of them is not finite."""
    numbers = np.asarray(values, float)
    if not np.isfinite(numbers).all():
        raise ConfigError(f"{name} must be finite numbers, got {numbers}.")
    return numbers


def _read_info(info: Infos, name: str, shape: tuple[int, ...]) -> Floats:
    """Return the values of an entry in infos, or 0 if it is missing.

    Args:
        info: info of one step or of several steps.
        name: name of the entry.
        shape: expected shape of several values, () or (B,).

    Raises:
        ConfigError: the shape of the entry is wrong.
    """
    if info is None:
        return np.zeros(shape)
    if isinstance(info, Mapping):
        values = np.asarray(info.get(name, 0.0), float)
    else:
        values = np.array([each.get(name, 0.0) for each in info], float)
    if values.shape not in ((), shape):
        check_shape(f"info[{name!r}]", values.shape, shape, "one value per pair of goals")
    return values
