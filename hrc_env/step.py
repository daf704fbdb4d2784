"""What a step or a reset gives: observation, reward, end, named values, crew, suspects."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import metrics
from hrc_env.core.old_names import Named
from hrc_env.core.records import PoseEstimate, WorkerTruth
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion.workers import Crew
from hrc_env.tracking.miscalibration import MiscalibrationFlags

Info = dict[str, Floats]
"""Named values (B,); NaN means that the environment has no such value in this step."""
FLAGS = ("is_success",)
"""Values that are true or false."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What a step or a reset gives, per environment."""

    observation: NDArray[np.float32]
    """(B, n)."""
    reward: Floats
    """(B,)."""
    terminated: Bools
    """(B,)."""
    info: Info
    crew: Crew
    """Who is there, and what they do."""
    suspects: MiscalibrationFlags
    """Which cameras are thought to be miscalibrated."""

    def info_of(self, b: int) -> dict[str, Any]:
        """The info of one environment: absent values are left out, flags are bool."""
        values = {name: value.item(b) for name, value in self.info.items()}
        known: dict[str, Any] = {name: value for name, value in values.items() if value == value}
        for name in FLAGS:
            known[name] = bool(known[name])
        return Named(known, **self.crew.info_of(b), **self.suspects.info_of(b))


def rows_of(info: Info, ids: Ints) -> Info:
    """Rows `ids` of every value of an info."""
    return {name: value[ids] for name, value in info.items()}


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


def tracking_info(estimate: PoseEstimate, truth: WorkerTruth, present: Bools) -> Info:
    """How far the belief is from the truth; no error is given where nobody is tracked."""
    error_m, lost = metrics.tracking_error(estimate, truth, present)
    return {"tracking/mpjpe_m": error_m, "tracking/lost": lost.astype(float)}
