"""Where a packet stands among those that came: new, repeated, late or beyond belief."""

from __future__ import annotations

import math
from enum import Enum
from typing import Final

from ..envs.errors import DataError
from .packets import Cues, Format

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


# Which of the packets that come are used: those that are whole, new, in time, and from whom we listen to.


Address = tuple[str, int]

KINDS: Final = ("used", "malformed", "not_finite", "implausible", "repeated", "late", "stale", "foreign")
"""What becomes of a packet that comes."""

_LARGEST_FORCE: Final = 1000.0
"""More than any car does, m/s^2; the same for a file of cues."""
_LARGEST_RATE: Final = 100.0
"""More than any car does, rad/s."""
_LARGEST_LEAP: Final = 10_000
"""Packets that may be lost in one go: 10 s of them, and far less silence renews the whole."""
_DRIFT: Final = 1e-3
"""How much faster one clock may run than the other."""


class Inbox:
    """Sorts packets, and keeps the newest cues.

    Args:
        form: How packets are written.
        stale: Delay beyond the least seen from which a packet is too old, s.
        gap: Longest time between packets that come without a gap, s.
        peer: Host and port to listen to alone; port 0 for any. None for whoever comes first.

    Attributes:
        counts: Packets by kind, those of :data:`KINDS`; a lost one comes too late to count, or never.
        newest: Cues in use.
        arrival: When they came, s.
        sender: Of the newest cues.
    """

    def __init__(self, form: Format, stale: float, gap: float, peer: Address | None = None) -> None:
        self._form, self._stale, self._gap, self._peer = form, stale, gap, peer
        self.counts = dict.fromkeys(KINDS, 0)
        self.newest: Cues | None = None
        self.arrival = -math.inf
        self.sender: Address | None = None
        self._since = math.inf
        self._lost = 0
        self._window = SequenceWindow(_LARGEST_LEAP)
        self._offset, self._looked = math.inf, math.inf
        self._bound: Address | None = None

    def renew(self) -> None:
        """Listen to anyone again, with any sequence and any clock: the sender has been silent for long."""
        self._lost = self.lost
        self._window = SequenceWindow(_LARGEST_LEAP)
        self._offset, self._bound = math.inf, None

    @property
    def lost(self) -> int:
        """Packets whose number was passed over."""
        return self._lost + self._window.lost

    def age(self, now: float) -> float:
        """Of the newest cues, s; infinite before any."""
        return now - self.arrival

    @property
    def steady(self) -> float:
        """How long cues have come without a gap, s."""
        return self.arrival - self._since if self.newest is not None else 0.0

    def take(self, data: bytes, sender: Address, now: float) -> str:
        """Look at a datagram; returns what became of it, one of :data:`KINDS`."""
        kind = self._sorted(data, sender, now)
        self.counts[kind] += 1
        return kind

    def _sorted(self, data: bytes, sender: Address, now: float) -> str:
        if not self._listens_to(sender):
            return "foreign"
        try:
            cues = self._form.unpack_cues(data)
        except DataError:
            return "malformed"
        numbers = (cues.time, *cues.force, *cues.rate)
        if not all(map(math.isfinite, numbers)):
            return "not_finite"
        if max(map(abs, cues.force)) > _LARGEST_FORCE or max(map(abs, cues.rate)) > _LARGEST_RATE:
            return "implausible"
        return self._placed(cues, sender, now)

    def _placed(self, cues: Cues, sender: Address, now: float) -> str:
        place = self._window.put(cues.sequence)
        if place is Place.LEAPT:
            return "implausible"
        if place is not Place.NEW:
            return str(place.value)
        offset = now - cues.time
        self._offset = min(offset, self._offset + _DRIFT * max(now - self._looked, 0.0))
        self._looked = now
        if offset - self._offset > self._stale:
            return "stale"
        if not now - self.arrival <= self._gap:
            self._since = now
        self.newest, self.arrival, self.sender = cues, now, sender
        self._bound = sender
        return "used"

    def _listens_to(self, sender: Address) -> bool:
        if self._peer is not None:
            host, port = self._peer
            return sender[0] == host and port in (0, sender[1])
        return self._bound is None or sender == self._bound
