"""A training that begins with the network of an agent there is already."""

from __future__ import annotations

from ..envs.errors import ConfigurationError
from ..envs.task.batch import Batch
from .actor import Actor, begin_at_rest
from .agent import Agent, Network
from .config import TrainingConfig


def initial_agent(config: TrainingConfig) -> Agent | None:
    """The agent of ``config.initial``, or None where nothing is named.

    Raises:
        DataError: the file cannot be read.
    """
    return None if config.initial is None else Agent.load(config.initial)


def initial_network(config: TrainingConfig) -> Network | None:
    """Its network.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: that agent sees, does or drives something else.
    """
    agent = initial_agent(config)
    if agent is None:
        return None
    for name in ("platform", "observation", "action"):
        theirs, ours = getattr(agent.task, name), getattr(config.task, name)
        if theirs != ours:
            raise ConfigurationError(f"initial {config.initial}: its task.{name} is {theirs}, not {ours}")
    return agent.network


def begin(actor: Actor, batch: Batch, config: TrainingConfig) -> None:
    """Give an actor the weights of the initial network, or let it begin at rest where none is named.

    Raises:
        DataError: the agent's file cannot be read, or its network is built in another way.
        ConfigurationError: that agent sees, does or drives something else.
    """
    network = initial_network(config)
    if network is None:
        begin_at_rest(actor, batch)
    else:
        actor.load(network)
