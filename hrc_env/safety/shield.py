"""Shields, which modify a command before the arm receives it, based only on the belief."""

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, cast

import numpy as np

from hrc_env.belief import Belief, lend_belief
from hrc_env.core.brought import check_arguments, describe, numbers_of
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.lending import call_user_function, is_of_user
from hrc_env.core.mapping import from_mapping
from hrc_env.core.registry import Registry
from hrc_env.core.typing import Floats, JointVelocities, is_list_or_tuple, is_mapping
from hrc_env.safety.built_in import ShieldOutput, limit_command
from hrc_env.safety.config import PRESETS, ShieldConfig

Shield = Callable[
    [Belief, JointVelocities, float], ShieldOutput | tuple[JointVelocities, Mapping[str, Floats]]
]
"""A function (belief, velocities, dt_s) -> (allowed, values) that may change a command.

`velocities` and `allowed` (B, N) [rad/s] are the joint velocities of the agent and those that the
arm receives, `dt_s` is the time until the next command [s]. The `values` (B,), by name, are
reported as "shield/NAME" in info. A shield has no state. After the shield, only the joint limits
are enforced (speed, acceleration, range); distances and contacts are not checked again.
"""
ShieldChoice = str | ShieldConfig | Mapping[str, Any] | Shield | None
"""Values that the argument `shield` accepts: a name, settings or a mapping of them, a function, or
None."""
MEASURED = ("change", "active", "scale")
"""Names of the values that are measured for every shield."""
ACTIVE_RAD_S = 0.02
"""Change of the joint velocities above which a shield counts as active [rad/s]."""

SHIELDS: Registry[Shield] = Registry(
    "shield", {name: partial(limit_command, config=config) for name, config in PRESETS.items()}
)
"""Built-in shields and shields that users have registered, by name."""


def find_shield(shield: ShieldChoice) -> Shield | None:
    """Return the shield for a name, settings or a function; for None, return None.

    Raises:
        ConfigError: no shield has this name, a setting is invalid, the function has other
            parameters, or the calibrated bounds on errors are missing or out of date.
    """
    if isinstance(shield, str):
        if shield not in SHIELDS:
            raise make_unknown_name_error("shield", shield, SHIELDS)
        if shield in PRESETS:
            PRESETS[shield].load_bounds()
        return SHIELDS[shield]
    if is_mapping(shield):
        shield = from_mapping(ShieldConfig, shield, "shield.")
    if isinstance(shield, ShieldConfig):
        shield.load_bounds()
        return partial(limit_command, config=shield)
    if shield is not None and not callable(shield):
        raise ConfigError(
            "shield must be a name, a ShieldConfig or a mapping of its fields, a function or None, "
            f"got {shield!r}."
        )
    if shield is not None:
        check_shield("A shield", shield)
    return shield


def check_shield(description: str, shield: Callable[..., Any]) -> None:
    """Raise `ConfigError` if the parameters of a function are not those of a shield."""
    check_arguments(description, shield, "belief", "velocities", "dt_s")


def apply_shield(
    shield: Shield | None, belief: Belief, command: JointVelocities, dt_s: float
) -> ShieldOutput:
    """Apply a shield to a command, and return the velocities and the values for info.

    In addition to the values that the shield returns, the following values are measured:

    - "shield/change": norm of the change of the command [rad/s; m/s for prismatic joints];
    - "shield/active": 1 if the change exceeds `ACTIVE_RAD_S`, otherwise 0;
    - "shield/scale": fraction of the command that remains along its direction; 1 if it is
      unchanged.

    Without a shield, the command is returned unchanged and there are no values.

    Args:
        shield: the shield, or None.
        belief: the robot's knowledge of itself and of the workers.
        command: (B, N) joint velocities of the agent [rad/s].
        dt_s: time until the next command [s].

    Raises:
        ConfigError: the shield returns something other than velocities and values, velocities of
            another shape, or numbers that are not finite.
    """
    if shield is None:
        return ShieldOutput(command, {})
    output: Any
    if is_of_user(shield):
        output = call_user_function("A shield", shield, lend_belief(belief), command.copy(), dt_s)
    else:
        output = shield(belief, command.copy(), dt_s)
    pair = output if is_list_or_tuple(output) else ()
    if not isinstance(output, tuple) or len(pair) != 2 or not is_mapping(pair[1]):
        raise ConfigError(
            "A shield must return a pair: the allowed velocities (B, joints) and a mapping from "
            "names to values (B,), which may be empty ({}); got "
            f"{describe(cast(object, output))}."
        )
    allowed = numbers_of("A shield's velocities", pair[0], command.shape, "B, joints")
    values = _check_values(pair[1], len(command))
    if belief.model is not None and is_of_user(shield):
        _warn_of_speed(allowed, belief.model.chain.velocity_limit_rad_s)
    change = np.sqrt(np.square(allowed - command).sum(-1))
    squared = np.square(command).sum(-1)
    along = np.where(squared > 0, (allowed * command).sum(-1), 1.0)
    scale = along / np.where(squared > 0, squared, 1.0)
    measured = dict(zip(MEASURED, (change, change > ACTIVE_RAD_S, scale), strict=True))
    named = {f"shield/{k}": np.asarray(v, float) for k, v in {**measured, **values}.items()}
    return ShieldOutput(allowed, named)


def _check_values(values: Mapping[Any, Any], batch: int) -> dict[str, Floats]:
    """Return the values of a shield as arrays (B,), or raise `ConfigError`."""
    checked: dict[str, Floats] = {}
    for name, value in values.items():
        if not isinstance(name, str):
            raise ConfigError(f"Keys of a shield's values must be names, got {name!r}.")
        if name in MEASURED:
            raise ConfigError(
                f"A custom shield must not return the value {name!r}, which is measured for every "
                f"shield: choose a name other than {', '.join(map(repr, MEASURED))}."
            )
        words = f"The value {name!r} of a shield"
        checked[name] = numbers_of(words, value, (batch,), "B", finite=False)
    return checked


def _warn_of_speed(allowed: JointVelocities, limit_rad_s: Floats) -> None:
    """Warn if a shield allows velocities above the limits of the joints."""
    over = np.abs(allowed).max(0, initial=0.0) / limit_rad_s
    if (over > 1.0 + 1e-9).any():
        joint = int(over.argmax())
        warnings.warn(
            f"A shield lets joint {joint} move at {over[joint]:.3g} times its velocity limit: a "
            "shield may only reduce speed, or command velocities within the joints' limits. "
            "Distances are not checked after it.",
            stacklevel=4,
        )
