"""Maneuvers between cones: both severe lane changes of ISO 3888, and the slalom."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field
from scipy.ndimage import gaussian_filter1d

from ..settings import Positive, configuration
from .corridors import GRID, Gate, smoothest_way
from .driver import Driver
from .maneuver import KMH, Maneuver
from .paths import Path
from .schedules import Hold, Schedule
from .simulation import Plan, simulate
from .vehicles import Car

TEST_DRIVER = Driver(preview_time=0.7)
"""Aims nearer than in traffic."""

RUN_UP = 15.0
"""Straight driving between the settling and the first cones, where the way may start to swerve, m."""


LAPS = 4
"""Practice runs before the one that counts."""

LEARNED = 0.5
"""Share of the deviation that the next run corrects."""

BLUR = 2.5
"""Standard deviation of the smoothing of that correction, m."""


@lru_cache(maxsize=64)
def practised_path(gates: tuple[Gate, ...], car: Car, speed: float, length: float, margin: float) -> Path:
    """The line to aim at so that the car, which lags behind its driver's aim, drives the smoothest way.

    As on a proving ground the driver practises: after every run the aim is shifted by the deviation of the
    car from the wanted way (iterative learning).
    """
    x, wanted = smoothest_way(gates, car, speed, length, margin)
    aim = wanted
    schedule = Schedule.of(speed, [Hold(length / speed)])
    for _ in range(LAPS):
        trace = simulate([Plan("practice", car, Path.of_offset(x, aim), schedule, driver=TEST_DRIVER)])[0]
        missed = wanted - np.interp(x, trace.channels["x_m"], trace.channels["y_m"])
        missed[x > gates[-1].end] = 0.0
        aim = aim + LEARNED * gaussian_filter1d(missed, BLUR / GRID, mode="nearest")
    return Path.of_offset(x, aim)


@configuration
class ConeManeuver(Maneuver):
    """A drive between cones at constant speed, along the smoothest way through them.

    Args:
        speed: m/s.
        margin: Distance kept from the cones by the planned way, m.
    """

    speed: Positive = 80.0 * KMH
    margin: Positive = 0.05
    calm: Positive = 4.0

    @abstractmethod
    def track(self, car: Car) -> tuple[Gate, ...]:
        """The cones, from the first one at 0 m."""

    def gates(self, car: Car) -> tuple[Gate, ...]:
        """The cones where this drive finds them, from its start."""
        shift = self.speed * self.settle + RUN_UP
        return tuple(Gate(g.start + shift, g.end + shift, g.left, g.right) for g in self.track(car))

    def plan(self, car: Car) -> Plan:
        """The smoothest way through the gates, after a straight."""
        gates = self.gates(car)
        start = self.speed * self.settle
        length = gates[-1].end + 2.0 * RUN_UP
        near = tuple(Gate(g.start - start, g.end - start, g.left, g.right) for g in gates)
        path = practised_path(near, car, self.speed, length - start, self.margin).delayed(start)
        schedule = Schedule.of(self.speed, [Hold(length / self.speed + self.calm)])
        return Plan(self.name, car, path, schedule, driver=TEST_DRIVER)


@configuration
class DoubleLaneChange(ConeManeuver):
    """ISO 3888-1: out to a lane 3.5 m to the left and back, at 80 km/h.

    Sections of 15, 30, 25, 25, 15 and 15 m; lanes 1.1 w + 0.25, 1.2 w + 0.25 and 1.3 w + 0.25 m wide (w:
    width of the car), their middles 3.5 m apart.

    Args:
        offset: Between the middles of the lanes, m.
    """

    name: ClassVar[str] = "double-lane-change"
    summary: ClassVar[str] = "severe double lane change at 80 km/h (ISO 3888-1)"

    offset: Positive = 3.5

    def track(self, car: Car) -> tuple[Gate, ...]:
        """Lane 1, lane 2 (beside it), and lane 3 with the exit section."""
        w = car.width
        return (
            Gate.lane(0.0, 15.0, 0.0, 1.1 * w + 0.25),
            Gate.lane(45.0, 25.0, -self.offset, 1.2 * w + 0.25),
            Gate.lane(95.0, 30.0, 0.0, 1.3 * w + 0.25),
        )


@configuration
class ObstacleAvoidance(ConeManeuver):
    """ISO 3888-2: round an obstacle to the left and back, sections of 12, 13.5, 11, 12.5 and 12 m.

    Lanes 1.1 w + 0.25, w + 1 and at least 3 m (1.3 w + 0.25) wide; 1 m between the near edges of lanes 1 and
    2; lane 3 in line with lane 1 at its outer edge. The standard leaves the speed to the test: the default is
    one that all cars of the package can drive cleanly, and the driver keeps it, where the standard lets the
    throttle go.

    Args:
        gap: Between the near edges of lanes 1 and 2, m.
    """

    name: ClassVar[str] = "obstacle-avoidance"
    summary: ClassVar[str] = "obstacle avoidance at 45 km/h (ISO 3888-2)"

    speed: Positive = 45.0 * KMH
    margin: Positive = 0.1
    gap: Positive = 1.0

    def track(self, car: Car) -> tuple[Gate, ...]:
        """The three lanes."""
        first, second = 1.1 * car.width + 0.25, car.width + 1.0
        third = max(1.3 * car.width + 0.25, 3.0)
        near = -0.5 * first - self.gap
        return (
            Gate.lane(0.0, 12.0, 0.0, first),
            Gate(25.5, 36.5, near - second, near),
            Gate(49.0, 61.0, 0.5 * first - third, 0.5 * first),
        )


@configuration
class Slalom(ConeManeuver):
    """Round cones in a row, alternately to the left and to the right of them.

    Args:
        cones: How many.
        spacing: m.
        cone_width: Diameter of the cones' base, m.
    """

    name: ClassVar[str] = "slalom"
    summary: ClassVar[str] = "slalom round cones 18 m apart at 50 km/h"

    speed: Positive = 50.0 * KMH
    margin: Positive = 0.2
    cones: Annotated[int, Field(ge=2)] = 8
    spacing: Positive = 18.0
    cone_width: Positive = 0.3

    def track(self, car: Car) -> tuple[Gate, ...]:
        """One-sided gates: left of the first cone, right of the second, and so on."""
        half = 0.5 * self.cone_width
        places = [(k * self.spacing, k % 2 == 0) for k in range(self.cones)]
        return tuple(
            Gate(x - half, x + half, -math.inf, -half) if left else Gate(x - half, x + half, half, math.inf)
            for x, left in places
        )
