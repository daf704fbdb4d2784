"""Cost of a step, computed from the true separations and the incidents."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hrc_env.core.declared import Records2
from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.typing import Bools, Floats
from hrc_env.safety.incidents import FLEEING, MOVING_M_S, TOWARDS, Incident

_BY_INCIDENT: dict[str, Callable[[Records2[Incident]], Floats]] = {
    "towards": lambda incidents: (incidents["kind"] == TOWARDS).sum(1).astype(float),
    "force": lambda incidents: np.nansum(incidents["force_ratio"], axis=1),
    "separation_violated": lambda incidents: (
        incidents["is_separation_violated"].any(1).astype(float)
    ),
    "near_miss": lambda incidents: incidents["is_near_miss"].sum(1).astype(float),
}
"""Functions that compute components of the cost (B,) from incidents (B, W): the number of contacts
that begin while the robot moves towards the worker; the sum of the forces of contacts that begin,
relative to the permitted forces; 1 if the robot moves towards a worker within the protective
distance; and the number of near misses."""
COMPONENTS = ("proximity", "contact", "unsafe", *_BY_INCIDENT)
"""Names of the components that `CostConfig.components` accepts."""
FORMER_COMPONENT = "too_near"
"""Former name of the component "separation_violated"."""


@dataclass(frozen=True, slots=True)
class CostConfig:
    """Settings of the cost: unsafe events, and whether a contact ends the episode."""

    components: tuple[str, ...] = ("unsafe",)
    """Components that are added up: "unsafe", 1 for a step in which the robot endangers a worker,
    which it never does while it stands (`find_unsafe`); "proximity", 1 for a step nearer than
    `proximity_m`; "contact", 1 for a step with a contact; "towards", contacts that begin while the
    robot moves towards the worker; "force", forces of contacts relative to the permitted ones;
    "separation_violated", 1 for a step within the protective distance while approaching;
    "near_miss". With the first three, the cost is a number of control steps."""
    proximity_m: float = 0.15
    """True separation between surfaces below which a robot is near [m]."""
    contact_terminates: bool = False
    """Whether a contact ends the episode."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "proximity_m")
        if FORMER_COMPONENT in self.components:
            raise ConfigError(
                f"The cost component {FORMER_COMPONENT!r} is called 'separation_violated' now."
            )
        check_names("cost component", self.components, COMPONENTS)
        if not self.components or len(set(self.components)) < len(self.components):
            raise ConfigError(
                f"cost.components must be one or more different names of {', '.join(COMPONENTS)}, "
                f"got {self.components}."
            )


@dataclass(frozen=True, slots=True)
class Cost:
    """Costs of one step that depend on separations, for each environment."""

    proximity: Floats
    """1 for environments in which the separation was below `CostConfig.proximity_m`, otherwise 0
    (B,) [control steps]."""
    contact: Floats
    """1 for environments in which the surfaces of a robot and a worker touched, otherwise 0 (B,)
    [control steps]."""
    min_separation_m: Floats
    """Smallest true separation in the step (B,) [m]; infinite without workers."""
    is_near: Bools
    """Mask (B, W) of the workers that were nearer than `CostConfig.proximity_m`."""


def measure_cost(gaps_m: Floats, config: CostConfig) -> Cost:
    """Return the cost of a step from the true separations (B, T, W) of its physics steps [m].

    Contacts are detected by distance instead of the contact solver, because a hand that follows a
    recording can pass through a thin arm between two physics steps.
    """
    of_workers_m = gaps_m.min(1, initial=np.inf)
    nearest_m = of_workers_m.min(1, initial=np.inf)
    return Cost(
        proximity=(nearest_m < config.proximity_m).astype(float),
        contact=(nearest_m <= 0.0).astype(float),
        min_separation_m=nearest_m,
        is_near=of_workers_m < config.proximity_m,
    )


def find_unsafe(cost: Cost, incidents: Records2[Incident], pushed: Bools) -> Floats:
    """Return 1 for environments in which the robot endangered a worker in a step, otherwise 0 (B,).

    A step is unsafe if the robot is near a worker and its directed speed exceeds `MOVING_M_S`, if
    it moves into a contact, or if it retreats too late from a contact with more force than the
    touched region tolerates. A standing robot that is touched is safe, whatever the force, and also
    while it springs back.

    Args:
        cost: cost from separations.
        incidents: (B, W) incidents of the step.
        pushed: (B, W) mask of the workers that push the robot by a touch
            (`IncidentMonitor.find_pushed`).
    """
    kind = incidents["kind"]
    comes_near = cost.is_near & (incidents["robot_m_s"] > MOVING_M_S) & ~pushed
    too_hard = (kind == FLEEING) & (incidents["force_ratio"] > 1.0)
    return (comes_near | (kind == TOWARDS) | too_hard).any(1).astype(float)


def split_cost(
    cost: Cost, incidents: Records2[Incident], pushed: Bools, config: CostConfig
) -> dict[str, Floats]:
    """Return the components (B,) of a step's cost by name.

    Proximity and contact are always included.

    Args:
        cost: cost from separations.
        incidents: (B, W) incidents of the step.
        pushed: (B, W) mask of the workers that push the robot by a touch.
        config: settings that select the components.
    """
    components = {"proximity": cost.proximity, "contact": cost.contact}
    for name in config.components:
        if name == "unsafe":
            components[name] = find_unsafe(cost, incidents, pushed)
        elif name not in components:
            components[name] = _BY_INCIDENT[name](incidents)
    return components


def sum_cost(components: Mapping[str, Floats], config: CostConfig) -> Floats:
    """Return the cost (B,) of a step: the sum of the chosen components."""
    first, *others = config.components
    return sum((components[name] for name in others), components[first])
