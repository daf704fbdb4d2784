"""Agents that studies are given: their check, their record in results, their maker."""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.agents import policies
from hrc_env.agents.env_info import Agent, EnvInfo
from hrc_env.agents.registry import AGENTS, OTHERS, check_agent, function_of, make_agent
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.experiments.versions import digest_of, source_digest

AgentChoice = str | Callable[[EnvInfo], Agent]
"""As `hrc_env.make_agent` takes it, or a function that makes an agent."""


def check_choice(agent: AgentChoice) -> None:
    """Raise `ConfigError` for an agent that is no name, no file that exists, and no function."""
    if not isinstance(agent, str):
        return
    check_agent(agent)
    is_file = not agent.startswith(policies.PREFIX) and Path(agent).suffix in (
        ".zip", policies.SUFFIX
    )  # fmt: skip
    if is_file and not Path(agent).is_file():
        raise ConfigError(f"{unknown('agent', agent, AGENTS)} Or {OTHERS}.")


def maker_of(agent: AgentChoice, trust: bool = False) -> Callable[[EnvInfo], Agent]:
    """Return the function that makes an agent for an `EnvInfo`."""
    return partial(make_agent, agent, trust=trust) if isinstance(agent, str) else agent


def described(agent: AgentChoice) -> Any:
    """Return the description of an agent that keys the parts of a study, as JSON can hold it: its
    name; of a file its digest; of a function of the user's own its name and the digest of its
    file."""
    if not isinstance(agent, str):
        name = getattr(agent, "__qualname__", type(agent).__qualname__)
        return {"function": name, "source": source_digest(agent)}
    if agent.startswith(policies.PREFIX):
        return {"policy": agent, "sha256": policies.read(policies.path_of(agent))[0].sha256}
    if Path(agent).is_file():
        return {"policy": digest_of(Path(agent))[:12]}
    if agent not in AGENTS and ":" in agent:
        return {"function": agent, "source": source_digest(function_of(agent))}
    return agent


def labels_of(agents: Sequence[str], taken: Mapping[str, str]) -> dict[str, str]:
    """Return agents by names that files and results can have, in their order.

    Args:
        agents: as `hrc_env.make_agent` takes them; twice the same is once.
        taken: names that a study gives to agents of its own.

    Raises:
        ConfigError: two have the same name.
    """
    found: dict[str, str] = {}
    for agent in dict.fromkeys(agents):
        label = agent if agent in taken else label_of(agent, taken)
        if label in found:
            raise ConfigError(
                f"{found[label]!r} and {agent!r} would both be called {label!r} in results: rename "
                "one of the files."
            )
        found[label] = agent
    return found


def label_of(agent: str, taken: Mapping[str, str]) -> str:
    """Return a name for an agent of the user's own: its letters, digits and _, joined by -."""
    stem = agent.removesuffix(".zip").removesuffix(policies.SUFFIX)
    label = re.sub(r"\W+", "-", stem).strip("-")
    return f"own-{label}" if label in taken else label
