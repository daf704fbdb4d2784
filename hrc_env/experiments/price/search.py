"""The search of the margin at which a rate falls to a level, by bisection, and its evaluation.

A search evaluates margins on the same seeds, so that margins differ by their effect and not by
their draws (common random numbers): it halves a bracket until noise is wider, and takes a margin on
either side. At the margin found, fresh seeds are played. These give the height of the curve there;
the search gives its shape beside it: y(m) = y_fresh(m_0) y_search(m) / y_search(m_0), a ratio
estimator of two samples (Cochran 1977, Sampling Techniques, ch. 12). As the search chose the
margin, its own seeds do not affect the height of the curve.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.optimize import isotonic_regression

from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation import intervals
from hrc_env.evaluation.intervals import find_crossing

RequestT = TypeVar("RequestT")
AnswerT = TypeVar("AnswerT")
ResultT = TypeVar("ResultT")
HALF = 0.5
"""Events added to counts before their logarithm is taken."""


def search(
    rate: Callable[[float], Generator[RequestT, AnswerT, float]],
    low: float,
    high: float,
    level: float,
    n_steps: int,
) -> Generator[RequestT, AnswerT, list[float]]:
    """Evaluate a falling rate at `n_steps` bisections of a bracket and at margins beside it.

    Args:
        rate: generator function that evaluates the rate at an argument; its requests are yielded.
        low: lower end of the bracket.
        high: upper end of the bracket.
        level: level to which the rate falls.
        n_steps: number of bisections.

    Returns:
        All arguments that were tried; the last are the ends of the bracket and one beyond either.
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
    searches: Sequence[Generator[RequestT, AnswerT, ResultT]],
    answer: Callable[[list[RequestT]], list[AnswerT]],
) -> list[ResultT]:
    """Run searches side by side, one step of each in a round, and return their results.

    Args:
        searches: generators that yield requests and are sent the answers.
        answer: returns the answers to all requests of a round, in their order.
    """
    results: dict[int, ResultT] = {}
    answers: dict[int, Any] = dict.fromkeys(range(len(searches)))
    while answers:
        requests: dict[int, RequestT] = {}
        for k, sent in answers.items():
            try:
                requests[k] = searches[k].send(sent)
            except StopIteration as end:
                results[k] = end.value
        answers = dict(zip(requests, answer([*requests.values()]), strict=True)) if requests else {}
    return [results[k] for k in range(len(searches))]


def fit_falling_rates(events: Floats, minutes: Floats) -> Floats:
    """Return logarithms of rates (K,), fitted so that they fall, from counts and minutes (K,)."""
    rates = np.log((events + HALF) / minutes)
    return np.asarray(isotonic_regression(rates, increasing=False).x)


@dataclass(frozen=True, slots=True)
class MarginSearch:
    """Sums of the episodes of a search, one column per seed."""

    margins_m: Floats
    """Margins (K,) in increasing order [m]."""
    events: Floats
    """Events (K, n), which become rarer as the margin grows."""
    achieved: Floats
    """Goals (K, n)."""
    minutes: Floats
    """Durations (K, n) [min]."""
    fresh_margin_m: float
    """Margin of the fresh seeds [m]."""
    fresh_events: Floats
    """Events of fresh seeds (m,)."""
    fresh_achieved: Floats
    """Goals of fresh seeds (m,)."""
    fresh_minutes: Floats
    """Durations of fresh seeds (m,) [min]."""

    def evaluate(self, level_per_min: float, drawn: Ints, fresh: Ints) -> Floats:
        """Return the margin [m] at which events fall to a level, and goals per minute there (R, 2).

        A margin beyond those that were tried is the last of them.

        Args:
            level_per_min: events per minute.
            drawn: number of times that each seed of the search counts (R, n).
            fresh: number of times that each fresh seed counts (R, m).
        """
        m, m_0, level = self.margins_m, self.fresh_margin_m, np.log(level_per_min)
        minutes, fresh_minutes = drawn @ self.minutes.T, fresh @ self.fresh_minutes
        events, achieved = drawn @ self.events.T, drawn @ self.achieved.T / minutes
        height = np.log((fresh @ self.fresh_events + HALF) / fresh_minutes)
        results = np.empty((len(drawn), 2))
        for r, curve in enumerate(map(fit_falling_rates, events, minutes)):
            margin_m = find_crossing(m, curve + height[r] - np.interp(m_0, m, curve), level)
            there, here = np.interp([margin_m, m_0], m, achieved[r])
            results[r] = margin_m, there / here if here else 1.0
        results[:, 1] *= fresh @ self.fresh_achieved / fresh_minutes
        return results


class SeedWeights(NamedTuple):
    """The number of times that each seed counts, in 1 + R draws; in the first each counts once."""

    search: Ints
    """Seeds of the search (1 + R, n)."""
    fresh: Ints
    """Fresh seeds (1 + R, m)."""


def draw_seeds(n: int, m: int, n_draws: int) -> SeedWeights:
    """Return draws of n seeds of a search and of m fresh ones, the same in every call.

    Rows that share their seeds can therefore be compared draw by draw.
    """
    weights = (
        np.vstack([np.ones((1, k), int), intervals.draw_seeds(k, n_draws, stream)])
        for stream, k in enumerate((n, m))
    )
    return SeedWeights(*weights)
