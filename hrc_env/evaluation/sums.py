"""Sums of an episode's infos, updated step by step, and the statistics computed from them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks.task import Task

COSTS = ("cost", "cost_proximity", "cost_contact")
"""Infos that are summed over an episode."""
SUMS = np.dtype(
    [(name, "f8") for name in ("steps", "reward", *COSTS, "contacts", "touching", "nearest_m")]
)
"""Data type of the sums over the current episode. A lasting contact counts once."""
ACHIEVED, FAILED = "goals_reached", "goals_missed"
"""Names of the statistics that count an episode's achieved and failed attempts (`Task.achieved`,
`Task.failed`)."""

STATISTICS = (
    "r", "l", "seconds", "cost", "cost_steps", "contacts",
    *(f"contacts_{kind}" for kind in KINDS), ACHIEVED, FAILED, "success", "min_separation_m",
)  # fmt: skip
"""Names of the statistics of an episode (`EpisodeSums.summarize`)."""
COST_UNIT = "control steps"
"""Unit of costs."""
UNITS = {
    "cost": COST_UNIT, "cost_steps": COST_UNIT, "l": "control steps", "seconds": "s",
    "min_separation_m": "m",
}  # fmt: skip
"""Units of statistics by name; all other statistics have the unit "1"."""


class EpisodeSums:
    """Sums over the current episode of each environment."""

    def __init__(self, num_envs: int) -> None:
        self.sums = np.zeros(num_envs, SUMS)
        self.begin(np.arange(num_envs))

    def begin(self, ids: Ints) -> None:
        """Reset the sums of environments `ids` for a new episode."""
        self.sums[ids] = np.zeros(1, SUMS)
        self.sums["nearest_m"][ids] = np.inf

    def add(self, reward: Floats, infos: Mapping[str, Any]) -> Floats:
        """Add one step of all environments and return the costs (num_envs,) of the step.

        Args:
            reward: rewards (num_envs,).
            infos: infos of a vector environment, with their masks.
        """
        sums = self.sums
        sums["steps"] += 1
        sums["reward"] += reward
        costs = {name: read_step_value(infos, name, len(sums)) for name in COSTS}
        for name, cost in costs.items():
            sums[name] += cost
        touching = costs["cost_contact"] > 0
        sums["contacts"] += touching > sums["touching"]
        sums["touching"] = touching
        separation_m = read_step_value(infos, "safety/min_separation_m", len(sums))
        sums["nearest_m"] = np.fmin(sums["nearest_m"], separation_m)
        return costs["cost"]

    def summarize(
        self, b: int, info: Mapping[str, Any], task: Task, ctrl_dt_s: float
    ) -> dict[str, float]:
        """Return the statistics of the current episode of environment `b` by name.

        Args:
            b: index of the environment.
            info: the last info of the episode.
            task: the environment's task.
            ctrl_dt_s: duration of a control step [s].
        """
        episode = self.sums[b]
        return {
            "r": float(episode["reward"]),
            "l": int(episode["steps"]),
            "seconds": float(episode["steps"] * ctrl_dt_s),
            "cost": float(episode["cost"]),
            "cost_steps": float(episode["cost_proximity"]),
            "contacts": float(episode["contacts"]),
            **{f"contacts_{kind}": info[f"safety/contacts_{kind}"] for kind in KINDS},
            ACHIEVED: info[task.achieved],
            FAILED: info[task.failed],
            "success": float(info["is_success"]),
            "min_separation_m": float(episode["nearest_m"]),
        }


def read_step_value(infos: Mapping[str, Any], name: str, num_envs: int) -> Floats:
    """Return the values (num_envs,) of an info for the last step, NaN where it is missing.

    If the step ended an episode, the value is read from the final info of that episode.
    """
    value = np.full(num_envs, np.nan)
    for part in (infos, infos.get("final_info", {})):
        if name in part:
            known: Bools = part[f"_{name}"]
            value[known] = part[name][known]
    return value
