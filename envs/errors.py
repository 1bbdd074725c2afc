"""Errors a user can meet: each says which field is wrong and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import TypeVar

T = TypeVar("T")


class MotionCueingError(Exception):
    """Base of every error this package raises on purpose."""


class ConfigurationError(MotionCueingError, ValueError):
    """A field of a configuration is unknown, missing, of the wrong type or out of range."""


class UnknownArgumentError(ConfigurationError, TypeError):
    """A keyword that an environment does not know; a TypeError for libraries that try keywords out."""


class GeometryError(ConfigurationError):
    """A hexapod that cannot close, or whose neutral pose is singular."""


class DataError(MotionCueingError, ValueError):
    """Data (an array, a CSV file, a saved result) is broken: NaN, wrong shape, missing column."""


class ActionError(MotionCueingError, ValueError):
    """An action that is not nine finite numbers."""


class UnknownNameError(MotionCueingError, KeyError):
    """A name that is not registered; the message has near ones, or the new name of an old one."""

    def __init__(
        self, kind: str, name: str, known: Iterable[str], renamed: Mapping[str, str] | None = None
    ) -> None:
        self.kind, self.name, self.known = kind, name, sorted(known)
        new = (renamed or {}).get(name)
        if new is None:
            super().__init__(f"unknown {kind} {name!r}. {suggest(name, self.known)}")
        else:
            super().__init__(f"unknown {kind} {name!r}; it is called {new!r} now")

    def __str__(self) -> str:
        # KeyError would show the repr of the message.
        return str(self.args[0])


def look_up(kind: str, name: str, known: Mapping[str, T]) -> T:
    """What is registered under a name.

    Raises:
        UnknownNameError: nothing is; the message lists the nearest known names.
    """
    if name not in known:
        raise UnknownNameError(kind, name, known)
    return known[name]


def suggest(name: str, known: Iterable[str]) -> str:
    """A sentence with the nearest known names, or with all of them where none is near."""
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if near:
        return "Did you mean " + " or ".join(near) + "?"
    return "Known: " + ", ".join(names) + "."
