"""Where a packet stands among those that came: new, repeated, late or beyond belief."""

from __future__ import annotations

from enum import Enum
from typing import Final

_WIDTH: Final = 64
"""Numbers below the newest of which is known whether they came."""


class Place(Enum):
    """Where a number stands among those that came."""

    NEW = "used"
    """Beyond all others."""
    REPEATED = "repeated"
    """It has come before."""
    LATE = "late"
    """Overtaken by a newer one."""
    LEAPT = "leapt"
    """So far ahead that it cannot be right."""


class SequenceWindow:
    """Remembers which sequence numbers came, as RFC 4303 does against replays.

    Args:
        leap: Greatest step ahead that is believed.

    Attributes:
        lost: Numbers passed over that have not come since.
    """

    def __init__(self, leap: int) -> None:
        self._leap = leap
        self._first, self._newest = 0, -1
        self._seen = 0
        self.lost = 0

    def put(self, number: int) -> Place:
        """Say where a number stands, and remember it."""
        if self._newest < 0:
            self._first, self._newest, self._seen = number, number, 1
            return Place.NEW
        ahead = number - self._newest
        if ahead > self._leap:
            return Place.LEAPT
        if ahead > 0:
            self._newest = number
            self._seen = ((self._seen << ahead) | 1) & (2**_WIDTH - 1) if ahead < _WIDTH else 1
            self.lost += ahead - 1
            return Place.NEW
        return self._behind(number, -ahead)

    def _behind(self, number: int, behind: int) -> Place:
        if behind >= _WIDTH:
            return Place.LATE
        if self._seen >> behind & 1:
            return Place.REPEATED
        self._seen |= 1 << behind
        # Numbers before the first that came were not passed over.
        self.lost -= number > self._first
        return Place.LATE
