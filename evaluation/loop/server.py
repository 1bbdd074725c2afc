"""The controller in real time: a period a millisecond, packets in between."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from .controller import Controller
from .endpoint import Endpoint
from .histogram import Histogram
from .inbox import Address
from .pacing import Pace
from .packets import NO_SEQUENCE, Format

_NS: Final = 1e-9


class Server:
    """Runs a controller at the times of a pace.

    Args:
        controller: The controller.
        endpoint: Where packets come and set-points go.
        form: How set-points are written.
        rate: Periods a second.
        lead: How long before its first period a time step is decided, s.
        clock: Nanoseconds now, as of the endpoint.

    Attributes:
        timings: By name: "latency" from the arrival of cues until the first set-point they moved is sent;
            "interval" between set-points, as its deviation from the period; "wake" from a period's time to
            its begin; "period" from there until its set-point is sent; "decision" a step of policy and
            machine.
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
    ) -> None:
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
        """Go on until the controller has come home after it was stopped.

        Args:
            ends: Given the seconds since the begin, before each step: whether it is to be stopped.
        """
        controller, clock = self._controller, self._clock
        self.pace = pace = Pace(self._rate, clock)
        begin = clock()
        while not controller.finished:
            if controller.decides:
                self._endpoint.listen(pace.deadline - self._lead, self._take)
                if ends(_NS * (clock() - begin)):
                    controller.stop()
                self._decide()
            self._endpoint.listen(pace.deadline, self._take)
            self._period(pace.deadline)
            pace.done()
        self.duration = _NS * (clock() - begin)

    def _decide(self) -> None:
        began = self._clock()
        self._controller.decide(_NS * began)
        self.timings["decision"].add(self._clock() - began)

    def _take(self, data: bytes, sender: Address, now: int) -> None:
        self._controller.inbox.take(data, sender, _NS * now)

    def _period(self, deadline: int) -> None:
        began = self._clock()
        setpoint = self._controller.period(_NS * began)
        sender = self._controller.inbox.sender
        if sender is not None:
            self._endpoint.send(self._form.pack_setpoint(setpoint), sender)
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
