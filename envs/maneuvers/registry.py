"""The maneuvers of the package, by name."""

from __future__ import annotations

from typing import Final

from ..errors import look_up
from .cones import DoubleLaneChange, ObstacleAvoidance, Slalom
from .maneuver import Maneuver
from .standard import (
    Acceleration,
    Braking,
    Hill,
    LaneChange,
    Roundabout,
    SineWithDwell,
    SteadyTurn,
    StepSteer,
    StopAndGo,
)

_MANEUVERS: Final[tuple[type[Maneuver], ...]] = (
    SteadyTurn,
    Braking,
    LaneChange,
    Acceleration,
    DoubleLaneChange,
    ObstacleAvoidance,
    Slalom,
    StepSteer,
    SineWithDwell,
    StopAndGo,
    Roundabout,
    Hill,
)
_BY_NAME: Final = {maneuver.name: maneuver for maneuver in _MANEUVERS}


def maneuver_names() -> list[str]:
    """Names that :func:`get_maneuver` knows, the paper's three first."""
    return list(_BY_NAME)


def get_maneuver(name: str) -> Maneuver:
    """A maneuver with its default parameters.

    Raises:
        UnknownNameError: no such maneuver; the message lists the nearest names.
    """
    return look_up("maneuver", name, _BY_NAME)()
