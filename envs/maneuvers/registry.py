"""Maneuvers and recorded drives by name, open to other packages; their names import no maneuver.

A recorded drive lies in a folder of its own under ``recorded``, with the notice of its license and the
command that converted it from the published log.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ..cues import CueTrace
from ..errors import look_up
from ..registry import Registry

if TYPE_CHECKING:
    from .standard import Maneuver

_MANEUVERS: Final[Registry[Any]] = Registry("maneuver", "motion_cueing.maneuvers")

for _name, _where, _about in (
    ("steady-turn", "standard:SteadyTurn", "60 km/h into a circle of 150 m (the paper's EST)"),
    ("braking", "standard:Braking", "0.25 g from 80 km/h to a full stop (the paper's BRK)"),
    ("lane-change", "standard:LaneChange", "one lane of 4 m at 60 km/h, 0.125 g (the paper's LC)"),
    ("acceleration", "standard:Acceleration", "0.25 g from rest to 80 km/h"),
    ("double-lane-change", "cones:DoubleLaneChange", "severe double lane change at 80 km/h (ISO 3888-1)"),
    ("obstacle-avoidance", "cones:ObstacleAvoidance", "obstacle avoidance at 45 km/h (ISO 3888-2)"),
    ("slalom", "cones:Slalom", "slalom round cones 18 m apart at 50 km/h"),
    ("step-steer", "standard:StepSteer", "step of the steering wheel to 4 m/s^2 at 80 km/h (ISO 7401)"),
    ("sine-with-dwell", "standard:SineWithDwell", "sine with dwell at 80 km/h (FMVSS 126)"),
    ("stop-and-go", "standard:StopAndGo", "three stops in a queue, up to 40 km/h"),
    ("roundabout", "standard:Roundabout", "roundabout of 18 m at 26 km/h, third exit, from and to 50 km/h"),
    ("hill", "standard:Hill", "8 % up and down at 60 km/h"),
):
    _MANEUVERS.register(_name, f"{__package__}.{_where}", _about)


register = _MANEUVERS.register
"""Give a maneuver or its class a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""

maneuver_names = _MANEUVERS.names
"""Names that :func:`get_maneuver` knows, the paper's three first."""

describe_maneuver = _MANEUVERS.description
"""One line about a maneuver."""


def get_maneuver(name: str) -> Maneuver:
    """A maneuver with its default parameters.

    Raises:
        UnknownNameError: no such maneuver; the message lists the nearest names.
    """
    maneuver: Maneuver = _MANEUVERS.make(name)
    return maneuver


_FOLDER: Final = Path(__file__).parent / "recorded"
_FILE: Final = "cues.csv.gz"

_SOURCES: Final[Mapping[str, str]] = {
    "city-drive": "214 s through a city, turns and a rough stretch; log by Paul Balzer, CC BY-SA 2.0",
    "commute": "60 s of a commute, speeding up and slowing down; comma2k19 by comma.ai, MIT",
}


def recording_names() -> list[str]:
    """Names of the recorded drives."""
    return sorted(_SOURCES)


def describe_recording(name: str) -> str:
    """One line about a recorded drive, with its source."""
    return look_up("recording", name, _SOURCES)


def get_recording(name: str) -> CueTrace:
    """A recorded drive: 100 Hz, F_A axes, with the channel ``speed_m_s``.

    Raises:
        UnknownNameError: no recording has this name.
    """
    source = describe_recording(name)
    return replace(CueTrace.from_csv(_FOLDER / name / _FILE, name=name), source=source)
