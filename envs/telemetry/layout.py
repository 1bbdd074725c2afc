"""Layout of a datagram as a table of fields: place, type, unit, frame and sign of each."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from ..errors import DataError

_TYPES: Final = {
    "f": "float", "d": "double", "i": "int32", "I": "uint32", "h": "int16", "H": "uint16", "B": "uint8",
    "b": "int8", "Q": "uint64", "s": "bytes", "x": "not read",
}  # fmt: skip


class Field(NamedTuple):
    """One field of a datagram.

    Args:
        name: Of the field, as the protocol's description has it or close to it.
        code: Type as in :mod:`struct`, with a count: ``3f`` are three floats, ``164x`` skips bytes.
        meaning: Unit, frame and sign, for people.
    """

    name: str
    code: str
    meaning: str = ""

    @property
    def length(self) -> int:
        """Numbers in it."""
        return int(self.code[:-1] or 1)

    @property
    def read(self) -> bool:
        """Whether its content is read."""
        return self.code[-1] != "x"

    @property
    def type(self) -> str:
        """Its type, for people."""
        kind = _TYPES[self.code[-1]]
        return kind if self.length == 1 else f"{self.length} {kind}{'' if self.code[-1] in 'sx' else 's'}"


class Layout:
    """Fields of a datagram, one behind the other without padding.

    Args:
        name: Of the datagram, for messages.
        fields: All of it, from the first byte on.
        order: Of the bytes, as in :mod:`struct`: ``<`` for little-endian.

    Attributes:
        size: Of a datagram, bytes.
    """

    def __init__(self, name: str, fields: Sequence[Field], order: str = "<") -> None:
        self.name, self.fields = name, tuple(fields)
        self._struct = struct.Struct(order + "".join(field.code for field in fields))
        self.size = self._struct.size

    def unpack(self, data: bytes) -> dict[str, Any]:
        """The content by field: a number, bytes, or (n,) numbers where a field has several.

        Raises:
            DataError: the size is wrong.
        """
        if len(data) != self.size:
            raise DataError(f"{self.name}: a datagram of {len(data)} bytes, expected {self.size}")
        values = iter(self._struct.unpack(data))
        found: dict[str, Any] = {}
        for field in self.fields:
            if not field.read:
                continue
            if field.code[-1] == "s" or field.length == 1:
                found[field.name] = next(values)
            else:
                found[field.name] = np.array([next(values) for _ in range(field.length)], dtype=np.float64)
        return found

    def rows(self) -> list[tuple[str, str, str, str]]:
        """First and last byte, type, name and meaning of each field that is read."""
        rows, place = [], 0
        for field in self.fields:
            size = struct.calcsize("<" + field.code)
            if field.read:
                bytes_of = str(place) if size == 1 else f"{place}-{place + size - 1}"
                rows.append((bytes_of, field.type, field.name, field.meaning))
            place += size
        return rows
