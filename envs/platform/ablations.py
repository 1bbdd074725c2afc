"""Machines with a subsystem locked: what does each of them buy?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

from .machines import Platform


def _without_turntable(platform: Platform) -> Platform | None:
    return platform.without_turntable() if platform.turntable else None


def _without_carriage(platform: Platform) -> Platform | None:
    return platform.without_carriage() if platform.carriage else None


def _hexapod_only(platform: Platform) -> Platform | None:
    if platform.turntable is None or platform.carriage is None:
        return None
    return platform.without_turntable().without_carriage()


ABLATIONS: Final[Mapping[str, Callable[[Platform], Platform | None]]] = {
    "no-turntable": _without_turntable,
    "no-carriage": _without_carriage,
    "hexapod-only": _hexapod_only,
}
"""What is left of a machine by the end of its name; None where it never had the subsystem."""

_LEFT: Final = {
    "no-turntable": "its turntable locked",
    "no-carriage": "its carriage locked",
    "hexapod-only": "turntable and carriage locked",
}


def ablations(platform: Platform) -> list[Platform]:
    """The machine without turntable, without carriage and with the hexapod alone, as far as it has them.

    The names are the machine's with -no-turntable, -no-carriage and -hexapod-only at the end.
    """
    found = []
    for suffix, take in ABLATIONS.items():
        left = take(platform)
        if left is not None:
            about = f"{platform.name} with {_LEFT[suffix]}"
            found.append(replace(left, name=f"{platform.name}-{suffix}", description=about))
    return found
