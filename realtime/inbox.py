"""Packet filter: which of the cue packets that arrive are used; the others are counted by cause.

===========  ==========================================================================================
kind         cause
===========  ==========================================================================================
used         it is whole, new and in time
malformed    size, magic, version or checksum are wrong
not_finite   a NaN or an infinity
implausible  beyond the bounds of :class:`CueBounds`, or more than 10,000 numbers ahead
repeated     its number has arrived before
late         overtaken by a packet with a higher number
stale        delayed by more than ``stale`` beyond the quickest packet
foreign      from another sender than the first, or than the named peer
paused       the sender says that its drive is paused
===========  ==========================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ..envs.cues import GRAVITY
from ..envs.errors import DataError
from ..envs.settings import Positive, configuration
from .packets import Cues, Format

Address = tuple[str, int]
"""Host and port."""

KINDS: Final = (
    "used",
    "malformed",
    "not_finite",
    "implausible",
    "repeated",
    "late",
    "stale",
    "foreign",
    "paused",
)

_LARGEST_JUMP: Final = 10_000
"""Packets that may be lost in a row: 10 s at 1 kHz; the watchdog resets the filter after far less silence."""
_DRIFT: Final = 1e-3
"""Relative drift of the two clocks that is tolerated."""
_WINDOW: Final = 64
"""Numbers below the newest for which the window remembers whether they arrived."""


@configuration
class CueBounds:
    """Bounds of plausible cues; packets beyond them are not used.

    The defaults are for road cars, whose tires limit the horizontal force to about 10 m/s^2. Racing cars with
    downforce reach more. The vertical bound refuses senders that leave gravity out, give it the other sign,
    or send zeros from a menu: all differ by 9.81 m/s^2 or more. A car that flies over a crest does, too.

    Args:
        force: Largest horizontal specific force on an axis, m/s^2.
        vertical: Largest distance of the vertical specific force from that of a standing car, m/s^2.
        rate: Largest angular velocity about an axis, rad/s.
    """

    force: Positive = 30.0
    vertical: Positive = 9.0
    rate: Positive = 5.0

    def allow(self, force: Sequence[float], rate: Sequence[float]) -> bool:
        """Whether cues are within the bounds."""
        x, y, z = force
        return (
            max(abs(x), abs(y)) <= self.force
            and abs(z + GRAVITY) <= self.vertical
            and max(map(abs, rate)) <= self.rate
        )


ROAD_CAR: Final = CueBounds()


class SequenceWindow:
    """Sliding window over sequence numbers, as RFC 4303 keeps against replays.

    Args:
        jump: Greatest step ahead that is accepted.

    Attributes:
        lost: Numbers that were passed over and have not arrived since.
    """

    def __init__(self, jump: int) -> None:
        self._jump = jump
        self._first, self._newest = 0, -1
        self._seen = 0
        self.lost = 0

    def put(self, number: int) -> str:
        """Register a number; returns its kind: used, repeated, late or implausible."""
        if self._newest < 0:
            self._first, self._newest, self._seen = number, number, 1
            return "used"
        ahead = number - self._newest
        if ahead > self._jump:
            return "implausible"
        if ahead > 0:
            self._newest = number
            self._seen = ((self._seen << ahead) | 1) & (2**_WINDOW - 1) if ahead < _WINDOW else 1
            self.lost += ahead - 1
            return "used"
        if -ahead >= _WINDOW:
            return "late"
        if self._seen >> -ahead & 1:
            return "repeated"
        self._seen |= 1 << -ahead
        # Numbers before the first one were not passed over.
        self.lost -= number > self._first
        return "late"


class Inbox:
    """Sorts packets by kind, and keeps the newest cues.

    The delay of a packet is measured against the quickest one so far, so that the clocks need not agree.

    Args:
        form: Wire format.
        stale: Delay beyond the least one so far from which a packet is too old, s.
        gap: Longest time between packets without a gap, s.
        peer: The only sender to listen to, host and port; port 0 for any. None for whoever sends first.
        bounds: Of plausible cues.

    Attributes:
        counts: Packets by kind, see :data:`KINDS`.
        newest: Cues in use.
        paused: Whether a pause was the last that the sender said.
        arrival: When the newest cues, or the pause, arrived, s.
        sender: Of the newest cues.
    """

    def __init__(
        self,
        form: Format,
        stale: float,
        gap: float,
        peer: Address | None = None,
        bounds: CueBounds = ROAD_CAR,
    ) -> None:
        self._form, self._stale, self._gap, self._peer, self._bounds = form, stale, gap, peer, bounds
        self.counts = dict.fromkeys(KINDS, 0)
        self.newest: Cues | None = None
        self.paused = False
        self.arrival = -math.inf
        self.sender: Address | None = None
        self._since = self._last_checked = math.inf
        self._lost = 0
        self._window = SequenceWindow(_LARGEST_JUMP)
        self._least_delay = math.inf
        self._bound: Address | None = None

    def reset(self) -> None:
        """Accept any sender, sequence and clock again, after a long silence."""
        self._lost = self.lost
        self._window = SequenceWindow(_LARGEST_JUMP)
        self._least_delay, self._bound = math.inf, None

    @property
    def accepted(self) -> int:
        """Packets that were whole, new and in time."""
        return self.counts["used"] + self.counts["paused"]

    @property
    def lost(self) -> int:
        """Packets whose number was passed over."""
        return self._lost + self._window.lost

    def age(self, now: float) -> float:
        """Age of the newest cues, s; infinite before any."""
        return now - self.arrival

    @property
    def steady(self) -> float:
        """Time for which cues have arrived without a gap, s."""
        return self.arrival - self._since if self.newest is not None else 0.0

    def take(self, data: bytes, sender: Address, now: float) -> str:
        """Sort a datagram that arrives now, s; returns its kind, one of :data:`KINDS`."""
        kind = self._kind(data, sender, now)
        self.counts[kind] += 1
        return kind

    def _kind(self, data: bytes, sender: Address, now: float) -> str:
        if self._peer is not None:
            host, port = self._peer
            if sender[0] != host or port not in (0, sender[1]):
                return "foreign"
        elif self._bound not in (None, sender):
            return "foreign"
        try:
            cues = self._form.unpack_cues(data)
        except DataError:
            return "malformed"
        # The numbers of a pause mean nothing, but for its time.
        numbers = () if cues.paused else (*cues.force, *cues.rate, *cues.known)
        if not all(map(math.isfinite, (cues.time, *numbers))):
            return "not_finite"
        if not (cues.paused or self._bounds.allow(cues.force, cues.rate)):
            return "implausible"
        kind = self._window.put(cues.sequence)
        if kind != "used":
            return kind
        delay = now - cues.time
        self._least_delay = min(delay, self._least_delay + _DRIFT * max(now - self._last_checked, 0.0))
        self._last_checked = now
        if delay - self._least_delay > self._stale:
            return "stale"
        if not now - self.arrival <= self._gap:
            self._since = now
        self.arrival, self.sender, self._bound, self.paused = now, sender, sender, cues.paused
        if cues.paused:
            return "paused"
        self.newest = cues
        return "used"
