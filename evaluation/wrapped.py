"""A policy that stands before another one, and is to the rollout what that one is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

_OWN: Final = ("start", "dt")
"""Attributes that a policy may have, and that then hold for whatever stands before it."""


class Wrapped:
    """What a rollout asks a policy for beside its answers, taken from another one.

    Args:
        policy: The other one.
    """

    name: str
    parameters: Any

    def __init__(self, policy: Any) -> None:
        self._inner = policy
        self.name = getattr(policy, "name", type(policy).__name__)
        self.parameters = getattr(policy, "parameters", None)
        for attribute in _OWN:
            if hasattr(policy, attribute):
                setattr(self, attribute, getattr(policy, attribute))

    @property
    def notes(self) -> Mapping[str, str]:
        """What the policy has counted by now."""
        return getattr(self._inner, "notes", {})
