"""BeamNG.drive, MotionSim: one datagram of 88 bytes, 20 to 2000 a second.

Source of the layout: BeamNG's page "Protocols" (modding documentation), and the comments in the game's
``motionSim.lua`` (0.2x to 0.3x). World axes are x east, y north, z up. The accelerations are those of the
vehicle's own axes, x right, y forward, z up, without gravity. There is no clock and no flag for a pause:
while it is paused the game is silent.
"""

from __future__ import annotations

import numpy as np

from ..errors import DataError
from .layout import Field, Layout
from .sample import Sample, Source, attitude_of, from_east_north_up

LAYOUT = Layout(
    "BeamNG MotionSim",
    (
        Field("magic", "4s", "`BNG1`"),
        Field("position", "3f", "m, world: x east, y north, z up"),
        Field("velocity", "3f", "m/s, world"),
        Field("acceleration", "3f", "m/s², vehicle: right, forward, up; without gravity"),
        Field("up", "3f", "the vehicle's upward axis in the world"),
        Field("angles", "3f", "rad: roll (left side down positive), pitch (nose up), yaw (to the left)"),
        Field("rates", "3f", "rad/s: roll (right side down positive), pitch (nose up), yaw (to the right)"),
        Field("angular_acceleration", "12x"),
    ),
)


class BeamNG(Source):
    """BeamNG.drive's MotionSim protocol."""

    name = "beamng"
    summary = "BeamNG.drive, MotionSim (BNG1)"
    port = 4444
    layouts = (LAYOUT,)
    tick = 0.005
    uncertain = (
        "The game negates roll and yaw before it sends them, and sends the rates as they are; the sense of "
        "the roll angle follows from that. The angles move gravity alone."
    )

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        found = LAYOUT.unpack(datagram)
        if found["magic"] != b"BNG1":
            raise DataError(f"beamng: a datagram begins with {found['magic']!r}, expected b'BNG1'")
        right, forward, up = found["acceleration"]
        roll, pitch, yaw = found["angles"]
        return Sample(
            acceleration=np.array([forward, right, -up]),
            rate=found["rates"],
            attitude=attitude_of(-roll, pitch, -yaw),
            velocity=from_east_north_up(found["velocity"]),
            position=from_east_north_up(found["position"]),
        )
