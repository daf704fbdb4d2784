"""The policies whose eyes are exchanged."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hrc_env
from hrc_env.core.agents_door import agents
from hrc_env.core.errors import unknown
from hrc_env.experiments.impact.trial.episodes import MakeAgent
from hrc_env.experiments.impact.trial.tally import SLOW_M, STOP_M
from hrc_env.simulation import Simulation

SCRIPTED, SLOWED, PPO = "scripted", "scripted_slowed", "ppo"
POLICIES = (SCRIPTED, SLOWED, PPO)
"""Full speed whoever is near; slower by the estimated gap; trained."""
_READ = ("belief", "observations", "rewards", "sb3")


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
            return scripted.ScriptedAgent(here, yielding)
        return base.make_agent(policy.name, here)

    return make


def code_of_policies() -> str:
    """A fingerprint of what policies are, read and learn from: rows are of these and no others."""
    package = Path(hrc_env.__file__).parent
    files = [package / f"{name}.py" for name in _READ]
    files += sorted((package / "tasks").glob("*.py"))
    files += sorted(Path(agents("base").__file__ or "").parent.glob("*.py"))
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
