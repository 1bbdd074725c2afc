"""The datagrams of the real-time loop: cues to the controller, set-points from it. One datagram each.

Axes: x forward, y right, z down. SI units and radians. Specific force is f = a - g: (0, 0, -9.81) in a car
that stands. The plain format ("floats") is little-endian, and ends in the CRC-32 of zlib over all before it.

Cues, 76 bytes; a sender that knows no pause writes version 1:

=====  =========  ================================================================
bytes  type       content
=====  =========  ================================================================
0-3    4 bytes    ``MCGC``
4-5    uint16     version, 1 or 2
6-7    uint16     flags: in version 2, bit 0 says that the drive is paused; else 0
8-15   uint64     sequence: one more for each packet
16-23  double     time of the sender's clock, s
24-47  3 doubles  specific force at the cab's reference point of the car, m/s^2
48-71  3 doubles  angular velocity of the car, rad/s
72-75  uint32     CRC-32 of bytes 0-71
=====  =========  ================================================================

Set-points, version 1, 364 bytes, for the end of the period that begins when they are sent:

=======  =========  =================================================================================
bytes    type       content
=======  =========  =================================================================================
0-3      4 bytes    ``MCGS``
4-5      uint16     version, 1
6        uint8      state of the controller, see :class:`~.watchdog.State`
7        uint8      0
8-15     uint64     sequence: one more for each set-point
16-23    uint64     echo: sequence of the cues that last moved the machine; 2^64 - 1 before any
24-31    double     their time stamp, s of the sender's clock
32-39    double     when they arrived, s of the controller's clock
40-47    double     when this set-point was made, s of the controller's clock
48-119   9 doubles  positions: carriage x, y; surge, sway, heave, roll, pitch, yaw from neutral; turntable
120-191  9 doubles  velocities of the same (Euler rates)
192-263  9 doubles  accelerations of the same
264-311  6 doubles  extensions of legs 1 to 6 from neutral, m
312-359  6 doubles  their rates, m/s
360-363  uint32     CRC-32 of bytes 0-359
=======  =========  =================================================================================

MessagePack ("msgpack") has the same content as maps. Cues: ``version``, ``sequence``, ``time``, ``force``,
``rate``; in version 2 ``paused``, a boolean. Set-points: ``version``, ``state``, ``sequence``, ``echo``,
``echo_time``, ``received``, ``sent``, ``position``, ``velocity``, ``acceleration``, ``legs``, ``leg_rates``.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError, DataError, look_up
from .watchdog import State

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]

VERSION: Final = 1
"""Of set-points, and of cues without flags; a reader refuses unknown versions."""

FLAGS_VERSION: Final = 2
"""Of cues with flags."""

_PAUSED: Final = 1

LARGEST: Final = 2048
"""Longest datagram that is read, bytes."""

NO_SEQUENCE: Final = 2**64 - 1
"""Echo before any cues have arrived."""

MOTION: Final = {
    "position": slice(0, 9),
    "velocity": slice(9, 18),
    "acceleration": slice(18, 27),
    "legs": slice(27, 33),
    "leg_rates": slice(33, 39),
}
"""Parts of a set-point's motion."""

MOTION_SIZE: Final = 39


class Cues(NamedTuple):
    """Cues of the car at one moment.

    Args:
        sequence: Number of the packet, one more for each.
        time: Of the sender's clock, s.
        force: Specific force f = a - g at the cab's reference point of the car, m/s^2.
        rate: Angular velocity of the car, rad/s.
        paused: Whether the drive is paused: force and rate mean nothing, as in the menu of a game.
    """

    sequence: int
    time: float
    force: Triple
    rate: Triple
    paused: bool = False


