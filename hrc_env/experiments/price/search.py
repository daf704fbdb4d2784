"""The margin at which something falls to a level, by bisection, and what else is true there.

A search of some steps evaluates margins on the same seeds, so that one margin differs from another
by what it does and not by who was drawn (common random numbers). The last of them is played again
on fresh seeds. These say how much there is at that margin; the search says how it changes beside
it: y(m) = y_fresh(m_last) y_search(m) / y_search(m_last), a ratio estimator of two samples
(Cochran 1977, Sampling Techniques, ch. 12). As the search chose the margin, its own seeds have
no say in the height of the curve.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import isotonic_regression

from hrc_env.core.typing import Floats, Ints
from hrc_env.experiments.study.intervals import crossing

HALF = 0.5
"""Of an event, added to counts whose logarithm is asked for."""


def bisected(
    rate: Callable[[float], float], low: float, high: float, level: float, n_steps: int
) -> list[float]:
    """The arguments that were tried, the last one next to where a falling rate crosses the level,
    or next to the end of the bracket beyond which it does."""
    tried: list[float] = []
    for _ in range(n_steps):
        tried.append(middle := 0.5 * (low + high))
        if rate(middle) > level:
            low = middle
        else:
            high = middle
    return tried


@dataclass(frozen=True, slots=True)
class Tried:
    """Sums of episodes, a seed a column."""

    margins_m: Floats
    """(K,) in the order in which they were tried."""
    events: Floats
    """(K, n) what has to fall."""
    achieved: Floats
    """(K, n)."""
    minutes: Floats
    """(K, n)."""
    fresh_events: Floats
    """(m,) on other seeds, with the last of the margins."""
    fresh_achieved: Floats
    fresh_minutes: Floats

    def at(self, level_per_min: float, drawn: Ints, fresh: Ints) -> Floats:
        """(R, 2) the margin [m] at which events come down to the level, and what is achieved a
        minute there, for how often seeds are drawn (R, n) and (R, m). A margin beyond those that
        were tried is the last of them."""
        order = np.argsort(self.margins_m)
        last = int(np.flatnonzero(order == len(order) - 1)[0])
        margins_m, minutes = self.margins_m[order], drawn @ self.minutes[order].T
        events = np.log((drawn @ self.events[order].T + HALF) / minutes)
        achieved = drawn @ self.achieved[order].T / minutes
        fresh_minutes = fresh @ self.fresh_minutes
        height = np.log((fresh @ self.fresh_events + HALF) / fresh_minutes)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = fresh @ self.fresh_achieved / fresh_minutes / achieved[:, last]
        found = np.empty((len(drawn), 2))
        for r, curve in enumerate(events):
            falling = isotonic_regression(curve, increasing=False).x
            falling = falling + height[r] - falling[last]
            margin_m = crossing(margins_m, falling, np.log(level_per_min))
            found[r] = margin_m, np.interp(margin_m, margins_m, achieved[r]) * scale[r]
        return found


def draws(n: int, m: int, n_draws: int) -> tuple[Ints, Ints]:
    """(1 + R, n) and (1 + R, m) how often seeds are drawn: first each once, then at random, always
    the same, so that what shares its seeds is compared draw by draw."""
    return _drawn(n, n_draws, 0), _drawn(m, n_draws, 1)


@lru_cache(maxsize=8)
def _drawn(n: int, n_draws: int, seed: int) -> Ints:
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), n_draws)
    return np.vstack([np.ones((1, n), int), drawn])
