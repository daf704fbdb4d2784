"""Cost: what counts as unsafe in a step, on the true separations and what happened to people."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.typing import Floats, Records
from hrc_env.safety import incidents

_BY_INCIDENT: dict[str, Callable[[Records], Floats]] = {
    "towards": lambda happened: (happened["kind"] == incidents.TOWARDS).sum(1).astype(float),
    "force": lambda happened: np.nansum(happened["force_ratio"], axis=1),
    "too_near": lambda happened: happened["too_near"].any(1).astype(float),
    "near_miss": lambda happened: happened["near_miss"].sum(1).astype(float),
}
"""Of (B, W) `incidents.INCIDENT`: contacts that begin while the robot comes towards who is touched;
how hard those are that begin, as a share of what the body bears; nearness within the protective
distance while the robot comes; near misses."""
COMPONENTS = ("proximity", "contact", *_BY_INCIDENT)
"""What can count as cost: nearness, touch, and what happens to people."""


@dataclass(frozen=True, slots=True)
class CostConfig:
    """What counts as unsafe, and what happens then."""

    components: tuple[str, ...] = ("proximity", "contact")
    """Summands: some of `COMPONENTS`; the sum of the default ones is in control steps."""
    proximity_m: float = 0.15
    """A step costs 1 when the true surfaces come nearer than this [m]."""
    contact_terminates: bool = False
    """Whether a contact ends the episode."""

    def __post_init__(self) -> None:
        check_fields(self, "not be negative", "proximity_m")
        check_names("cost component", self.components, COMPONENTS)
        if not self.components or len(set(self.components)) < len(self.components):
            raise ConfigError(
                f"cost.components must be one or more different ones of {', '.join(COMPONENTS)}, "
                f"got {self.components}."
            )


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of one step, per environment (B,) [control steps]."""

    proximity: Floats
    contact: Floats
    min_separation_m: Floats
    """Smallest true separation of the step; infinite without workers."""


def cost(gaps_m: Floats, config: CostConfig) -> Cost:
    """Cost of a step, of the true separations (B, T, W) at every substep [m].

    Contact is decided by distance: a mocap hand can pass through a thin arm between two
    substeps of the contact solver.
    """
    nearest_m = gaps_m.min((1, 2), initial=np.inf)
    return Cost(
        proximity=(nearest_m < config.proximity_m).astype(float),
        contact=(nearest_m <= 0.0).astype(float),
        min_separation_m=nearest_m,
    )


def parts(cost: Cost, happened: Records, config: CostConfig) -> dict[str, Floats]:
    """(B,) parts of the cost of a step, those of nearness and touch and whatever else is chosen;
    (B, W) `incidents.INCIDENT` says that."""
    found = {"proximity": cost.proximity, "contact": cost.contact}
    return found | {
        name: _BY_INCIDENT[name](happened) for name in config.components if name not in found
    }


def total(costs: Mapping[str, Floats], config: CostConfig) -> Floats:
    """(B,) the cost of a step: the sum of the chosen parts, by default in control steps."""
    return sum((costs[name] for name in config.components[1:]), costs[config.components[0]])
