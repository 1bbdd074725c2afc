"""What a washout's parameter does when it is raised: the words of the explanation pages, for sliders."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

_AXES: Final = ("x, forward", "y, lateral", "z, vertical")
_TURNS: Final = ("roll", "pitch", "yaw")
_FREEDOMS: Final = ("surge", "sway", "heave", "yaw")

EFFECTS: Final[Mapping[str, str]] = {
    "force_scale": "cues come nearer to the car's size; travel and limits are used in proportion",
    "rate_scale": "cues come nearer to the car's size; travel and limits are used in proportion",
    "hpr.frequency": "angles return to zero sooner: less yaw and less roll of the machine, more missing angular rate",
    "rate_bandwidth": "angular cues come sooner, with more noise of the input in the acceleration",
    "tilt.low_pass.frequency": "tilt sets in sooner; above about 5 rad/s only its rate limit counts",
    "tilt.rate": "the sag after an onset is shorter; the rotation becomes noticeable above about 3 deg/s",
    "tilt.acceleration": "the sag after an onset is shorter; the rotation becomes noticeable above about 3 deg/s",
    "tilt.approach": "the tilt follows its target more tightly where no limit acts",
    "turntable_share": "more of the yaw by the turntable, which has no end, less by the hexapod, which has",
    "hps.frequency": "shorter onset, less travel, deeper sag before the tilt has come",
    "hpi.frequency": "the carriage recenters sooner; crosstalk between x and y in the cab grows while it turns",
    "lpc.frequency": "more of the motion by the carriage, less by the legs",
    "adaptation.displacement": "the machine may go farther before the gains on acceleration fall",
    "adaptation.velocity": "the same of its speed: high values favor long onsets",
    "adaptation.angle": "roll, pitch and yaw may be larger before their gains fall; 100 rad for a turntable without end",
    "adaptation.force_departure": "gains leave 1 more easily, and return more slowly",
    "adaptation.rate_departure": "gains leave 1 more easily, and return more slowly",
    "adaptation.force_speed": "gains follow the cost faster: closer to its minimum, but a cue changes its size while it "
    "lasts, which the driver may notice. 0 holds a gain at 1",
    "adaptation.rate_speed": "gains follow the cost faster: closer to its minimum, but a cue changes its size while it "
    "lasts, which the driver may notice. 0 holds a gain at 1",
    "force_bandwidth": "cues are taken to be short: less sustained tilt, more of the onset by moving. Low: they last, and "
    "tilt sets in at once",
    "sensed_rate": "an error of the rate counts less beside one of the force: faster tilt",
    "displacement": "more travel, longer onsets",
    "integral": "the machine comes home later",
    "velocity": "faster travel",
    "tilt_rate": "faster, more sudden tilt: shorter sag, more false rotation",
    "tilt_acceleration": "faster, more sudden tilt: shorter sag, more false rotation",
    "acceleration": "more of a sudden cue is given",
    "angle": "more of a long turn is given; the turntable has no end",
    "rate": "more of a long turn is given; the turntable has no end",
}
"""By :func:`kind_of` a parameter: what follows "raise it, and" in docs/explanation."""


def kind_of(path: str) -> str:
    """The kind of a parameter by its path: the same for every axis, as hps.frequency of hps.0.frequency."""
    parts = [part for part in path.split(".") if not part.isdigit()]
    return ".".join(parts[1:] if parts[0] in _FREEDOMS and len(parts) > 1 else parts)


def axis_of(path: str) -> str:
    """The axis of a parameter in words; "" where it has none."""
    parts = path.split(".")
    if parts[0] in _FREEDOMS and len(parts) > 1:
        return parts[0]
    number = next((int(part) for part in parts if part.isdigit()), None)
    if number is None or parts[0] == "adaptation":
        return "" if number is None else str(number + 1)
    return (_TURNS if re.match(r"rate_|hpr", path) else _AXES)[number]


def unit_of(kind: str) -> str:
    """Unit of a kind of parameter of the classical washout; "" where it is a share, a size or a ratio."""
    if kind.endswith("frequency") or kind == "rate_bandwidth":
        return "rad/s"
    return {
        "force_limit": "m/s²",
        "rate_limit": "rad/s",
        "tilt.rate": "rad/s",
        "tilt.acceleration": "rad/s²",
    }.get(kind, "")
