"""Sums over an episode: what all numbers of the experiment are made of, a row an episode."""

import hashlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints, Points3
from hrc_env.experiments.impact.trial.counts import ERRORS_M, GAPS_M, SPEEDS_MPS, Bins
from hrc_env.experiments.impact.trial.judge import Step
from hrc_env.step import Info

STOP_M, SLOW_M = 0.10, 0.60
"""A gap below the first calls for standing still, below the second for slowing down [m]: the
distances of `agents.scripted.Yielding`, judgement."""
MOVING_MPS = 0.05
"""From this directed speed on a robot moves towards the worker or flees [m/s]; judgement. No
shield can help it when somebody walks into a robot that stands, or catches one that flees."""
_BINS: dict[str, Bins] = {
    "error": ERRORS_M, "optimism": GAPS_M, "robot_speed": SPEEDS_MPS, "worker_speed": SPEEDS_MPS,
}  # fmt: skip
_COUNTED = (
    "cost", "missed_stops", "false_stops", "called_stops", "missed_slowings", "false_slowings",
    "called_slowings", "approaches", "contacts_towards", "contacts_fleeing", "contacts_standing",
)  # fmt: skip


@dataclass(slots=True)
class Tally:
    """Of a batch of episodes that run side by side."""

    batch: int
    margin_m: float
    """By how much the robot adds to every distance that it keeps [m]."""
    sums: dict[str, Floats] = field(init=False)
    """(B,) each."""
    counts: dict[str, Ints] = field(init=False)
    """(B, bins) each."""
    nearest_m: Floats = field(init=False)
    touching: Bools = field(init=False)
    walks: list[Any] = field(init=False)
    """Digests of where the workers truly were."""

    def __post_init__(self) -> None:
        self.sums = {name: np.zeros(self.batch) for name in _COUNTED}
        self.counts = {
            name: np.zeros((self.batch, len(bins.edges) + 1), np.int64)
            for name, bins in _BINS.items()
        }
        self.nearest_m = np.full(self.batch, np.inf)
        self.touching = np.zeros(self.batch, bool)
        self.walks = [hashlib.sha256() for _ in range(self.batch)]

    def add(self, step: Step, joints_world: Points3, info: Info) -> None:
        """One step of every episode."""
        self.sums["cost"] += info["cost"]
        self.nearest_m = np.fmin(self.nearest_m, info["safety/min_separation_m"])
        self._stops(step)
        self._contacts(step, info["cost_contact"] > 0)
        self._spread(step)
        for walk, joints in zip(self.walks, joints_world, strict=True):
            walk.update(np.ascontiguousarray(joints))

    def _stops(self, step: Step) -> None:
        """Decisions that the belief makes otherwise than the truth, and what came of them."""
        believed_m = step.believed_separation_m - self.margin_m
        for name, limit_m in (("stops", STOP_M), ("slowings", SLOW_M)):
            called, given = step.true_separation_m < limit_m, believed_m < limit_m
            self.sums[f"called_{name}"] += called
            self.sums[f"missed_{name}"] += called & ~given
            self.sums[f"false_{name}"] += given & ~called
        approaching = step.robot_mps > MOVING_MPS
        self.sums["approaches"] += approaching & (step.true_separation_m < STOP_M)

    def _contacts(self, step: Step, touching: Bools) -> None:
        """Touches that begin; one that lasts counts once."""
        begins = touching & ~self.touching
        towards, flees = step.robot_mps > MOVING_MPS, step.robot_mps < -MOVING_MPS
        self.sums["contacts_towards"] += begins & towards
        self.sums["contacts_fleeing"] += begins & flees
        self.sums["contacts_standing"] += begins & ~towards & ~flees
        self.touching = touching

    def _spread(self, step: Step) -> None:
        """Errors always; gaps and speeds where the gap matters."""
        near = step.true_separation_m < SLOW_M
        self.counts["error"] += ERRORS_M.count(step.error_m)
        optimism_m = step.believed_separation_m - step.true_separation_m
        self.counts["optimism"] += GAPS_M.count(optimism_m, near)
        self.counts["robot_speed"] += SPEEDS_MPS.count(step.robot_mps, near)
        self.counts["worker_speed"] += SPEEDS_MPS.count(step.worker_mps, near)

    def rows(self, info: Info, seconds: float) -> dict[str, list[Any]]:
        """Everything, a list over episodes each; `info` is that of the last step."""
        return {
            **{name: value.tolist() for name, value in self.sums.items()},
            **{f"{name}_counts": value.tolist() for name, value in self.counts.items()},
            "separation_min_m": self.nearest_m.tolist(),
            "goals": info["task/goals_reached"].tolist(),
            "goals_missed": info["task/goals_missed"].tolist(),
            "minutes": [seconds / 60] * self.batch,
            "walk": [walk.hexdigest()[:16] for walk in self.walks],
        }
