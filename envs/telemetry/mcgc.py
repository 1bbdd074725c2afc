"""Cue packets of this project, 76 bytes: specific force and angular velocity as the controller takes them.

Source of the layout: docs/reference/real-time.md. The bridge takes them from a sender of a low or uneven
rate.
"""

from __future__ import annotations

import zlib

from ..errors import DataError
from .layout import Field, Layout
from .sample import Sample, Source

LAYOUT = Layout(
    "cues",
    (
        Field("magic", "4s", "`MCGC`"),
        Field("version", "H", "1 or 2"),
        Field("flags", "H", "in version 2, bit 0: paused"),
        Field("sequence", "8x"),
        Field("time", "d", "s"),
        Field("force", "3d", "m/s², car: specific force forward, right, down"),
        Field("rate", "3d", "rad/s, car"),
        Field("checksum", "I", "CRC-32 of all before it"),
    ),
)


class Mcgc(Source):
    """The packets that the controller itself takes."""

    name = "mcgc"
    summary = "cue packets of this project, versions 1 and 2"
    port = 47101
    layouts = (LAYOUT,)

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        found = LAYOUT.unpack(datagram)
        if found["magic"] != b"MCGC":
            raise DataError(f"mcgc: a datagram begins with {found['magic']!r}, expected b'MCGC'")
        if found["version"] not in (1, 2):
            raise DataError(f"mcgc: a packet of version {found['version']}; 1 and 2 are read")
        if zlib.crc32(datagram[:-4]) != found["checksum"]:
            raise DataError("mcgc: a packet is damaged: its checksum is wrong")
        paused = found["version"] == 2 and bool(found["flags"] & 1)
        if paused:
            return Sample(time=found["time"], paused=True)
        return Sample(time=found["time"], force=found["force"], rate=found["rate"], paused=False)
