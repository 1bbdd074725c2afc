"""Sender of cues to ``motion-cueing serve``, in one file. Python 3.8 or later, no package.

Axes of the car: x forward, y to the right, z down. SI units, radians. The specific force is f = a - g: a car
that stands has (0, 0, -9.81). Send a packet for each step of your simulation, at 100 Hz or more. While your
simulation is paused, go on sending with ``paused=True``::

    with Sender("127.0.0.1", 47100) as sender:
        sender.send(seconds, force, rate)
        for setpoint in sender.receive():
            ...

The layout of the packets: docs/reference/real-time.md.
"""

from __future__ import annotations

import socket
import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

_CUES = struct.Struct("<4sHHQ7d")
_SETPOINT = struct.Struct("<4sHBBQQ3d39d")
NEUTRAL, RUNNING, HOLDING, BRAKING = range(4)


class SetPoint(NamedTuple):
    """Set-point of the machine, from neutral, m and rad.

    Axes: carriage x, y; surge, sway, heave, roll, pitch, yaw of the hexapod; turntable.
    """

    state: int
    sequence: int
    echo: int
    echo_time: float
    received: float
    sent: float
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]
    legs: tuple[float, ...]
    leg_rates: tuple[float, ...]


def pack(
    sequence: int, time: float, force: Sequence[float], rate: Sequence[float], paused: bool = False
) -> bytes:
    """The packet of cues: time in s of your clock, force in m/s^2, rate in rad/s."""
    head = (2, 1) if paused else (1, 0)
    body = _CUES.pack(b"MCGC", *head, sequence, time, *force, *rate)
    return body + struct.pack("<I", zlib.crc32(body))


def unpack(data: bytes) -> SetPoint | None:
    """The set-point in a packet; None if size, mark, version or checksum are wrong."""
    if len(data) != _SETPOINT.size + 4 or data[-4:] != struct.pack("<I", zlib.crc32(data[:-4])):
        return None
    magic, version, state, _, sequence, echo, echo_time, received, sent, *motion = _SETPOINT.unpack(data[:-4])
    if magic != b"MCGS" or version != 1 or state > BRAKING:
        return None
    places = ((0, 9), (9, 18), (18, 27), (27, 33), (33, 39))
    parts = (tuple(motion[first:last]) for first, last in places)
    return SetPoint(state, sequence, echo, echo_time, received, sent, *parts)


class Sender:
    """Sends cues to a controller, and receives its set-points without waiting."""

    def __init__(self, host: str = "127.0.0.1", port: int = 47100) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((host, port))
        self._socket.setblocking(False)
        self.sequence = 0

    def __enter__(self) -> Sender:
        return self

    def __exit__(self, *error: object) -> None:
        self._socket.close()

    def send(self, time: float, force: Sequence[float], rate: Sequence[float], paused: bool = False) -> bool:
        """Send cues; False if the network refuses them: they are lost, and the next may pass."""
        packet = pack(self.sequence, time, force, rate, paused)
        self.sequence += 1
        try:
            return self._socket.send(packet) == len(packet)
        except OSError:
            return False

    def receive(self) -> Iterator[SetPoint]:
        """The set-points that have arrived."""
        while True:
            try:
                data = self._socket.recv(1024)
            except OSError:
                return
            setpoint = unpack(data)
            if setpoint is not None:
                yield setpoint
