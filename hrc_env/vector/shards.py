"""A batch of environments in contiguous ranges, each a `Simulation` with its own thread.

Results depend neither on the batch size nor on the number of ranges.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.batching import State, gather
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.typing import Floats, Ints
from hrc_env.reset_options import Fixed
from hrc_env.simulation import Simulation
from hrc_env.step_result import StepResult, concatenate_results


class Located(NamedTuple):
    """The simulation that contains an environment, and the environment's index in it."""

    simulation: Simulation
    """The simulation that contains the environment."""
    b: int
    """Index of the environment in the simulation."""


class Shards:
    """Environments in several simulations; the first simulation runs in the calling thread.

    Args:
        batch: number of environments.
        n_shards: number of simulations.
        make: function that returns a simulation of a given number of environments.
    """

    def __init__(self, batch: int, n_shards: int, make: Callable[[int], Simulation]) -> None:
        self.bounds = [batch * k // n_shards for k in range(n_shards + 1)]
        self.parts = [make(high - low) for low, high in pairwise(self.bounds)]
        self.first = self.parts[0]
        """Simulation of the calling thread."""
        self._pool: ThreadPoolExecutor | None = None

    def reset(
        self, ids: Ints, rngs: Sequence[np.random.Generator], fixed: Sequence[Fixed | None] = ()
    ) -> StepResult:
        """Begin new episodes in environments `ids`, in the calling thread.

        Most of a reset is Python code, which additional threads would not speed up.

        Args:
            ids: (n,) sorted indices of the environments.
            rngs: random generators of the n environments.
            fixed: fixed parts of each episode; empty if nothing is fixed.

        Returns:
            The result of the n environments that are reset.
        """
        cuts = pairwise(np.searchsorted(ids, self.bounds).tolist())
        parts = zip(self.parts, self.bounds[:-1], cuts, strict=True)
        jobs = [
            (first, partial(part.reset, ids[low:high] - first, rngs[low:high], fixed[low:high]))
            for part, first, (low, high) in parts
            if low < high
        ]
        return concatenate_results(_collect(jobs))

    def locate(self, k: int) -> Located:
        """Return the simulation that contains environment `k`, and the index within it."""
        shard = int(np.searchsorted(self.bounds, k, "right")) - 1
        return Located(self.parts[shard], k - self.bounds[shard])

    def step(self, action: Floats) -> StepResult:
        """Advance every environment by one control step.

        Args:
            action: (B, A) actions in [-1, 1].
        """
        first, *others = [
            (low, partial(part.step, action[low:high]))
            for part, (low, high) in zip(self.parts, pairwise(self.bounds), strict=True)
        ]
        if others and self._pool is None:
            self._pool = ThreadPoolExecutor(len(others), thread_name_prefix="hrc_env-shard")
        started = [(low, self._pool.submit(job).result) for low, job in others if self._pool]
        return concatenate_results(_collect([first, *started]))

    def get_state(self) -> list[State]:
        """Return a copy of the state of every simulation."""
        return [part.get_state() for part in self.parts]

    def set_state(self, state: list[State]) -> None:
        """Restore a state of the same number of simulations with the same settings."""
        if len(state) != len(self.parts):
            raise ConfigError(
                f"The state was taken with {len(state)} threads, but here there are "
                f"{len(self.parts)}. Create the environment with num_threads={len(state)}."
            )
        for part, saved in zip(self.parts, state, strict=True):
            part.set_state(saved)

    def get_rows(self, ids: Ints) -> State:
        """Return a copy of the state of environments `ids` (n,), with a row for each."""
        shard = np.searchsorted(self.bounds, ids, "right") - 1
        inside = [ids[shard == s] - first for s, first in enumerate(self.bounds[:-1])]
        parts = [
            part.get_rows(own, part.batch) for part, own in zip(self.parts, inside, strict=True)
        ]
        order = np.argsort(np.argsort(shard, kind="stable"), kind="stable")
        return gather(parts, [0, *np.cumsum([len(own) for own in inside]).tolist()], order)

    def set_rows(self, states: Sequence[State], bounds: Sequence[int], ids: Ints) -> None:
        """Replace every environment k by environment `ids[k]` of states with rows.

        Args:
            states: states as `get_rows` returns them; the first contains all environments as they
                are now.
            bounds: first environments of the states, as in `batching.gather`.
            ids: (B,) index of the environment that each one becomes.
        """
        for part, (first, end) in zip(self.parts, pairwise(self.bounds), strict=True):
            own = ids[first:end]
            if (own != np.arange(first, end)).any():
                part.set_state({"settings": part.settings, **gather(states, bounds, own)})

    def restart_streams(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Spawn the random streams of environments anew.

        Args:
            ids: (n,) sorted indices of the environments.
            rngs: random generators of these n environments.
        """
        cuts = pairwise(np.searchsorted(ids, self.bounds).tolist())
        for part, first, (low, high) in zip(self.parts, self.bounds[:-1], cuts, strict=True):
            part.restart_streams(ids[low:high] - first, rngs[low:high])

    def close(self) -> None:
        """Stop the threads, and close the simulations."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
        for part in self.parts:
            part.close()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_pool": None}


def _collect(jobs: Iterable[tuple[int, Callable[[], StepResult]]]) -> list[StepResult]:
    """Return the results of jobs. If any has failed, raise the first error once all have ended.

    Args:
        jobs: pairs (index of a job's first environment, job).
    """
    results, errors = list[StepResult](), list[BaseException]()
    for first, job in jobs:
        try:
            results.append(job())
        except BaseException as error:
            errors.append(error)
            if isinstance(error, HRCError) and first > 0:
                error.add_note(f"Here, environments are counted from number {first} of the vector.")
    if errors:
        raise errors[0]
    return results
