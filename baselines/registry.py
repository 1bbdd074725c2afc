"""Policies by name or file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ..envs.errors import DataError, UnknownNameError
from ..envs.platform.machines import Platform
from .policy import NoMotion, Policy
from .washout import ClassicalWashout, load_washout, washout_presets

_DEFAULT: Final = ("no-motion", "classical", "classical-tuned", "est1", "brk")


def policy_names() -> list[str]:
    """Names :func:`make_policy` knows."""
    return [NoMotion.name, *washout_presets()]


def default_policies() -> list[str]:
    """Policies an evaluation compares unless told otherwise."""
    return list(_DEFAULT)


def describe_policy(name: str) -> str:
    """One line about a policy."""
    if name == NoMotion.name:
        return "the machine stands still"
    return load_washout(name).description


def make_policy(name: str | Path, platform: Platform) -> Policy:
    """A policy for a machine, by name or from a washout's YAML file.

    Raises:
        UnknownNameError: no policy has this name.
        DataError: the file does not exist or cannot be read.
        ConfigurationError: a field of the file is wrong.
    """
    if str(name) == NoMotion.name:
        return NoMotion()
    if Path(name).suffix in (".yaml", ".yml"):
        return ClassicalWashout(load_washout(name), platform.cab)
    if str(name) in washout_presets():
        return ClassicalWashout(str(name), platform.cab)
    if Path(name).exists():
        raise DataError(f"{name}: not a policy; expected a washout's .yaml file")
    raise UnknownNameError("policy", str(name), policy_names())
