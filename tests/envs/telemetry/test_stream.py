"""Recorded datagrams and captures: whole, cut off, and as the log of an import."""

from __future__ import annotations

import builtins
import struct
from dataclasses import replace

import dpkt
import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.logs.importer import import_log
from motion_cueing.envs.logs.readers import read_recording
from motion_cueing.envs.logs.signals import ImportOptions
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.telemetry import Datagram, StreamWriter, read_stream
from motion_cueing.envs.telemetry.stream import read_capture

from . import games
from .games import PACK, Motion

DRIVE = get_maneuver("slalom").drive()
FPS = 60.0
START = 1_714_866_590.0


def motions(drive=DRIVE, fps=FPS):
    """A drive of the package, frame by frame, as a game knows it: the lean of the body is not in it."""
    time = np.arange(0.0, drive.time[-1], 1.0 / fps)

    def at(values):
        return np.interp(time, drive.time, values)

    speed, side = at(drive.channels["speed_m_s"]), at(drive.channels["lateral_speed_m_s"])
    heading = at(np.unwrap(drive.channels["heading_rad"]))
    yaw_rate = np.gradient(heading, time)
    force = np.array([at(axis) for axis in drive.specific_force.T])
    found, position = [], np.zeros(3)
    for k, t in enumerate(time):
        cosine, sine = np.cos(heading[k]), np.sin(heading[k])
        velocity = (speed[k] * cosine - side[k] * sine, speed[k] * sine + side[k] * cosine, 0.0)
        position = position + np.array(velocity) / fps
        # Whole milliseconds: stamps of games do not jitter against their own frames here.
        found.append(Motion(
            time=10.0 + t, heading=float(heading[k]), acceleration=(force[0, k], force[1, k], 0.0),
            rate=(0.0, 0.0, float(yaw_rate[k])), velocity=velocity, position=tuple(position),
        ))  # fmt: skip
    return found


def record(path, name, frames):
    with StreamWriter(path, name) as writer:
        for k, frame in enumerate(frames):
            writer.add(Datagram(START + k / FPS, frame))
    return path


def test_a_recording_comes_back_and_is_never_overwritten(tmp_path):
    path = record(tmp_path / "drive.mcgd", "forza", [b"one", b"", b"three"])
    name, datagrams, fault = read_stream(path)
    assert (name, fault) == ("forza", "")
    assert [datagram.data for datagram in datagrams] == [b"one", b"", b"three"]
    assert datagrams[2].time == START + 2 / FPS
    with pytest.raises(ConfigurationError, match="there already"):
        StreamWriter(path, "forza")


def test_the_bytes_of_a_recording_are_those_of_the_documentation(tmp_path):
    path = record(tmp_path / "drive.mcgd", "f1", [b"abc"])
    expected = b"MCGDGRAM" + struct.pack("<HH", 1, 2) + b"f1" + struct.pack("<dH", START, 3) + b"abc"
    assert path.read_bytes() == expected


@pytest.mark.parametrize("name", list(PACK))
def test_a_recorded_game_is_the_log_of_its_drive(name, tmp_path):
    path = record(tmp_path / "drive.mcgd", name, [PACK[name](m) for m in motions()])
    # A receiver's gaps and repeats do not occur; the slalom begins and ends at speed.
    imported = import_log(path)
    found = imported.trace
    n = min(len(found), len(DRIVE)) - 100
    delay = 0.5 / FPS if name in ("f1", "dirt") else 0.0
    begin = 1.0 / FPS if name in ("f1", "dirt") else 0.0
    time = found.time[100:n] + begin
    for axis in (0, 1):
        truth = np.interp(time, DRIVE.time, DRIVE.specific_force[:, axis])
        # The import smooths above 5 Hz.
        assert np.sqrt(np.mean((found.specific_force[100:n, axis] - truth) ** 2)) < 0.08
    truth = np.interp(time - delay, DRIVE.time, DRIVE.angular_velocity[:, 2])
    assert np.sqrt(np.mean((found.angular_velocity[100:n, 2] - truth) ** 2)) < 0.01
    # The axes are the car's own: nothing about a mounting is estimated, but the slopes are looked at.
    mounting = imported.findings.device.mounting
    assert (mounting.roll, mounting.pitch, mounting.yaw, mounting.rate_sign) == (0.0, 0.0, 0.0, 1)
    if name != "mcgc":
        assert imported.findings.device.force_turn > 0.9
    assert "telemetry" in imported.findings.format


def test_a_game_with_a_wrong_sign_is_refused_by_its_slopes(tmp_path):
    mirrored = [games.outsim(replace(m, acceleration=(m.acceleration[0], -m.acceleration[1], 0.0)))
                for m in motions()]  # fmt: skip
    with pytest.raises(DataError, match="f_y on v r"):
        import_log(record(tmp_path / "drive.mcgd", "outsim", mirrored))
    found = import_log(tmp_path / "drive.mcgd", {"force_y": "-force_y"}).trace
    truth = np.interp(found.time, DRIVE.time, DRIVE.specific_force[:, 1])
    assert np.sqrt(np.mean((found.specific_force[:, 1] - truth)[100:-100] ** 2)) < 0.08


