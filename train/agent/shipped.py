"""The agents that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...envs.errors import UnknownNameError
from .agent import Agent

FOLDER: Final = Path(__file__).parents[1] / "agents"


def agent_names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.stem for path in FOLDER.glob("*.safetensors"))


def get_agent(name: str) -> Agent:
    """A shipped agent.

    Raises:
        UnknownNameError: no agent has this name.
    """
    known = agent_names()
    if name not in known:
        raise UnknownNameError("agent", name, known)
    return Agent.load(FOLDER / f"{name}.safetensors")
