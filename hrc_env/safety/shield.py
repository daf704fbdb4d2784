"""Shields: what changes a command before the arm gets it. They read the belief, never the truth."""

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from hrc_env.belief import Belief, lend_belief
from hrc_env.core.brought import check_arguments, described, numbers_of
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.lending import called, is_of_user
from hrc_env.core.mapping import from_mapping
from hrc_env.core.registry import Registry
from hrc_env.core.typing import Floats, JointVelocities
from hrc_env.safety.config import PRESETS, ShieldConfig
from hrc_env.safety.guard import guarded

Shield = Callable[[Belief, JointVelocities, float], tuple[JointVelocities, Mapping[str, Floats]]]
"""A function that may change a command: (belief, velocities, dt_s) -> (allowed, values).

`velocities` and `allowed` (B, N) [rad/s] are the joint velocities that the agent asks for and that
the arm gets, `dt_s` is the time until the next command [s]. `values` (B,) by name become
"shield/NAME" in info. It keeps nothing from step to step. After it only limits of joints hold
(speed, acceleration, ends): nothing checks distances or contacts again."""
ShieldChoice = str | ShieldConfig | Mapping[str, Any] | Shield | None
SHIELDS: Registry[Shield] = Registry(
    "shield", {name: partial(guarded, config=config) for name, config in PRESETS.items()}
)
"""By name: the built-in ones and those that were registered."""
OF_ANY = ("change", "active", "scale")
"""Names of values that are measured of every shield."""
ACTIVE_RAD_S = 0.02
"""A shield that changes joint velocities by more is called active."""


def shield_called(shield: ShieldChoice) -> Shield | None:
    """A shield by its name, its settings, itself, or none."""
    if isinstance(shield, str):
        if shield not in SHIELDS:
            raise unknown("shield", shield, SHIELDS)
        return SHIELDS[shield]
    if isinstance(shield, Mapping):
        shield = from_mapping(ShieldConfig, shield, "shield.")
    if isinstance(shield, ShieldConfig):
        return partial(guarded, config=shield)
    if shield is not None and not callable(shield):
        raise ConfigError(
            "shield must be a name, a ShieldConfig or a mapping of its fields, a function or None, "
            f"got {shield!r}."
        )
    if shield is not None:
        check_shield("A shield", shield)
    return shield


def check_shield(what: str, shield: Callable[..., Any]) -> None:
    """Raise `ConfigError` for a function that takes other arguments than a shield does."""
    check_arguments(what, shield, "belief", "velocities", "dt_s")


def shielded(
    shield: Shield | None, now: Belief, command: JointVelocities, dt_s: float
) -> tuple[JointVelocities, dict[str, Floats]]:
    """What a shield makes of a command, and what there is to say by its name in info: what the
    shield says, and of any shield

    - "shield/change": the length of the change [rad/s], of slides [m/s];
    - "shield/active": 1 where that is more than `ACTIVE_RAD_S`;
    - "shield/scale": what is left of the command along itself, 1 for all of it.

    Without a shield the command goes to the arm as it is, and there is nothing to say.

    Raises:
        ConfigError: the velocities have another shape or are no finite numbers.
    """
    if shield is None:
        return command, {}
    if is_of_user(shield):
        given = called("A shield", shield, lend_belief(now), command.copy(), dt_s)
    else:
        given = shield(now, command.copy(), dt_s)
    if not (isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], Mapping)):
        raise ConfigError(
            "A shield must return two things, the velocities that it allows (B, joints) and a "
            f"mapping of what it says (B,) by name, {{}} for nothing; got {described(given)}."
        )
    allowed = numbers_of("A shield's velocities", given[0], command.shape, "B, joints")
    said: dict[str, Floats] = {}
    for name, value in given[1].items():
        if not isinstance(name, str):
            raise ConfigError(f"What a shield says must have names, got {name!r}.")
        if name in OF_ANY:
            raise ConfigError(
                f"A shield of your own must not say {name!r}, which is measured of every shield: "
                f"choose another name than {', '.join(map(repr, OF_ANY))}."
            )
        words = f"A shield's {name!r}"
        said[name] = numbers_of(words, value, (len(command),), "B", finite=False)
    if now.model is not None and is_of_user(shield):
        _warn_of_speed(allowed, now.model.chain.velocity_limit_rad_s)
    change = np.sqrt(np.square(allowed - command).sum(-1))
    asked = np.square(command).sum(-1)
    scale = np.where(asked > 0, (allowed * command).sum(-1), 1.0) / np.where(asked > 0, asked, 1.0)
    of_any = dict(zip(OF_ANY, (change, change > ACTIVE_RAD_S, scale), strict=True))
    return allowed, {f"shield/{k}": np.asarray(v, float) for k, v in {**of_any, **said}.items()}


def _warn_of_speed(allowed: JointVelocities, most_rad_s: Floats) -> None:
    """Warn of a shield that allows more than the velocity limits of joints."""
    over = np.abs(allowed).max(0, initial=0.0) / most_rad_s
    if (over > 1.0 + 1e-9).any():
        joint = int(over.argmax())
        warnings.warn(
            f"A shield lets joint {joint} go {over[joint]:.3g} times as fast as it can: a shield "
            "may only take speed off, or ask for what joints can do. Nothing checks distances "
            "after it.",
            stacklevel=4,
        )
