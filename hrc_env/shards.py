"""A batch of environments in contiguous ranges, each a `Simulation` stepped by its own thread.

A range's simulation may live in a process of its own; then its thread only waits for it. As no
result depends on the size of a batch, none depends on the number of ranges either.
"""

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from itertools import pairwise
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from hrc_env import crew, suspects
from hrc_env.errors import ConfigError, HRCError
from hrc_env.outcome import Outcome
from hrc_env.simulation import Simulation
from hrc_env.stateful import State
from hrc_env.typing import Floats, Ints


class Part(Protocol):
    """A range of environments: a `Simulation`, or what stands for one in another process."""

    batch: int

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> Outcome:
        """As `Simulation.reset`."""
        ...

    def step(self, action: Floats) -> Outcome:
        """As `Simulation.step`."""
        ...

    def get_state(self) -> State:
        """A copy of everything that changes."""
        ...

    def set_state(self, state: State) -> None:
        """Continue from a state."""
        ...

    def close(self) -> None:
        """Release what it holds."""
        ...


PartT = TypeVar("PartT", bound=Part)


class Shards(Generic[PartT]):
    """`batch` environments in `n_shards` simulations; the calling thread works on the first."""

    def __init__(
        self,
        batch: int,
        n_shards: int,
        make: Callable[[int], Simulation],
        make_other: Callable[[int], PartT],
    ) -> None:
        """Make them.

        Args:
            batch: how many environments.
            n_shards: in how many ranges.
            make: gives a simulation of so many environments, always of the same kind.
            make_other: gives those beside the first, which is made while these come about.
        """
        self.bounds = [batch * k // n_shards for k in range(n_shards + 1)]
        here, *others = (high - low for low, high in pairwise(self.bounds))
        rest = [make_other(size) for size in others]
        self.first = make(here)
        self.parts: list[Simulation | PartT] = [self.first, *rest]
        self._pool: ThreadPoolExecutor | None = None

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> Outcome:
        """Start environments `ids` (sorted) anew, one generator each; their rows."""
        rows = pairwise(np.searchsorted(ids, self.bounds).tolist())
        return self._run(
            partial(part.reset, ids[low:high] - first, rngs[low:high])
            for part, first, (low, high) in zip(self.parts, self.bounds[:-1], rows, strict=True)
            if high > low
        )

    def step(self, action: Floats) -> Outcome:
        """One control step of every environment; action (B, A) in [-1, 1]."""
        spans = pairwise(self.bounds)
        return self._run(
            partial(_step, part, low, action[low:high])
            for part, (low, high) in zip(self.parts, spans, strict=True)
        )

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

    def _run(self, jobs: Iterable[Callable[[], Outcome]]) -> Outcome:
        """What all jobs together give; nobody works on any more when this returns or raises."""
        first, *others = jobs
        if others and self._pool is None:
            n_helpers = len(self.parts) - 1
            self._pool = ThreadPoolExecutor(n_helpers, thread_name_prefix="hrc_env-shard")
        futures = [self._pool.submit(job) for job in others] if self._pool else []
        try:
            outcome = first()
        finally:
            wait(futures)
        return joined([outcome, *(future.result() for future in futures)])


def _step(part: Part, first: int, action: Floats) -> Outcome:
    try:
        return part.step(action)
    except HRCError as error:
        if first > 0:
            error.add_note(f"Environments are counted from number {first} of the vector here.")
        raise


def joined(outcomes: list[Outcome]) -> Outcome:
    """Outcomes of ranges, one after the other."""
    if len(outcomes) == 1:
        return outcomes[0]
    return Outcome(
        observation=np.concatenate([each.observation for each in outcomes]),
        reward=np.concatenate([each.reward for each in outcomes]),
        terminated=np.concatenate([each.terminated for each in outcomes]),
        crew=crew.joined([each.crew for each in outcomes]),
        suspects=suspects.joined([each.suspects for each in outcomes]),
        info={
            name: np.concatenate([each.info[name] for each in outcomes])
            for name in outcomes[0].info
        },
    )


def n_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
