"""Trained policies: one file each, which NumPy alone reads and runs.

The agents that come with the package have names in the registry of policies, from which any function makes
them. Attributes are imported when they are first used: a list of names costs no import of Warp.
"""

from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...baselines.registry import POLICY_FILES, describe_policy, make_policy, policy_names, register
from ...envs.errors import DataError
from .names import FOLDER, SUFFIX, agent_names, description_in, is_agent

if TYPE_CHECKING:
    from ...envs.platform.machines import Platform
    from .agent import Agent, find_agent, get_agent
    from .files import Record
    from .network import Network, PolicyNetwork
    from .recurrent import RecurrentNetwork

_LAZY = {
    "Agent": ".agent",
    "Network": ".network",
    "PolicyNetwork": ".network",
    "Record": ".files",
    "RecurrentNetwork": ".recurrent",
    "find_agent": ".agent",
    "get_agent": ".agent",
}

__all__ = [
    "Agent",
    "Network",
    "PolicyNetwork",
    "Record",
    "RecurrentNetwork",
    "agent_names",
    "describe_policy",
    "find_agent",
    "get_agent",
    "is_agent",
    "make_policy",
    "policy_names",
    "register_agents",
]


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name], __name__), name)


def _from_file(path: Path, platform: "Platform") -> "Agent":
    from .agent import Agent

    return Agent.load(path)


def _from_zip(path: Path, platform: "Platform") -> "Agent":
    command = f"motion-cueing convert {path} --environment ID --out NAME.safetensors"
    raise DataError(
        f"{path}: a model of Stable-Baselines3 does not say which environment it acts in; `{command}` makes "
        "an agent of it; loading a model executes code in it, so convert only one that you trust"
    )


def register_agents(folder: Path) -> None:
    """Give the agents in a folder the names of their files."""
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        register(path.stem, partial(_from_file, path), description_in(path))


register_agents(FOLDER)
POLICY_FILES.register(SUFFIX.removeprefix("."), _from_file, "an agent")
POLICY_FILES.register("zip", _from_zip, "refused, with the way to an agent")
