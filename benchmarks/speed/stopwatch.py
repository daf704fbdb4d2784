"""A stopwatch that wraps functions from outside, without changes of their code."""

import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

Place = tuple[Any, str]
"""A module or a class, and the name of a function in it."""


@dataclass(slots=True)
class _Hand:
    """The sums of one thread."""

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    calls: Counter[str] = field(default_factory=Counter)
    within: list[float] = field(default_factory=list)
    """Seconds of timed calls inside of each open timed call."""
    closed: bool = False
    """Whether a call is open that is timed as a whole."""


class Stopwatch:
    """Seconds of each part by itself, over all threads.

    Time that a timed call spends in other timed calls counts for those only, so parts add up. Time
    that a thread waits for another one counts for the part that waits. Inside of the parts named
    `whole` no other parts are distinguished.
    """

    def __init__(self, organs: Mapping[str, Sequence[Place]], whole: Sequence[str] = ()) -> None:
        self.organs, self.whole = organs, whole
        self._own, self._hands = threading.local(), list[_Hand]()

    @property
    def seconds(self) -> dict[str, float]:
        """Return each part's seconds, summed over threads."""
        return {organ: sum(hand.seconds[organ] for hand in self._hands) for organ in self.organs}

    @property
    def idle(self) -> list[str]:
        """Return the functions that were never called."""
        places = [format_name(place) for each in self.organs.values() for place in each]
        return [name for name in places if not any(hand.calls[name] for hand in self._hands)]

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time the calls of all parts inside of the context; functions are restored afterwards."""
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
        """Return a function that is timed."""
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
        """Return the sums of this thread."""
        try:
            return self._own.hand
        except AttributeError:
            self._own.hand = hand = _Hand()
            self._hands.append(hand)
            return hand


def format_name(place: Place) -> str:
    """Return the full name of a function, as "hrc_env.scene.physics.Physics.step"."""
    owner, name = place
    room = f"{owner.__module__}." if isinstance(owner, type) else ""
    return f"{room}{owner.__name__}.{name}"
