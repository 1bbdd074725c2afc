"""The same packets in MessagePack, for senders that have a library for it; docs/loop.md has the fields."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final

import numpy as np

from ...envs.errors import ConfigurationError, DataError
from .packets import LARGEST, MOTION, MOTION_SIZE, NO_SEQUENCE, VERSION, Cues, SetPoint, state_of

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
