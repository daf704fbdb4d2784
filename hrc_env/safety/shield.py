"""Shields: what changes a command before the arm gets it. They read the belief, never the truth."""

from collections.abc import Callable

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import ConfigError, check_shape, unknown
from hrc_env.core.typing import Floats, JointVelocities

Shield = Callable[[Belief, JointVelocities, float], tuple[JointVelocities, dict[str, Floats]]]
"""(belief, joint velocities (B, N) that the agent asks for [rad/s], time until the next command
[s]) -> the velocities that the arm gets, and what there is to say, (B,) by name, which becomes
"shield/NAME" in info."""
SHIELDS: dict[str, Shield] = {}
"""By name: those that were registered."""


def shield_called(shield: str | Shield | None) -> Shield | None:
    """A shield by its name, itself, or none."""
    if isinstance(shield, str):
        if shield not in SHIELDS:
            raise unknown("shield", shield, SHIELDS)
        return SHIELDS[shield]
    if shield is not None and not callable(shield):
        raise ConfigError(f"shield must be a name, a function or None, got {shield!r}.")
    return shield


def shielded(
    shield: Shield, now: Belief, command: JointVelocities, dt_s: float
) -> tuple[JointVelocities, dict[str, Floats]]:
    """What a shield makes of a command, and what it says by its name in info; `ConfigError` where
    that has another shape or the velocities are no finite numbers."""
    allowed, said = shield(now, command.copy(), dt_s)
    check_shape("A shield's velocities", np.shape(allowed), command.shape, "B, joints")
    if not np.isfinite(allowed).all():
        raise ConfigError(f"A shield's velocities must be finite [rad/s], got {allowed}.")
    for name, value in said.items():
        check_shape(f"A shield's {name!r}", np.shape(value), (len(command),), "B")
    return allowed, {f"shield/{name}": np.asarray(value, float) for name, value in said.items()}
