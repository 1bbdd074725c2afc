"""Trained policies: one file each, which NumPy alone reads and runs.

The agents that come with the package have names in the registry of policies, from which any function makes
them. Attributes are imported when they are first used: a list of names costs no import of Warp.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .names import agent_names, describe_policy, is_agent, policy_names

if TYPE_CHECKING:
    from .agent import Agent, find_agent, get_agent
    from .files import Record
    from .network import Network

_LAZY = {
    "Agent": ".agent",
    "Network": ".network",
    "Record": ".files",
    "find_agent": ".agent",
    "get_agent": ".agent",
}

__all__ = [
    "Agent",
    "Network",
    "Record",
    "agent_names",
    "describe_policy",
    "find_agent",
    "get_agent",
    "is_agent",
    "policy_names",
]


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name], __name__), name)