class SetPoint(NamedTuple):
    """Set-point of the machine for the end of a period, with the state of the controller.

    Args:
        state: Of the controller.
        sequence: Number of the set-point, one more for each.
        echo: Sequence of the cues that last moved the machine, or :data:`NO_SEQUENCE`.
        echo_time: Their time stamp, s of the sender's clock.
        received: When they arrived, s of the controller's clock.
        sent: When this was made, s of the controller's clock.
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


class FloatsFormat:
    """The plain binary format; a broken packet raises a DataError."""

    name = "floats"

    _CUES: Final = struct.Struct("<4sHHQ7d")
    _HEAD: Final = struct.Struct("<4sHBBQQ3d")
    CUES_MAGIC: Final = b"MCGC"
    SETPOINT_MAGIC: Final = b"MCGS"
    CUES_SIZE: Final = _CUES.size + 4
    SETPOINT_SIZE: Final = _HEAD.size + 8 * MOTION_SIZE + 4

    def pack_cues(self, cues: Cues) -> bytes:
        """The datagram of cues, 76 bytes."""
        flags = (FLAGS_VERSION, _PAUSED) if cues.paused else (VERSION, 0)
        body = self._CUES.pack(self.CUES_MAGIC, *flags, cues.sequence, cues.time, *cues.force, *cues.rate)
        return body + zlib.crc32(body).to_bytes(4, "little")

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram; their numbers may be NaN.

        Raises:
            DataError: size, magic, version or checksum are wrong.
        """
        body = _checked(data, self.CUES_SIZE, self.CUES_MAGIC, FLAGS_VERSION)
        _, version, flags, sequence, time, fx, fy, fz, wx, wy, wz = self._CUES.unpack(body)
        paused = version == FLAGS_VERSION and bool(flags & _PAUSED)
        return Cues(sequence, time, (fx, fy, fz), (wx, wy, wz), paused)

    def pack_setpoint(self, setpoint: SetPoint) -> bytes:
        """The datagram of a set-point, 364 bytes."""
        head = self._HEAD.pack(self.SETPOINT_MAGIC, VERSION, setpoint.state, 0, *setpoint[1:6])
        body = head + np.asarray(setpoint.motion, dtype="<f8").tobytes()
        return body + zlib.crc32(body).to_bytes(4, "little")

    def unpack_setpoint(self, data: bytes) -> SetPoint:
        """The set-point of a datagram; its numbers may be NaN.

        Raises:
            DataError: size, magic, version, checksum or state are wrong.
        """
        body = _checked(data, self.SETPOINT_SIZE, self.SETPOINT_MAGIC, VERSION)
        _, _, state, _, sequence, echo, echo_time, received, sent = self._HEAD.unpack_from(body)
        motion = np.frombuffer(body, dtype="<f8", offset=self._HEAD.size).astype(np.float64)
        return SetPoint(_state(state), sequence, echo, echo_time, received, sent, motion)


def _checked(data: bytes, size: int, magic: bytes, newest: int) -> bytes:
    """The bytes before the checksum of a packet of the expected size, kind and version, 1 to ``newest``."""
    if len(data) != size:
        raise DataError(f"packet of {len(data)} bytes, expected {size}")
    body = data[:-4]
    if body[:4] != magic:
        raise DataError(f"packet begins with {body[:4]!r}, expected {magic!r}")
    version = int.from_bytes(body[4:6], "little")
    if not VERSION <= version <= newest:
        raise DataError(f"packet of version {version}; versions up to {newest} are read")
    if zlib.crc32(body) != int.from_bytes(data[-4:], "little"):
        raise DataError("packet is damaged: its checksum is wrong")
    return body


