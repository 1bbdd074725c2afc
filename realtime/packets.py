"""The datagrams of the real-time loop: cues to the controller, set-points from it. One datagram each.

Axes: x forward, y right, z down. SI units and radians. Specific force is f = a - g: (0, 0, -9.81) in a car
that stands. The plain format ("floats") is little-endian, and ends in the CRC-32 of zlib over all before it.

Cues, 76 bytes; a sender that knows no pause writes version 1, one that knows more of the car version 3:

=====  =========  ================================================================
bytes  type       content
=====  =========  ================================================================
0-3    4 bytes    ``MCGC``
4-5    uint16     version, 1 to 3
6-7    uint16     flags: from version 2 on, bit 0 says that the drive is paused;
                  in version 3, bit 1 that controls follow, and bit 2 that the
                  road does; else 0
8-15   uint64     sequence: one more for each packet
16-23  double     time of the sender's clock, s
24-47  3 doubles  specific force at the cab's reference point of the car, m/s^2
48-71  3 doubles  angular velocity of the car, rad/s
72-75  uint32     CRC-32 of bytes 0-71
=====  =========  ================================================================

In version 3 these come before the checksum, each where its flag says so:

========  ===========  =============================================================
block     type         content
========  ===========  =============================================================
controls  5 doubles    angle of the steering wheel, rad, positive to the right;
                       shares of throttle and brake; speed, m/s; side slip, rad,
                       positive to the right
road      49 doubles   distance to the next stop, m, 10000 for none; then, at each of
                       :data:`~motion_cueing.envs.road.ROAD_TIMES` by the present
                       speed (3 m/s at least): curvature, 1/m, positive to the right;
                       slope, rad, positive uphill; cross slope, rad, right side down
                       positive; speed limit, m/s. First all curvatures, and so on
========  ===========  =============================================================

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
``rate``; from version 2 on ``paused``, a boolean; in version 3 ``controls``, 5 numbers, and ``road``, 49, or
neither. Set-points: ``version``, ``state``, ``sequence``, ``echo``,
``echo_time``, ``received``, ``sent``, ``position``, ``velocity``, ``acceleration``, ``legs``, ``leg_rates``.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError, DataError, look_up
from ..envs.road import NO_STOP, ROAD_TIMES
from .watchdog import State

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]

VERSION: Final = 1
"""Of set-points, and of cues without flags; a reader refuses unknown versions."""

FLAGS_VERSION: Final = 2
"""Of cues with flags."""

KNOWN_VERSION: Final = 3
"""Of cues with the driver's controls or the road ahead."""

_PAUSED, _CONTROLS, _ROAD = 1, 2, 4
"""Bits of the flags."""

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


class Controls(NamedTuple):
    """Controls of the driver, and state of the car, at one moment.

    Args:
        wheel: Angle of the steering wheel, rad, positive to the right.
        throttle: Share.
        brake: Share.
        speed: m/s.
        slip: Side slip, rad, positive to the right.
    """

    wheel: float
    throttle: float
    brake: float
    speed: float
    slip: float = 0.0


Places = tuple[float, ...]
"""A number at each of :data:`~motion_cueing.envs.road.ROAD_TIMES`."""


class Road(NamedTuple):
    """Road ahead at one moment.

    Args:
        curvature: 1/m, positive to the right, at each of :data:`~motion_cueing.envs.road.ROAD_TIMES`.
        grade: rad, positive uphill, likewise.
        bank: rad, right side down positive, likewise.
        speed_limit: m/s, likewise.
        stop_distance: m to the next stop; :data:`~motion_cueing.envs.road.NO_STOP` where none is known.
    """

    curvature: Places
    grade: Places
    bank: Places
    speed_limit: Places
    stop_distance: float = NO_STOP

    @property
    def numbers(self) -> Places:
        """Everything in the order of a packet."""
        return (self.stop_distance, *self.curvature, *self.grade, *self.bank, *self.speed_limit)

    @classmethod
    def of(cls, numbers: Sequence[float]) -> Road:
        """From :attr:`numbers`."""
        n = len(ROAD_TIMES)
        curvature, grade, bank, limit = (tuple(numbers[1 + k * n : 1 + (k + 1) * n]) for k in range(4))
        return cls(curvature, grade, bank, limit, numbers[0])


