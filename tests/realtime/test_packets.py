"""Packets: round trips, and refusal of broken ones."""

from __future__ import annotations

import math
import struct
import sys
import zlib

import msgpack
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.road import ROAD_TIMES
from motion_cueing.realtime.packets import (
    MOTION,
    MOTION_SIZE,
    Controls,
    Cues,
    FloatsFormat,
    Road,
    SetPoint,
    make_format,
)
from motion_cueing.realtime.watchdog import State

FORMATS = [make_format(name) for name in ("floats", "msgpack")]
EVERY_FORMAT = pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
NUMBER = st.floats(allow_nan=False)
TRIPLE = st.tuples(NUMBER, NUMBER, NUMBER)
PLACES = st.tuples(*[NUMBER] * len(ROAD_TIMES))
CONTROLS = st.none() | st.builds(Controls, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)
ROADS = st.none() | st.builds(Road, PLACES, PLACES, PLACES, PLACES, NUMBER)
CUES = st.builds(
    Cues, st.integers(0, 2**64 - 2), NUMBER, TRIPLE, TRIPLE, st.booleans(), controls=CONTROLS, road=ROADS
)
MOTIONS = st.lists(NUMBER, min_size=MOTION_SIZE, max_size=MOTION_SIZE).map(np.array)
COUNT = st.integers(0, 2**64 - 1)
SETPOINTS = st.builds(SetPoint, st.sampled_from(State), COUNT, COUNT, NUMBER, NUMBER, NUMBER, MOTIONS)
SOME = Cues(7, 1.5, (1.0, 2.0, -9.81), (0.1, 0.2, 0.3))


@EVERY_FORMAT
@given(cues=CUES)
def test_cues_come_back_to_the_bit(form, cues):
    assert form.unpack_cues(form.pack_cues(cues)) == cues


@EVERY_FORMAT
@given(setpoint=SETPOINTS)
def test_setpoints_come_back_to_the_bit(form, setpoint):
    back = form.unpack_setpoint(form.pack_setpoint(setpoint))
    assert back[:-1] == setpoint[:-1]
    assert isinstance(back.state, State)
    np.testing.assert_array_equal(back.motion, setpoint.motion)


@EVERY_FORMAT
@given(data=st.binary(max_size=400))
@example(data=b"\x81\xa7version\x01")
@example(data=b"\xc1")
@example(
    data=msgpack.packb({"version": 1, "sequence": 1, "time": 0.0, "force": [1, 2, "x"], "rate": [0] * 3})
)
@example(data=msgpack.packb({"version": 1, "sequence": -1, "time": 0.0, "force": [0] * 3, "rate": [0] * 3}))
@example(data=msgpack.packb({"version": 1, "sequence": True, "time": 0.0, "force": [0] * 3, "rate": [0] * 3}))
@example(data=msgpack.packb({"version": 1, "sequence": 1, "time": None, "force": [0] * 3, "rate": [0] * 3}))
@example(data=msgpack.packb({"version": 1, "sequence": 1, "time": 0.0, "force": [0] * 2, "rate": [0] * 3}))
@example(data=b"\x91" * 1500)
@example(data=b"\x00" * 2049)
def test_noise_is_refused(form, data):
    for unpack in (form.unpack_cues, form.unpack_setpoint):
        with pytest.raises(DataError):
            unpack(data)


@EVERY_FORMAT
def test_nan_passes_so_that_it_is_counted_as_such(form):
    cues = form.unpack_cues(form.pack_cues(SOME._replace(force=(math.nan, 0.0, math.inf))))
    assert math.isnan(cues.force[0])
    assert cues.force[2] == math.inf


