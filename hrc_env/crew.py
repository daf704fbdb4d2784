"""Who is there: how many workers an episode has, and what each of them is doing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.errors import ConfigError
from hrc_env.motion import generator
from hrc_env.motion.generator import MotionState
from hrc_env.typing import Bools, Ints

ACTIVITY = "worker/activity"
"""What each worker is doing, by name; `ABSENT_NAME` of who is not in the episode."""
ABSENT_NAME = "absent"


@dataclass(frozen=True, slots=True)
class Crew:
    """The workers of B environments now."""

    activity: Ints
    """(B, W) what each worker does, an index into `generator.activity_names` or `ABSENT`."""

    @property
    def present(self) -> Bools:
        """(B, W) who is in the episode."""
        return self.activity != generator.ABSENT

    def info_of(self, b: int) -> dict[str, Any]:
        """What the info of environment b says of its workers, by name."""
        return {ACTIVITY: named(self.activity[b])}

    def arrays(self, who: Bools) -> dict[str, NDArray[np.object_]]:
        """The same of environments `who` (B,), one array (B,) a name; the others have None."""
        said = {ACTIVITY: np.full(len(who), None, object)}
        for b in np.flatnonzero(who).tolist():
            said[ACTIVITY][b] = named(self.activity[b])
        return said

    def blank(self, batch: int) -> "Crew":
        """Rows for `batch` environments, to be written."""
        return Crew(np.zeros((batch, self.activity.shape[1]), np.int64))


def crew_of(motion: MotionState) -> Crew:
    """The workers of a motion."""
    return Crew(generator.activity(motion))


def named(activity: Ints) -> tuple[str, ...]:
    """The names of what workers (W,) do."""
    names = generator.activity_names
    return tuple(ABSENT_NAME if k == generator.ABSENT else names[k] for k in activity.tolist())


def worker_counts(n_workers: int | tuple[int, int]) -> tuple[int, int]:
    """The fewest and the most workers of an episode, from one number or from both.

    Raises:
        ConfigError: they are no whole numbers, 0 or more, in this order.
    """
    pair = tuple(n_workers) if isinstance(n_workers, Sequence) else (n_workers, n_workers)
    whole = all(isinstance(k, int | np.integer) and not isinstance(k, bool) for k in pair)
    if not whole or len(pair) != 2 or not 0 <= pair[0] <= pair[1]:
        raise ConfigError(
            "n_workers must be a whole number, 0 or more, or (fewest, most), from which each "
            f"episode's number is drawn, got {n_workers!r}."
        )
    return int(pair[0]), int(pair[1])
