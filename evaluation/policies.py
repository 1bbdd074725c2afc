"""Policies by name or file: baselines, washouts in YAML files, and agents."""

from __future__ import annotations

from pathlib import Path

from .. import baselines
from ..baselines import ForeknowingPolicy, Policy
from ..envs.errors import UnknownNameError
from ..envs.platform import Platform
from ..train.agents import Agent, agent_names, get_agent
from ..train.agents.files import SUFFIX
from .rollout import TaskPolicy, on_machine
from .selection import is_file


def policy_names() -> list[str]:
    """Names :func:`make_policy` knows."""
    return [*baselines.policy_names(), *agent_names()]


def default_policies(platform: Platform) -> list[str]:
    """Policies an evaluation compares unless told otherwise; the agents that were made for the machine.

    Those are also the agents that are told their machine, whichever it is.
    """
    agents = [name for name in agent_names() if get_agent(name).told or get_agent(name).platform == platform]
    return [*baselines.default_policies(), *agents]


def describe_policy(name: str) -> str:
    """One line about a policy."""
    return get_agent(name).description if name in agent_names() else baselines.describe_policy(name)


def is_agent(name: str) -> bool:
    """Whether a name or file means an agent."""
    return name in agent_names() or Path(name).suffix == SUFFIX


def find_agent(name: str) -> Agent:
    """An agent by the name of a shipped one, or by file.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: the file does not exist, is broken or no agent.
    """
    return Agent.load(name) if name not in agent_names() and is_file(name) else get_agent(name)


def make_policy(name: str, platform: Platform) -> Policy | TaskPolicy | ForeknowingPolicy:
    """A policy for a machine, by name, or from the file of a washout or an agent.

    Raises:
        UnknownNameError: no policy has this name.
        DataError: the file does not exist or cannot be read.
        ConfigurationError: a field of the file is wrong, or its agent was made for another machine.
    """
    if is_agent(name):
        return on_machine(find_agent(name), platform)
    try:
        return baselines.make_policy(name, platform)
    except UnknownNameError:
        raise UnknownNameError("policy", name, policy_names()) from None
