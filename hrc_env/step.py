"""What a step or a reset gives: observation, reward, end, and infos by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import metrics
from hrc_env.core.records import PoseEstimate, RobotState, WorkerTruth
from hrc_env.core.typing import Bools, Floats, Ints, Records
from hrc_env.core.vacancy import Vacancy
from hrc_env.metrics import CostConfig
from hrc_env.motion import generator
from hrc_env.safety import incidents
from hrc_env.safety.watch import Watch

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
CONTACT_KIND, CONTACT_REGION = "safety/contact_kind", "safety/contact_region"
"""Of contacts that begin in a step: what the robot did, and where they are."""
ABSENT = "absent"
MISCALIBRATED = "perception/miscalibrated"
"""Names of cameras that contradict the others as if they had been moved, turned or zoomed."""
MORE_PEOPLE = "perception/more_people"
"""1 while cameras detect more people than there are slots for workers."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step or a reset gives, per environment."""

    observation: Observation
    reward: Floats
    """(B,)."""
    terminated: Bools
    """(B,)."""
    info: Info

    def info_of(self, b: int) -> dict[str, Any]:
        """The info of one environment: absent values are left out, flags are bool."""
        values = {name: value.item(b) for name, value in self.info.items()}
        known = {name: value for name, value in values.items() if value == value}
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


def cost_info(cost: metrics.Cost, happened: Records, present: Bools, config: CostConfig) -> Info:
    """The cost by the names that safe-RL libraries read, with its parts, and the separation from
    who is there."""
    parts = metrics.parts(cost, happened, config)
    total = metrics.total(parts, config)
    return {
        "cost": total,
        "cost_sum": total,
        **{f"cost_{name}": value for name, value in parts.items()},
        "safety/min_separation_m": np.where(present.any(1), cost.min_separation_m, np.nan),
    }


def nothing_happened(n: int, config: CostConfig) -> Info:
    """What `n` resets say of cost and incidents: none."""
    names = ("", "_sum", *(f"_{name}" for name in ("proximity", "contact", *config.components)))
    counts = (*(f"contacts_{kind}" for kind in incidents.KINDS), "near_misses")
    nothing = np.full((n, 0), -1)
    return {
        **{f"cost{name}": np.zeros(n) for name in names},
        **{f"safety/{name}": np.zeros(n) for name in counts},
        **{name: _begun(nothing, ()) for name in (CONTACT_KIND, CONTACT_REGION)},
    }


def incident_info(happened: Records, watch: Watch, robot: RobotState) -> Info:
    """What happened to people in a step, (B, W) `incidents.INCIDENT`, and in its episode."""
    told = incidents.summed_up(happened, watch.known)
    return {
        **{f"safety/{name}": told[name] for name in incidents.SUMMARY.names or ()},
        "safety/time_to_stop_s": watch.stop_s(robot),
        CONTACT_KIND: _begun(happened["kind"], incidents.KINDS),
        CONTACT_REGION: _begun(happened["region"], incidents.REGION_NAMES),
    }


def _begun(indices: Ints, names: tuple[str, ...]) -> NDArray[np.object_]:
    """(B,) tuples of the names of indices (B, W) that are not -1."""
    rows = (tuple(names[k] for k in row if k >= 0) for row in indices.tolist())
    return np.fromiter(rows, object)


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


def perception_info(cameras: tuple[str, ...], suspected: Bools, vacancy: Vacancy | None) -> Info:
    """The cameras (B, C) that contradict the others, and whether there are more people than slots;
    nothing without cameras."""
    if vacancy is None:
        return {}
    named = (tuple(compress(cameras, row)) for row in suspected.tolist())
    return {
        MISCALIBRATED: np.fromiter(named, object),
        MORE_PEOPLE: vacancy.others.any.astype(float),
    }


def _named(indices: Ints, names: tuple[str, ...]) -> NDArray[np.object_]:
    """(B,) tuples of the names of indices (B, W); `ABSENT` for `generator.ABSENT`, which is -1."""
    return np.fromiter(map(tuple, _table(names)[indices].tolist()), object)


@cache
def _table(names: tuple[str, ...]) -> NDArray[np.object_]:
    return np.array([*names, ABSENT], object)
