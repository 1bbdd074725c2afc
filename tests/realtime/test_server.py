"""Addresses, and the server in a time of the test's own."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.realtime import Cues, State, WatchdogOptions
from motion_cueing.realtime.server import Server, address_of, is_loopback

from .bench import FLOATS, REST, SENDER, Bench, Clock


def test_addresses():
    assert address_of("127.0.0.1", 5) == ("127.0.0.1", 5)
    assert address_of("127.0.0.1:6", 5) == ("127.0.0.1", 6)
    with pytest.raises(ConfigurationError):
        address_of("127.0.0.1:", 5)
    # The system's own answer is 0.0.0.0: an unset variable in a script would let the network in.
    for text in ("", ":6"):
        with pytest.raises(ConfigurationError, match="name a host"):
            address_of(text, 5)
    assert is_loopback(("127.0.0.1", 1))
    assert not is_loopback(("0.0.0.0", 1))


class Wire:
    """An endpoint in the clock's time: a packet comes every millisecond until ``until``, s."""

    def __init__(self, clock, until) -> None:
        self.clock, self.until, self.sent, self.number = clock, until, [], 0
        self.due = clock.now

    def listen(self, deadline, take) -> None:
        while self.due <= deadline and self.due < self.until * 10**9:
            self.clock.now = max(self.clock.now, self.due)
            take(
                FLOATS.pack_cues(Cues(self.number, 1e-9 * self.due, REST, (0.0, 0.0, 0.1))), SENDER, self.due
            )
            self.number, self.due = self.number + 1, self.due + 10**6
        self.clock.now = max(self.clock.now, deadline)

    def send(self, data, to) -> None:
        assert to == SENDER
        self.sent.append(FLOATS.unpack_setpoint(data))


@pytest.mark.parametrize(("lead", "latency"), [(0.001, 0.001), (0.0, 0.0)])
def test_the_server_keeps_its_times(lead, latency):
    clock = Clock()
    bench, wire = Bench(rate=1000, watchdog=WatchdogOptions(fade=0.0)), Wire(clock, until=10.0)
    server = Server(bench.controller, wire, FLOATS, 1000, lead, clock)
    server.run(lambda seconds: seconds >= 2.0)
    sequences = [setpoint.sequence for setpoint in wire.sent]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    assert [round(1e3 * (b.sent - a.sent), 6) for a, b in zip(wire.sent, wire.sent[1:], strict=False)] == [
        1.0
    ] * (len(wire.sent) - 1)
    timings = {name: histogram.summary() for name, histogram in server.timings.items()}
    assert timings["interval"].max == timings["wake"].max == 0.0
    assert timings["latency"].max == pytest.approx(latency)
    assert timings["period"].count == bench.controller.periods
    assert timings["decision"].count == len(bench.controller.log)
    assert bench.controller.finished
    assert State.BRAKING in set(bench.controller.log.states)
    assert server.duration >= 2.0


def test_a_slow_policy_makes_periods_late_but_leaves_no_hole_in_the_motion():
    clock = Clock()

    class Slow:
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            clock.now += 3_500_000
            return np.tile([1.0, 0, 0, 0, 0, 0, 0, 0, 0], (1, 1)), state

    bench, wire = Bench(Slow(), rate=1000), Wire(clock, until=10.0)
    server = Server(bench.controller, wire, FLOATS, 1000, 0.001, clock)
    server.run(lambda seconds: seconds >= 1.5)
    log = bench.controller.log
    running = [setpoint for setpoint in wire.sent if setpoint.state is State.RUNNING]
    x = np.array([setpoint.motion[0] for setpoint in running])
    np.testing.assert_allclose(np.diff(x, 2), 1e-6, atol=1e-12)
    # Asked 1 ms before its time, answered 2.5 ms after: the first period is late, the second left out.
    asked = sum(state is not State.NEUTRAL and state is not State.BRAKING for state in map(State, log.states))
    assert server.pace.skipped == server.pace.overrun == asked > 100
