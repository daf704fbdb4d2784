"""Sums of an episode's infos, updated step by step, and the statistics computed from them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hrc_env.core.infos import Info
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.safety.incidents import KINDS, MOVING_M_S
from hrc_env.tasks.task import Task

COSTS = ("cost", "cost_proximity", "cost_contact")
"""Infos that are summed over an episode."""
SEVERITY, FORCE, ACTIVE, COMING = (
    "safety/contact_severity", "safety/contact_force_ratio", "shield/active",
    "safety/robot_towards_m_s",
)  # fmt: skip
"""Infos from which severe contacts, interventions and approaches are counted; the severity is 0 if
no contact begins in the step."""
RATED, ABOVE, INTERVENTIONS = "contacts_rated", "contacts_above_limit", "interventions"
"""Names of the statistics that count contacts with an estimated force, those of them with a force
above the limit of the touched region, and interventions of the shield."""
APPROACHES, TOUCHING_STEPS = "approaches", "contact_steps"
"""Names of the statistics that count approaches and steps with a contact."""
SUMS = np.dtype([
    (name, "f8")
    for name in ("steps", "reward", *COSTS, "contacts", "touching", "nearest_m", RATED, ABOVE,
                 INTERVENTIONS, "active", APPROACHES, "near")
])  # fmt: skip
"""Data type of the sums over the current episode. A lasting contact counts once."""
ACHIEVED, FAILED = "goals_reached", "goals_missed"
"""Names of the statistics that count an episode's achieved and failed attempts (`Task.achieved`,
`Task.failed`)."""

STATISTICS = (
    "r", "l", "seconds", "cost", "cost_steps", TOUCHING_STEPS, APPROACHES, "contacts",
    *(f"contacts_{kind}" for kind in KINDS), RATED, ABOVE, INTERVENTIONS, ACHIEVED, FAILED,
    "success", "min_separation_m",
)  # fmt: skip
"""Names of the statistics of an episode (`EpisodeSums.summarize`)."""
RARE = tuple(name for name in STATISTICS if name.startswith("contacts"))
"""Statistics that count rare events, the rates of which have exact intervals."""
COST_UNIT = "control steps"
"""Unit of costs."""
UNITS = {
    "cost": COST_UNIT, "cost_steps": COST_UNIT, TOUCHING_STEPS: COST_UNIT, "l": "control steps",
    "seconds": "s",
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
        sums[RATED] += read_step_value(infos, SEVERITY, len(sums)) > 0
        sums[ABOVE] += read_step_value(infos, FORCE, len(sums)) > 1.0
        active = read_step_value(infos, ACTIVE, len(sums))
        begins = np.where(np.isnan(active), np.nan, active > sums["active"])
        sums[INTERVENTIONS] += begins
        sums["active"] = active
        near, coming_m_s = costs["cost_proximity"], read_step_value(infos, COMING, len(sums))
        enters = near > sums["near"]
        is_unknown = np.isnan(near) | (enters & np.isnan(coming_m_s))
        sums[APPROACHES] += np.where(is_unknown, np.nan, enters & (coming_m_s > MOVING_M_S))
        sums["near"] = near
        separation_m = read_step_value(infos, "safety/min_separation_m", len(sums))
        sums["nearest_m"] = np.fmin(sums["nearest_m"], separation_m)
        return costs["cost"]

    def summarize(
        self, b: int, info: Mapping[str, Any], task: Task, ctrl_dt_s: float
    ) -> dict[str, float]:
        """Return the statistics of the current episode of environment `b` by name.

        An intervention begins when the shield becomes active: `shield/active` is 1, and was 0 in
        the step before or the episode begins. Without a shield, the number of interventions is NaN.
        An approach is a step in which the robot gets nearer than `CostConfig.proximity_m` to a
        worker while its speed towards the nearest one exceeds `MOVING_M_S`, after a step in which
        it was near no worker. Contacts with several workers that begin in the same step count as
        one rated contact, with the largest force.

        Args:
            b: index of the environment.
            info: the last info of the episode.
            task: the environment's task.
            ctrl_dt_s: duration of a control step [s].
        """
        episode = self.sums[b]
        is_shielded = np.isfinite(episode[INTERVENTIONS])
        return {
            "r": float(episode["reward"]),
            "l": int(episode["steps"]),
            "seconds": float(episode["steps"] * ctrl_dt_s),
            "cost": float(episode["cost"]),
            "cost_steps": float(episode["cost_proximity"]),
            TOUCHING_STEPS: float(episode["cost_contact"]),
            APPROACHES: float(episode[APPROACHES]),
            "contacts": float(episode["contacts"]),
            **{f"contacts_{kind}": info[f"safety/contacts_{kind}"] for kind in KINDS},
            RATED: float(episode[RATED]),
            ABOVE: float(episode[ABOVE]),
            INTERVENTIONS: float(episode[INTERVENTIONS]) if is_shielded else np.nan,
            ACHIEVED: info[task.achieved],
            FAILED: info[task.failed],
            "success": float(info["is_success"]),
            "min_separation_m": float(episode["nearest_m"]),
        }


def count_severe(infos: Sequence[Info]) -> dict[str, Ints]:
    """Return the numbers (B,) of contacts with an estimated force, and of those above the limit.

    Args:
        infos: infos of all steps of B episodes.
    """
    severity, ratio = (np.stack([info[name] for info in infos]) for name in (SEVERITY, FORCE))
    return {RATED: (severity > 0).sum(0), ABOVE: (ratio > 1.0).sum(0)}


def count_interventions(infos: Sequence[Info]) -> dict[str, Ints]:
    """Return the numbers (B,) of interventions of the shield; an empty dictionary without one.

    Args:
        infos: infos of all steps of B episodes.
    """
    if ACTIVE not in infos[0]:
        return {}
    active = np.stack([info[ACTIVE] for info in infos]).astype(float)
    return {INTERVENTIONS: (np.diff(active, axis=0, prepend=0.0) > 0).sum(0)}


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
