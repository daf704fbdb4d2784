"""Ctrl-C as a wish that a loop grants where it can stop cleanly."""

import signal
import threading
from types import FrameType
from typing import Any, Self


class Interrupt:
    """After `listen` the first Ctrl-C is kept in `asked`; the second one interrupts as ever."""

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def listen(self) -> None:
        """From now on."""
        if threading.current_thread() is threading.main_thread():  # signals come nowhere else
            self._before = signal.signal(signal.SIGINT, self._answer)

    def _answer(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
