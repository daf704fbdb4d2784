"""The margin at which something falls to a level, by bisection, and what else is true there.

A search evaluates margins on the same seeds, so that one margin differs from another by what it
does and not by who was drawn (common random numbers): it halves a bracket until noise is wider, and
takes a margin on either side. Where the level seems to be, fresh seeds are played. These say how
much there is there; the search says how it changes beside it: y(m) = y_fresh(m_0) y_search(m) /
y_search(m_0), a ratio estimator of two samples (Cochran 1977, Sampling Techniques, ch. 12). As the
search chose the margin, its own seeds have no say in the height of the curve.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from scipy.optimize import isotonic_regression

from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation import intervals
from hrc_env.evaluation.intervals import crossing

AskedT = TypeVar("AskedT")
AnswerT = TypeVar("AnswerT")
FoundT = TypeVar("FoundT")
HALF = 0.5
"""Of an event, added to counts whose logarithm is asked for."""


def searched(
    rate: Callable[[float], Generator[AskedT, AnswerT, float]],
    low: float,
    high: float,
    level: float,
    n_steps: int,
) -> Generator[AskedT, AnswerT, list[float]]:
    """Search where a falling rate comes down to a level.

    Args:
        rate: a generator function, whose yields are passed on.
        low, high: the bracket.
        level: of the rate.
        n_steps: halvings of the bracket round the level; then one argument as wide as what is left
            of it is tried on either side.

    Returns:
        All arguments that were tried.
    """
    tried: list[float] = []
    for _ in range(n_steps):
        tried.append(middle := 0.5 * (low + high))
        if (yield from rate(middle)) > level:
            low = middle
        else:
            high = middle
    width = high - low
    for beside in (low - width, low, high, high + width):
        if not np.isclose(tried, beside).any():
            yield from rate(beside)
            tried.append(beside)
    return tried


def run_together(
    searches: Sequence[Generator[AskedT, AnswerT, FoundT]],
    answer: Callable[[list[AskedT]], list[AnswerT]],
) -> list[FoundT]:
    """Run searches side by side, a step of each in a round; return what they found.

    Args:
        searches: each yields what it asks for, and is sent the answer.
        answer: of all that is asked for in a round, in that order.
    """
    found: dict[int, FoundT] = {}
    answers: dict[int, Any] = dict.fromkeys(range(len(searches)))
    while answers:
        asked: dict[int, AskedT] = {}
        for k, sent in answers.items():
            try:
                asked[k] = searches[k].send(sent)
            except StopIteration as end:
                found[k] = end.value
        answers = dict(zip(asked, answer([*asked.values()]), strict=True)) if asked else {}
    return [found[k] for k in range(len(searches))]


def falling(events: Floats, minutes: Floats) -> Floats:
    """(K,) logarithms of rates, the nearest that fall, of counts in so many minutes (K,)."""
    rates = np.log((events + HALF) / minutes)
    return np.asarray(isotonic_regression(rates, increasing=False).x)


@dataclass(frozen=True, slots=True)
class Tried:
    """Sums of episodes, a seed a column."""

    margins_m: Floats
    """(K,) that grow."""
    events: Floats
    """(K, n) what has to fall."""
    achieved: Floats
    """(K, n)."""
    minutes: Floats
    """(K, n)."""
    fresh_margin_m: float
    """With which fresh seeds were played."""
    fresh_events: Floats
    """(m,)."""
    fresh_achieved: Floats
    """(m,)."""
    fresh_minutes: Floats
    """(m,)."""

    def at(self, level_per_min: float, drawn: Ints, fresh: Ints) -> Floats:
        """(R, 2) the margin [m] at which events come down to the level, and what is achieved a
        minute there, for how often seeds are drawn (R, n) and (R, m). A margin beyond those that
        were tried is the last of them."""
        m, m_0, level = self.margins_m, self.fresh_margin_m, np.log(level_per_min)
        minutes, fresh_minutes = drawn @ self.minutes.T, fresh @ self.fresh_minutes
        events, achieved = drawn @ self.events.T, drawn @ self.achieved.T / minutes
        height = np.log((fresh @ self.fresh_events + HALF) / fresh_minutes)
        found = np.empty((len(drawn), 2))
        for r, curve in enumerate(map(falling, events, minutes)):
            margin_m = crossing(m, curve + height[r] - np.interp(m_0, m, curve), level)
            there, here = np.interp([margin_m, m_0], m, achieved[r])
            found[r] = margin_m, there / here if here else 1.0
        found[:, 1] *= fresh @ self.fresh_achieved / fresh_minutes
        return found


def draws(n: int, m: int, n_draws: int) -> tuple[Ints, Ints]:
    """(1 + R, n) and (1 + R, m) how often seeds are drawn: first each once, then at random, always
    the same, so that what shares its seeds is compared draw by draw."""
    sizes = (n, m)
    tried, fresh = (np.vstack([np.ones((1, k), int), intervals.draws(k, n_draws, stream)])
                    for stream, k in enumerate(sizes))  # fmt: skip
    return tried, fresh
