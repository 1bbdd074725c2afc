"""The test client of the controller: sends the cues of a drive in real time, and checks the set-points.

It can also impair the network: packets that are lost, repeated, delayed or broken, drawn from a seed.
"""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..envs.cues import CONTROLS, CueTrace
from ..envs.errors import ConfigurationError, DataError
from ..envs.platform import Platform, actuator_limits
from ..envs.platform.kernels import ACTUATORS
from ..envs.platform.machines import limits_exceeded
from ..envs.road import ROAD_TIMES, SLOWEST
from ..envs.task.knowledge import controls_of
from .inbox import Address
from .packets import NO_SEQUENCE, Controls, Cues, Format, Road, SetPoint
from .server import Endpoint
from .timing import Histogram, Pace
from .watchdog import State

Floats = NDArray[np.float64]

_DELAYS: Final = (0.0005, 0.05)
"""Shortest and longest delay of a late packet, s."""
_TOLERANCE: Final = 1e-6
"""Of each limit, relative; of a travel, of the whole stroke."""
_LISTED_FAULTS: Final = 5
"""Wrong set-points that are described; all are counted."""
_LATEST: Final = 1e10
"""Latest time that a clock may show, s: 300 years."""
_NS: Final = 1e-9


class NetworkFaults:
    """Impairs packets on their way to the controller.

    Args:
        drop: Share of the packets that are lost.
        repeat: Share that arrives twice.
        late: Share that is delayed by up to 50 ms.
        nan: Share with a NaN in it.
        seed: Of the draws.
    """

    def __init__(self, drop: float, repeat: float, late: float, nan: float, seed: int) -> None:
        for name, share in {"drop": drop, "repeat": repeat, "late": late, "nan": nan}.items():
            if not 0.0 <= share <= 1.0:
                raise ConfigurationError(f"--{name} must be a share from 0 to 1, found {share:g}")
        self._drop, self._repeat, self._late, self._nan = drop, repeat, late, nan
        self._random = np.random.default_rng(seed)
        self._queue: list[tuple[float, int, Cues]] = []

    def sent(self, cues: Cues, now: float) -> Iterator[Cues]:
        """The packets that leave now, s: these cues unless lost or delayed, and delayed ones that are due."""
        drop, repeat, late, nan = self._random.random(4)
        if nan < self._nan:
            cues = cues._replace(force=(math.nan, *cues.force[1:]))
        if drop >= self._drop:
            due = now
            if late < self._late:
                due += self._random.uniform(*_DELAYS)
            for copy in range(2 if repeat < self._repeat else 1):
                heapq.heappush(self._queue, (due, 2 * cues.sequence + copy, cues))
        while self._queue and self._queue[0][0] <= now:
            yield heapq.heappop(self._queue)[2]


class LimitCheck:
    """Holds set-points, and the change from one to the next, against the limits of the actuators.

    Args:
        platform: The machine.
        rate: Set-points a second.
    """

    def __init__(self, platform: Platform, rate: int) -> None:
        self._limits, self._rate = actuator_limits(platform), rate
        self._last: tuple[int, Floats] | None = None

    def __call__(self, setpoint: SetPoint) -> str:
        """The fault of a set-point in words; empty if there is none."""
        if not np.isfinite(setpoint.motion).all():
            return f"set-point {setpoint.sequence} is not finite"
        axes, legs = setpoint.part("position"), setpoint.part("legs")
        position = np.concatenate([axes[:2], legs, axes[8:]])
        axes, legs = setpoint.part("velocity"), setpoint.part("leg_rates")
        velocity = np.concatenate([axes[:2], legs, axes[8:]])
        acceleration = np.zeros(9)
        if self._last is not None and setpoint.sequence > self._last[0]:
            acceleration = (velocity - self._last[1]) * self._rate / (setpoint.sequence - self._last[0])
        self._last = setpoint.sequence, velocity
        exceeded = limits_exceeded(self._limits, position, velocity, acceleration, _TOLERANCE)
        for limit, flags in exceeded._asdict().items():
            if flags.any():
                name = ACTUATORS[int(np.argmax(flags))]
                return f"set-point {setpoint.sequence} exceeds the {limit} limit of {name}"
        return ""


