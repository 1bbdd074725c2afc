"""Live for Speed, OutSim: a datagram of 64 bytes, or 68 with an identifier, up to 100 a second.

Source of the layout: the game's ``docs/InSim.txt`` and ``docs/OutSimPack.txt`` (0.6 to 0.7), with "OutSim
Opts 0". All vectors are in the world: x right, y forward at heading 0, z up. Angles turn anticlockwise seen
from above (heading), from the right (pitch) and from the front (roll). "OutSim Mode 1" is silent in replays.
"""

from __future__ import annotations

from .layout import Field, Layout
from .sample import Sample, Source, attitude_of, from_east_north_up

_FIELDS = (
    Field("time", "I", "ms"),
    Field("angular_velocity", "3f", "rad/s, world: x right, y forward at heading 0, z up"),
    Field("heading", "f", "rad, anticlockwise from above"),
    Field("pitch", "f", "rad, nose up positive"),
    Field("roll", "f", "rad, right side down positive"),
    Field("acceleration", "3f", "m/s², world, without gravity"),
    Field("velocity", "3f", "m/s, world"),
    Field("position", "3i", "1/65536 m, world"),
)


class OutSim(Source):
    """Live for Speed's OutSim protocol."""

    name = "outsim"
    summary = "Live for Speed, OutSim with OutSim Opts 0"
    port = 30000
    layouts = (
        Layout("OutSim", _FIELDS),
        Layout("OutSim with an identifier", (*_FIELDS, Field("identifier", "4x"))),
    )
    tick = 0.001
    period = 2.0**32 * 1e-3
    uncertain = "The documentation does not say whether the acceleration contains gravity; taken as without."

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        found = self.layout_of(datagram).unpack(datagram)
        attitude = attitude_of(found["roll"], found["pitch"], -found["heading"])
        return Sample(
            time=1e-3 * found["time"],
            acceleration=attitude @ from_east_north_up(found["acceleration"]),
            rate=attitude @ from_east_north_up(found["angular_velocity"]),
            attitude=attitude,
            velocity=from_east_north_up(found["velocity"]),
            position=from_east_north_up(found["position"] / 65536.0),
        )
