"""Forza "Data Out": 232 bytes (sled), 311 (Motorsport 7), 331 (Motorsport 2023), 324 (Horizon 4 to 6), 60 Hz.

Source of the layout: the game's support page "Data Out Documentation". All of them begin with the sled's 232
bytes, which have every cue. Vectors are in the car's left-handed axes: x right, y up, z forward. A positive
turn about an axis of a left-handed system is clockwise, seen from its tip toward the origin: to the right,
nose down, left side down. In menus ``IsRaceOn`` is 0.
"""

from __future__ import annotations

import numpy as np

from .layout import Field, Layout
from .sample import Sample, Source, attitude_of, from_east_up_north

_SLED = (
    Field("race_on", "i", "0 in menus, pauses and replays"),
    Field("time", "I", "ms; begins again at 2^32"),
    Field("engine", "12x"),
    Field("acceleration", "3f", "m/s², car: right, up, forward; without gravity"),
    Field("velocity", "3f", "m/s, car"),
    Field("angular_velocity", "3f", "rad/s: nose down, to the right, left side down positive"),
    Field("angles", "3f", "rad: yaw (to the right), pitch (nose down), roll (left side down)"),
    Field("wheels", "164x"),
)
_POSITION = Field("position", "3f", "m, world: x east, y up, z north")


class Forza(Source):
    """Forza Motorsport's and Forza Horizon's Data Out."""

    name = "forza"
    summary = "Forza Motorsport 7 and 2023, Forza Horizon 4 to 6, Data Out"
    port = 5300
    layouts = (
        Layout("Forza, sled", _SLED),
        Layout("Forza Motorsport 7, dash", (*_SLED, _POSITION, Field("rest", "67x"))),
        Layout("Forza Motorsport 2023, dash", (*_SLED, _POSITION, Field("rest", "87x"))),
        Layout("Forza Horizon", (*_SLED, Field("horizon", "12x"), _POSITION, Field("rest", "68x"))),
    )
    tick = 0.001
    period = 2.0**32 * 1e-3
    uncertain = (
        "The page names the axes, but not the senses of turning; those of a left-handed system are taken, as "
        "in DirectX."
    )

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        found = self.layout_of(datagram).unpack(datagram)
        if found["race_on"] == 0:
            return Sample(time=1e-3 * found["time"], paused=True)
        right, up, forward = found["acceleration"]
        nose_down, to_the_right, left_down = found["angular_velocity"]
        yaw, pitch, roll = found["angles"]
        attitude = attitude_of(-roll, -pitch, yaw)
        velocity = np.array([found["velocity"][2], found["velocity"][0], -found["velocity"][1]])
        position = found.get("position")
        return Sample(
            time=1e-3 * found["time"],
            acceleration=np.array([forward, right, -up]),
            rate=np.array([-left_down, -nose_down, to_the_right]),
            attitude=attitude,
            velocity=attitude.T @ velocity,
            position=np.full(3, np.nan) if position is None else from_east_up_north(position),
            paused=False,
        )
