"""The maneuver: a name, parameters, a plan for a car, and the drive that results."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from typing import ClassVar, Final

import numpy as np

from ..car.simulation import Plan, simulate
from ..car.vehicles import SEDAN, Car
from ..cues import CueTrace
from ..errors import ConfigurationError
from ..settings import Positive, configuration

KMH: Final = 1.0 / 3.6
"""One km/h in m/s."""

DEGREE: Final = math.pi / 180.0
"""One degree in radians."""

LARGEST_OFFSET: Final = 1.0
"""How far from its path a driver who follows one may be, m; the package's own maneuvers stay within 0.4 m."""


@configuration
class Maneuver(ABC):
    """A drive of a car, from calm to calm.

    Args:
        settle: Steady straight driving (or standing) before it, s.
        calm: The same after it, s.
    """

    name: ClassVar[str]
    """What it is called on the command line."""

    settle: Positive = 2.0
    calm: Positive = 3.0

    @abstractmethod
    def plan(self, car: Car) -> Plan:
        """Path, speed and, for open-loop tests, steering for this car."""

    def drive(self, car: Car | None = None) -> CueTrace:
        """Let a car (the sedan if None) drive it; 100 Hz, at the origin of F_A.

        Raises:
            ConfigurationError: the car cannot drive it: it came off its path by more than
                :data:`LARGEST_OFFSET`. Open-loop steering tests have no path to come off.
            DataError: the car left the range of the vehicle model.
        """
        plan = self.plan(car or SEDAN)
        trace = simulate([plan])[0]
        if plan.steering is None:
            self._refuse_if_off_path(trace, plan.car)
        return trace

    def _refuse_if_off_path(self, trace: CueTrace, car: Car) -> None:
        offset = float(np.abs(trace.channels["path_offset_m"]).max())
        if offset > LARGEST_OFFSET:
            raise ConfigurationError(
                f"{car.name} cannot drive {self.name} with {self._asked()}: "
                f"it came {offset:.1f} m off its path (at most {LARGEST_OFFSET:g} m); "
                "ask for less speed or gentler bends"
            )

    def _asked(self) -> str:
        """The parameters that are plain numbers, as given."""
        values = {item.name: getattr(self, item.name) for item in dataclasses.fields(self)}
        return ", ".join(
            f"{name} {value:g}" for name, value in values.items() if isinstance(value, int | float)
        )