CONTROLS_SIZE: Final = len(Controls._fields)
ROAD_SIZE: Final = 1 + 4 * len(ROAD_TIMES)
"""Numbers of each block of version 3."""


class Cues(NamedTuple):
    """Cues of the car at one moment.

    Args:
        sequence: Number of the packet, one more for each.
        time: Of the sender's clock, s.
        force: Specific force f = a - g at the cab's reference point of the car, m/s^2.
        rate: Angular velocity of the car, rad/s.
        paused: Whether the drive is paused: force and rate mean nothing, as in the menu of a game.
        controls: Of the driver, where the sender has them.
        road: Ahead, where the sender has a map.
    """

    sequence: int
    time: float
    force: Triple
    rate: Triple
    paused: bool = False
    controls: Controls | None = None
    road: Road | None = None

    @property
    def flags(self) -> int:
        """Bits for a packet."""
        return (
            _PAUSED * self.paused + _CONTROLS * (self.controls is not None) + _ROAD * (self.road is not None)
        )

    @property
    def version(self) -> int:
        """The lowest that has all of it."""
        if self.flags & (_CONTROLS | _ROAD):
            return KNOWN_VERSION
        return FLAGS_VERSION if self.paused else VERSION

    @property
    def known(self) -> Places:
        """The numbers of controls and road."""
        return (*(self.controls or ()), *(() if self.road is None else self.road.numbers))


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
        """The datagram of cues, 76 bytes, more with controls and road."""
        head = cues.version, cues.flags, cues.sequence, cues.time
        body = self._CUES.pack(self.CUES_MAGIC, *head, *cues.force, *cues.rate)
        known = cues.known
        if known:
            body += struct.pack(f"<{len(known)}d", *known)
        return body + zlib.crc32(body).to_bytes(4, "little")

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram; their numbers may be NaN.

        Raises:
            DataError: size, magic, version or checksum are wrong.
        """
        size, flags = self.CUES_SIZE, 0
        if len(data) >= self.CUES_SIZE:
            version, flags = struct.unpack_from("<HH", data, 4)
            if version != KNOWN_VERSION:
                flags &= _PAUSED if version == FLAGS_VERSION else 0
            size += 8 * (CONTROLS_SIZE * bool(flags & _CONTROLS) + ROAD_SIZE * bool(flags & _ROAD))
        body = _checked(data, size, self.CUES_MAGIC, KNOWN_VERSION)
        _, _, _, sequence, time, fx, fy, fz, wx, wy, wz = self._CUES.unpack_from(body)
        known = struct.unpack_from(f"<{(len(body) - self._CUES.size) // 8}d", body, self._CUES.size)
        controls, road = _known(known, flags)
        return Cues(sequence, time, (fx, fy, fz), (wx, wy, wz), bool(flags & _PAUSED), controls, road)

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


def _known(numbers: Sequence[float], flags: int) -> tuple[Controls | None, Road | None]:
    """Controls and road of the numbers that follow the cues."""
    first = CONTROLS_SIZE if flags & _CONTROLS else 0
    controls = Controls(*numbers[:first]) if first else None
    return controls, Road.of(numbers[first:]) if flags & _ROAD else None


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
        fields: dict[str, Any] = {"version": cues.version} | cues._asdict()
        if cues.version == VERSION:
            del fields["paused"]
        for name, block in (("controls", cues.controls), ("road", cues.road and cues.road.numbers)):
            del fields[name]
            if block is not None:
                fields[name] = list(block)
        return bytes(self._library.packb(fields))

    def unpack_cues(self, data: bytes) -> Cues:
        """The cues of a datagram; their numbers may be NaN."""
        fields = self._fields(data, KNOWN_VERSION)
        sequence = _sequence(fields, "sequence", NO_SEQUENCE - 1)
        fx, fy, fz = _numbers(fields, "force", 3)
        wx, wy, wz = _numbers(fields, "rate", 3)
        paused = fields["version"] >= FLAGS_VERSION and fields.get("paused") is True
        knows = fields["version"] == KNOWN_VERSION
        controls = road = None
        if knows and "controls" in fields:
            controls = Controls(*_numbers(fields, "controls", CONTROLS_SIZE))
        if knows and "road" in fields:
            road = Road.of(_numbers(fields, "road", ROAD_SIZE))
        time = _number("time", fields.get("time"))
        return Cues(sequence, time, (fx, fy, fz), (wx, wy, wz), paused, controls, road)

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
