"""The test client: impaired networks, limits of set-points, and what it counts."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.realtime import Cues, SetPoint, State
from motion_cueing.realtime.client import Client, LimitCheck, NetworkFaults, cues_at
from motion_cueing.realtime.server import Endpoint

from .bench import FLOATS, PAPER, lane_change


def sent(trouble, count=2000):
    out = [
        [packet.sequence for packet in trouble.sent(Cues(k, 0.0, (0, 0, 0), (0, 0, 0)), k / 1000)]
        for k in range(count)
    ]
    return [number for numbers in out for number in numbers]


def test_trouble_is_what_was_asked_for():
    assert sent(NetworkFaults(0, 0, 0, 0, 0)) == list(range(2000))
    dropped = sent(NetworkFaults(0.1, 0, 0, 0, 0))
    assert 1700 < len(dropped) < 1900
    assert dropped == sorted(set(dropped))
    repeated = sent(NetworkFaults(0, 0.1, 0, 0, 0))
    assert len(repeated) - len(set(repeated)) == pytest.approx(200, abs=50)
    late = sent(NetworkFaults(0, 0, 0.1, 0, 0))
    assert late != sorted(late)
    assert set(range(1900)) <= set(late)
    assert sent(NetworkFaults(0.1, 0.1, 0.1, 0.1, 5)) == sent(NetworkFaults(0.1, 0.1, 0.1, 0.1, 5))
    broken = NetworkFaults(0, 0, 0, 1.0, 0)
    (packet,) = broken.sent(Cues(0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 0.0)
    assert np.isnan(packet.force[0])


def test_cues_are_sent_over_and_over_at_the_rate():
    trace = lane_change(0.5)
    found = list(cues_at(trace, 200, 2))
    assert len(found) == 2 * len(trace.resampled(0.005))
    assert [cues.sequence for cues in found] == list(range(len(found)))
    np.testing.assert_allclose(found[0].force, trace.specific_force[0])
    assert found[len(found) // 2].force == found[0].force
    np.testing.assert_allclose(found[1].force, 0.5 * (trace.specific_force[0] + trace.specific_force[1]))


def still(sequence, **parts) -> SetPoint:
    motion = np.zeros(39)
    for where, value in parts.values():
        motion[where] = value
    return SetPoint(State.RUNNING, sequence, 0, 0.0, 0.0, 0.0, motion)


@pytest.mark.parametrize(
    ("where", "value", "told"),
    [
        (0, 1e3, "position limit of carriage_x"),
        (27, 1e3, "position limit of leg_1"),
        (17, 1e3, "velocity limit of turntable"),
        (38, -1e3, "velocity limit of leg_6"),
        (10, 0.1, "acceleration limit of carriage_y"),
        (5, np.nan, "not finite"),
    ],
)
def test_what_exceeds_a_limit_is_told(where, value, told):
    check = LimitCheck(PAPER, 1000)
    assert check(still(0)) == ""
    assert told in check(still(1, one=(where, value)))


def test_the_client_knows_how_much_came_while_the_machine_braked():
    here, there = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    client = Client(here, there.address, FLOATS, PAPER, 1000, NetworkFaults(0, 0, 0, 0, 0))
    braking = [still(k)._replace(state=State.BRAKING) for k in range(6)]
    for setpoint in (*braking[:3], still(3)):
        there.send(FLOATS.pack_setpoint(setpoint), here.address)
    client.run(cues_at(lane_change(0.1), 100, 1), lambda: False)
    assert client.braking == 0.75
    # Silence makes any machine brake.
    for setpoint in braking[4:]:
        there.send(FLOATS.pack_setpoint(setpoint), here.address)
    client.listen(0.0)
    assert client.states[State.BRAKING] == 5
    assert client.braking == 0.75
    here.close()
    there.close()


def test_the_client_counts_what_is_wrong():
    here, there = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    client = Client(here, there.address, FLOATS, PAPER, 1000, NetworkFaults(0, 0, 0, 0, 0))
    for setpoint in (still(0), still(1), still(4), still(2), still(5, one=(0, 1e3))):
        there.send(FLOATS.pack_setpoint(setpoint), here.address)
    there.send(b"noise", here.address)
    here.send(FLOATS.pack_setpoint(still(6)), here.address)
    client.listen(0.0)
    assert client.counts == {
        "received": 5, "malformed": 1, "foreign": 1, "missing": 2, "disordered": 1, "outside_limits": 1,
    }  # fmt: skip
    assert client.faults == ["set-point 5 exceeds the position limit of carriage_x"]
    # Times of a controller that is not ours may be anything.
    for wrong in ({"echo_time": np.nan}, {"sent": np.inf}, {"received": -1e300}):
        there.send(FLOATS.pack_setpoint(still(7)._replace(**wrong)), here.address)
    client.listen(0.0)
    assert (client.counts["malformed"], client.counts["received"]) == (4, 5)
    here.close()
    there.close()
