"""Who is there: how many workers an episode has, with which bodies, and what each is doing."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Bools, Ints
from hrc_env.motion import generator
from hrc_env.motion.generator import MotionState

ACTIVITY = "worker/activity"
"""What each worker is doing, by name; `ABSENT_NAME` of who is not in the episode."""
BODY = "worker/body"
"""Which baked body each worker has in this episode; likewise."""
ABSENT_NAME = "absent"


@dataclass(frozen=True, slots=True)
class Crew:
    """The workers of B environments now."""

    activity: Ints
    """(B, W) what each worker does, an index into `generator.activity_names` or `ABSENT`."""
    bodies: NDArray[np.object_]
    """(B,) the names of their bodies, a tuple of W; written out once an episode."""

    @property
    def present(self) -> Bools:
        """(B, W) who is in the episode."""
        return self.activity != generator.ABSENT

    def info_of(self, b: int) -> dict[str, Any]:
        """What the info of environment b says of its workers, by name."""
        return {ACTIVITY: named(self.activity[b]), BODY: self.bodies[b]}

    def arrays(self, who: Bools) -> dict[str, NDArray[np.object_]]:
        """The same of environments `who` (B,), one array (B,) a name; the others have None."""
        doing, bodies = np.full((2, len(who)), None, object)
        bodies[who] = self.bodies[who]
        ids, activities = np.flatnonzero(who).tolist(), self.activity[who].tolist()
        for b, activity in zip(ids, activities, strict=True):
            doing[b] = _names_of(tuple(activity))
        return {ACTIVITY: doing, BODY: bodies}

    def blank(self, batch: int) -> "Crew":
        """Rows for `batch` environments, to be written."""
        shape = (batch, self.activity.shape[1])
        return Crew(np.zeros(shape, np.int64), np.full(batch, None, object))


def joined(crews: Sequence[Crew]) -> Crew:
    """Crews of ranges of a batch, one after the other."""
    return Crew(
        np.concatenate([crew.activity for crew in crews]),
        np.concatenate([crew.bodies for crew in crews]),
    )


def bodies_of(motion: MotionState, ids: Ints, names: tuple[str, ...]) -> NDArray[np.object_]:
    """(len(ids),) the names of the bodies in environments `ids`, a tuple of W each."""
    said = np.full(len(ids), None, object)
    for row, b in enumerate(ids.tolist()):
        there = zip(
            motion.workers["body"][b].tolist(), motion.workers["present"][b].tolist(), strict=True
        )
        said[row] = tuple(names[k] if present else ABSENT_NAME for k, present in there)
    return said


def named(activity: Ints) -> tuple[str, ...]:
    """The names of what workers (W,) do."""
    return _names_of(tuple(activity.tolist()))


@functools.lru_cache(maxsize=4096)
def _names_of(activity: tuple[int, ...]) -> tuple[str, ...]:
    names = generator.activity_names
    return tuple(ABSENT_NAME if k == generator.ABSENT else names[k] for k in activity)


def worker_counts(n_workers: int | tuple[int, int]) -> tuple[int, int]:
    """The fewest and the most workers of an episode, from one number or from both."""
    pair = tuple(n_workers) if isinstance(n_workers, Sequence) else (n_workers, n_workers)
    whole = all(isinstance(k, int | np.integer) and not isinstance(k, bool) for k in pair)
    if not whole or len(pair) != 2 or not 0 <= pair[0] <= pair[1]:
        raise ConfigError(
            "n_workers must be a whole number, 0 or more, or (fewest, most), from which each "
            f"episode's number is drawn, got {n_workers!r}."
        )
    return int(pair[0]), int(pair[1])
