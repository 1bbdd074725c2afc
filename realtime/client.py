"""What a network does to packets: loses, repeats, delays and breaks some; drawn from a seed."""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError, DataError
from ..envs.platform import Platform, actuator_limits
from ..envs.platform.kernels import ACTUATORS
from .inbox import Address
from .packets import NO_SEQUENCE, Cues, Format, SetPoint
from .server import Endpoint
from .timing import Histogram, Pace
from .watchdog import State

_DELAYS = (0.0005, 0.05)
"""Shortest and longest delay of a late packet, s."""


class Trouble:
    """Turns the cues that should be sent into what is sent, and when.

    Args:
        drop: Share of the packets that are lost.
        repeat: Share that comes twice.
        late: Share that comes up to 50 ms later than it should.
        nan: Share with a NaN in it.
        seed: Of the draws.
    """

    def __init__(self, drop: float, repeat: float, late: float, nan: float, seed: int) -> None:
        for name, share in {"drop": drop, "repeat": repeat, "late": late, "nan": nan}.items():
            if not 0.0 <= share <= 1.0:
                raise ConfigurationError(f"--{name} must be a share from 0 to 1, found {share:g}")
        self._drop, self._repeat, self._late, self._nan = drop, repeat, late, nan
        self._random = np.random.default_rng(seed)
        self._held: list[tuple[float, int, Cues]] = []

    def sent(self, cues: Cues, now: float) -> Iterator[Cues]:
        """What goes out now, s: the cues, unless something happens to them, and those that were held back."""
        drop, repeat, late, nan = self._random.random(4)
        if nan < self._nan:
            cues = cues._replace(force=(math.nan, *cues.force[1:]))
        if drop >= self._drop:
            due = now
            if late < self._late:
                due += self._random.uniform(*_DELAYS)
            copies = 2 if repeat < self._repeat else 1
            for copy in range(copies):
                heapq.heappush(self._held, (due, 2 * cues.sequence + copy, cues))
        while self._held and self._held[0][0] <= now:
            yield heapq.heappop(self._held)[2]


# Whether set-points keep a machine's limits: position, velocity and acceleration of every actuator.


Floats = NDArray[np.float64]

_TOLERANCE = 1e-6
"""Of each limit, relative; of a travel, of the whole stroke."""
_UNLIMITED = 1e3
"""Stroke that is taken for the tolerance where there is none, rad."""


class LimitCheck:
    """Holds each set-point, and what lies between two, against the limits.

    Args:
        platform: The machine.
        rate: Set-points a second.
    """

    def __init__(self, platform: Platform, rate: int) -> None:
        limits = actuator_limits(platform)
        slack = _TOLERANCE * np.minimum(limits["position_max"] - limits["position_min"], _UNLIMITED)
        self._low, self._high = limits["position_min"] - slack, limits["position_max"] + slack
        self._velocity = limits["velocity"] * (1.0 + _TOLERANCE)
        self._acceleration = limits["acceleration"] * (1.0 + _TOLERANCE)
        self._rate = rate
        self._before: tuple[int, Floats] | None = None

    def __call__(self, setpoint: SetPoint) -> str:
        """What is wrong with a set-point, in words; nothing if nothing is."""
        position = _actuators(setpoint.part("position"), setpoint.part("legs"))
        velocity = _actuators(setpoint.part("velocity"), setpoint.part("leg_rates"))
        if not np.isfinite(setpoint.motion).all():
            return f"set-point {setpoint.sequence} is not finite"
        wrong = self._wrong("position", (position < self._low) | (position > self._high))
        wrong = wrong or self._wrong("velocity", np.abs(velocity) > self._velocity)
        if self._before is not None and setpoint.sequence > self._before[0]:
            change = (velocity - self._before[1]) * self._rate / (setpoint.sequence - self._before[0])
            wrong = wrong or self._wrong("acceleration", np.abs(change) > self._acceleration)
        self._before = setpoint.sequence, velocity
        return f"set-point {setpoint.sequence} exceeds the {wrong}" if wrong else ""

    def _wrong(self, what: str, beyond: NDArray[np.bool_]) -> str:
        return f"{what} limit of {ACTUATORS[int(np.argmax(beyond))]}" if beyond.any() else ""


def _actuators(axes: Floats, legs: Floats) -> Floats:
    """(9,) values of the actuators, of those of axes and legs."""
    return np.concatenate([axes[:2], legs, axes[8:]])


# The other side of the controller: sends a drive's cues in real time, and looks at what comes back.


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
