"""What is kept of an episode so that images can come late, freeze or lie about their time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hrc_env.core.stateful import Stateful
from hrc_env.core.typing import Floats, Ints
from hrc_env.perception.faults.schedule import Frame, Schedule


class Recent(Stateful):
    """Steps of B environments with a record of each that may be wanted again."""

    CHANGES = ("steps", "seeds", "_kept")

    def __init__(self, batch: int, schedule: Schedule) -> None:
        self.schedule = schedule
        self.steps = np.full(batch, -1)
        """(B,) the present step; -1 before the first."""
        self.seeds: list[int] = [0] * batch
        """Each episode's number for faults."""
        self._kept: list[dict[int, Any]] = [{} for _ in range(batch)]
        self._reach = max(1, schedule.longest_memory)
        self._pinned = schedule.frozen_steps

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Begin environments `ids` anew; of each one's generator a child is asked, and nothing of
        itself."""
        for b in ids.tolist():
            child = rngs[b].spawn(1)[0]
            self.steps[b], self.seeds[b], self._kept[b] = -1, int(child.integers(2**31)), {}

    def begin(self, b: int) -> int:
        """Count a step of environment b, and let go of what is too old."""
        self.steps[b] += 1
        step = int(self.steps[b])
        for old in [each for each in self._kept[b] if each < step - self._reach]:
            if old not in self._pinned:
                del self._kept[b][old]
        return step

    def keep(self, b: int, record: Any) -> None:
        """Keep a record of the present step."""
        self._kept[b][int(self.steps[b])] = record

    def at(self, b: int, step: int) -> Any:
        """The record of a step; None if it was never kept."""
        return self._kept[b].get(step)

    def frames(self, b: int) -> list[Frame | None]:
        """What each camera gives environment b at its present step."""
        schedule, step = self.schedule, int(self.steps[b])
        cameras = range(len(schedule.cameras))
        return [schedule.frame(self.seeds[b], step, c) for c in cameras]

    def times_s(self, frames: Sequence[Frame | None]) -> Floats:
        """(C,) when images were taken, as they say, on the tracker's clock, on which the reset's
        image is one step old [s]; NaN: no image."""
        dt_s = self.schedule.dt_s
        return np.array([np.nan if f is None else (f.taken + 1) * dt_s for f in frames])
