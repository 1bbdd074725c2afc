"""What goes over the wire: cues to the controller, set-points from it; as little-endian numbers.

docs/loop.md has the layout byte by byte.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError, DataError, look_up
from .watchdog import State

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]

VERSION: Final = 1
"""Of both packets; a reader refuses others."""

LARGEST: Final = 2048
"""Bytes of a datagram that is looked at; ours are far below."""

NO_SEQUENCE: Final = 2**64 - 1
"""Echoed before any cues have come."""

MOTION: Final = {
    "position": slice(0, 9),
    "velocity": slice(9, 18),
    "acceleration": slice(18, 27),
    "legs": slice(27, 33),
    "leg_rates": slice(33, 39),
}
"""Where each part of a set-point's motion lies among its numbers."""

MOTION_SIZE: Final = 39
"""Numbers of a set-point's motion."""


class Cues(NamedTuple):
    """What the driver of the car feels at a moment.

    Args:
        sequence: Number of the packet, one more for each.
        time: Of the sender's clock, s.
        force: Specific force f = a - g at the cab's reference point of the car, m/s^2; x forward, y right,
            z down.
        rate: Angular velocity of the car, rad/s.
    """

    sequence: int
    time: float
    force: Triple
    rate: Triple


class SetPoint(NamedTuple):
    """Where the machine is to be at the end of a period, and what the controller is doing.

    Args:
        state: Of the controller.
        sequence: Number of the set-point, one more for each.
        echo: Number of the cues that last moved the machine, or :data:`NO_SEQUENCE`.
        echo_time: Their time stamp, s of the sender's clock.
        received: When they came, s of the controller's clock.
        sent: When this was made, s of the same.
        motion: (39,) position, velocity and acceleration of the nine axes in the order of ``AXES``,
            extensions and rates of the legs, as in :data:`MOTION`; SI units, from neutral.
    """

    state: State
    sequence: int
    echo: int
    echo_time: float
    received: float
    sent: float
    motion: Floats

    def part(self, name: str) -> Floats:
        """A part of the motion, by its name in :data:`MOTION`."""
        return self.motion[MOTION[name]]


class Format(Protocol):
    """Turns packets into bytes, and back; what is broken raises a DataError."""

    @property
    def name(self) -> str:
        """What it is called on the command line."""
        ...

    def pack_cues(self, cues: Cues) -> bytes:
        """A datagram of cues."""
        ...

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram; their numbers may be NaN."""
        ...

    def pack_setpoint(self, setpoint: SetPoint) -> bytes:
        """A datagram of a set-point."""
        ...

    def unpack_setpoint(self, data: bytes) -> SetPoint:
        """The set-point of a datagram."""
        ...


class FloatsFormat:
    """Little-endian doubles between a header and a CRC-32 of all before it."""

    name = "floats"

    _CUES: Final = struct.Struct("<4sHHQ7d")
    _HEAD: Final = struct.Struct("<4sHBBQQ3d")
    _CRC: Final = struct.Struct("<I")
    CUES_MAGIC: Final = b"MCGC"
    SETPOINT_MAGIC: Final = b"MCGS"
    CUES_SIZE: Final = _CUES.size + _CRC.size
    SETPOINT_SIZE: Final = _HEAD.size + 8 * MOTION_SIZE + _CRC.size

    def pack_cues(self, cues: Cues) -> bytes:
        """76 bytes."""
        body = self._CUES.pack(self.CUES_MAGIC, VERSION, 0, cues.sequence, cues.time, *cues.force, *cues.rate)
        return self._sealed(body)

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram.

        Raises:
            DataError: size, magic, version or checksum are wrong.
        """
        body = self._opened(data, self.CUES_SIZE, self.CUES_MAGIC)
        _, _, _, sequence, time, fx, fy, fz, wx, wy, wz = self._CUES.unpack(body)
        return Cues(sequence, time, (fx, fy, fz), (wx, wy, wz))

    def pack_setpoint(self, setpoint: SetPoint) -> bytes:
        """364 bytes."""
        head = self._HEAD.pack(self.SETPOINT_MAGIC, VERSION, setpoint.state, 0, *setpoint[1:6])
        return self._sealed(head + np.asarray(setpoint.motion, dtype="<f8").tobytes())

    def unpack_setpoint(self, data: bytes) -> SetPoint:
        """The set-point of a datagram.

        Raises:
            DataError: size, magic, version, checksum or state are wrong.
        """
        body = self._opened(data, self.SETPOINT_SIZE, self.SETPOINT_MAGIC)
        _, _, state, _, sequence, echo, echo_time, received, sent = self._HEAD.unpack_from(body)
        motion = np.frombuffer(body, dtype="<f8", offset=self._HEAD.size).astype(np.float64)
        return SetPoint(state_of(state), sequence, echo, echo_time, received, sent, motion)

    def _sealed(self, body: bytes) -> bytes:
        return body + self._CRC.pack(zlib.crc32(body))

    def _opened(self, data: bytes, size: int, magic: bytes) -> bytes:
        """What lies before the checksum."""
        if len(data) != size:
            raise DataError(f"packet of {len(data)} bytes, expected {size}")
        body = data[:-4]
        if body[:4] != magic:
            raise DataError(f"packet begins with {body[:4]!r}, expected {magic!r}")
        version = int.from_bytes(body[4:6], "little")
        if version != VERSION:
            raise DataError(f"packet of version {version}, expected {VERSION}")
        if zlib.crc32(body) != self._CRC.unpack(data[-4:])[0]:
            raise DataError("packet is damaged: its checksum is wrong")
        return body