def test_the_bytes_are_those_of_the_documentation():
    data = FORMATS[0].pack_cues(SOME)
    body = b"MCGC" + struct.pack("<HHQ", 1, 0, 7) + struct.pack("<7d", 1.5, 1.0, 2.0, -9.81, 0.1, 0.2, 0.3)
    assert data == body + struct.pack("<I", zlib.crc32(body))
    assert len(data) == FloatsFormat.CUES_SIZE == 76
    wheel = Controls(0.1, 0.2, 0.3, 4.0, 0.05)
    places = [tuple(100.0 * part + k for k in range(12)) for part in range(4)]
    data = FORMATS[0].pack_cues(SOME._replace(controls=wheel, road=Road(*places, stop_distance=50.0)))
    body = b"MCGC" + struct.pack("<HHQ", 3, 6, 7) + struct.pack("<7d", 1.5, 1.0, 2.0, -9.81, 0.1, 0.2, 0.3)
    body += struct.pack("<5d", *wheel) + struct.pack("<49d", 50.0, *sum(places, ()))
    assert data == body + struct.pack("<I", zlib.crc32(body))
    motion = np.arange(39.0)
    data = FORMATS[0].pack_setpoint(SetPoint(State.HOLDING, 5, 7, 1.5, 2.0, 2.5, motion))
    body = b"MCGS" + struct.pack("<HBBQQ3d", 1, 2, 0, 5, 7, 1.5, 2.0, 2.5) + struct.pack("<39d", *motion)
    assert data == body + struct.pack("<I", zlib.crc32(body))
    assert len(data) == FloatsFormat.SETPOINT_SIZE == 364
    assert sorted(k for part in MOTION.values() for k in range(39)[part]) == list(range(39))


def test_cues_of_a_paused_drive_are_of_version_2():
    body = b"MCGC" + struct.pack("<HHQ", 2, 1, 7) + struct.pack("<7d", 1.5, 1.0, 2.0, -9.81, 0.1, 0.2, 0.3)
    data = body + struct.pack("<I", zlib.crc32(body))
    assert FORMATS[0].pack_cues(SOME._replace(paused=True)) == data
    fields = msgpack.unpackb(FORMATS[1].pack_cues(SOME._replace(paused=True)))
    assert (fields["version"], fields["paused"]) == (2, True)
    assert "paused" not in msgpack.unpackb(FORMATS[1].pack_cues(SOME))
    # In version 1 the field of flags had no meaning; version 4 is not known.
    for version, paused in ((1, False), (2, True), (3, True), (4, None)):
        changed = data[:4] + struct.pack("<H", version) + data[6:-4]
        changed += struct.pack("<I", zlib.crc32(changed))
        if paused is None:
            with pytest.raises(DataError, match="version 4"):
                FORMATS[0].unpack_cues(changed)
        else:
            assert FORMATS[0].unpack_cues(changed) == SOME._replace(paused=paused)


@given(bit=st.integers(0, 8 * 76 - 1))
def test_a_turned_bit_is_found(bit):
    data = bytearray(FORMATS[0].pack_cues(SOME))
    data[bit // 8] ^= 1 << bit % 8
    with pytest.raises(DataError):
        FORMATS[0].unpack_cues(bytes(data))


@pytest.mark.parametrize(
    ("change", "told"), [((4, b"\x02"), "version 2"), ((0, b"MCGS"), "begins"), ((6, b"\x04"), "no state 4")]
)
def test_what_is_wrong_is_told(change, told):
    data = bytearray(FORMATS[0].pack_setpoint(SetPoint(State.RUNNING, 0, 0, 0.0, 0.0, 0.0, np.zeros(39))))
    where, what = change
    data[where : where + len(what)] = what
    data[-4:] = struct.pack("<I", zlib.crc32(data[:-4]))
    unpack = FORMATS[0].unpack_cues if told == "begins" else FORMATS[0].unpack_setpoint
    with pytest.raises(DataError, match="bytes" if told == "begins" else told):
        unpack(bytes(data))


def test_unknown_formats_and_missing_libraries_are_told(monkeypatch):
    with pytest.raises(UnknownNameError, match="Did you mean floats"):
        make_format("float")
    monkeypatch.setitem(sys.modules, "msgpack", None)
    with pytest.raises(ConfigurationError, match=r"motion-cueing-gym\[loop\]"):
        make_format("msgpack")
