"""Set-points for other motion controllers: units and strokes, and an OSC peer made from its specification."""

from __future__ import annotations

import json
import socket
import struct

import numpy as np
import pytest
import yaml

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.realtime import SetPoint, State
from motion_cueing.realtime.outputs import SOURCES, Channel, Output, OutputTemplate, load_output
from motion_cueing.realtime.server import Endpoint, Server

from .bench import FLOATS, PAPER, Bench, Clock

STROKE = 0.67
"""Of a leg of this machine, m from neutral either way."""


def setpoint(**axes):
    motion = np.zeros(39)
    for name, value in axes.items():
        order = ("carriage_x", "carriage_y", "surge", "sway", "heave", "roll", "pitch", "yaw", "turntable")
        motion[order.index(name) if name in order else 26 + int(name.removeprefix("leg_"))] = value
    return SetPoint(State.RUNNING, 0, 0, 0.0, 0.0, 0.0, motion)


def written(channels, motion, **fields):
    template = OutputTemplate(to="127.0.0.1:9000", channels=tuple(channels), **fields)
    return Output(template, PAPER, 1000).datagram(motion)


@pytest.mark.parametrize(
    ("channel", "value", "expected"),
    [
        ({"unit": "m"}, 0.1, 0.1),
        ({"unit": "mm"}, -0.1, -100.0),
        ({"unit": "cm", "reverse": True}, 0.1, -10.0),
        ({"unit": "percent"}, 0.0, 50.0),
        ({"unit": "percent"}, STROKE, 100.0),
        ({"unit": "percent", "reverse": True}, STROKE / 2, 25.0),
        ({"unit": "percent", "stroke": [-0.1, 0.3]}, 0.0, 25.0),
        ({"unit": "percent", "stroke": [-0.1, 0.3]}, 0.5, 100.0),
        ({"unit": "counts"}, -STROKE, 0),
        ({"unit": "counts"}, STROKE, 65535),
        ({"unit": "counts", "counts": [0, 1000]}, 0.0, 500),
        ({"unit": "counts", "counts": [-500, 500], "reverse": True}, STROKE / 2, -250),
        ({"unit": "counts", "counts": [1000, 0]}, STROKE, 0),
    ],
)
def test_units_of_a_leg(channel, value, expected):
    data = written([Channel(source="leg_3", **channel)], setpoint(leg_3=value), decimals=6)
    assert float(data) == pytest.approx(expected, abs=1e-6)
    assert (b"." in data) == (channel["unit"] != "counts")


@pytest.mark.parametrize("source", SOURCES)
def test_each_source_is_read_where_it_stands(source):
    unit = "deg" if source in ("roll", "pitch", "yaw", "turntable") else "mm"
    expected = np.rad2deg(0.05) if unit == "deg" else 50.0
    channels = [Channel(source=source, unit=unit)]
    assert float(written(channels, setpoint(**{source: 0.05}))) == pytest.approx(expected, abs=1e-4)
    for other in set(SOURCES) - {source}:
        assert written(channels, setpoint(**{other: 0.05})) == b"0.0000\n"


def test_lines_and_objects():
    channels = [
        Channel(source="leg_1", unit="percent"),
        Channel(source="pitch", unit="deg", name="tilt"),
        Channel(source="leg_6", unit="counts", counts=(0, 1023)),
    ]
    motion = setpoint(leg_1=-STROKE, pitch=-1e-9, leg_6=STROKE)
    assert written(channels, motion, decimals=2) == b"0.00,0.00,1023\n"
    assert (
        written(channels, motion, decimals=1, state=True, separator=";", end="\r\n") == b"1;0.0;0.0;1023\r\n"
    )
    assert json.loads(written(channels, motion, format="json", state=True)) == {
        "state": 1, "leg_1": 0.0, "tilt": 0.0, "leg_6": 1023,
    }  # fmt: skip


def osc_message(data):
    """Address and arguments of an OSC 1.0 message, read as its specification says."""
    assert len(data) % 4 == 0

    def string(begin):
        end = data.index(0, begin)
        after = end + 4 - end % 4
        assert not any(data[end:after])
        return data[begin:end].decode("ascii"), after

    address, at = string(0)
    tags, at = string(at)
    assert tags[0] == ","
    arguments = []
    for tag in tags[1:]:
        arguments += struct.unpack_from({"i": ">i", "f": ">f"}[tag], data, at)
        at += 4
    assert at == len(data)
    return address, arguments


