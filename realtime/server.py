"""The controller in real time over UDP: a period a millisecond, packets received in between.

Times of a report, each as a histogram:

========  ============================  =================================================================
time      from                          to
========  ============================  =================================================================
latency   cues arrive                   the first set-point that they moved is sent
interval  a set-point is sent           the next one is; the deviation from the period: jitter
wake      a period should begin         it begins
period    it begins                     its set-point is sent
decision  a time step begins            policy and machine have taken it
========  ============================  =================================================================
"""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from ..envs.errors import ConfigurationError
from .controller import Controller
from .inbox import Address
from .packets import LARGEST, NO_SEQUENCE, Format, SetPoint
from .timing import Histogram, Pace

_SPIN: Final = 100_000
"""Time before a deadline in which the socket is polled, ns: the system does not wake a process so exactly."""

_LATE_DATAGRAMS: Final = 32
"""Most datagrams received after the deadline: a flood must not stop the clock."""

_NS: Final = 1e-9


class Endpoint:
    """A UDP socket that receives until a deadline; a datagram that the network refuses is lost.

    Args:
        address: Host and port to bind; port 0 for any that is free.

    Attributes:
        address: Host and port it is bound to.
        unsent: Datagrams that the network refused.

    Raises:
        ConfigurationError: the address is not one of this computer, or taken.
    """

    def __init__(self, address: Address) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(address)
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise ConfigurationError(
                f"{address[0]}:{address[1]} cannot be listened at ({error}); name another host or port"
            ) from None
        self._socket.setblocking(False)
        self.address: Address = self._socket.getsockname()
        self.unsent = 0

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def send(self, data: bytes, to: Address) -> None:
        """Send a datagram."""
        try:
            self._socket.sendto(data, to)
        except OSError:
            self.unsent += 1

    def listen(
        self,
        deadline: int,
        take: Callable[[bytes, Address, int], object],
        clock: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        """Receive until a deadline; after it, at most 32 datagrams that have arrived already.

        Args:
            deadline: Of the clock, ns.
            take: Called with each datagram, its sender and its arrival, ns.
            clock: Nanoseconds now.
        """
        late = 0
        while True:
            now = clock()
            try:
                data, sender = self._socket.recvfrom(LARGEST + 1)
            except OSError:
                if now >= deadline:
                    return
                if deadline - now > _SPIN:
                    select.select([self._socket], [], [], 1e-9 * (deadline - now - _SPIN))
                continue
            take(data, sender, now)
            late += now >= deadline
            if late >= _LATE_DATAGRAMS:
                return


def address_of(text: str, port: int) -> Address:
    """Host and port of ``HOST`` or ``HOST:PORT``.

    Args:
        text: A name or IPv4 address.
        port: Default.

    Raises:
        ConfigurationError: the host is missing or unknown, or the port is no number from 0 to 65535.
    """
    host, colon, digits = text.partition(":")
    if colon and not (digits.isascii() and digits.isdigit()):
        raise ConfigurationError(f"{text}: a port is a number, as in 127.0.0.1:{port}")
    if not host:
        # The system would take it for 0.0.0.0, every address of this machine.
        raise ConfigurationError(f"{text!r}: name a host, as in 127.0.0.1:{port}")
    number = int(digits) if colon else port
    if number > 65535:
        raise ConfigurationError(f"{text}: a port is at most 65535")
    try:
        return socket.gethostbyname(host), number
    except (OSError, UnicodeError):
        raise ConfigurationError(f"{text}: there is no host {host!r}") from None


def is_loopback(address: Address) -> bool:
    """Whether only programs of this machine reach an address."""
    return ipaddress.ip_address(address[0]).is_loopback


class Receiver(Protocol):
    """Writes set-points for another receiver, as :class:`~.outputs.Output` does."""

    @property
    def every(self) -> int:
        """Set-points from one datagram to the next."""
        ...

    def datagram(self, setpoint: SetPoint) -> bytes:
        """The datagram of a set-point."""
        ...


class Server:
    """Runs a controller at absolute deadlines.

    Args:
        controller: The controller.
        endpoint: Receives cues, and sends set-points to the sender of the newest.
        form: Wire format.
        rate: Periods a second.
        lead: Time before its first period at which a time step is decided, s; at most a period.
        clock: Nanoseconds now, as of the endpoint.
        outputs: Other receivers of the set-points, with the address of each.

    Attributes:
        timings: Histograms by name, see the table of the module.
        pace: Of the periods.
        duration: Of the run, s.
    """

    def __init__(
        self,
        controller: Controller,
        endpoint: Endpoint,
        form: Format,
        rate: int,
        lead: float,
        clock: Callable[[], int] = time.perf_counter_ns,
        outputs: Sequence[tuple[Receiver, Address]] = (),
    ) -> None:
        self._outputs = outputs
        self._controller, self._endpoint, self._form, self._rate = controller, endpoint, form, rate
        self._clock = clock
        self._lead = round(1e9 * min(lead, 1.0 / rate))
        names = ("latency", "wake", "interval", "period", "decision")
        self.timings = {name: Histogram() for name in names}
        self.pace = Pace(rate, clock)
        self.duration = 0.0
        self._sent = 0
        self._answered = NO_SEQUENCE

    def run(self, ends: Callable[[float], bool]) -> None:
        """Run until the controller was stopped and has returned to neutral.

        Args:
            ends: Called before each time step with the seconds since the begin; whether to stop.
        """
        controller, clock = self._controller, self._clock
        self.pace = pace = Pace(self._rate, clock)
        begin = clock()
        while not controller.finished:
            if controller.decides:
                self._endpoint.listen(pace.deadline - self._lead, self._take)
                if ends(_NS * (clock() - begin)):
                    controller.stop()
                began = clock()
                controller.decide(_NS * began)
                self.timings["decision"].add(clock() - began)
            self._endpoint.listen(pace.deadline, self._take)
            self._period(pace.deadline)
            pace.done()
        self.duration = _NS * (clock() - begin)

    def _take(self, data: bytes, sender: Address, now: int) -> None:
        self._controller.inbox.take(data, sender, _NS * now)

    def _period(self, deadline: int) -> None:
        began = self._clock()
        setpoint = self._controller.period(_NS * began)
        sender = self._controller.inbox.sender
        if sender is not None:
            self._endpoint.send(self._form.pack_setpoint(setpoint), sender)
        for output, address in self._outputs:
            if setpoint.sequence % output.every == 0:
                self._endpoint.send(output.datagram(setpoint), address)
        sent = self._clock()
        timings = self.timings
        timings["wake"].add(began - deadline)
        timings["period"].add(sent - began)
        if self._sent:
            timings["interval"].add(abs(sent - self._sent - 1_000_000_000 // self._rate))
        if setpoint.echo not in (NO_SEQUENCE, self._answered):
            timings["latency"].add(sent - round(1e9 * setpoint.received))
            self._answered = setpoint.echo
        self._sent = sent
