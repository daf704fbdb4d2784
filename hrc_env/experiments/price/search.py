"""Search by bisection for the margin at which a rate falls to a level, and its evaluation.

A search evaluates all margins on the same seeds (common random numbers). Rates therefore differ by
the effect of the margin and not by random draws. The search bisects a bracket a fixed number of
times; it then tries the ends of the bracket and one margin beyond either end. Episodes on new seeds
are played with the resulting margin. They determine the height of the curve at that margin, and the
search determines its shape: y(m) = y_new(m_0) y_search(m) / y_search(m_0), a ratio estimator of two
samples (Cochran 1977, Sampling Techniques, ch. 12). The seeds of the search do not affect the
height of the curve, because they were used to choose the margin.
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
"""Number of events added to a count before its logarithm is computed."""


def search(
    rate: Callable[[float], Generator[RequestT, AnswerT, float]],
    low: float,
    high: float,
    level: float,
    n_steps: int,
) -> Generator[RequestT, AnswerT, list[float]]:
    """Evaluate a decreasing rate at `n_steps` bisections of a bracket and at arguments nearby.

    Args:
        rate: generator function that evaluates the rate at an argument. Its requests are yielded.
        low: lower end of the bracket.
        high: upper end of the bracket.
        level: level to which the rate falls.
        n_steps: number of bisections.

    Returns:
        All arguments that were tried; the last are the ends of the final bracket and one argument
            beyond either end.
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
    """Run searches in parallel, one step of each per round, and return their results.

    Args:
        searches: generators that yield requests and receive the answers by `send`.
        answer: function that returns the answers to all requests of a round, in their order.
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
    """Fit decreasing rates to counts and minutes (K,), and return their logarithms (K,)."""
    rates = np.log((events + HALF) / minutes)
    return np.asarray(isotonic_regression(rates, increasing=False).x)


@dataclass(frozen=True, slots=True)
class MarginSearch:
    """Sums of the episodes of a search and of those on new seeds, with one column per seed."""

    margins_m: Floats
    """Margins (K,) in increasing order [m]."""
    events: Floats
    """Numbers of events (K, n), which decrease as the margin grows."""
    achieved: Floats
    """Numbers of goals (K, n)."""
    minutes: Floats
    """Durations (K, n) [min]."""
    fresh_margin_m: float
    """Margin with which the episodes on new seeds were played [m]."""
    fresh_events: Floats
    """Numbers of events (m,) on the new seeds."""
    fresh_achieved: Floats
    """Numbers of goals (m,) on the new seeds."""
    fresh_minutes: Floats
    """Durations (m,) of the episodes on the new seeds [min]."""

    def evaluate(self, level_per_min: float, drawn: Ints, fresh: Ints) -> Floats:
        """Return the margin [m] at which events fall to a level, and goals per minute there (R, 2).

        A margin outside the range of the tried margins is replaced by the nearest of these.

        Args:
            level_per_min: level of the rate [events per minute].
            drawn: number of times (R, n) that each seed of the search counts.
            fresh: number of times (R, m) that each new seed counts.
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
    """Number of times that each seed counts in 1 + R draws; in the first, each counts once."""

    search: Ints
    """Weights (1 + R, n) of the seeds of the search."""
    fresh: Ints
    """Weights (1 + R, m) of the new seeds."""


def draw_seeds(n: int, m: int, n_draws: int) -> SeedWeights:
    """Return draws of n seeds of a search and of m new seeds; they are the same in every call.

    Rows that share their seeds can therefore be compared draw by draw.
    """
    weights = (
        np.vstack([np.ones((1, k), int), intervals.draw_seeds(k, n_draws, stream)])
        for stream, k in enumerate((n, m))
    )
    return SeedWeights(*weights)
