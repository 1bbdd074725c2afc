"""The other side of the controller: sends a drive's cues in real time, and looks at what comes back."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Final

from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.platform import Platform
from .endpoint import Endpoint
from .histogram import Histogram
from .inbox import Address
from .limit_check import LimitCheck
from .pacing import Pace
from .packets import NO_SEQUENCE, Cues, Format, SetPoint
from .trouble import Trouble
from .watchdog import State

_NS: Final = 1e-9
_MOST_FAULTS: Final = 5
"""Wrong set-points that are told; all are counted."""
_LATEST: Final = 1e10
"""No clock shows more, s: that are 300 years."""


class Client:
    """Drives a controller through cues.

    Args:
        endpoint: Of this side.
        to: The controller.
        form: How packets are written.
        platform: The machine, whose limits the set-points must keep.
        rate: Packets a second, and set-points that are expected.
        trouble: What happens to packets on the way.

    Attributes:
        counts: Set-points by what was found.
        states: Set-points by state of the controller.
        timings: By name: "round_trip" from the sending of cues until the first set-point that knows of them;
            "server" their time in the controller; "wake" how late a packet was sent.
        faults: The first of what was wrong with set-points.
        pace: Of the packets.
        periods: In which packets were due.
        duration: Of the run, s.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        to: Address,
        form: Format,
        platform: Platform,
        rate: int,
        trouble: Trouble,
    ) -> None:
        self._endpoint, self._to, self._form, self._rate = endpoint, to, form, rate
        self._trouble, self._check = trouble, LimitCheck(platform, rate)
        kinds = ("received", "malformed", "foreign", "missing", "disordered", "outside_limits")
        self.counts = dict.fromkeys(kinds, 0)
        self.states = dict.fromkeys(State, 0)
        self.timings = {name: Histogram() for name in ("round_trip", "server", "wake")}
        self.faults: list[str] = []
        self.pace = Pace(rate)
        self.periods = 0
        self.duration = 0.0
        self._last = -1
        self._echoed = -1

    def run(self, cues: Iterator[Cues], stops: Callable[[], bool]) -> None:
        """Send cues, one a period, until there are no more or ``stops`` says so."""
        self.pace = pace = Pace(self._rate)
        begin = time.perf_counter_ns()
        for item in cues:
            self._endpoint.listen(pace.deadline, self._take)
            if stops():
                break
            now = time.perf_counter_ns()
            self.timings["wake"].add(now - pace.deadline)
            for packet in self._trouble.sent(item._replace(time=_NS * now), _NS * now):
                self._endpoint.send(self._form.pack_cues(packet), self._to)
            self.periods += 1
            pace.done()
        self.duration = _NS * (time.perf_counter_ns() - begin)

    def listen(self, seconds: float) -> None:
        """Go on listening."""
        self._endpoint.listen(time.perf_counter_ns() + round(1e9 * seconds), self._take)

    def _take(self, data: bytes, sender: Address, now: int) -> None:
        if sender != self._to:
            self.counts["foreign"] += 1
            return
        try:
            setpoint = self._form.unpack_setpoint(data)
        except DataError:
            self.counts["malformed"] += 1
            return
        if not all(abs(stamp) <= _LATEST for stamp in (setpoint.echo_time, setpoint.received, setpoint.sent)):
            self.counts["malformed"] += 1
            return
        self.counts["received"] += 1
        self.states[setpoint.state] += 1
        self._look_at(setpoint, now)

    def _look_at(self, setpoint: SetPoint, now: int) -> None:
        if setpoint.sequence <= self._last:
            self.counts["disordered"] += 1
            return
        if self._last >= 0:
            self.counts["missing"] += setpoint.sequence - self._last - 1
        self._last = setpoint.sequence
        wrong = self._check(setpoint)
        if wrong:
            self.counts["outside_limits"] += 1
            self.faults += [wrong] if len(self.faults) < _MOST_FAULTS else []
        if setpoint.echo not in (NO_SEQUENCE, self._echoed):
            self._echoed = setpoint.echo
            self.timings["round_trip"].add(now - round(1e9 * setpoint.echo_time))
            self.timings["server"].add(round(1e9 * (setpoint.sent - setpoint.received)))


def cues_at(trace: CueTrace, rate: int, times: int) -> Iterator[Cues]:
    """The cues of a drive, ``rate`` a second, over and over; their time stamps are to be filled in."""
    trace = trace.resampled(1.0 / rate)
    forces, rates = trace.specific_force, trace.angular_velocity
    for k in range(len(trace) * times):
        force, rate_now = forces[k % len(trace)].tolist(), rates[k % len(trace)].tolist()
        yield Cues(k, math.nan, tuple(force), tuple(rate_now))
