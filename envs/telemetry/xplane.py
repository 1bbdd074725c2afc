"""X-Plane 11 and 12, RREF: the simulator sends datarefs that were asked for, at the rate asked for.

Source of the layout: the file ``Instructions/Exchanging Data with X-Plane`` and the list of datarefs. An
answer is ``RREF`` and a byte, then a number and a float for each dataref. World axes are x east, y up, z
south. P, Q and R are about forward, right and down. The accelerations of the world are asked for, not the
loads ``g_axil`` and ``g_side``, whose senses the list does not say.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np

from ..errors import DataError
from .layout import Field, Layout
from .sample import Sample, Source, attitude_of, from_east_up_south

_POSITION: Final = "sim/flightmodel/position/"
DATAREFS: Final = {
    "sim/time/total_running_time_sec": "s",
    **{_POSITION + f"local_a{axis}": f"m/s², world {axis}: without gravity" for axis in "xyz"},
    _POSITION + "P": "deg/s, right side down positive",
    _POSITION + "Q": "deg/s, nose up positive",
    _POSITION + "R": "deg/s, to the right positive",
    _POSITION + "phi": "deg, roll, right side down positive",
    _POSITION + "theta": "deg, pitch, nose up positive",
    _POSITION + "psi": "deg, heading, to the right positive",
    **{_POSITION + f"local_v{axis}": f"m/s, world {axis}" for axis in "xyz"},
    **{_POSITION + f"local_{axis}": f"m, world {axis}" for axis in "xyz"},
    "sim/time/paused": "1 while paused",
    "sim/time/is_in_replay": "1 in a replay",
}
"""Datarefs that are asked for, with their units; an answer's number is the place here."""

RATE: Final = 100
"""Answers a second that are asked for; X-Plane sends at most one a frame."""

REQUEST: Final = struct.Struct("<4sxii400s")
_ANSWER: Final = struct.Struct("<if")
_HEAD: Final = 5
LAYOUT: Final = Layout(
    "X-Plane RREF",
    (
        Field("magic", "4s", "`RREF`"),
        Field("separator", "1x"),
        *(
            field
            for name, meaning in DATAREFS.items()
            for field in (Field(f"number of {name}", "4x"), Field(name, "f", meaning))
        ),
    ),
)


class XPlane(Source):
    """X-Plane's datarefs over UDP."""

    name = "xplane"
    summary = "X-Plane 11 and 12, RREF"
    port = 49010
    simulator_port = 49000
    layouts = (LAYOUT,)

    def requests(self) -> tuple[bytes, ...]:
        """A request for each dataref."""
        return tuple(
            REQUEST.pack(b"RREF", RATE, number, name.encode()) for number, name in enumerate(DATAREFS)
        )

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        if datagram[:4] != b"RREF" or (len(datagram) - _HEAD) % _ANSWER.size:
            raise DataError(f"xplane: a datagram of {len(datagram)} bytes is no answer of RREF")
        values = dict(_ANSWER.iter_unpack(datagram[_HEAD:]))
        if set(values) != set(range(len(DATAREFS))):
            raise DataError(
                f"xplane: an answer with {len(values)} datarefs, expected {len(DATAREFS)}; other programs "
                "may have asked with the same numbers"
            )
        numbers = [values[place] for place in range(len(DATAREFS))]
        roll, pitch, heading = np.radians(numbers[7:10])
        attitude = attitude_of(roll, pitch, heading)
        acceleration, velocity, position = (
            from_east_up_south(np.array(numbers[first : first + 3])) for first in (1, 10, 13)
        )
        return Sample(
            time=numbers[0],
            acceleration=attitude @ acceleration,
            rate=np.radians(numbers[4:7]),
            attitude=attitude,
            velocity=velocity,
            position=position,
            paused=bool(numbers[16] or numbers[17]),
        )
