"""A stopwatch that is put round functions from outside: what it times knows nothing of it."""

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
    """One thread's sums."""

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    calls: Counter[str] = field(default_factory=Counter)
    within: list[float] = field(default_factory=list)
    """For each timed call that is open, the seconds of the timed calls inside it."""
    closed: bool = False
    """Whether a call is open that is timed as a whole."""


class Stopwatch:
    """Seconds of each organ by itself, on whatever threads it runs.

    What a timed call spends in other timed calls counts for those only, so that organs add up.
    Time that a thread waits for another one counts for the organ that waits. In the organs named
    `whole` nothing is told apart.
    """

    def __init__(self, organs: Mapping[str, Sequence[Place]], whole: Sequence[str] = ()) -> None:
        self.organs, self.whole = organs, whole
        self._own, self._hands = threading.local(), list[_Hand]()

    @property
    def seconds(self) -> dict[str, float]:
        """Each organ's seconds, summed over threads."""
        return {organ: sum(hand.seconds[organ] for hand in self._hands) for organ in self.organs}

    @property
    def idle(self) -> list[str]:
        """The places that nobody called."""
        places = [name_of(place) for each in self.organs.values() for place in each]
        return [name for name in places if not any(hand.calls[name] for hand in self._hands)]

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time the organs' calls while this is open; afterwards everything is as it was."""
        kept: list[tuple[Any, str, Any]] = []
        try:
            for organ, places in self.organs.items():
                for owner, name in places:
                    function = vars(owner)[name]
                    kept.append((owner, name, function))
                    setattr(owner, name, self._timed(organ, name_of((owner, name)), function))
            yield
        finally:
            for owner, name, function in kept:
                setattr(owner, name, function)

    def _timed(self, organ: str, place: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function with a stopwatch round it."""
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
        """This thread's sums."""
        try:
            return self._own.hand
        except AttributeError:
            self._own.hand = hand = _Hand()
            self._hands.append(hand)
            return hand


def name_of(place: Place) -> str:
    """A place as people say it: "hrc_env.scene.physics.Physics.step"."""
    owner, name = place
    room = f"{owner.__module__}." if isinstance(owner, type) else ""
    return f"{room}{owner.__name__}.{name}"
