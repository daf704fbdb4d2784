"""The policies whose eyes are exchanged."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.checkout import agents
from hrc_env.core.errors import unknown
from hrc_env.experiments.impact.trial.episodes import MakeAgent
from hrc_env.experiments.impact.trial.tally import SLOW_M, STOP_M
from hrc_env.simulation import Simulation

SCRIPTED, SLOWED, PPO = "scripted", "scripted_slowed", "ppo"
POLICIES = (SCRIPTED, SLOWED, PPO)
"""Full speed whoever is near; slower by the estimated gap; trained."""


@dataclass(frozen=True, slots=True)
class Policy:
    """A policy, and what it adds to the distances that it keeps."""

    name: str
    margin_m: float = 0.0

    @property
    def label(self) -> str:
        """As parts and results are called."""
        if self.margin_m == 0:
            return self.name
        return f"{self.name}_plus_{round(1000 * self.margin_m)}mm"


def check_policy(name: str) -> None:
    """Raise `ConfigError` unless there is a policy of that name."""
    if name not in POLICIES:
        raise unknown("policy", name, POLICIES)


def maker(policy: Policy, checkpoint: Path) -> MakeAgent:
    """What makes the agent for a robot."""
    base = agents("base")

    def make(part: Simulation) -> Any:
        here = base.situation(part)
        if policy.name == PPO:
            return base.make_agent(str(checkpoint), here)
        if policy.name == SLOWED:
            scripted = agents("scripted")
            yielding = scripted.Yielding(STOP_M + policy.margin_m, SLOW_M + policy.margin_m)
            return scripted.expert(here, yielding)
        return base.make_agent(policy.name, here)

    return make
