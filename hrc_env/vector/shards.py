"""A batch of environments in contiguous ranges, each a `Simulation` stepped by its own thread.

As no result depends on the size of a batch, none depends on the number of ranges either.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from hrc_env.core.batching import State
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.typing import Floats, Ints
from hrc_env.reset_options import Fixed
from hrc_env.simulation import Simulation
from hrc_env.step_result import StepResult, joined


class Shards:
    """`batch` environments in `n_shards` simulations; the calling thread works on the first."""

    def __init__(self, batch: int, n_shards: int, make: Callable[[int], Simulation]) -> None:
        """`make` gives a simulation of so many environments, always of the same kind."""
        self.bounds = [batch * k // n_shards for k in range(n_shards + 1)]
        self.parts = [make(high - low) for low, high in pairwise(self.bounds)]
        self.first = self.parts[0]
        """That of the calling thread."""
        self._pool: ThreadPoolExecutor | None = None

    def reset(
        self, ids: Ints, rngs: Sequence[np.random.Generator], fixed: Sequence[Fixed | None] = ()
    ) -> StepResult:
        """Start environments `ids` (sorted) anew, one generator each; their rows. In one thread:
        this is Python for the most part, in which others would only wait. `fixed`: as of
        `Simulation.reset`."""
        cuts = pairwise(np.searchsorted(ids, self.bounds).tolist())
        parts = zip(self.parts, self.bounds[:-1], cuts, strict=True)
        jobs = [
            (first, partial(part.reset, ids[low:high] - first, rngs[low:high], fixed[low:high]))
            for part, first, (low, high) in parts
            if low < high
        ]
        return joined(_all_done(jobs))

    def where(self, k: int) -> tuple[Simulation, int]:
        """Return the simulation of environment k, and its number there."""
        shard = int(np.searchsorted(self.bounds, k, "right")) - 1
        return self.parts[shard], k - self.bounds[shard]

    def step(self, action: Floats) -> StepResult:
        """One control step of every environment; action (B, A) in [-1, 1]."""
        own, *theirs = [
            (low, partial(part.step, action[low:high]))
            for part, (low, high) in zip(self.parts, pairwise(self.bounds), strict=True)
        ]
        if theirs and self._pool is None:
            self._pool = ThreadPoolExecutor(len(theirs), thread_name_prefix="hrc_env-shard")
        started = [(low, self._pool.submit(job).result) for low, job in theirs if self._pool]
        return joined(_all_done([own, *started]))

    def get_state(self) -> list[State]:
        """A copy of everything that changes, part by part."""
        return [part.get_state() for part in self.parts]

    def set_state(self, state: list[State]) -> None:
        """Continue from a state of as many parts with the same settings."""
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


def _all_done(jobs: Iterable[tuple[int, Callable[[], StepResult]]]) -> list[StepResult]:
    """What jobs give, each with the number of its first environment; or, once all are done and
    nobody works on any more, the first error."""
    results, errors = [], []
    for first, job in jobs:
        try:
            results.append(job())
        except BaseException as error:
            errors.append(error)
            if isinstance(error, HRCError) and first > 0:
                error.add_note(f"Environments are counted from number {first} of the vector here.")
    if errors:
        raise errors[0]
    return results
