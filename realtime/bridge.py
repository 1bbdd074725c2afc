"""Bridge: telemetry of a simulator or game becomes the controller's cue packets.

What comes is sorted by kind:

==============  ====================================================================================
kind            cause
==============  ====================================================================================
used            a new frame of motion
foreign         none of the protocol: another size, mark, version or checksum
without_motion  of the protocol, but another of its packets
broken          an infinity, or a vector with a number missing
repeated        the frame before once more: the same stamp, or the same numbers of a car that moves
late            overtaken by a later frame
paused          the sender says that nobody drives: menu, pause, replay
==============  ====================================================================================

The drive is interrupted, and packets say "paused", while one of these holds, and for ``settle`` after it:

=========  =========================================================================================
kind       cause
=========  =========================================================================================
pauses     the sender says that nobody drives
frozen     no new frame for ``frozen``: a pause without a flag, or a game that has ended
jumps      position or velocity are not where the last ones lead: a teleport, or a reset of the car
restarts   the sender's clock runs backwards or jumps: another drive, or a rewind
off_pace   the sender's clock is slower or faster than time: slow motion
=========  =========================================================================================
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..envs.errors import DataError
from ..envs.settings import NonNegative, Positive, configuration
from ..envs.telemetry import CueEstimator, MotionCheck, Sample, Source
from ..evaluation.results import Headed
from .inbox import Address
from .machine import AT_REST
from .packets import Cues, Format
from .resampling import Resampler, SteadyClock
from .server import Endpoint
from .timing import Pace

Floats = NDArray[np.float64]

KINDS: Final = ("used", "foreign", "without_motion", "broken", "repeated", "late", "paused")
INTERRUPTIONS: Final = ("pauses", "frozen", "jumps", "restarts", "off_pace")
_NS: Final = 1e-9
_ASK_NS: Final = 2_000_000_000
"""Time between two requests to a simulator, ns."""
_LATE_S: Final = 0.5
"""A frame further back than this begins another drive, s."""
_CHANGE: Final = (10.0, 150.0)
"""A velocity that changes by more than this, m/s, and this a second, m/s^2, is another car's."""
_SLEW: Final = 0.01
"""Share by which the time of the cues may run faster or slower than time, to follow the sender's clock."""
_DRIFT: Final = 1e-3
"""Relative drift of the two clocks that is tolerated."""
_PACE: Final = (0.05, 0.1)
"""The sender's clock may be off by so many seconds, and this share of the time it was watched."""


@configuration
class BridgeOptions:
    """How telemetry becomes cues.

    Args:
        smoothing: Half of the smoothing spline's width, 1 to 3 frames of the game. Cues are late by it.
        margin: Time for which a frame that is late on its way is waited for, s.
        frozen: Time without a new frame after which the drive counts as paused, s.
        settle: Time for which telemetry must have come without a fault before it is followed again, s.
        teleport: Distance from where the velocity leads, beyond which the car was moved, m.
        reverse: Cues whose sign is changed, as the check at the end suggests.
    """

    smoothing: Annotated[int, Field(ge=1, le=3)] = 2
    margin: NonNegative = 0.005
    frozen: Positive = 0.25
    settle: NonNegative = 0.5
    teleport: Positive = 3.0
    reverse: tuple[Literal["f_x", "f_y", "w_x", "w_y", "w_z"], ...] = ()


