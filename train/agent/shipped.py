"""The agents that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...envs.errors import DataError, UnknownNameError
from .agent import Agent
from .files import SUFFIX

FOLDER: Final = Path(__file__).parents[1] / "agents"


def agent_names() -> list[str]:
    """Names of the shipped agents."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def get_agent(name: str) -> Agent:
    """A shipped agent.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: there is none at all.
    """
    known = agent_names()
    if not known:
        raise DataError(f"agent {name!r}: no agent comes with this package; name an agent's {SUFFIX} file")
    if name not in known:
        raise UnknownNameError("agent", name, known)
    return Agent.load(FOLDER / f"{name}{SUFFIX}")
