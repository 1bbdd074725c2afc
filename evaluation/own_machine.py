"""The motion base an agent was made for, and those it may drive."""

from __future__ import annotations

from typing import Any, TypeVar

from ..envs.errors import ConfigurationError
from ..envs.platform import Platform
from ..envs.task.library import platform_of

Anyone = TypeVar("Anyone")
"""A :class:`~.drivers.TaskPolicy`."""


def on_machine(policy: Anyone, platform: Platform) -> Anyone:
    """A policy on a machine: one that is told its machine (``observation.machine``) is told this one.

    Args:
        policy: With a ``task``; one that goes elsewhere has ``on(platform)``, as an agent.
        platform: The machine.

    Raises:
        ConfigurationError: the policy was made for another machine, and is not told which it has.
    """
    own: Any = policy
    if own.task.observation.machine and callable(getattr(own, "on", None)):
        return own.on(platform)  # type: ignore[no-any-return]
    check_machine(policy, platform)
    return policy


def check_machine(policy: Any, platform: Platform) -> None:
    """Refuse a machine that a policy was not made for.

    Raises:
        ConfigurationError: the machine is another one.
    """
    own = platform_of(policy.task)
    if own != platform:
        name = getattr(policy, "name", type(policy).__name__)
        raise ConfigurationError(
            f"{name} was made for the motion base {own.name!r}, not {platform.name!r}; evaluate it on "
            f"{own.name!r}, or force it, in Python: agent.on(get_platform({platform.name!r}))"
        )
