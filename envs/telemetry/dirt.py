"""DiRT Rally and DiRT Rally 2.0 with ``extradata="3"``: 66 floats, 264 bytes, 60 to 100 a second.

Source of the layout: the community's table of the fields, as the logger dr2_logger has it, and the
description of the same fields in the F1 games of 2016 and 2017, which call the vectors at byte 44 and 56 the
car's right and forward direction. There is no vertical load: it is from the velocity. Angular velocity is
from the directions. There is no flag for a pause: the run time stands still.
"""

from __future__ import annotations

from .codemasters import sample_of
from .layout import Field, Layout
from .sample import Sample, Source

LAYOUT = Layout(
    "DiRT Rally",
    (
        Field("time", "f", "s of the run"),
        Field("lap", "12x"),
        Field("position", "3f", "m, world with y up"),
        Field("speed", "4x"),
        Field("velocity", "3f", "m/s, world"),
        Field("right", "3f", 'direction in the world ("roll")'),
        Field("forward", "3f", 'direction in the world ("pitch")'),
        Field("suspension", "68x"),
        Field("lateral", "f", "g, to the right positive"),
        Field("longitudinal", "f", "g, forward positive"),
        Field("rest", "120x"),
    ),
)


class Dirt(Source):
    """DiRT Rally's and DiRT Rally 2.0's UDP telemetry."""

    name = "dirt"
    summary = "DiRT Rally and DiRT Rally 2.0, extradata 3"
    port = 20777
    layouts = (LAYOUT,)
    uncertain = (
        "The publisher does not describe the fields. The senses of the lateral load and of the vector at "
        "byte 44 are those of the F1 games of 2016 and 2017."
    )

    def parse(self, datagram: bytes) -> Sample | None:
        """See :meth:`.Source.parse`."""
        found = LAYOUT.unpack(datagram)
        return sample_of(
            found["time"],
            found["forward"],
            found["right"],
            found["velocity"],
            found["position"],
            (found["longitudinal"], found["lateral"]),
        )
