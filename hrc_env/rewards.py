"""The reward of an environment, which is the sum of declared terms.

Terms about people read only the estimate; the progress of the task is computed from the true state.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hrc_env.belief import Belief, lend_belief
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import ConfigError, check_fields, check_names, check_shape, require
from hrc_env.core.kernels import kernel
from hrc_env.core.lending import call_user_function, is_of_user, read_only
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class RewardConfig:
    """Weights of the reward terms that all tasks share.

    The weights of all other terms are among the settings of the task. A learner that is penalized
    for closeness from the start learns to stand still, far from people, before it learns the task.
    Increase the weight of `proximity` gradually from 0 (`set_reward`; `train --ramp`), and compare
    numbers of reached goals instead of returns, which depend on the weights.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"unknown": "unknown_closeness"}
    """Current names of renamed fields, by former name."""

    effort: float = 0.02
    """Weight of the penalty on the mean squared action."""
    smoothness: float = 0.02
    """Weight of the penalty on the mean squared change of the action."""
    proximity: float = 2.0
    """Weight of the penalty on closeness to the *estimated* bodies, which is in [0, 2.25]. With a
    weight of 6 from the first step, PPO (one seed) reached no goal of `HRCReach-v0` in the last 64
    episodes before step 135,000; with 0, it reached 5.7 goals per episode."""
    proximity_reach_m: float = 0.3
    """Separation between the surfaces of robot and body below which closeness is penalized [m]."""
    unknown_closeness: float = 0.25
    """Lower bound on the closeness while a worker is unknown, in [0, 1]. With a positive value,
    losing sight of a worker is not rewarded like being alone."""
    shield_change: float = 0.0
    """Weight of the penalty on the mean squared change of the joint velocities by the shield,
    relative to the fastest ones that an action can command. A policy that learns with a shield
    then avoids commands that the shield has to change."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "proximity_reach_m")
        check_fields(self, "be in [0, 1]", "unknown_closeness")
        check_fields(self, "not be negative", "shield_change")


KINDS = ("dense", "sparse")
"""Valid values of the setting `reward` of tasks: with or without a reward for progress."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class RewardTerm:
    """Term of the reward, which is the sum of all terms."""

    name: str
    """Name of the term; its value is `info["reward/NAME"]`."""
    doc: str
    """Description of the term for the environment's documentation page, in one sentence."""
    function: Callable[[Belief, Any, Floats, Any], Floats]
    """Callable (belief, step, previous action (B, A), weights) that computes the values (B,) of the
    term. The step is the result of `Task.advance`. The weights are a `RewardConfig` for shared
    terms, and the task's settings for terms of the task. Useful fields of the belief are
    `separation.distance_m` (B, W), `robot.tool_world` (B, 3) and `estimate.mean_world` (B, W, J,
    3), all in metres."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for a function that does not take four arguments."""
        label = f"The function of the reward term {self.name!r}"
        check_arguments(label, self.function, "belief", "step", "previous_action", "weights")


def check_kind(config: Any) -> None:
    """Raise `ConfigError` if the setting `reward` of a task is not one of `KINDS`."""
    if config.reward not in KINDS:
        name = type(config).__name__
        raise ConfigError(f'{name}.reward must be "dense" or "sparse", got {config.reward!r}.')


def progress(description: str) -> RewardTerm:
    """Return the reward term for progress, for a task with `progress_m` in the result of its steps.

    Progress is the decrease of the remaining distance, a difference of potentials. Therefore its
    sum over an episode does not exceed the initial distance.
    """
    doc = f'{description}, times `task.progress_per_m`; 0 with `task.reward` "sparse".'
    return RewardTerm("progress", doc, _progress)


def _progress(belief: Belief, step: Any, previous: Floats, config: Any) -> Floats:
    """Return the reward (B,) for progress."""
    share = config.progress_per_m if config.reward == "dense" else 0.0
    return np.asarray(share * step["progress_m"])


def closeness(separation_m: Floats, reach_m: float) -> Floats:
    """Return the unweighted proximity penalty: 0 beyond `reach_m`, 1 at contact, at most 2.25."""
    share = np.minimum(np.maximum((reach_m - separation_m) / reach_m, 0.0), 1.5)
    return share * share


@kernel(makes_arrays=True)
def _mean_square(vectors: Floats) -> Floats:
    """Return the mean square (B,) of the entries of vectors (B, n)."""
    mean = np.zeros(len(vectors))
    for b in range(len(vectors)):
        for value in vectors[b]:
            mean[b] += value * value
        mean[b] /= vectors.shape[1]
    return mean


