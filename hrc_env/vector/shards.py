"""A batch of environments in contiguous ranges, each a `Simulation` stepped by its own thread.

As no result depends on the size of a batch, none depends on the number of ranges either.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.stateful import State
from hrc_env.core.typing import Floats, Ints
from hrc_env.simulation import Simulation
from hrc_env.step import StepResult, joined


class Shards:
    """`batch` environments in `n_shards` simulations; the calling thread works on the first."""

    def __init__(self, batch: int, n_shards: int, make: Callable[[int], Simulation]) -> None:
        """Make them.

        Args:
            batch: how many environments.
            n_shards: in how many ranges.
            make: gives a simulation of so many environments, always of the same kind.
        """
        self.bounds = [batch * k // n_shards for k in range(n_shards + 1)]
        self.parts = [make(high - low) for low, high in pairwise(self.bounds)]
        self._pool: ThreadPoolExecutor | None = None

    @property
    def first(self) -> Simulation:
        """That of the calling thread."""
        return self.parts[0]

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> StepResult:
        """Start environments `ids` (sorted) anew, one generator each; their rows."""
        rows = pairwise(np.searchsorted(ids, self.bounds).tolist())
        given = zip(self.bounds[:-1], rows, strict=True)
        arguments = ((ids[low:high] - first, rngs[low:high]) for first, (low, high) in given)
        return self._run("reset", [each if len(each[0]) > 0 else None for each in arguments])

    def step(self, action: Floats) -> StepResult:
        """One control step of every environment; action (B, A) in [-1, 1]."""
        return self._run("step", [(action[low:high],) for low, high in pairwise(self.bounds)])

    def get_state(self) -> list[State]:
        """A copy of everything that changes, part by part."""
        return [part.get_state() for part in self.parts]

    def set_state(self, state: list[State]) -> None:
        """Continue from a state.

        Raises:
            ConfigError: it was taken with other settings or another number of parts.
        """
        if len(state) != len(self.parts):
            raise ConfigError(
                f"The state was taken with {len(state)} threads; here there are "
                f"{len(self.parts)}. Make the environment with num_threads={len(state)}."
            )
        for part, saved in zip(self.parts, state, strict=True):
            part.set_state(saved)

    def close(self) -> None:
        """Stop the threads, release what the simulations hold."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
        for part in self.parts:
            part.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_pool": None}

    def _run(self, name: str, arguments: Sequence[tuple[Any, ...] | None]) -> StepResult:
        """What a method of all parts gives, of those but for which the arguments are None.

        The others are set to work first. Nobody works on any more when this returns or raises.
        """
        mine, *theirs = arguments
        others = [
            (first, self._start(part, name, each))
            for part, first, each in zip(self.parts[1:], self.bounds[1:-1], theirs, strict=True)
            if each is not None
        ]
        own = [] if mine is None else [(0, partial(getattr(self.first, name), *mine))]
        return joined(_all_done([*own, *others]))

    def _start(
        self, part: Simulation, name: str, arguments: tuple[Any, ...]
    ) -> Callable[[], StepResult]:
        """Have a thread work on a part; but a reset is Python for the most part, in which threads
        would only wait for each other."""
        if name == "reset":
            return partial(getattr(part, name), *arguments)
        if self._pool is None:
            n_helpers = len(self.parts) - 1
            self._pool = ThreadPoolExecutor(n_helpers, thread_name_prefix="hrc_env-shard")
        return self._pool.submit(getattr(part, name), *arguments).result


def _all_done(jobs: Iterable[tuple[int, Callable[[], StepResult]]]) -> list[StepResult]:
    """What jobs give, each with the number of its first environment; or, once all are done, the
    first error."""
    outcomes, errors = [], []
    for first, job in jobs:
        try:
            outcomes.append(job())
        except BaseException as error:
            errors.append(error)
            if isinstance(error, HRCError) and first > 0:
                error.add_note(f"Environments are counted from number {first} of the vector here.")
    if errors:
        raise errors[0]
    return outcomes
