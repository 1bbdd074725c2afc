"""Errors a user can meet: each says which field is wrong and what to do."""

from __future__ import annotations

import difflib
import sysconfig
import traceback
from collections.abc import Iterable, Mapping
from pathlib import Path
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


class PolicyError(MotionCueingError, RuntimeError):
    """A policy that raised an error of its own; the message says in which step, and where in its code."""


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
    return "Known: " + (", ".join(names) or "none") + "."


def reason(error: Exception) -> str:
    """Why a file cannot be read, without the numbers of the operating system."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file"
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)


def place(error: BaseException) -> str:
    """File and line of an error, ``file.py:7``: the last line of a user's code on the way to it."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{Path(error.filename).name}:{error.lineno}"
    frames = [
        (frame.f_globals.get("__name__", ""), frame.f_code.co_filename, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
        if not frame.f_code.co_filename.startswith("<")
    ]
    library = sysconfig.get_path("stdlib")
    own = [
        (name, file, line)
        for name, file, line in frames
        if not name.startswith("motion_cueing.")
        and "site-packages" not in file
        and not file.startswith(library)
    ]
    return "".join(f"{Path(file).name}:{line}" for _, file, line in (own or frames)[-1:])


def summary(error: BaseException) -> str:
    """An error of a user's code in one line: its type and message."""
    text = " ".join((error.msg if isinstance(error, SyntaxError) else str(error)).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