class MessagePackFormat:
    """Maps with the names of the fields, for senders with a MessagePack library; raises as FloatsFormat does.

    Raises:
        ConfigurationError: the library is missing.
    """

    name = "msgpack"

    def __init__(self) -> None:
        try:
            import msgpack  # type: ignore[import-untyped]
        except ImportError:
            raise ConfigurationError(
                "--format msgpack needs a package: pip install 'motion-cueing-gym[loop]'"
            ) from None
        self._library: Any = msgpack

    def pack_cues(self, cues: Cues) -> bytes:
        """The datagram of cues."""
        fields = {"version": FLAGS_VERSION if cues.paused else VERSION} | cues._asdict()
        if not cues.paused:
            del fields["paused"]
        return bytes(self._library.packb(fields))

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram; their numbers may be NaN."""
        fields = self._fields(data, FLAGS_VERSION)
        sequence = _sequence(fields, "sequence", NO_SEQUENCE - 1)
        fx, fy, fz = _numbers(fields, "force", 3)
        wx, wy, wz = _numbers(fields, "rate", 3)
        paused = fields["version"] == FLAGS_VERSION and fields.get("paused") is True
        return Cues(sequence, _number("time", fields.get("time")), (fx, fy, fz), (wx, wy, wz), paused)

    def pack_setpoint(self, setpoint: SetPoint) -> bytes:
        """The datagram of a set-point."""
        fields = {"version": VERSION} | setpoint._asdict() | {"state": int(setpoint.state)}
        del fields["motion"]
        parts = {name: setpoint.part(name).tolist() for name in MOTION}
        return bytes(self._library.packb(fields | parts))

    def unpack_setpoint(self, data: bytes) -> SetPoint:
        """The set-point of a datagram; its numbers may be NaN."""
        fields = self._fields(data, VERSION)
        motion = np.zeros(MOTION_SIZE)
        for name, part in MOTION.items():
            motion[part] = _numbers(fields, name, part.stop - part.start)
        return SetPoint(
            state=_state(fields.get("state")),
            sequence=_sequence(fields, "sequence", NO_SEQUENCE),
            echo=_sequence(fields, "echo", NO_SEQUENCE),
            echo_time=_number("echo_time", fields.get("echo_time")),
            received=_number("received", fields.get("received")),
            sent=_number("sent", fields.get("sent")),
            motion=motion,
        )

    def _fields(self, data: bytes, newest: int) -> dict[str, Any]:
        if len(data) > LARGEST:
            raise DataError(f"packet of {len(data)} bytes, at most {LARGEST} are read")
        try:
            fields = self._library.unpackb(data)
        except (ValueError, TypeError, RecursionError, self._library.UnpackException) as error:
            raise DataError(f"packet is not MessagePack ({error})") from None
        if not isinstance(fields, dict):
            raise DataError(f"packet is no map but {type(fields).__name__}")
        if fields.get("version") not in range(VERSION, newest + 1):
            raise DataError(
                f"packet of version {fields.get('version')!r:.40}; versions up to {newest} are read"
            )
        return fields


def _state(value: Any) -> State:
    try:
        return State(value)
    except ValueError:
        raise DataError(f"packet: there is no state {value!r}") from None


def _sequence(fields: dict[str, Any], name: str, largest: int) -> int:
    value = fields.get(name)
    if type(value) is not int or not 0 <= value <= largest:
        raise DataError(f"packet: {name} must be a number from 0 to {largest}, found {value!r:.40}")
    return value


def _number(name: str, value: Any) -> float:
    if type(value) not in (int, float):
        raise DataError(f"packet: {name} must be a number, found {value!r:.40}")
    return float(value)


def _numbers(fields: dict[str, Any], name: str, count: int) -> list[float]:
    values = fields.get(name)
    if not isinstance(values, list) or len(values) != count:
        raise DataError(f"packet: {name} must be {count} numbers, found {values!r:.40}")
    return [_number(name, value) for value in values]


Format: TypeAlias = FloatsFormat | MessagePackFormat


def make_format(name: str) -> Format:
    """A wire format by name: floats or msgpack.

    Raises:
        UnknownNameError: there is none of this name.
        ConfigurationError: its library is missing.
    """
    formats: dict[str, type[Format]] = {form.name: form for form in (FloatsFormat, MessagePackFormat)}
    return look_up("format", name, formats)()
