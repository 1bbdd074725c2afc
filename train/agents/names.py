"""Names of the shipped agents in the registry of policies, read without importing Warp."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...baselines.registry import POLICY_FILES, describe_policy, policy_names, register

if TYPE_CHECKING:
    from ...envs.platform.machines import Platform
    from .agent import Agent

__all__ = ["agent_names", "describe_policy", "description_of", "is_agent", "policy_names", "register_agents"]

FOLDER: Final = Path(__file__).parent
SUFFIX: Final = ".safetensors"
METADATA: Final = "motion-cueing-agent"
"""Key of an agent's description in the metadata of its file."""
LENGTH: Final = 8
"""Bytes of the header's length, before the header, which begins with a brace."""


def agent_names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def is_agent(name: str) -> bool:
    """Whether a name or file means an agent."""
    return name in agent_names() or Path(name).suffix == SUFFIX


def description_of(algorithm: str, any_machine: bool, platform: str, mode: str) -> str:
    """One line about an agent.

    Args:
        algorithm: That trained it.
        any_machine: Whether its observation describes the machine.
        platform: Name of the machine it was trained on.
        mode: Of its actions.
    """
    machine = "any motion base, which it is told" if any_machine else f"the motion base {platform}"
    return f"agent by {algorithm} for {machine}, action {mode}"


def _description(path: Path) -> str:
    """The same of an agent's file, from its header alone."""
    with open(path, "rb") as file:
        header = json.loads(file.read(int.from_bytes(file.read(LENGTH), "little")))
    about: dict[str, Any] = json.loads(header["__metadata__"][METADATA])["contents"]
    task = about["task"]
    return description_of(
        about["record"]["algo"],
        bool(task["observation"].get("machine")),
        about["platform"]["name"],
        task["action"]["mode"],
    )


def _from_file(path: Path, platform: Platform) -> Agent:
    from .agent import Agent

    return Agent.load(path)


def register_agents(folder: Path) -> None:
    """Give the agents in a folder the names of their files."""
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        register(path.stem, partial(_from_file, path), _description(path))


register_agents(FOLDER)
POLICY_FILES.register(SUFFIX.removeprefix("."), _from_file, "an agent")
