"""An engine by name."""

from __future__ import annotations

from typing import Final

from ...envs.errors import UnknownNameError
from .job import Engine
from .local import LocalEngine
from .processes import ProcessEngine

ENGINES: Final = ("local", "ray")
"""Names ``--engine`` takes."""


def make_engine(name: str, jobs: int | None = None, address: str | None = None) -> Engine:
    """An engine.

    Args:
        name: One of :data:`ENGINES`.
        jobs: Jobs at a time; by default 1 with "local", one a core of machine or cluster with "ray".
        address: Of a Ray cluster to join; None for one of its own, on this machine.

    Raises:
        UnknownNameError: no engine has this name.
        ConfigurationError: Ray is not installed.
    """
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    if name == "ray":
        from .ray_engine import RayEngine

        return RayEngine(jobs, address)
    return LocalEngine() if jobs in (None, 1) else ProcessEngine(jobs or 1)
