"""Buckets of times, deadlines, and the server in a time of the test's own."""

from __future__ import annotations

import gc
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.realtime import Patience, State
from motion_cueing.realtime.packets import Cues
from motion_cueing.realtime.server import Server
from motion_cueing.realtime.timing import Histogram, Pace, TimingSummary, undisturbed

from .loops import FLOATS, REST, SENDER, Bench


@given(st.lists(st.integers(0, 10**13), min_size=1, max_size=200), st.floats(0.001, 1.0))
def test_quantiles_are_three_percent_exact(times, share):
    histogram = Histogram()
    for time in times:
        histogram.add(time)
    exact = sorted(times)[max(1, int(np.ceil(share * len(times)))) - 1]
    found = histogram.quantile(share)
    assert exact <= found <= exact * (1.0 + 1.0 / 32.0)
    summary = histogram.summary()
    assert summary.count == len(times) == sum(count for _, count in summary.buckets)
    assert summary.max == pytest.approx(1e-9 * max(times))
    assert summary.mean == pytest.approx(1e-9 * np.mean(times))
    assert list(summary.buckets) == sorted(summary.buckets)


def test_nothing_counted_says_nothing():
    assert Histogram().summary() == TimingSummary(0)
    negative = Histogram()
    negative.add(-5)
    assert negative.summary().max == 0.0


class Clock:
    """Moves when told, and a little whenever it is looked at."""

    def __init__(self, tick=0) -> None:
        self.now, self.tick = 10**9, tick

    def __call__(self) -> int:
        self.now += self.tick
        return self.now


def test_deadlines_do_not_drift_at_any_rate():
    clock = Clock()
    pace, begin = Pace(300, clock), clock.now
    for k in range(3000):
        assert pace.deadline == begin + k * 10**9 // 300
        clock.now = pace.deadline + 100
        pace.done()
    assert (pace.overrun, pace.skipped) == (0, 0)


@pytest.mark.parametrize(
    ("took", "overrun", "skipped", "following"),
    [(1.0, 0, 0, 1), (1.001, 1, 0, 1), (1.9, 1, 0, 1), (2.1, 1, 1, 2), (35.5, 1, 34, 35)],
)
def test_a_period_that_takes_too_long_is_told_and_never_made_up(took, overrun, skipped, following):
    clock = Clock()
    pace, begin = Pace(1000, clock), clock.now
    clock.now += round(took * 1e6)
    pace.done()
    assert (pace.overrun, pace.skipped) == (overrun, skipped)
    assert pace.deadline == begin + following * 10**6


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
    bench, wire = Bench(rate=1000, patience=Patience(fade=0.0)), Wire(clock, until=10.0)
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


def test_the_collector_rests_and_works_again():
    with undisturbed():
        assert not gc.isenabled()
    assert gc.isenabled()
    with pytest.raises(ConfigurationError, match="refuses --cpu 100000"), undisturbed(cpu=100000):
        pass
    assert gc.isenabled()


def test_core_and_priority_are_given_back(monkeypatch):
    """Also the core, where the priority that comes after it is refused."""
    cores, levels = os.sched_getaffinity(0), []
    monkeypatch.setattr(os, "sched_setscheduler", lambda *given: levels.append(given))
    with undisturbed(cpu=min(cores), priority=7):
        assert os.sched_getaffinity(0) == {min(cores)}
    assert os.sched_getaffinity(0) == cores
    assert [(policy, one.sched_priority) for _, policy, one in levels] == [
        (os.SCHED_FIFO, 7),
        (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority),
    ]

    def refuse(*given):
        raise PermissionError("not you")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with pytest.raises(ConfigurationError, match="not you"), undisturbed(cpu=min(cores), priority=7):
        pass
    assert os.sched_getaffinity(0) == cores
