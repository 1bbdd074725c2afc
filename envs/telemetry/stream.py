"""Recorded datagrams: a file of this project, and captures of a network.

The file begins with a head, and has a record for each datagram; all numbers are little-endian:

=======  ==========  ==============================================
bytes    type        content
=======  ==========  ==============================================
0-7      8 bytes     ``MCGDGRAM``
8-9      uint16      version, 1
10-11    uint16      length n of the source's name
12-      n bytes     name of the source, as ``bridge --from`` has it
=======  ==========  ==============================================

=======  ==========  ==============================================
bytes    type        content of a record
=======  ==========  ==============================================
0-7      double      when the datagram arrived, s since 1970
8-9      uint16      its length m
10-      m bytes     the datagram
=======  ==========  ==============================================
"""

from __future__ import annotations

import contextlib
import io
import struct
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Final, NamedTuple

from typing_extensions import Self

from ..errors import ConfigurationError, DataError, reason
from ..limits import LARGEST_TABLE, read_bytes

MAGIC: Final = b"MCGDGRAM"
VERSION: Final = 1
_HEAD: Final = struct.Struct("<8sHH")
_RECORD: Final = struct.Struct("<dH")
CAPTURE_MAGICS: Final = (
    b"\xa1\xb2\xc3\xd4", b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\x3c\x4d", b"\x4d\x3c\xb2\xa1", b"\x0a\x0d\x0d\x0a",
)  # fmt: skip
"""First bytes of pcap, of its variant with nanoseconds, and of pcapng."""


class Datagram(NamedTuple):
    """A datagram with the time of its arrival, s since 1970."""

    time: float
    data: bytes


class StreamWriter:
    """Writes datagrams as they arrive.

    Args:
        path: A new file.
        source: Name of the protocol.

    Raises:
        ConfigurationError: the file is there already.
    """

    def __init__(self, path: Path, source: str) -> None:
        try:
            self._file: BinaryIO = path.open("xb")
        except FileExistsError:
            raise ConfigurationError(f"{path} is there already; move it away, or name another file") from None
        name = source.encode()
        self._file.write(_HEAD.pack(MAGIC, VERSION, len(name)) + name)

    def __enter__(self) -> Self:
        """The writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._file.close()

    def add(self, datagram: Datagram) -> None:
        """Write a datagram."""
        self._file.write(_RECORD.pack(datagram.time, len(datagram.data)) + datagram.data)


def read_stream(path: Path) -> tuple[str, list[Datagram], str]:
    """Source and datagrams of a file of :class:`StreamWriter`, and its fault; empty if it is whole.

    Raises:
        DataError: it cannot be read, or is none.
    """
    content = _content(path)
    if len(content) < _HEAD.size:
        raise DataError(f"{path}: {len(content)} bytes are too few for a recording of datagrams")
    magic, version, length = _HEAD.unpack_from(content)
    if magic != MAGIC or version != VERSION:
        raise DataError(f"{path}: it begins with {magic!r}, version {version}; {MAGIC!r}, version 1, is read")
    place = _HEAD.size + length
    name = content[_HEAD.size : place].decode("utf-8", errors="replace")
    found: list[Datagram] = []
    while place < len(content):
        begin = place + _RECORD.size
        if begin > len(content):
            return name, found, f"it is cut off within record {len(found) + 1}"
        time, size = _RECORD.unpack_from(content, place)
        if begin + size > len(content):
            return name, found, f"it is cut off within record {len(found) + 1}"
        found.append(Datagram(time, content[begin : begin + size]))
        place = begin + size
    return name, found, ""


def read_capture(path: Path) -> tuple[dict[int, list[Datagram]], str]:
    """UDP datagrams of a capture (pcap or pcapng) by the port they went to, and its fault; empty if whole.

    Raises:
        DataError: it cannot be read, or its packets have no IP.
        ImportError: dpkt is missing.
    """
    import dpkt  # type: ignore[import-untyped]

    flows: dict[int, list[Datagram]] = {}
    content, fault = io.BytesIO(_content(path)), ""
    try:
        reader = dpkt.pcap.UniversalReader(content)
    except (ValueError, struct.error) as error:
        raise DataError(f"{path}: no capture that can be read ({error})") from None
    if reader.datalink() not in _LINKS:
        raise DataError(
            f"{path}: link type {reader.datalink()} is not read; capture Ethernet or the loopback"
        )
    link = _LINKS[reader.datalink()](dpkt)
    try:
        for time, packet in reader:
            layer: Any = None
            with contextlib.suppress(dpkt.UnpackError, struct.error, IndexError):
                layer = link(packet)
            while isinstance(layer, dpkt.Packet) and not isinstance(layer, dpkt.udp.UDP):
                layer = layer.data
            if isinstance(layer, dpkt.udp.UDP) and len(layer.data) < layer.ulen - 8:
                fault = f"the capture is cut off within a packet to port {layer.dport}"
            elif isinstance(layer, dpkt.udp.UDP):
                flows.setdefault(int(layer.dport), []).append(Datagram(float(time), bytes(layer.data)))
    except (ValueError, struct.error, dpkt.Error) as error:
        fault = f"the capture is damaged ({error})"
    return flows, fault


_LINKS: Final[dict[int, Callable[[Any], Any]]] = {
    0: lambda dpkt: dpkt.loopback.Loopback,
    1: lambda dpkt: dpkt.ethernet.Ethernet,
    12: lambda dpkt: dpkt.ip.IP,
    101: lambda dpkt: dpkt.ip.IP,
    108: lambda dpkt: dpkt.loopback.Loopback,
    113: lambda dpkt: dpkt.sll.SLL,
    228: lambda dpkt: dpkt.ip.IP,
    276: lambda dpkt: dpkt.sll2.SLL2,
}
"""What unpacks a packet, by the number of the capture's link type."""


def _content(path: Path) -> bytes:
    try:
        return read_bytes(path, LARGEST_TABLE)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