class Bridge:
    """Takes datagrams of telemetry, and gives cues at any time.

    Args:
        source: The protocol.
        options: How it becomes cues.

    Attributes:
        source: The same.
        counts: Datagrams by kind, see :data:`KINDS`.
        interruptions: By kind, see :data:`INTERRUPTIONS`.
        refused: Why the first foreign datagram was refused; empty if none was.
        check: Whether the cues follow speed and course.
        begun: Whether any telemetry has come.
        follows: Whether the drive goes on.
    """

    def __init__(self, source: Source, options: BridgeOptions | None = None) -> None:
        self.source, self._options = source, options or BridgeOptions()
        self.counts = dict.fromkeys(KINDS, 0)
        self.interruptions = dict.fromkeys(INTERRUPTIONS, 0)
        self.refused = ""
        self.begun = self.follows = False
        self.check = MotionCheck()
        names = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
        self._signs = np.where([name in self._options.reverse for name in names], -1.0, 1.0)
        self._estimator, self._clock = CueEstimator(), SteadyClock(source.tick)
        self._resampler = Resampler(self._options.smoothing)
        self._sequence = 0
        self._given = AT_REST
        self._turns = 0
        self._said_paused = False
        self._last: Sample | None = None
        self._data = b""
        self._least = self._offset = math.inf
        self._arrived = -math.inf
        self._restart()

    @property
    def rate(self) -> float:
        """Frames a second."""
        return 1.0 / self._resampler.step if self._resampler.step else 0.0

    @property
    def delay(self) -> float:
        """How much later than the game the cues are, s, besides the way of the datagrams."""
        return self._resampler.delay + self._options.margin

    def take(self, data: bytes, now: float) -> str:
        """Sort a datagram that arrives now, s; returns its kind, one of :data:`KINDS`."""
        kind = self._kind(data, now)
        self.counts[kind] += 1
        return kind

    def cues(self, now: float) -> Cues:
        """The next packet of cues, at the time now, s."""
        if self.follows:
            time = now - self._offset
            if time - self._resampler.newest > self._options.frozen:
                self._interrupt("frozen")
            else:
                self._given = self._resampler.at(time - self.delay)
        force, rate = self._given[:3].tolist(), self._given[3:].tolist()
        cues = Cues(self._sequence, now, tuple(force), tuple(rate), not self.follows)
        self._sequence += 1
        return cues

    def _kind(self, data: bytes, now: float) -> str:
        try:
            sample = self.source.parse(data)
        except DataError as error:
            self.refused = self.refused or str(error)
            return "foreign"
        if sample is None:
            return "without_motion"
        self.begun = True
        if sample.broken:
            return "broken"
        if sample.paused is not None:
            self._pause(sample.paused)
        if sample.paused:
            return "paused"
        if not sample.moves:
            return "without_motion"
        copy, self._data = data == self._data, data
        stamp = self._stamp(sample, now)
        last = self._last
        if copy or (last is not None and _same(last, sample)):
            return "repeated"
        if last is not None and stamp <= last.time:
            if last.time - stamp < _LATE_S:
                return "repeated" if stamp == last.time else "late"
            self._interrupt("restarts")
        self._frame(replace(sample, time=stamp), now)
        return "used"

    def _stamp(self, sample: Sample, now: float) -> float:
        """The sender's time without its wraps, s; that of the arrival where it has no clock."""
        if math.isnan(sample.time):
            return now
        period, last = self.source.period, self._last
        stamp = sample.time
        if math.isfinite(period):
            stamp += self._turns * period
            if last is not None and stamp < last.time - 0.5 * period:
                self._turns += 1
                stamp += period
        return stamp

    def _pause(self, paused: bool) -> None:
        if paused and not self._said_paused:
            self._interrupt("pauses")
        self._said_paused = paused

    def _frame(self, sample: Sample, now: float) -> None:
        """Take a new frame in."""
        last = self._last
        if last is not None and self._led_elsewhere(last, sample, now):
            last = None
        if last is None:
            self._estimator.reset()
            self.check.reset()
        self._last = sample
        time = self._clock(sample.time)
        cues = self._estimator(sample)
        self._arrivals(time, now)
        if cues is not None and np.isfinite(cues).all():
            self.check.add(sample, cues)
            self._resampler.add(time, cues * self._signs)

    def _led_elsewhere(self, last: Sample, sample: Sample, now: float) -> bool:
        """Whether the car is not where the last frame leads; the drive is then interrupted."""
        step = sample.time - last.time
        change = float(np.linalg.norm(sample.velocity - last.velocity))
        if step > self._options.frozen:
            if self.follows:
                self._interrupt("restarts" if now - self._arrived < 0.5 * step else "frozen")
            self._restart()
        elif change > _CHANGE[0] + _CHANGE[1] * step:
            self._interrupt("jumps")
        else:
            moved = 0.5 * step * (last.velocity + sample.velocity)
            missed = np.linalg.norm(sample.position - last.position - moved)
            # A game may take position and stamp at different moments of a frame.
            if not missed > self._options.teleport + 0.5 * np.linalg.norm(moved):
                return False
            self._interrupt("jumps")
        return True

    def _arrivals(self, time: float, now: float) -> None:
        """Follow the sender's clock: its offset to the arrivals is that of the quickest datagrams."""
        offset = now - time
        if math.isinf(self._least):
            self._least = self._offset = offset
            self._since = (time, now)
        elapsed = max(now - self._arrived, 0.0)
        self._arrived = now
        self._least = min(offset, self._least + _DRIFT * elapsed)
        bound = _SLEW * elapsed if self.follows else math.inf
        self._offset += min(max(self._least - self._offset, -bound), bound)
        watched = now - self._since[1]
        off = abs(watched - (time - self._since[0]))
        if not self.follows and watched >= self._options.settle:
            if off > _PACE[0] + _PACE[1] * watched:
                self._interrupt("off_pace")
            else:
                self.follows = not self._said_paused

    def _interrupt(self, kind: str) -> None:
        """The drive does not go on; what was before is forgotten."""
        self.interruptions[kind] += 1
        self._least = self._offset = math.inf
        self._arrived = -math.inf
        self._restart()

    def _restart(self) -> None:
        self.follows = False
        self._last = None
        self._estimator.reset()
        self._clock.reset()
        self._resampler.reset()
        self.check.reset()
        self._least, self._offset, self._arrived = math.inf, 0.0, -math.inf
        self._since = (0.0, 0.0)


