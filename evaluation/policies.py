"""Every policy by name or file: the baselines, registered ones, and the agents of the package."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import baselines
from ..baselines import describe_policy, make_policy, policy_names
from ..baselines.registry import is_reference, name_of_reference
from ..train import agents
from ..train.agents import find_agent, is_agent

if TYPE_CHECKING:
    from ..envs.platform import Platform

__all__ = [
    "default_policies",
    "describe_policy",
    "find_agent",
    "is_agent",
    "is_reference",
    "make_policy",
    "name_of_reference",
    "policy_names",
]


def default_policies(platform: Platform) -> list[str]:
    """Policies an evaluation compares where none is named: the baselines meant for it, and agents.

    Agents are those that were made for the machine, or for any, and that any drive has enough for: not those
    that see controls or road.
    """
    shipped = {name: agents.get_agent(name) for name in agents.agent_names()}
    fit = [
        name
        for name, agent in shipped.items()
        if (agent.task.observation.machine or agent.platform == platform) and not agent.task.observation.knows
    ]
    return [*baselines.default_policies(), *fit]