def ethernet(data, port=5300, version=4):
    udp = dpkt.udp.UDP(sport=1234, dport=port, data=data, ulen=8 + len(data))
    if version == 4:
        inner = dpkt.ip.IP(src=b"\x7f\0\0\1", dst=b"\x7f\0\0\1", p=dpkt.ip.IP_PROTO_UDP, data=udp)
        return dpkt.ethernet.Ethernet(src=bytes(6), dst=bytes(6), type=dpkt.ethernet.ETH_TYPE_IP, data=inner)
    inner = dpkt.ip6.IP6(src=bytes(16), dst=bytes(16), nxt=dpkt.ip.IP_PROTO_UDP, plen=8 + len(data), data=udp)
    inner.extension_hdrs = {}
    return dpkt.ethernet.Ethernet(src=bytes(6), dst=bytes(6), type=dpkt.ethernet.ETH_TYPE_IP6, data=inner)


def capture(path, packets, writer=dpkt.pcap.Writer, **options):
    with path.open("wb") as file:
        out = writer(file, **options)
        for time, packet in packets:
            out.writepkt(bytes(packet), time)
    return path


@pytest.mark.parametrize("writer", [dpkt.pcap.Writer, dpkt.pcapng.Writer])
def test_a_capture_of_a_game_among_other_traffic(writer, tmp_path):
    frames = motions()
    packets = [(START + k / FPS, ethernet(games.forza(m))) for k, m in enumerate(frames)]
    packets += [(START + k / 500, ethernet(b"set-points", port=47100)) for k in range(2000)]
    packets.append((START, dpkt.ethernet.Ethernet(src=bytes(6), dst=bytes(6), type=0x88CC, data=b"lldp")))
    packets.sort(key=lambda one: one[0])
    path = capture(tmp_path / "drive.pcap", packets, writer)
    flows, fault = read_capture(path)
    assert fault == ""
    assert {port: len(found) for port, found in flows.items()} == {5300: len(frames), 47100: 2000}
    assert flows[5300][1].time == pytest.approx(START + 1 / FPS, abs=1e-5)
    recording = read_recording(path)
    assert "Forza" in recording.format
    assert len(recording.tables[0].columns[0].values) == len(frames)
    trace = import_log(path).trace
    truth = np.interp(trace.time, DRIVE.time, DRIVE.specific_force[:, 1])
    assert np.sqrt(np.mean((trace.specific_force[:, 1] - truth)[100:-100] ** 2)) < 0.08


def test_captures_of_the_loopback_and_of_ip_alone(tmp_path):
    data = games.outsim(Motion())
    loopback = struct.pack("<I", 2) + bytes(ethernet(data).data)
    for link, packet in ((0, loopback), (101, bytes(ethernet(data).data)), (1, ethernet(data, version=6))):
        flows, _ = read_capture(capture(tmp_path / f"{link}.pcap", [(START, packet)], linktype=link))
        assert [one.data for one in flows[5300]] == [data]
    with pytest.raises(DataError, match="link type 105"):
        read_capture(capture(tmp_path / "wifi.pcap", [(START, loopback)], linktype=105))


def test_what_is_cut_off_is_refused_or_mended(tmp_path):
    frames = [games.forza(m) for m in motions()]
    whole = record(tmp_path / "drive.mcgd", "forza", frames).read_bytes()
    path = tmp_path / "cut.mcgd"
    path.write_bytes(whole[:-5])
    with pytest.raises(DataError, match="cut off within record"):
        read_recording(path)
    recording = read_recording(path, ImportOptions(damage="mend"))
    assert any("cut off" in change.text for change in recording.changes)
    assert len(recording.tables[0].columns[0].values) == len(frames) - 1
    packets = [(START + k / FPS, ethernet(frame)) for k, frame in enumerate(frames)]
    path = capture(tmp_path / "drive.pcap", packets)
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(DataError, match="cut off within a packet to port 5300"):
        read_recording(path)
    recording = read_recording(path, ImportOptions(damage="mend"))
    assert len(recording.tables[0].columns[0].values) == len(frames) - 1


def test_repeats_pauses_and_noise_are_left_out_and_told(tmp_path):
    frames = [games.forza(m) for m in motions()]
    with_others = []
    for k, frame in enumerate(frames):
        with_others += [frame, frame] if k % 3 == 0 else [frame]
        if k == 100:
            with_others += [games.forza(Motion(time=11.0, paused=True))] * 7 + [b"noise"]
    plain = read_recording(record(tmp_path / "plain.mcgd", "forza", frames))
    recording = read_recording(record(tmp_path / "others.mcgd", "forza", with_others))
    for one, other in zip(plain.tables[0].columns, recording.tables[0].columns, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
    said = " ".join(change.text for change in recording.changes)
    assert "7 datagrams of a pause" in said
    assert "1 datagrams of another kind" in said
    assert f"{len(range(0, len(frames), 3))} datagrams that repeat" in said


def test_files_without_telemetry_are_refused_by_name(tmp_path, monkeypatch):
    with pytest.raises(DataError, match="forsa"):
        read_recording(record(tmp_path / "a.mcgd", "forsa", [b"x"]))
    with pytest.raises(DataError, match="fewer than 2 samples"):
        read_recording(record(tmp_path / "b.mcgd", "forza", [b"x"] * 9))
    path = capture(tmp_path / "c.pcap", [(START, ethernet(b"x"))])
    with pytest.raises(DataError, match="1 to port 5300"):
        read_recording(path)
    original = builtins.__import__

    def missing(name, *rest, **others):
        if name == "dpkt":
            raise ImportError(name=name)
        return original(name, *rest, **others)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(DataError, match=r"motion-cueing-gym\[logs\]"):
        read_recording(path)
