"""A stopwatch that measures functions by wrapping them at run time."""

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

Place = tuple[Any, str]
"""A module or class, and the name of one of its functions."""


@dataclass(slots=True)
class _Hand:
    """Times and numbers of calls in one thread."""

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    calls: Counter[str] = field(default_factory=Counter)
    within: list[float] = field(default_factory=list)
    """Time spent in nested timed calls, for each timed call that is running [s]."""
    closed: bool = False
    """Whether a call of a function of a part in `Stopwatch.whole` is running."""


class Stopwatch:
    """A stopwatch for the exclusive time of each part, summed over all threads.

    Time that a timed call spends in other timed calls is attributed only to the latter, so that the
    times of the parts add up. The time of waiting for another thread is attributed to the waiting
    part. Within the parts in `whole`, no other parts are timed.
    """

    def __init__(self, organs: Mapping[str, Sequence[Place]], whole: Sequence[str] = ()) -> None:
        self.organs, self.whole = organs, whole
        self._own, self._hands = threading.local(), list[_Hand]()

    @property
    def seconds(self) -> dict[str, float]:
        """Time of each part, summed over threads [s]."""
        return {organ: sum(hand.seconds[organ] for hand in self._hands) for organ in self.organs}

    @property
    def idle(self) -> list[str]:
        """Names of functions that were never called."""
        places = [format_name(place) for each in self.organs.values() for place in each]
        return [name for name in places if not any(hand.calls[name] for hand in self._hands)]

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time all calls of the parts within the context, and restore the functions afterwards."""
        kept: list[tuple[Any, str, Any]] = []
        try:
            for organ, places in self.organs.items():
                for owner, name in places:
                    function = vars(owner)[name]
                    kept.append((owner, name, function))
                    setattr(owner, name, self._wrap(organ, format_name((owner, name)), function))
            yield
        finally:
            for owner, name, function in kept:
                setattr(owner, name, function)

    def _wrap(self, organ: str, place: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a wrapper that times a function."""
        closes = organ in self.whole

        def call(*arguments: Any, **named: Any) -> Any:
            hand = self._hand()
            if hand.closed:
                return function(*arguments, **named)
            hand.within.append(0.0)
            hand.closed = closes
            started_s = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                spent_s = time.perf_counter() - started_s
                hand.closed = False
                hand.seconds[organ] += spent_s - hand.within.pop()
                hand.calls[place] += 1
                if hand.within:
                    hand.within[-1] += spent_s

        return call

    def _hand(self) -> _Hand:
        """Return the times and numbers of calls of the current thread."""
        try:
            return self._own.hand
        except AttributeError:
            self._own.hand = hand = _Hand()
            self._hands.append(hand)
            return hand


def format_name(place: Place) -> str:
    """Return the full name of a function, e.g. "hrc_env.scene.physics.Physics.step"."""
    owner, name = place
    room = f"{owner.__module__}." if isinstance(owner, type) else ""
    return f"{room}{owner.__name__}.{name}"
