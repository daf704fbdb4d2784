"""What a step or a reset gives: observation, reward, end, and infos by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import metrics
from hrc_env.core.errors import Named
from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion import generator

Info = dict[str, NDArray[Any]]
"""Named values (B,): numbers, NaN where an environment has none in this step; or tuples of words,
as objects."""
Observation = NDArray[np.float32] | dict[str, NDArray[np.float32]]
"""(B, n), or such arrays by name where goals stand apart (`hrc_env.tasks.goal`)."""
FLAGS = ("is_success",)
"""Values that are true or false."""
ACTIVITY = "worker/activity"
"""What each worker is doing, by name; `ABSENT` of who is not in the episode."""
BODY = "worker/body"
"""Which baked body each worker has in this episode; likewise."""
ABSENT = "absent"
MISCALIBRATED = "perception/miscalibrated"
"""Names of cameras that contradict the others as if they had been moved, turned or zoomed."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step or a reset gives, per environment."""

    observation: Observation
    reward: Floats
    """(B,)."""
    terminated: Bools
    """(B,)."""
    info: Info

    def info_of(self, b: int) -> Named:
        """The info of one environment: absent values are left out, flags are bool."""
        values = {name: value.item(b) for name, value in self.info.items()}
        known = Named((name, value) for name, value in values.items() if value == value)
        for name in FLAGS:
            known[name] = bool(known[name])
        return known


def joined(results: Sequence[StepResult]) -> StepResult:
    """Results of ranges of a batch, one after the other."""
    if len(results) == 1:
        return results[0]
    parts = zip(*((r.observation, r.reward, r.terminated) for r in results), strict=True)
    info = {name: np.concatenate([each.info[name] for each in results]) for name in results[0].info}
    observations, *others = parts
    reward, terminated = map(np.concatenate, others)
    return StepResult(_joined(observations), reward, terminated, info)


def _joined(parts: Sequence[Any]) -> Any:
    """Observations one after the other."""
    if not isinstance(parts[0], dict):
        return np.concatenate(parts)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def cost_info(cost: metrics.Cost, present: Bools) -> Info:
    """The cost by the names that safe-RL libraries read, and the separation from who is there."""
    separation = np.where(present.any(1), cost.min_separation_m, np.nan)
    return {
        "cost": cost.total,
        "cost_sum": cost.total,
        "cost_proximity": cost.proximity,
        "cost_contact": cost.contact,
        "safety/min_separation_m": separation,
    }


def no_cost(n: int) -> Info:
    """What `n` resets cost: nothing, under the names of `cost_info`; a separation has no such 0."""
    return {name: np.zeros(n) for name in ("cost", "cost_sum", "cost_proximity", "cost_contact")}


def tracking_info(
    estimate: PoseEstimate, truth: WorkerTruth, present: Bools, identities: metrics.Identities
) -> Info:
    """How far the belief is from the truth, and whether it takes one worker for another; no error
    is given where nobody is tracked."""
    found = metrics.tracking_error(estimate, truth, present, identities)
    return {f"tracking/{name}": found[name] for name in metrics.TRACKING.names or ()}


def worker_info(activity: Ints, body: Ints, bodies: tuple[str, ...]) -> Info:
    """What workers (B, W) do, and which of the `bodies` (B, W) they have, by name."""
    worn = np.where(activity == generator.ABSENT, generator.ABSENT, body)
    return {ACTIVITY: _named(activity, generator.activity_names), BODY: _named(worn, bodies)}


def miscalibration_info(cameras: tuple[str, ...], suspected: Bools) -> Info:
    """Which of the cameras (B, C) contradict the others; nothing where there are no cameras."""
    if not suspected.shape[1]:
        return {}
    named = (tuple(compress(cameras, row)) for row in suspected.tolist())
    return {MISCALIBRATED: np.fromiter(named, object)}


def _named(indices: Ints, names: tuple[str, ...]) -> NDArray[np.object_]:
    """(B,) tuples of the names of indices (B, W); `ABSENT` for `generator.ABSENT`, which is -1."""
    return np.fromiter(map(tuple, _table(names)[indices].tolist()), object)


@cache
def _table(names: tuple[str, ...]) -> NDArray[np.object_]:
    return np.array([*names, ABSENT], object)
