"""A simulation in a process of its own: calls go there, what they give comes back.

Two threads of one process share Python's lock and slow each other; two processes do not. The
child is `python -m hrc_env.remote`, which reads pickled calls from its standard input, so that
scripts need no `if __name__ == "__main__"`. It ends when its parent does.
"""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.errors import HRCError
from hrc_env.outcome import Outcome
from hrc_env.rewards import RewardConfig
from hrc_env.simulation import N_STREAMS, Simulation
from hrc_env.stateful import State
from hrc_env.streams import children
from hrc_env.typing import Floats, Ints
from hrc_env.views import Views

_LAST_WORDS_S = 5.0
"""How long a process that no longer answers has to end by itself."""


class Remote:
    """As far as a vector environment asks, a `Simulation` and its `Views`."""

    def __init__(self, make: Callable[[int], Simulation], batch: int) -> None:
        """Have `make` (that can be pickled) make one of `batch` environments over there."""
        self.batch = batch
        self._child = subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        self._send((make, batch))
        self._owed = 1

    def start(self, name: str, arguments: tuple[Any, ...]) -> Callable[[], Outcome]:
        """Have `reset` or `step` done; what to call for its result."""
        if name == "reset":
            ids, rngs = arguments
            name, arguments = "begin", (ids, [children(rng, N_STREAMS) for rng in rngs])
        self._call(name, arguments)
        return lambda: _unpacked(self._answer())

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> Outcome:
        """As `Simulation.reset`."""
        return self.start("reset", (ids, rngs))()

    def step(self, action: Floats) -> Outcome:
        """As `Simulation.step`."""
        return self.start("step", (action,))()

    def set_reward(self, weights: RewardConfig) -> None:
        """As `Simulation.set_reward`."""
        self._ask("set_reward", weights)

    def get_state(self) -> State:
        """As `Simulation.get_state`."""
        return self._ask("get_state")

    def set_state(self, state: State) -> None:
        """As `Simulation.set_state`."""
        self._ask("set_state", state)

    def picture(self, depth: bool, b: int, size: tuple[int, int]) -> NDArray[Any]:
        """As `Views.picture`."""
        return self._ask("picture", depth, b, size)

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError):  # it has ended, with words unread
            self._pipe(self._child.stdin).close()
        self._child.wait()
        self._pipe(self._child.stdout).close()

    def __getstate__(self) -> Any:
        raise pickle.PicklingError(
            'An environment with backend="processes" cannot be pickled; save get_state() of it.'
        )

    def _ask(self, name: str, *arguments: Any) -> Any:
        self._call(name, arguments)
        return self._answer()

    def _call(self, name: str, arguments: tuple[Any, ...]) -> None:
        """Ask for something; what nobody has waited for before (who was interrupted) is left."""
        while self._owed > 0:
            self._answer()
        self._send((name, arguments))
        self._owed += 1

    def _send(self, what: Any) -> None:
        pipe = self._pipe(self._child.stdin)
        try:
            pickle.dump(what, pipe, pickle.HIGHEST_PROTOCOL)
            pipe.flush()
        except (BrokenPipeError, ValueError) as error:
            raise self._ended() from error

    def _answer(self) -> Any:
        try:
            is_result, answer = pickle.load(self._pipe(self._child.stdout))
        except (EOFError, pickle.UnpicklingError, ValueError) as error:
            raise self._ended() from error
        self._owed -= 1
        if is_result:
            return answer
        raise answer

    def _ended(self) -> HRCError:
        try:
            code = self._child.wait(_LAST_WORDS_S)
        except subprocess.TimeoutExpired:  # it lives, but what it says makes no sense any more
            self._child.kill()
            code = self._child.wait()
        return HRCError(
            f"The process of {self.batch} environments has ended (exit status {code}): killed, or "
            "out of memory? What it wrote stands above. Make a new environment."
        )

    @staticmethod
    def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
        if pipe is None:
            raise HRCError("A process was started without its pipes.")
        return pipe


def _packed(outcome: Outcome) -> tuple[Outcome, tuple[str, ...], Floats]:
    """An outcome with its info apart as one array: fifty small ones take longer to send."""
    info = outcome.info
    return replace(outcome, info={}), tuple(info), np.array(list(info.values()), float)


def _unpacked(packed: tuple[Outcome, tuple[str, ...], Floats]) -> Outcome:
    outcome, names, values = packed
    return replace(outcome, info=dict(zip(names, values, strict=True)))


class _Desk:
    """What a child does for its parent."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self.views = simulation, Views(simulation)

    def answer(self, name: str, arguments: Sequence[Any]) -> Any:
        """Do what is asked."""
        holder = self.views if name == "picture" else self.simulation
        answer = getattr(holder, name)(*arguments)
        return _packed(answer) if isinstance(answer, Outcome) else answer

    def close(self) -> None:
        """Release what is held."""
        self.views.close()
        self.simulation.close()


def _serve(calls: IO[bytes], answers: IO[bytes]) -> None:
    """Answer until nobody asks any more."""

    def attempt(job: Callable[[], Any]) -> None:
        try:
            answer = (True, job())
        except Exception as error:
            answer = (False, error)
        pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
        answers.flush()

    make, batch = pickle.load(calls)
    desk: list[_Desk] = []
    attempt(lambda: desk.append(_Desk(make(batch))))
    while desk:
        try:
            name, arguments = pickle.load(calls)
        except EOFError:
            desk.pop().close()
            return
        attempt(lambda name=name, arguments=arguments: desk[0].answer(name, arguments))


def _main() -> None:
    """Serve on standard input and output; whatever else is printed goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is told, and ends this
    warnings.simplefilter("ignore")  # the parent has warned of the same
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    try:
        _serve(sys.stdin.buffer, answers)
    except BrokenPipeError:
        os._exit(1)  # nobody is there to hear


if __name__ == "__main__":
    _main()
