"""The bridge in a time of the test's own: a game at its frame rate becomes cues, and each fault a pause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.telemetry import get_source
from motion_cueing.realtime import Cues, FloatsFormat, GuardOptions
from motion_cueing.realtime.bridge import INTERRUPTIONS, Bridge, BridgeLoop, BridgeOptions
from motion_cueing.realtime.guard import Guard
from motion_cueing.realtime.inbox import Inbox
from motion_cueing.realtime.server import Endpoint

from ..envs.telemetry import games
from ..envs.telemetry.games import PACK, G, Motion, later

FPS = 60.0


def force_of(t):
    """(3,) acceleration of the drive at a time, below 1 Hz."""
    return np.array([1.5 * np.sin(2.0 * t), 2.0 * np.sin(1.3 * t), 0.0 * t])


def drive(seconds, fps=FPS, seed=0):
    """Motions of a car that speeds up, brakes and turns, one a frame."""
    m = Motion(time=100.0, velocity=(20.0, 0.0, 0.0))
    motions = []
    for _ in range(int(seconds * fps)):
        t = m.time - 100.0
        speed = float(np.hypot(*m.velocity[:2]))
        at = force_of(t)
        m = replace(m, acceleration=tuple(at), rate=(0.0, 0.0, at[1] / speed))
        motions.append(m)
        m = later(m, 1.0 / fps)
    return motions


class Wire:
    """Sends datagrams at their arrival times through a bridge that is asked for cues at a fixed rate."""

    def __init__(self, name="forza", rate=200, **options):
        self.bridge = Bridge(get_source(name), BridgeOptions(**options))
        self.name, self.rate, self.kinds = name, rate, []
        self.cues: list[Cues] = []

    def run(self, arrivals, until):
        """Datagrams as (arrival, bytes); cues until a time, s."""
        waiting = sorted(arrivals, key=lambda one: one[0])
        now = 0.0
        while now < until:
            while waiting and waiting[0][0] <= now:
                arrival, data = waiting.pop(0)
                self.kinds.append(self.bridge.take(data, arrival))
            if self.bridge.begun:
                self.cues.append(self.bridge.cues(now))
            now += 1.0 / self.rate
        return self

    @property
    def rows(self):
        """Time, paused, and the six cues of each packet."""
        return np.array([[c.time, c.paused, *c.force, *c.rate] for c in self.cues])


def sent(motions, name="forza", start=0.5, jitter=0.0, seed=0):
    """Arrivals of the datagrams of motions, jitter late at most."""
    rng = np.random.default_rng(seed)
    pack = PACK[name]
    return [(start + m.time - motions[0].time + rng.uniform(0.0, jitter), pack(m)) for m in motions]


@pytest.mark.parametrize("name", list(PACK))
@pytest.mark.parametrize("jitter", [0.0, 0.004])
def test_a_drive_arrives_with_its_delay_and_nothing_else(name, jitter):
    wire = Wire(name).run(sent(drive(12.0), name, jitter=jitter), 12.4)
    rows = wire.rows
    live = rows[(rows[:, 1] == 0.0) & (rows[:, 0] > 3.0)]
    assert len(live) > 1800
    assert wire.bridge.interruptions == dict.fromkeys(INTERRUPTIONS, 0)
    t = live[:, 0] - 0.5 - wire.bridge.delay
    expected = np.stack(force_of(t), axis=1) - [0.0, 0.0, G]
    # Jitter of arrivals is that of the time itself where there is no clock.
    late = 0.02 if name in ("f1", "dirt") else 0.012
    np.testing.assert_allclose(live[:, 2:5], expected, atol=4.0 * late + (0.01 if jitter else 0.0))
    assert wire.bridge.rate == pytest.approx(FPS, rel=5e-3)
    assert wire.bridge.delay == pytest.approx(2.0 / FPS + 0.005, rel=5e-3)
    # The packets change as smoothly as the drive: no steps at the frames.
    assert np.abs(np.diff(live[:, 2:4], 2, axis=0)).max() * wire.rate**2 < 20.0 + 400.0 * (jitter > 0.0)


def test_it_begins_after_the_settling_time_and_says_nothing_before_telemetry():
    wire = Wire().run(sent(drive(3.0)), 3.0)
    assert wire.cues[0].time == pytest.approx(0.5, abs=0.01)
    begin = next(c.time for c in wire.cues if not c.paused)
    assert begin == pytest.approx(1.0, abs=0.03)


def pauses(wire, after=2.0):
    """Spans (begin, end) in which packets said paused, after the start."""
    rows = wire.rows
    flag = np.r_[0, (rows[:, 1] == 1.0) & (rows[:, 0] > after), 0]
    edges = np.flatnonzero(np.diff(flag))
    times = np.r_[rows[:, 0], rows[-1, 0]]
    return [(times[a], times[b]) for a, b in edges.reshape(-1, 2)]


def shifted(arrivals, after, by):
    return [(t + by if t > after else t, data) for t, data in arrivals]


FAULTS = {
    "a pause with a flag": (
        "forza", "pauses", lambda a: shifted(a, 5.0, 3.0) + [
            (5.0 + k / FPS, games.forza(Motion(time=104.5, paused=True))) for k in range(int(3.0 * FPS))
        ]),
    "a pause that repeats the last packet": (
        "forza", "frozen", lambda a: shifted(a, 5.0, 3.0) + [
            (5.0 + k / FPS, [data for t, data in a if t < 5.0][-1]) for k in range(int(3.0 * FPS))
        ]),
    "a pause that is silent": ("beamng", "frozen", lambda a: shifted(a, 5.0, 3.0)),
    "a silence of the network": ("outsim", "frozen", lambda a: [d for d in a if not 5.0 < d[0] < 6.0]),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_each_pause_is_told_and_ends(fault):
    name, kind, impair = FAULTS[fault]
    wire = Wire(name).run(impair(sent(drive(14.0), name)), 14.0)
    assert wire.bridge.interruptions[kind] >= 1
    (span,) = pauses(wire)
    assert 4.99 < span[0] < 5.31
    resumed = 6.0 if fault == "a silence of the network" else 8.0
    assert resumed + 0.4 < span[1] < resumed + 1.2
    assert wire.bridge.follows


def moved(motions, after, offset=(0.0, 0.0, 0.0), velocity=None):
    """The car stands elsewhere from a time on."""
    out = []
    for m in motions:
        if m.time - motions[0].time > after:
            m = replace(m, position=tuple(np.add(m.position, offset)),
                        velocity=m.velocity if velocity is None else velocity)  # fmt: skip
        out.append(m)
    return out


@pytest.mark.parametrize("name", ["beamng", "outsim", "f1", "dirt", "xplane"])
@pytest.mark.parametrize("offset", [(20.0, 0.0, 0.0), (0.0, -20.0, 0.0), (0.0, 0.0, 20.0)])
def test_a_teleport_is_seen_by_the_position(name, offset):
    wire = Wire(name).run(sent(moved(drive(9.0), 5.0, offset), name), 9.0)
    assert wire.bridge.interruptions["jumps"] == 1
    (span,) = pauses(wire)
    assert 5.4 < span[0] < 5.6
    assert 0.4 < span[1] - span[0] < 0.6


@pytest.mark.parametrize("name", ["forza", "f1", "outsim"])
def test_a_reset_of_the_car_is_seen_by_the_velocity(name):
    wire = Wire(name).run(sent(moved(drive(9.0), 5.0, velocity=(0.0, 0.0, 0.0)), name), 9.0)
    assert wire.bridge.interruptions["jumps"] == 1


@pytest.mark.parametrize("name", [name for name in PACK if name != "beamng"])
def test_a_restart_of_the_clock_is_another_drive(name):
    first, second = drive(5.0), drive(5.0)
    arrivals = sent(first, name) + sent([replace(m, time=m.time - 60.0) for m in second], name, start=5.5)
    wire = Wire(name).run(arrivals, 10.0)
    assert wire.bridge.interruptions["restarts"] == 1
    assert wire.bridge.follows


@pytest.mark.parametrize("name", ["forza", "outsim"])
def test_a_clock_of_milliseconds_may_begin_again(name):
    shift = 2.0**32 * 1e-3 - 106.0
    motions = [replace(m, time=m.time + shift) for m in drive(10.0)]
    wire = Wire(name).run(sent(motions, name), 10.0)
    assert wire.bridge.interruptions == dict.fromkeys(INTERRUPTIONS, 0)
    assert not pauses(wire)


def test_copies_lost_and_late_frames_leave_the_drive_as_it_is():
    arrivals = sent(drive(12.0))
    rng = np.random.default_rng(1)
    impaired = []
    for t, data in arrivals:
        fate = rng.random()
        if fate < 0.1:
            continue
        impaired.append((t, data))
        if fate > 0.67:
            impaired.append((t + 0.5 / FPS, data))
        if fate > 0.98:
            impaired[-1] = (t + 2.5 / FPS, data)
    wire = Wire().run(impaired, 12.0)
    assert not pauses(wire)
    assert wire.bridge.counts["repeated"] > 150
    assert wire.bridge.counts["late"] > 3
    live = wire.rows[wire.rows[:, 0] > 3.0]
    t = live[:, 0] - 0.5 - wire.bridge.delay
    np.testing.assert_allclose(live[:, 2], force_of(t)[0], atol=0.1)


def test_slow_motion_is_no_drive():
    arrivals = [(0.5 + 2.0 * (t - 0.5), data) for t, data in sent(drive(6.0))]
    wire = Wire().run(arrivals, 12.0)
    rows = wire.rows
    assert rows[:, 1].mean() > 0.95
    assert wire.bridge.interruptions["off_pace"] > 0


def test_a_clock_that_drifts_is_followed():
    arrivals = [(0.5 + 1.0005 * (t - 0.5), data) for t, data in sent(drive(60.0))]
    wire = Wire(rate=100).run(arrivals, 60.0)
    assert not pauses(wire)
    live = wire.rows[wire.rows[:, 0] > 50.0]
    t = (live[:, 0] - 0.5) / 1.0005 - wire.bridge.delay
    np.testing.assert_allclose(live[:, 2], force_of(t)[0], atol=0.05)


def test_noise_and_other_packets_are_counted_and_change_nothing():
    arrivals = sent(drive(6.0), "f1")
    noise = [(t + 0.001, b"noise") for t, _ in arrivals[::3]]
    other = [(t + 0.002, games.f1_header(Motion(), 7) + bytes(100)) for t, _ in arrivals[::3]]
    plain, noisy = Wire("f1").run(arrivals, 6.6), Wire("f1").run(arrivals + noise + other, 6.6)
    assert np.array_equal(plain.rows, noisy.rows)
    assert noisy.bridge.counts["foreign"] == len(noise)
    assert noisy.bridge.counts["without_motion"] == len(other)
    assert "shorter than its header" in noisy.bridge.refused


def test_a_pause_of_f1_comes_with_its_session_packets():
    motions = drive(10.0)
    arrivals = sent([m for m in motions if not 4.5 < m.time - 100.0 < 7.0], "f1")
    arrivals += [(0.5 + t, games.f1_session(Motion(time=100.0 + t, paused=4.5 < t < 7.0)))
                 for t in np.arange(0.0, 10.0, 0.5)]  # fmt: skip
    wire = Wire("f1").run(arrivals, 10.0)
    assert wire.bridge.interruptions["pauses"] == 1
    (span,) = pauses(wire)
    assert 7.9 < span[1] < 8.6


def test_a_standing_car_is_not_frozen():
    motions = [Motion(time=100.0 + k / FPS) for k in range(600)]
    for name in PACK:
        wire = Wire(name).run(sent(motions, name), 10.0)
        # Without a clock a copy and a standing car look alike; both count as a pause.
        if name != "beamng":
            assert not pauses(wire), name
            np.testing.assert_allclose(wire.rows[-1, 2:], [0.0, 0.0, -G, 0.0, 0.0, 0.0], atol=1e-3)


def test_cues_are_reversed_by_choice():
    arrivals = sent(drive(6.0))
    plain, turned = Wire().run(arrivals, 6.0), Wire(reverse=("f_y", "w_z")).run(arrivals, 6.0)
    np.testing.assert_allclose(turned.rows[:, 2:], plain.rows[:, 2:] * [1, -1, 1, 1, 1, -1])
    assert [doubt.split(":")[0] for doubt in turned.bridge.check.doubts()] == []
    with pytest.raises(ConfigurationError, match="smoothing"):
        BridgeOptions(smoothing=4)


def felt(wire):
    """(n, 6) what the guard gives a policy at 100 Hz for the packets of a wire at 200 Hz."""
    form, guard = FloatsFormat(), Guard(GuardOptions(), 0.03)
    inbox, rows = Inbox(form, 0.05, 0.03), []
    for k, cues in enumerate(wire.cues):
        inbox.take(form.pack_cues(cues), ("127.0.0.1", 9), cues.time)
        if k % 2 and inbox.newest is not None:
            rows.append(guard(inbox.newest, inbox.paused, inbox.accepted))
    return np.array(rows), guard


@pytest.mark.parametrize("fault", [*FAULTS, "a teleport"])
def test_what_the_policy_gets_of_each_fault_is_a_fade(fault):
    if fault == "a teleport":
        name, arrivals = "outsim", sent(moved(drive(14.0), 4.5, (50.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "outsim")
    else:
        name, _, impair = FAULTS[fault]
        arrivals = impair(sent(drive(14.0), name))
    rows, guard = felt(Wire(name).run(arrivals, 14.0))
    jerk = np.abs(np.diff(rows[:, :3], axis=0)).max() * 100.0
    # The drive's own is 4 m/s^3; a fade has at most 30.
    assert jerk < 12.0
    assert guard.counts["pauses"] >= 1
    assert guard.counts["jumps"] == guard.counts["spikes"] == guard.counts["stuck"] == 0
    assert np.abs(rows[:, :2]).max() < 2.3


def test_the_loop_over_real_sockets(tmp_path):
    """A game on one socket, a controller on another: packets go out, set-points are counted, all recorded."""
    inlet, outlet = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    controller, game = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    form, bridge, recorded, received = FloatsFormat(), Bridge(get_source("xplane")), [], []
    requests = get_source("xplane").requests()
    asked = []
    loop = BridgeLoop(bridge, inlet, outlet, controller.address, form, 100, recorded.append,
                      (game.address, requests))  # fmt: skip
    motions = iter(drive(2.0))

    def ends(seconds):
        motion = next(motions)
        game.send(games.xplane(motion), inlet.address)
        controller.listen(0, lambda data, sender, now: received.append(form.unpack_cues(data)))
        game.listen(0, lambda data, sender, now: asked.append(data))
        controller.send(b"set-point", outlet.address)
        return len(received) >= 40

    try:
        loop.run(ends)
    finally:
        for endpoint in (inlet, outlet, controller, game):
            endpoint.close()
    assert bridge.counts["used"] == len(recorded) >= 40
    assert [cues.sequence for cues in received] == list(range(len(received)))
    assert received[0].paused
    assert loop.setpoints >= 40
    assert tuple(asked[: len(requests)]) == requests
