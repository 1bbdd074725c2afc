"""The command line that gives a command: for reports, and to do it again; and numbers with their noun."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any


def words_of(name: str, command: Any) -> list[str]:
    """The words that give a command: the options that differ from their default.

    Args:
        name: Of the subcommand.
        command: Its dataclass of arguments.
    """
    words = ["motion-cueing", name]
    for option in fields(command):
        value = getattr(command, option.name)
        if option.default is not MISSING and value == option.default:
            continue
        words.append("--" + option.name.replace("_", "-"))
        if not isinstance(value, bool):
            words += [str(item) for item in value] if isinstance(value, tuple) else [str(value)]
    return words


def how_many(count: int, noun: str) -> str:
    """A number and its noun: 1 drive, 2 drives."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
