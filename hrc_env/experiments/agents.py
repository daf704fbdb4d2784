"""Checks, descriptions, labels and factories of the agents of a study."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hrc_env.agents import policies
from hrc_env.agents.env_info import AgentFactory
from hrc_env.agents.registry import (
    AGENTS,
    OTHERS,
    check_agent,
    find_function,
    find_interface,
    make_agent,
)
from hrc_env.agents.separate import SeparateProcess
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.experiments.versions import hash_file, hash_source

AgentChoice = str | AgentFactory
"""An agent as `hrc_env.make_agent` accepts it, or a function that makes an agent."""


def check_choice(agent: AgentChoice) -> None:
    """Raise `ConfigError` unless an agent is a name, an existing file or a function."""
    if not isinstance(agent, str):
        return
    check_agent(agent)
    is_file = not agent.startswith(policies.PREFIX) and Path(agent).suffix in (
        ".zip", policies.SUFFIX
    )  # fmt: skip
    if is_file and not Path(agent).is_file():
        raise ConfigError(f"{make_unknown_name_error('agent', agent, AGENTS)} Or {OTHERS}.")


def get_agent_factory(agent: AgentChoice, trust: bool = False) -> AgentFactory:
    """Return the function that makes an agent for an `EnvInfo`."""
    return partial(make_agent, agent, trust=trust) if isinstance(agent, str) else agent


def find_env_arguments(agent: str, control: str | None) -> dict[str, Any]:
    """Return the environment's keyword arguments on which an agent's interface depends.

    They are the control mode and the optional terms of the observation with which it was trained.

    Args:
        agent: the agent as `hrc_env.make_agent` accepts it.
        control: control mode if the agent's file does not name one; None: the default.
    """
    default = {} if control is None else {"control": control}
    return default | find_interface(agent).complete({})


def describe_agent(agent: AgentChoice) -> Any:
    """Return a description of an agent for the cache keys of a study's parts, as JSON values.

    It is the agent's name or the digest of its file. For a user's function, it is the name of the
    function and the digest of its source file; for an agent in a process of its own, the policy and
    the digest of its files.
    """
    if isinstance(agent, SeparateProcess):
        return {"separate": agent.submission.policy, "sha256": agent.submission.sha256}
    if not isinstance(agent, str):
        name = getattr(agent, "__qualname__", type(agent).__qualname__)
        return {"function": name, "source": hash_source(agent)}
    if agent.startswith(policies.PREFIX):
        return {"policy": agent, "sha256": policies.read(policies.find_path(agent))[0].sha256}
    if Path(agent).is_file():
        return {"policy": hash_file(Path(agent))[:12]}
    if agent not in AGENTS and ":" in agent:
        return {"function": agent, "source": hash_source(find_function(agent))}
    return agent


def label_agents(agents: Sequence[str], taken: Mapping[str, str]) -> dict[str, str]:
    """Return agents, in the given order, by labels that are valid in names of files and results.

    Args:
        agents: agents as `hrc_env.make_agent` accepts them; repetitions count once.
        taken: labels of the study's built-in agents.

    Raises:
        ConfigError: two agents get the same label.
    """
    labels: dict[str, str] = {}
    for agent in dict.fromkeys(agents):
        label = agent if agent in taken else label_agent(agent, taken)
        if label in labels:
            raise ConfigError(
                f"{labels[label]!r} and {agent!r} would both be named {label!r} in results: rename "
                "one of the files."
            )
        labels[label] = agent
    return labels


def label_agent(agent: str, taken: Mapping[str, str]) -> str:
    """Return a label for a user's agent; it contains only letters, digits, _ and -.

    All other characters are replaced by -.
    """
    stem = agent.removesuffix(".zip").removesuffix(policies.SUFFIX)
    label = re.sub(r"\W+", "-", stem).strip("-")
    return f"own-{label}" if label in taken else label
