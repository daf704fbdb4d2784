"""What an episode comes to, summed step by step."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks.task import Task

COSTS = ("cost", "cost_proximity", "cost_contact")
"""Infos whose sums over an episode are kept."""
SUMS = np.dtype(
    [(name, "f8") for name in ("steps", "reward", *COSTS, "contacts", "touching", "nearest_m")]
)
"""Sums of an episode so far; a long touch is one contact."""
ACHIEVED, FAILED = "goals_reached", "goals_missed"
"""What an episode's statistics call the attempts of every task (`Task.achieved`, `Task.failed`)."""

STATISTICS = (
    "r", "l", "seconds", "cost", "cost_steps", "contacts",
    *(f"contacts_{kind}" for kind in KINDS), ACHIEVED, FAILED, "success", "min_separation_m",
)  # fmt: skip
"""What an episode comes to, by name (`EpisodeSums.summarize`)."""
COST_UNIT = "control steps"
UNITS = {
    "cost": COST_UNIT, "cost_steps": COST_UNIT, "l": "control steps", "seconds": "s",
    "min_separation_m": "m",
}  # fmt: skip
"""Of statistics that are no numbers of something, by name; "1" is that of the others."""


class EpisodeSums:
    """Sums over the episode of each of some environments."""

    def __init__(self, num_envs: int) -> None:
        self.sums = np.zeros(num_envs, SUMS)
        self.begin(np.arange(num_envs))

    def begin(self, ids: Ints) -> None:
        """Begin the episodes of environments `ids`."""
        self.sums[ids] = np.zeros(1, SUMS)
        self.sums["nearest_m"][ids] = np.inf

    def add(self, reward: Floats, infos: Mapping[str, Any]) -> Floats:
        """Add a step of all environments; return its cost (num_envs,).

        Args:
            reward: (num_envs,).
            infos: of a vector environment, with their masks.
        """
        now = self.sums
        now["steps"] += 1
        now["reward"] += reward
        costs = {name: value_of_step(infos, name, len(now)) for name in COSTS}
        for name, cost in costs.items():
            now[name] += cost
        touching = costs["cost_contact"] > 0
        now["contacts"] += touching > now["touching"]
        now["touching"] = touching
        separation_m = value_of_step(infos, "safety/min_separation_m", len(now))
        now["nearest_m"] = np.fmin(now["nearest_m"], separation_m)
        return costs["cost"]

    def summarize(
        self, b: int, info: Mapping[str, Any], task: Task, ctrl_dt_s: float
    ) -> dict[str, float]:
        """Return the statistics of the episode of environment `b`.

        Args:
            b: the environment.
            info: the episode's last.
            task: the environment's.
            ctrl_dt_s: the control step [s].
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


def value_of_step(infos: Mapping[str, Any], name: str, num_envs: int) -> Floats:
    """Return a value of the step itself (num_envs,), also where an episode ended with it; NaN where
    there is none."""
    value = np.full(num_envs, np.nan)
    for part in (infos, infos.get("final_info", {})):
        if name in part:
            known: Bools = part[f"_{name}"]
            value[known] = part[name][known]
    return value
