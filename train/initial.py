"""A training that begins with the network of an agent there is already."""

from __future__ import annotations

from ..envs.errors import ConfigurationError
from .agent import Agent, Network
from .config import TrainingConfig


def initial_network(config: TrainingConfig) -> Network | None:
    """The network of ``config.initial``, or None where nothing is named.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: that agent sees, does or drives something else.
    """
    if config.initial is None:
        return None
    agent = Agent.load(config.initial)
    for name in ("platform", "observation", "action"):
        theirs, ours = getattr(agent.task, name), getattr(config.task, name)
        if theirs != ours:
            raise ConfigurationError(f"initial {config.initial}: its task.{name} is {theirs}, not {ours}")
    return agent.network