@pytest.mark.parametrize("address", ["/a", "/ab", "/abc", "/rig/legs"])
@pytest.mark.parametrize("count", [1, 2, 3, 6])
def test_an_osc_peer_reads_it(address, count):
    values = np.linspace(-0.6, 0.6, count)
    motion = setpoint(**{f"leg_{k + 1}": value for k, value in enumerate(values)})
    channels = [Channel(source=f"leg_{k + 1}", unit="m") for k in range(count)]
    channels += [Channel(source="leg_1", unit="counts", name="drive")]
    found, arguments = osc_message(written(channels, motion, format="osc", address=address, state=True))
    assert found == address
    assert arguments[0] == State.RUNNING
    np.testing.assert_allclose(arguments[1:-1], values, rtol=1e-7)
    assert arguments[-1] == round(65535 * (values[0] + STROKE) / (2 * STROKE))


def test_the_example_of_the_osc_specification():
    # "/foo" with 1000, -1, 1.234: the bytes stand in the specification.
    motion = setpoint(leg_1=1.0, leg_2=-1.0, heave=1.234)
    channels = [
        Channel(source="leg_1", unit="counts", stroke=(0.0, 1.0), counts=(0, 1000)),
        Channel(source="leg_2", unit="counts", stroke=(-1.0, 1.0), counts=(-1, 1)),
        Channel(source="heave", unit="m"),
    ]
    data = written(channels, motion, format="osc", address="/foo")
    assert data == bytes.fromhex("2f666f6f00000000 2c69696600000000 000003e8 ffffffff 3f9df3b6")


@pytest.mark.slow
def test_a_server_sends_them_at_their_own_rate():
    clock = Clock()
    bench = Bench(rate=1000)
    template = OutputTemplate(
        to="127.0.0.1:9000", rate=50, format="osc", channels=(Channel(source="leg_1", unit="percent"),)
    )
    rig = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    rig.bind(("127.0.0.1", 0))
    rig.settimeout(5.0)

    class Quiet(Endpoint):
        def listen(self, deadline, take, clock_=None):
            clock.now = max(clock.now, deadline)

    endpoint = Quiet(("127.0.0.1", 0))
    outputs = [(Output(template, PAPER, 1000), rig.getsockname())]
    Server(bench.controller, endpoint, FLOATS, 1000, 0.0, clock, outputs).run(lambda seconds: seconds >= 0.2)
    expected = -(-bench.controller.periods // 20)
    messages = [osc_message(rig.recv(1024)) for _ in range(expected)]
    assert messages == [("/motion", [50.0])] * expected
    rig.setblocking(False)
    with pytest.raises(BlockingIOError):
        rig.recv(1024)
    endpoint.close()
    rig.close()


WRONG = [
    ({"channels": [{"source": "leg_7", "unit": "m"}]}, "leg_7"),
    ({"channels": [{"source": "leg_1", "unit": "deg"}]}, "leg_1 has no unit deg"),
    ({"channels": [{"source": "yaw", "unit": "mm"}]}, "yaw has no unit mm"),
    ({"channels": [{"source": "heave", "unit": "percent"}]}, "heave in percent needs a stroke"),
    ({"channels": [{"source": "turntable", "unit": "counts"}]}, "turntable in counts needs a stroke"),
    ({"channels": [{"source": "leg_1", "unit": "percent", "stroke": [0.1, 0.1]}]}, "stroke must be"),
    ({"channels": [{"source": "leg_1", "unit": "counts", "counts": [5, 5]}]}, "counts must differ"),
    ({"channels": []}, "at least 1"),
    ({"channels": 2 * [{"source": "leg_1", "unit": "m"}]}, "names of their own"),
    ({"rate": 300}, "rate must be a divisor of the 1000"),
    ({"to": "9000"}, "host and a port"),
    ({"format": "xml"}, "format"),
    ({"address": "motion"}, "OSC address"),
    ({"adress": "/motion"}, "address"),
]


@pytest.mark.parametrize(("change", "complaint"), WRONG)
def test_a_wrong_template_is_refused_with_its_file(change, complaint, tmp_path):
    values = {"to": "127.0.0.1:9000", "channels": [{"source": "leg_1", "unit": "percent"}]} | change
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(values), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=complaint) as found:
        load_output(tmp_path / "rig.yaml", PAPER, 1000)
    assert "rig.yaml" in str(found.value)


def test_a_template_file_makes_an_output(tmp_path):
    (tmp_path / "rig.yaml").write_text(
        "to: 127.0.0.1:9000\nrate: 200\nchannels:\n  - {source: leg_2, unit: counts, counts: [0, 4095]}\n",
        encoding="utf-8",
    )
    output = load_output(tmp_path / "rig.yaml", get_platform("paper"), 1000)
    assert output.every == 5
    assert output.datagram(setpoint()) == b"2048\n"