def _proximity(belief: Belief, step: Any, previous: Floats, config: RewardConfig) -> Floats:
    """Return the negative reward (B,) for closeness to estimated bodies."""
    nearest_m = np.minimum.reduce(belief.separation.distance_m, axis=-1, initial=np.inf)
    least = np.where(belief.estimate.unknown.any(-1), config.unknown_closeness, 0.0)
    near = np.maximum(closeness(nearest_m, config.proximity_reach_m), least)
    return -config.proximity * near


def _shield_change(belief: Belief, step: Any, previous: Floats, config: RewardConfig) -> Floats:
    """Return the negative reward (B,) for changes of the command by the shield."""
    if config.shield_change == 0.0:
        return np.zeros(len(belief.action))
    model = require(belief.model, "The robot's model (RobotModel) for the term shield_change")
    change = require(belief.shield_change, "The change of the command by the shield")
    return -config.shield_change * _mean_square(change / model.fastest_rad_s)


SHARED_TERMS: tuple[RewardTerm, ...] = (
    RewardTerm(
        "effort",
        "Minus `effort` times the mean squared action.",
        lambda belief, step, previous, config: -config.effort * _mean_square(belief.action),
    ),
    RewardTerm(
        "smoothness",
        "Minus `smoothness` times the mean squared change of the action.",
        lambda belief, step, previous, config: (
            -config.smoothness * _mean_square(belief.action - previous)
        ),
    ),
    RewardTerm(
        "proximity",
        "Minus `proximity` times clip((d0 - d) / d0, 0, 1.5)^2, where d is the distance between "
        "the robot's surface and the closest estimated body and d0 is `proximity_reach_m`; while a "
        "worker is unknown, the squared term is at least `unknown_closeness`.",
        _proximity,
    ),
    RewardTerm(
        "shield_change",
        "Minus `shield_change` times the mean square of the change of the joint velocities by the "
        "shield, each relative to the fastest velocity that an action can command; 0 without a "
        "shield.",
        _shield_change,
    ),
)


def evaluate_terms(
    terms: tuple[RewardTerm, ...], belief: Belief, step: Any, previous_action: Floats, weights: Any
) -> dict[str, Floats]:
    """Compute the values of reward terms; functions of users receive read-only arrays.

    Args:
        terms: the terms.
        belief: beliefs of B robots.
        step: result of `Task.advance`.
        previous_action: (B, A) actions of the previous step.
        weights: a `RewardConfig`, or the settings of the task.

    Returns:
        (B,) value of each term by name.
    """
    values: dict[str, Floats] = {}
    for term in terms:
        if is_of_user(term.function):
            lent = lend_belief(belief), *read_only((step, previous_action)), weights
            values[term.name] = call_user_function(
                f"Reward term {term.name!r}", term.function, *lent
            )
        else:
            values[term.name] = term.function(belief, step, previous_action, weights)
    return values


def check_factors(factors: Mapping[str, float], terms: Sequence[RewardTerm]) -> dict[str, float]:
    """Check factors on reward terms, and return them as floats by name.

    Raises:
        ConfigError: a name is unknown, or a factor is not a finite number.
    """
    names = [term.name for term in terms]
    check_names("reward term", factors, names)
    for name, factor in factors.items():
        number = isinstance(factor, int | float | np.number) and not isinstance(factor, bool)
        if not number or not np.isfinite(factor):
            raise ConfigError(
                f"The factor of reward term {name!r} must be a finite number, got {factor!r}."
            )
    return {name: float(factor) for name, factor in factors.items()}


def sum_terms(terms: Mapping[str, Floats], batch: int) -> Floats:
    """Return the sum of the terms (B,) of a reward.

    Args:
        terms: values of the terms by name.
        batch: number B of environments.

    Raises:
        ConfigError: the shape of a term is wrong.
        FloatingPointError: a term is not finite, which indicates an error in the code and never a
            fault of a camera.
    """
    for name, value in terms.items():
        check_shape(f"reward term {name!r}", np.shape(value), (batch,), "one value per environment")
    reward: Floats = sum(terms.values(), np.zeros(batch))
    if not np.isfinite(reward).all():
        wrong = [name for name, value in terms.items() if not np.isfinite(value).all()]
        raise FloatingPointError(f"Reward terms that are not finite: {', '.join(wrong)}.")
    return reward
