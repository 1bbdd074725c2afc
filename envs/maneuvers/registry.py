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
from ..errors import ConfigurationError, look_up
from ..registry import Registry
from ..road import RoadMap

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
    ("gear-change", "severe:GearChange", "2 m/s^2 from rest to 100 km/h through the gears (suite 2)"),
    ("circuit", "severe:CircuitLap", "one lap of a racing circuit at 0.75 g (suite 2)"),
    ("limit-handling", "severe:LimitHandling", "sine with dwell and J-turn at full severity (suite 2)"),
    ("surge-and-brake", "severe:SurgeAndBrake", "a minute of acceleration, then full braking (suite 2)"),
):
    _MANEUVERS.register(_name, f"{__package__}.{_where}", _about)


register = _MANEUVERS.register
"""Give a maneuver or its class a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""

_ADDED: Final = ("gear-change", "circuit", "limit-handling", "surge-and-brake")

SUITES: Final[Mapping[int, tuple[str, ...]]] = {
    1: tuple(name for name in _MANEUVERS.names() if name not in _ADDED),
    2: tuple(_MANEUVERS.names()),
}
"""Standard maneuvers by version of the suite, the paper's three first; figures compare within a version."""


def maneuver_names(suite: int | None = 1) -> list[str]:
    """Names of the standard maneuvers of a suite, the paper's three first, and of those of other packages.

    Args:
        suite: One of :data:`SUITES`; None for every name that :func:`get_maneuver` knows.

    Raises:
        ConfigurationError: there is no such suite.
    """
    if suite is None:
        return _MANEUVERS.names()
    if suite not in SUITES:
        raise ConfigurationError(f"suite {suite} is unknown; use one of {', '.join(map(str, SUITES))}")
    later = {name for names in SUITES.values() for name in names} - {*SUITES[suite]}
    return [name for name in _MANEUVERS.names() if name not in later]


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


_LIMITS: Final[Mapping[str, float]] = {"city-drive": 50.0 / 3.6, "commute": 65.0 * 0.44704}
"""Legal speed limits of the recorded roads, m/s: of German towns, and of Californian highways."""


def recording_names() -> list[str]:
    """Names of the recorded drives."""
    return sorted(_SOURCES)


def describe_recording(name: str) -> str:
    """One line about a recorded drive, with its source."""
    return look_up("recording", name, _SOURCES)


def get_recording(name: str) -> CueTrace:
    """A recorded drive: 100 Hz, F_A axes, with the channel ``speed_m_s``, and its road.

    The road has the curvature of the driven path, smoothed as a map is, and the legal speed limit.

    Raises:
        UnknownNameError: no recording has this name.
    """
    source = describe_recording(name)
    trace = CueTrace.from_csv(_FOLDER / name / _FILE, name=name)
    speed, yaw_rate = trace.channels["speed_m_s"], trace.angular_velocity[:, 2]
    road = RoadMap.of_recording(speed, yaw_rate, trace.dt, _LIMITS[name])
    return replace(trace, source=source, road=road)