def _same(last: Sample, sample: Sample) -> bool:
    """Whether a sample of a car that moves has the numbers of the one before."""
    parts = ("force", "acceleration", "rate", "velocity", "position")
    equal = all(np.array_equal(getattr(last, p), getattr(sample, p), equal_nan=True) for p in parts)
    resting = np.nan_to_num(np.concatenate([sample.rate, sample.velocity]))
    return equal and bool(np.any(resting != 0.0))


class BridgeLoop:
    """Runs a bridge in real time: a packet of cues each period, datagrams received in between.

    Args:
        bridge: The bridge.
        inlet: Where telemetry arrives.
        outlet: Sends cues, and receives the controller's set-points.
        to: Address of the controller.
        form: Wire format of the cues.
        rate: Packets a second.
        record: Takes each datagram that arrives.
        simulator: Address for the protocol's requests, sent every two seconds; None for none.

    Attributes:
        sent: Packets of cues.
        setpoints: Set-points that came back.
        pace: Of the packets.
        duration: Of the run, s.
    """

    def __init__(
        self,
        bridge: Bridge,
        inlet: Endpoint,
        outlet: Endpoint,
        to: Address,
        form: Format,
        rate: int,
        record: Callable[[bytes], object] | None = None,
        simulator: tuple[Address, Sequence[bytes]] | None = None,
    ) -> None:
        self._bridge, self._inlet, self._outlet, self._to = bridge, inlet, outlet, to
        self._form, self._rate, self._record, self._simulator = form, rate, record, simulator
        self.sent = self.setpoints = 0
        self.pace = Pace(rate)
        self.duration = 0.0

    def run(self, ends: Callable[[float], bool]) -> None:
        """Run until ``ends``, which is called with the seconds since the begin, says so."""
        self.pace = pace = Pace(self._rate)
        begin = asked = time.perf_counter_ns()
        while not ends(self.duration):
            if self._simulator is not None and asked <= time.perf_counter_ns():
                address, requests = self._simulator
                for request in requests:
                    self._inlet.send(request, address)
                asked += _ASK_NS
            self._inlet.listen(pace.deadline, self._take)
            self._outlet.listen(pace.deadline, self._count)
            now = time.perf_counter_ns()
            if self._bridge.begun:
                self._outlet.send(self._form.pack_cues(self._bridge.cues(_NS * now)), self._to)
                self.sent += 1
            pace.done()
            self.duration = _NS * (now - begin)

    def _take(self, data: bytes, sender: Address, now: int) -> None:
        if self._record is not None:
            self._record(data)
        self._bridge.take(data, _NS * now)

    def _count(self, data: bytes, sender: Address, now: int) -> None:
        self.setpoints += sender == self._to


@configuration
class BridgeReport(Headed):
    """A run of the bridge.

    Args:
        source: Name of the protocol.
        duration: s.
        packets: Datagrams of telemetry by kind, see :data:`KINDS`.
        interruptions: By kind, see :data:`INTERRUPTIONS`.
        refused: Why the first foreign datagram was refused; empty if none was.
        frames: Of the game, a second.
        delay: How much later than the game the cues were, s.
        slopes: Of f_x on dv/dt, f_y on v r, and the yaw rate on that of the course; 1 where all is well.
        doubts: What the slopes say against the cues.
        sent: Packets of cues.
        late: Periods that were not over when the next should have begun, and those left out.
        setpoints: That came back from the controller.
    """

    what = "the report of a bridge"
    version = 1

    source: str
    duration: float
    packets: dict[str, int]
    interruptions: dict[str, int]
    refused: str
    frames: float
    delay: float
    slopes: dict[str, float]
    doubts: tuple[str, ...]
    sent: int
    late: int
    setpoints: int

    @classmethod
    def of(cls, words: Sequence[str], bridge: Bridge, loop: BridgeLoop) -> BridgeReport:
        """The report of a run."""
        return cls(
            **cls.head(words),
            source=bridge.source.name,
            duration=loop.duration,
            packets=bridge.counts,
            interruptions=bridge.interruptions,
            refused=bridge.refused,
            frames=bridge.rate,
            delay=bridge.delay,
            slopes=bridge.check.slopes(),
            doubts=tuple(bridge.check.doubts()),
            sent=loop.sent,
            late=loop.pace.overrun + loop.pace.skipped,
            setpoints=loop.setpoints,
        )

    def lines(self) -> list[str]:
        """For people; zeros are not shown."""

        def shown(counts: Mapping[str, int]) -> str:
            return ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in counts.items() if n) or "none"

        slopes = ", ".join(f"{name} {slope:.2f}" for name, slope in self.slopes.items())
        lines = [
            f"datagrams      {shown(self.packets)}",
            f"interruptions  {shown(self.interruptions)}",
            f"telemetry      {self.frames:.1f} frames a second; cues are {1e3 * self.delay:.0f} ms late",
            f"slopes         {slopes or 'too little driven with a velocity to check'}",
            f"cues           {self.sent} packets in {self.duration:.1f} s, {self.late} late",
            f"set-points     {self.setpoints}",
        ]
        lines += [f"refused        {self.refused}"] if self.refused else []
        return [*lines, *(f"check          {doubt}" for doubt in self.doubts)]