class Client:
    """Sends cues to a controller, and checks the set-points that return.

    Args:
        endpoint: Of this side.
        to: Address of the controller.
        form: Wire format.
        platform: The machine, whose limits the set-points must keep.
        rate: Packets a second, and set-points that are expected.
        network: Impairs the packets.

    Attributes:
        counts: Set-points by kind.
        states: Set-points by state of the controller.
        timings: Histograms by name: "round_trip" from the sending of cues until the first set-point that
            they moved; "server" their time in the controller; "wake" how late a packet was sent.
        faults: The first few faults of set-points.
        pace: Of the packets.
        periods: In which packets were due.
        duration: Of the run, s.
        braking: Share of the run's set-points that came while the machine braked.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        to: Address,
        form: Format,
        platform: Platform,
        rate: int,
        network: NetworkFaults,
    ) -> None:
        self._endpoint, self._to, self._form, self._rate = endpoint, to, form, rate
        self._network, self._check = network, LimitCheck(platform, rate)
        kinds = ("received", "malformed", "foreign", "missing", "disordered", "outside_limits")
        self.counts = dict.fromkeys(kinds, 0)
        self.states = dict.fromkeys(State, 0)
        self.timings = {name: Histogram() for name in ("round_trip", "server", "wake")}
        self.faults: list[str] = []
        self.pace = Pace(rate)
        self.periods = 0
        self.duration = self.braking = 0.0
        self._last = -1
        self._echo = -1

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
            for packet in self._network.sent(item._replace(time=_NS * now), _NS * now):
                self._endpoint.send(self._form.pack_cues(packet), self._to)
            self.periods += 1
            pace.done()
        self.duration = _NS * (time.perf_counter_ns() - begin)
        self.braking = self.states[State.BRAKING] / max(self.counts["received"], 1)

    def listen(self, seconds: float) -> None:
        """Receive set-points for a while."""
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
        if setpoint.sequence <= self._last:
            self.counts["disordered"] += 1
            return
        if self._last >= 0:
            self.counts["missing"] += setpoint.sequence - self._last - 1
        self._last = setpoint.sequence
        fault = self._check(setpoint)
        if fault:
            self.counts["outside_limits"] += 1
            self.faults += [fault] if len(self.faults) < _LISTED_FAULTS else []
        if setpoint.echo not in (NO_SEQUENCE, self._echo):
            self._echo = setpoint.echo
            self.timings["round_trip"].add(now - round(1e9 * setpoint.echo_time))
            self.timings["server"].add(round(1e9 * (setpoint.sent - setpoint.received)))


def cues_at(trace: CueTrace, rate: int, times: int) -> Iterator[Cues]:
    """The cues of a drive, ``rate`` a second, ``times`` in a row; the sender fills in the time stamps."""
    trace = trace.resampled(1.0 / rate)
    forces, rates = trace.specific_force, trace.angular_velocity
    controls, roads = controls_sent(trace), roads_sent(trace)
    for k in range(len(trace) * times):
        row = k % len(trace)
        known = controls[row] if controls else None, roads[row] if roads else None
        yield Cues(k, math.nan, tuple(forces[row].tolist()), tuple(rates[row].tolist()), False, *known)


def controls_sent(trace: CueTrace) -> list[Controls]:
    """The controls of each sample of a drive; none where it has no steering wheel or pedals."""
    if any(name not in trace.channels for name in CONTROLS):
        return []
    return [Controls(*row) for row in np.column_stack(controls_of(trace)[:5]).tolist()]


def roads_sent(trace: CueTrace) -> list[Road]:
    """The road ahead of each sample of a drive; none where it has no speed or no road."""
    if trace.road is None or "speed_m_s" not in trace.channels:
        return []
    speed = np.maximum(trace.channels["speed_m_s"], SLOWEST)
    ahead = trace.road.ahead(speed[:, None] * np.array(ROAD_TIMES))
    rows = np.column_stack((ahead.stop_distance, *ahead[:4]))
    return [Road.of(row) for row in rows.tolist()]
