"""F1 23 and F1 24, UDP telemetry: motion (1349 bytes, up to 60 a second) and session (for its pause flag).

Source of the layout: EA's "Data Output from F1 23" and its successor for F1 24. The motion packet has 22
cars of 60 bytes behind a header of 29; the player's is ``player``. World axes have y up. The directions of
the car are whole numbers, 32767 for 1. Attitude and angular velocity are from the directions, and the
vertical acceleration is from the velocity, since the description says neither the sense of the angles nor
whether the vertical load contains gravity. F1 22 and earlier have another header and are refused.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..errors import DataError
from .codemasters import sample_of
from .layout import Field, Layout
from .sample import Sample, Source

_HEADER = (
    Field("format", "H", "2023 or 2024"),
    Field("versions", "4x"),
    Field("kind", "B", "0 motion, 1 session"),
    Field("session", "8x"),
    Field("time", "f", "s of the session"),
    Field("frame", "I", "number of the frame"),
    Field("overall_frame", "4x"),
    Field("player", "B", "the player's car, 0 to 21"),
    Field("second_player", "1x"),
)
HEADER: Final = Layout("F1, header", _HEADER)
CAR: Final = Layout(
    "F1, motion of a car",
    (
        Field("position", "3f", "m, world with y up"),
        Field("velocity", "3f", "m/s, world"),
        Field("forward", "3h", "1/32767, direction in the world"),
        Field("right", "3h", "1/32767, direction in the world"),
        Field("lateral", "f", "g, to the right positive"),
        Field("longitudinal", "f", "g, forward positive"),
        Field("vertical", "4x"),
        Field("angles", "12x"),
    ),
)
_CARS: Final = 22
_FORMATS: Final = (2023, 2024)
_PAUSE: Final = Layout(
    "F1, session", (Field("before", "14x"), Field("paused", "B", "1 while paused"), Field("spectating", "B"))
)
"""Behind the header of a session packet."""

MOTION: Final = Layout("F1, motion", (*_HEADER, Field("cars", f"{CAR.size * _CARS}x")))
_SESSIONS: Final = {2023: 644, 2024: 753}


class F1(Source):
    """EA's and Codemasters' F1 23 and F1 24."""

    name = "f1"
    summary = "F1 23 and F1 24, UDP format of the same year"
    port = 20777
    layouts = (MOTION, CAR)
    uncertain = (
        "The sense of the lateral load, and whether the horizontal loads contain gravity, are not described; "
        "taken as to the right, and as without."
    )

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        if len(datagram) < HEADER.size:
            raise DataError(f"f1: a datagram of {len(datagram)} bytes is shorter than its header")
        head = HEADER.unpack(datagram[: HEADER.size])
        if head["format"] not in _FORMATS:
            raise DataError(f"f1: a datagram of format {head['format']}; 2023 and 2024 are read")
        if head["kind"] == 1:
            return self._session(datagram, head["format"])
        if head["kind"] != 0:
            return None
        if len(datagram) != MOTION.size:
            raise DataError(f"f1: a motion packet of {len(datagram)} bytes, expected {MOTION.size}")
        if head["player"] >= _CARS:
            return None
        first = HEADER.size + CAR.size * head["player"]
        car = CAR.unpack(datagram[first : first + CAR.size])
        if not np.any(car["forward"]):
            # Nobody sits in that car.
            return Sample(time=head["time"], paused=True)
        return sample_of(
            head["time"],
            car["forward"] / 32767.0,
            car["right"] / 32767.0,
            car["velocity"],
            car["position"],
            (car["longitudinal"], car["lateral"]),
        )

    def _session(self, datagram: bytes, version: int) -> Sample:
        if len(datagram) != _SESSIONS[version]:
            raise DataError(f"f1: a session packet of {len(datagram)} bytes, expected {_SESSIONS[version]}")
        found = _PAUSE.unpack(datagram[HEADER.size : HEADER.size + _PAUSE.size])
        return Sample(paused=bool(found["paused"] or found["spectating"]))
