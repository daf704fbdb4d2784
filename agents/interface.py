"""Settings of an environment on which a policy's actions and observations depend."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hrc_env.core.mapping import answer_unknown_fields, from_mapping, merge

OBSERVED = ("forecast_s", "uncertainty", "observe_shield")
"""Names of the fields of `HRCConfig` that add terms to the observation."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True, kw_only=True)
class Interface:
    """Control mode and optional terms of the observation with which a policy was trained."""

    control: str | None = None
    """Control mode, which defines the meaning of actions; None if it is unspecified."""
    forecast_s: tuple[float, ...] = ()
    """Horizons of the observed forecasts [s]."""
    uncertainty: tuple[str, ...] = ()
    """Observed entries for the covariance of each joint (`HRCConfig.uncertainty`)."""
    observe_shield: bool = False
    """Whether the change of the last command by the shield is observed."""

    def complete(self, keywords: Mapping[str, Any]) -> dict[str, Any]:
        """Return an environment's keyword arguments, completed by those that the policy needs.

        Arguments that are given remain. A `config` that is not a mapping states every setting, and
        is not changed.

        Args:
            keywords: keyword arguments of an environment.
        """
        completed = dict(keywords)
        if self.control is not None and completed.get("control") is None:
            completed["control"] = self.control
        needed = {name: getattr(self, name) for name in OBSERVED if getattr(self, name)}
        config = completed.get("config", {})
        if needed and isinstance(config, Mapping):
            completed["config"] = merge(needed, config)
        return completed


def read_interface(keywords: Mapping[str, Any]) -> Interface:
    """Return the interface of a policy that was trained in an environment.

    Args:
        keywords: keyword arguments of the environment, as a checkpoint stores them.
    """
    config = keywords.get("config") or {}
    observed = {name: config[name] for name in OBSERVED if name in config}
    return from_mapping(Interface, {"control": keywords.get("control"), **observed})