def state_of(value: Any) -> State:
    """The state of a number.

    Raises:
        DataError: there is none.
    """
    try:
        return State(value)
    except ValueError:
        raise DataError(f"packet: there is no state {value!r}") from None


# The same packets in MessagePack, for senders that have a library for it; docs/loop.md has the fields.


_HEAD: Final = ("sequence", "echo", "echo_time", "received", "sent")


class MessagePackFormat:
    """Maps with the names of the fields.

    Raises:
        ConfigurationError: the library is missing.
    """

    name = "msgpack"

    def __init__(self) -> None:
        try:
            self._library: Any = import_module("msgpack")
        except ImportError:
            raise ConfigurationError(
                "--format msgpack needs a package: pip install 'motion-cueing-gym[loop]'"
            ) from None

    def pack_cues(self, cues: Cues) -> bytes:
        """A map of version, sequence, time, force and rate."""
        return self._packed({"version": VERSION} | cues._asdict())

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram.

        Raises:
            DataError: it is no such map.
        """
        fields = self._fields(data)
        sequence = _sequence(fields.get("sequence"), NO_SEQUENCE - 1)
        fx, fy, fz = _numbers("force", fields.get("force"), 3)
        wx, wy, wz = _numbers("rate", fields.get("rate"), 3)
        return Cues(sequence, _number("time", fields.get("time")), (fx, fy, fz), (wx, wy, wz))

    def pack_setpoint(self, setpoint: SetPoint) -> bytes:
        """A map of version, state, sequences, times and the parts of the motion."""
        head = {name: getattr(setpoint, name) for name in _HEAD}
        parts = {name: setpoint.part(name).tolist() for name in MOTION}
        return self._packed({"version": VERSION, "state": int(setpoint.state)} | head | parts)

    def unpack_setpoint(self, data: bytes) -> SetPoint:
        """The set-point of a datagram.

        Raises:
            DataError: it is no such map.
        """
        fields = self._fields(data)
        sequences = [_sequence(fields.get(name), NO_SEQUENCE) for name in _HEAD[:2]]
        times = [_number(name, fields.get(name)) for name in _HEAD[2:]]
        motion = np.zeros(MOTION_SIZE)
        for name, where in MOTION.items():
            motion[where] = _numbers(name, fields.get(name), where.stop - where.start)
        return SetPoint(
            state_of(fields.get("state")), sequences[0], sequences[1], times[0], times[1], times[2], motion
        )

    def _packed(self, fields: dict[str, Any]) -> bytes:
        return bytes(self._library.packb(fields))

    def _fields(self, data: bytes) -> dict[str, Any]:
        if len(data) > LARGEST:
            raise DataError(f"packet of {len(data)} bytes, at most {LARGEST} are read")
        try:
            fields = self._library.unpackb(data)
        except (ValueError, TypeError, RecursionError, self._library.UnpackException) as error:
            raise DataError(f"packet is not MessagePack ({error})") from None
        if not isinstance(fields, dict):
            raise DataError(f"packet is no map but {type(fields).__name__}")
        if fields.get("version") != VERSION:
            raise DataError(f"packet of version {fields.get('version')!r}, expected {VERSION}")
        return fields


def _sequence(value: Any, largest: int) -> int:
    if type(value) is not int or not 0 <= value <= largest:
        raise DataError(f"packet: a sequence number must be from 0 to {largest}, found {value!r:.40}")
    return value


def _number(name: str, value: Any) -> float:
    if type(value) not in (int, float):
        raise DataError(f"packet: {name} must be a number, found {value!r:.40}")
    return float(value)


def _numbers(name: str, values: Any, count: int) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise DataError(f"packet: {name} must be {count} numbers, found {values!r:.40}")
    return [_number(name, value) for value in values]


# How packets are written, by name.


_FORMATS: Final[Mapping[str, Callable[[], Format]]] = {
    FloatsFormat.name: FloatsFormat,
    MessagePackFormat.name: MessagePackFormat,
}


def make_format(name: str) -> Format:
    """A format by name: floats or msgpack.

    Raises:
        UnknownNameError: there is none of this name.
        ConfigurationError: its library is missing.
    """
    return look_up("format", name, _FORMATS)()
