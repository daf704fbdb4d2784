"""What the robot is rewarded for: one declaration per term.

Of people terms read the estimate only; what a step brought for the task is judged in the world.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.belief import Belief, lent_belief
from hrc_env.core.brought import check_arguments
from hrc_env.core.errors import ConfigError, check_fields, check_names, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.lending import called, is_of_user, read_only
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Floats


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class RewardConfig:
    """Weights of the terms that every task shares; a task's own are in its settings.

    A learner that is charged for closeness before it knows its task learns to stand still, far from
    people. Let the weight of `proximity` grow from 0 (`set_reward`; `train --ramp`), and look at
    goals, not at the return.
    """

    effort: float = 0.02
    """Taken off for the mean squared action."""
    smoothness: float = 0.02
    """Taken off for the mean squared change of the action."""
    proximity: float = 2.0
    """Taken off for closeness to the *estimated* body, times the term's shape in [0, 2.25]. With 6
    from the first step PPO (one seed) reached no goal of `HRCReach-v0` in the last 64 episodes
    before step 135,000, with 0 it reached 5.7 in each."""
    proximity_reach_m: float = 0.3
    """Closeness begins to count below this separation of the surfaces [m]."""
    unknown: float = 0.25
    """Closeness that a worker counts with at least who is unknown, in [0, 1]: losing sight of them
    is not rewarded like being alone."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "proximity_reach_m")
        check_fields(self, "be in [0, 1]", "unknown")


KINDS = ("dense", "sparse")
"""What a task's `reward` can be: whether coming nearer counts, too."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class RewardTerm:
    """One summand of the reward."""

    name: str
    """It stands in `info` as "reward/NAME"."""
    doc: str
    """A sentence for the environment's page."""
    function: Callable[[Belief, Any, Floats, Any], Floats]
    """(belief, step, previous action (B, A), weights) -> (B,). The step is a task's, as
    `Task.advance` returned it. The weights are a `RewardConfig`; those of a task's term are the
    task's settings. Of the belief are for example `separation.distance_m` (B, W),
    `robot.tool_world` (B, 3) and `estimate.mean_world` (B, W, J, 3), in metres."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for a function that does not take four arguments."""
        what = f"The function of the reward term {self.name!r}"
        check_arguments(what, self.function, "belief", "step", "previous_action", "weights")


def check_kind(config: Any) -> None:
    """Raise `ConfigError` for settings of a task whose `reward` is not one of `KINDS`."""
    if config.reward not in KINDS:
        name = type(config).__name__
        raise ConfigError(f'{name}.reward must be "dense" or "sparse", got {config.reward!r}.')


def progress(says: str) -> RewardTerm:
    """The term of a task whose steps have `progress_m`, the fall of the ways that are left: as
    differences of a potential they sum up to no more than there was to go."""
    said = f'{says}, times `task.progress_per_m`; 0 with `task.reward` "sparse".'
    return RewardTerm("progress", said, _progress)


def _progress(now: Belief, step: Any, previous: Floats, config: Any) -> Floats:
    share = config.progress_per_m if config.reward == "dense" else 0.0
    return np.asarray(share * step["progress_m"])


def closeness(separation_m: Floats, reach_m: float) -> Floats:
    """Shape of the proximity term: 0 from `reach_m` on, 1 at touch, at most 2.25 inside."""
    share = np.minimum(np.maximum((reach_m - separation_m) / reach_m, 0.0), 1.5)
    return share * share


@kernel(makes_arrays=True)
def _mean_square(vectors):
    """(B,) of (B, n)."""
    mean = np.zeros(len(vectors))
    for b in range(len(vectors)):
        for value in vectors[b]:
            mean[b] += value * value
        mean[b] /= vectors.shape[1]
    return mean


def _proximity(now: Belief, step: Any, previous: Floats, config: RewardConfig) -> Floats:
    nearest_m = np.minimum.reduce(now.separation.distance_m, axis=-1, initial=np.inf)
    least = np.where(now.estimate.unknown.any(-1), config.unknown, 0.0)
    near = np.maximum(closeness(nearest_m, config.proximity_reach_m), least)
    return -config.proximity * near


SHARED_TERMS: tuple[RewardTerm, ...] = (
    RewardTerm(
        "effort",
        "Minus `effort` times the mean squared action.",
        lambda now, step, previous, config: -config.effort * _mean_square(now.action),
    ),
    RewardTerm(
        "smoothness",
        "Minus `smoothness` times the mean squared change of the action.",
        lambda now, step, previous, config: (
            -config.smoothness * _mean_square(now.action - previous)
        ),
    ),
    RewardTerm(
        "proximity",
        "Minus `proximity` times clip((d0 - d) / d0, 0, 1.5)^2, where d is the distance of the "
        "robot's surface from the nearest estimated body and d0 is `proximity_reach_m`; at least "
        "`unknown` of that while somebody may be there whom nobody sees.",
        _proximity,
    ),
)


def evaluated(
    terms: tuple[RewardTerm, ...], now: Belief, step: Any, previous_action: Floats, weights: Any
) -> dict[str, Floats]:
    """The value (B,) of each of these terms by its name; those of users get read-only arrays."""
    values = {}
    for term in terms:
        given: Any = now, step, previous_action, weights
        if is_of_user(term.function):
            lent = lent_belief(now), *read_only(given[1:3]), weights
            values[term.name] = called(f"Reward term {term.name!r}", term.function, *lent)
        else:
            values[term.name] = term.function(*given)
    return values


def checked_factors(factors: Mapping[str, float], terms: Sequence[RewardTerm]) -> dict[str, float]:
    """Factors on a reward's terms by name, or `ConfigError` for a name that is none, with the
    nearest, and for what is no finite number."""
    names = [term.name for term in terms]
    check_names("reward term", factors, names)
    for name, factor in factors.items():
        number = isinstance(factor, int | float | np.number) and not isinstance(factor, bool)
        if not number or not np.isfinite(factor):
            raise ConfigError(
                f"The factor on reward term {name!r} must be a finite number, got {factor!r}."
            )
    return {name: float(factor) for name, factor in factors.items()}


def total(terms: Mapping[str, Floats], batch: int) -> Floats:
    """The reward (B,): the sum of its terms; `ConfigError` for one of another shape,
    `FloatingPointError` for one that is not finite, a fault of the code, never of a camera."""
    for name, value in terms.items():
        check_shape(f"reward term {name!r}", np.shape(value), (batch,), "a value an environment")
    reward: Floats = sum(terms.values(), np.zeros(batch))
    if not np.isfinite(reward).all():
        wrong = [name for name, value in terms.items() if not np.isfinite(value).all()]
        raise FloatingPointError(f"Reward terms that are not finite: {', '.join(wrong)}.")
    return reward
