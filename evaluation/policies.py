"""Policies by name or file: baselines, washouts in YAML files, and agents."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from inspect import signature
from pathlib import Path
from typing import Any

from .. import baselines
from ..baselines import ForeknowingPolicy, Policy
from ..envs.errors import ConfigurationError, UnknownNameError
from ..envs.platform import Platform
from ..envs.storage import is_file
from ..train.agents import Agent, agent_names, get_agent
from ..train.agents.files import SUFFIX
from .rollout import TaskPolicy, on_machine


def is_reference(name: str) -> bool:
    """Whether a name means an object of the user's: ``module:Class`` or ``file.py:Class``."""
    return ":" in name


def load_reference(name: str, platform: Platform) -> Any:
    """An object of the user's that has ``predict``; a class or function is called to make it.

    A class is called with the machine if its first argument is called ``platform``, else without arguments.

    Raises:
        ConfigurationError: it cannot be imported or made, or has no ``predict``.
    """
    module, _, attribute = name.rpartition(":")
    try:
        found = getattr(_import(module), attribute)
        if not hasattr(found, "predict") or isinstance(found, type):
            takes = next(iter(signature(found).parameters), None)
            found = found(platform) if takes == "platform" else found()
    except Exception as error:  # It is a user's code.
        raise ConfigurationError(f"policy {name}: {type(error).__name__}: {error}") from error
    if not hasattr(found, "predict"):
        raise ConfigurationError(f"policy {name}: it has no method predict(observation, state, ...)")
    return found


def _import(module: str) -> Any:
    """A module by name or file."""
    if not module.endswith(".py"):
        return import_module(module)
    if not Path(module).exists():
        raise FileNotFoundError(f"{module}: there is no such file")
    spec = spec_from_file_location(Path(module).stem, module)
    assert spec is not None
    assert spec.loader is not None
    loaded = module_from_spec(spec)
    # Dataclasses and pickles look for the module of their class.
    sys.modules.setdefault(spec.name, loaded)
    spec.loader.exec_module(loaded)
    return loaded


def policy_names() -> list[str]:
    """Names :func:`make_policy` knows."""
    return [*baselines.policy_names(), *agent_names()]


def default_policies(platform: Platform) -> list[str]:
    """Policies an evaluation compares unless told otherwise; the agents that were made for the machine.

    Those are also the agents that are told their machine, whichever it is.
    """
    agents = [name for name in agent_names() if get_agent(name).told or get_agent(name).platform == platform]
    return [*baselines.default_policies(), *agents]


def describe_policy(name: str) -> str:
    """One line about a policy."""
    return get_agent(name).description if name in agent_names() else baselines.describe_policy(name)


def is_agent(name: str) -> bool:
    """Whether a name or file means an agent."""
    return name in agent_names() or Path(name).suffix == SUFFIX


def find_agent(name: str) -> Agent:
    """An agent by the name of a shipped one, or by file.

    Raises:
        UnknownNameError: no agent has this name.
        DataError: the file does not exist, is broken or no agent.
    """
    return Agent.load(name) if name not in agent_names() and is_file(name) else get_agent(name)


def make_policy(name: str, platform: Platform) -> Policy | TaskPolicy | ForeknowingPolicy:
    """A policy for a machine, by name, or from the file of a washout or an agent.

    Raises:
        UnknownNameError: no policy has this name.
        DataError: the file does not exist or cannot be read.
        ConfigurationError: a field of the file is wrong, or its agent was made for another machine.
    """
    if is_reference(name):
        return load_reference(name, platform)  # type: ignore[no-any-return]
    if is_agent(name):
        return on_machine(find_agent(name), platform)
    try:
        return baselines.make_policy(name, platform)
    except UnknownNameError:
        raise UnknownNameError("policy", name, policy_names()) from None
