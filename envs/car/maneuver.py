"""What every maneuver has: a name, parameters, a plan, and the drive that comes of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar, Final

from pydantic.dataclasses import dataclass

from ..cues import CueTrace
from ..settings import STRICT, Positive
from .fleet import SEDAN
from .simulation import Plan, simulate
from .vehicles import Car

KMH: Final = 1.0 / 3.6
"""One km/h in m/s."""

DEGREE: Final = math.pi / 180.0
"""One degree in radians."""


@dataclass(frozen=True, config=STRICT)
class Maneuver(ABC):
    """A drive of a car, from calm to calm.

    Args:
        settle: Steady straight driving (or standing) before it, s.
        calm: The same after it, s.
    """

    name: ClassVar[str]
    """What it is called on the command line."""
    summary: ClassVar[str]
    """One line for lists and reports."""

    settle: Positive = 2.0
    calm: Positive = 3.0

    @abstractmethod
    def plan(self, car: Car) -> Plan:
        """Path, speed and, for open-loop tests, steering for this car."""

    def drive(self, car: Car | None = None) -> CueTrace:
        """Let a car (the sedan if None) drive it; 100 Hz, at the origin of F_A."""
        return simulate([self.plan(car or SEDAN)])[0]
