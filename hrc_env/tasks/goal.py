"""Goals that stand apart from the observation, so that what was done can be judged by another one.

Hindsight experience replay asks for this (HER; Andrychowicz et al. 2017, arXiv:1707.01495): the
reward must follow from what is achieved and what is desired, for any number of pairs at once.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.belief import Belief, lend_belief
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.lending import called, is_of_user, read_only
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Bools, Floats, Tensor
from hrc_env.rewards import RewardTerm

ACHIEVED, DESIRED = "achieved_goal", "desired_goal"
"""The parts of an observation beside the flat one, as the field calls them."""
TERM = "goal"
"""The reward's term that follows from a goal."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class Goal:
    """A goal apart from the observation, as hindsight replay (HER) needs it.

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

    In a task with the attribute `goal` observations are dictionaries of `observation`,
    `achieved_goal` and `desired_goal`, `reward` is a term of the reward, and `compute_reward` and
    `train --algorithm sac` judge transitions by other goals. Functions are over batches (B, ...).
    The observation must not hold the goal: a transition that is judged by another goal would still
    hold the old one.
    """

    size: int
    """How many numbers it is."""
    bound: float
    """Largest magnitude of each; larger values are clipped."""
    achieved: Callable[[Belief], Floats]
    """(belief) -> (B, size) what is so far, as the robot knows it."""
    desired: Callable[[Belief], Floats]
    """(belief) -> (B, size) what is to be."""
    reward: Callable[[Floats, Floats, Any], Floats]
    """(achieved (..., size), desired (..., size), the task's settings) -> (...)."""
    doc: str
    """A sentence: what the reward is."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for functions that take other arguments."""
        for name in ("achieved", "desired"):
            check_arguments(f"Goal.{name}", getattr(self, name), "belief")
        check_arguments("Goal.reward", self.reward, "achieved", "desired", "settings")


def parts(goal: Goal, now: Belief) -> dict[str, Tensor]:
    """(B, size) float32 what the observation holds of a goal, by name."""
    wanted = {
        ACHIEVED: _asked("Goal.achieved", goal.achieved, now),
        DESIRED: _asked("Goal.desired", goal.desired, now),
    }
    for name, value in wanted.items():
        check_shape(name, np.shape(value), (len(now.action), goal.size), "its `size`")
    clipped = {k: np.clip(value, -goal.bound, goal.bound) for k, value in wanted.items()}
    return {name: value.astype(np.float32) for name, value in clipped.items()}


def _asked(what: str, function: Callable[[Belief], Floats], now: Belief) -> Floats:
    """The value (B, size) of a function; one of users is given a read-only belief."""
    return called(what, function, lend_belief(now)) if is_of_user(function) else function(now)


def reward_terms(goal: Goal | None) -> tuple[RewardTerm, ...]:
    """The term of a goal, if there is one; it judges what the observation holds."""
    if goal is None:
        return ()

    def function(now: Belief, step: Any, previous: Floats, config: Any) -> Floats:
        held = parts(goal, now)
        pair = (held[ACHIEVED].astype(float), held[DESIRED].astype(float))
        return called("Goal.reward", goal.reward, *read_only(pair), config)

    return (RewardTerm(TERM, goal.doc, function),)


def judged(
    goal: Goal,
    achieved: ArrayLike,
    desired: ArrayLike,
    info: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None,
    config: Any,
    others: Sequence[str] = (),
    factor: float = 1.0,
) -> Floats | float:
    """The reward of achieving this when that is desired.

    Args:
        goal: of the task.
        achieved: (size,) or (B, size).
        desired: the same.
        info: of the step: its entries "reward/..." of the `others` are added, so that the sum is
            the step's reward, bit for bit; what it lacks counts nothing. Of many: one a pair, or
            arrays by name as a vector environment has them.
        config: settings of the task.
        others: names of the reward's other terms, in their order.
        factor: on the goal's term (`set_reward`).

    Returns:
        A number, or (B,).
    """
    reached, wanted = _pair(goal, achieved, desired)
    pair = read_only((reached, wanted))
    given = called("Goal.reward", goal.reward, *pair, config)
    value = np.zeros(reached.shape[:-1]) + factor * given
    for name in others:
        value = value + _told(info, f"reward/{name}", value.shape)
    return value if value.ndim else float(value)


def ended(
    goal: Goal, achieved: ArrayLike, desired: ArrayLike, info: Any, entries: Sequence[str] = ()
) -> Bools | bool:
    """Return whether the steps of these infos end their episodes, which reached goals never do.

    Args:
        goal, achieved, desired, info: as of `judged`.
        entries: of an info, any of which ends an episode where it is above 0.

    Returns:
        A bool, or (B,).
    """
    reached, _ = _pair(goal, achieved, desired)
    over = np.zeros(reached.shape[:-1], bool)
    for name in entries:
        over = over | (_told(info, name, over.shape) > 0)
    return over if over.ndim else bool(over)


def _pair(goal: Goal, achieved: ArrayLike, desired: ArrayLike) -> tuple[Floats, Floats]:
    """Return both as numbers, (size,) or (B, size); `ConfigError` for other shapes or values."""
    reached, wanted = _numbers(ACHIEVED, achieved), _numbers(DESIRED, desired)
    if reached.shape != wanted.shape or reached.ndim not in (1, 2):
        raise ConfigError(
            f"{ACHIEVED} and {DESIRED} must both have shape ({goal.size},) or (B, {goal.size}), "
            f"got {reached.shape} and {wanted.shape}."
        )
    check_shape(ACHIEVED, reached.shape[-1:], (goal.size,), "its last axis: entries of a goal")
    return reached, wanted


def _numbers(name: str, given: ArrayLike) -> Floats:
    values = np.asarray(given, float)
    if not np.isfinite(values).all():
        raise ConfigError(f"{name} must be finite numbers, got {values}.")
    return values


def _told(info: Any, name: str, shape: tuple[int, ...]) -> Floats:
    """What infos say under a name, 0 where they say nothing."""
    if info is None:
        return np.zeros(shape)
    if isinstance(info, Mapping):
        told = np.asarray(info.get(name, 0.0), float)
    else:
        told = np.array([each.get(name, 0.0) for each in info], float)
    if told.shape not in ((), shape):
        check_shape(f"info[{name!r}]", told.shape, shape, "a value a pair of goals")
    return told
