"""The three maneuvers of the paper: entry into a steady turn, braking to a stop, a single lane change."""

from __future__ import annotations

import math
from dataclasses import field
from typing import ClassVar

import numpy as np

from ..cues import GRAVITY
from ..settings import Positive, configuration
from .driver import Driver
from .maneuver import KMH, Maneuver
from .paths import STEP, Path, clothoids
from .schedules import Change, Hold, Schedule
from .simulation import Plan, straight
from .vehicles import Car


def _late_driver() -> Driver:
    return Driver(anticipation=0.1)


@configuration
class SteadyTurn(Maneuver):
    """60 km/h from a straight into a circle to the right of 150 m, and round it (cases EST1 to EST3).

    0.19 g centripetal; the driver sees the bend late and overshoots, so that the side force on him peaks at
    about 0.25 g as the paper reports. There is no calm at the end: the turn lasts.

    Args:
        speed: m/s.
        radius: m.
        entry: Length of the clothoid between straight and circle, m (engineering choice, half a second).
        duration: Of the turn, s.
        driver: Anticipates by 0.1 s, half of what the default driver does (tuned to the paper's overshoot).
    """

    name: ClassVar[str] = "steady-turn"
    summary: ClassVar[str] = "60 km/h into a circle of 150 m (the paper's EST)"

    speed: Positive = 60.0 * KMH
    radius: Positive = 150.0
    entry: Positive = 8.0
    duration: Positive = 26.0
    driver: Driver = field(default_factory=_late_driver)

    def plan(self, car: Car) -> Plan:
        """A straight, a clothoid and a circle at constant speed."""
        schedule = Schedule.of(self.speed, [Hold(self.settle + self.duration)])
        start = self.speed * self.settle
        knots = [(0.0, 0.0), (start, 0.0), (start + self.entry, 1.0 / self.radius)]
        path = Path.of_curvature(clothoids(knots, float(schedule.distance[-1]) + self.radius))
        return Plan(self.name, car, path, schedule, driver=self.driver)


@configuration
class Braking(Maneuver):
    """80 km/h to a full stop with 0.25 g, and standing (case BRK). The pedal is held until the car stands.

    Args:
        speed: m/s.
        deceleration: m/s^2.
        jerk: At the onset, m/s^3 (a quarter of a second to full deceleration; engineering choice).
    """

    name: ClassVar[str] = "braking"
    summary: ClassVar[str] = "0.25 g from 80 km/h to a full stop (the paper's BRK)"

    settle: Positive = 2.5
    calm: Positive = 10.0
    speed: Positive = 80.0 * KMH
    deceleration: Positive = 0.25 * GRAVITY
    jerk: Positive = 10.0

    def plan(self, car: Car) -> Plan:
        """Straight on, steady, braking, standing."""
        stop = Change(0.0, self.deceleration, self.jerk, math.inf)
        schedule = Schedule.of(
            self.speed, [Hold(self.settle), stop, Hold(self.calm, brake=self.deceleration)]
        )
        return Plan(self.name, car, straight(), schedule)


@configuration
class LaneChange(Maneuver):
    """One lane to the left at 60 km/h: one sine of lateral acceleration (cases LC1 and LC2).

    A sine of amplitude A and duration T moves the car sideways by A T^2 / (2 pi).

    Args:
        speed: m/s.
        offset: Distance between the lanes, m.
        peak: Lateral acceleration of the path, m/s^2.
    """

    name: ClassVar[str] = "lane-change"
    summary: ClassVar[str] = "one lane of 4 m at 60 km/h, 0.125 g (the paper's LC)"

    speed: Positive = 60.0 * KMH
    offset: Positive = 4.0
    peak: Positive = 0.125 * GRAVITY

    @property
    def duration(self) -> float:
        """T = sqrt(2 pi offset / peak), s; 4.53 s by default."""
        return math.sqrt(2.0 * math.pi * self.offset / self.peak)

    def plan(self, car: Car) -> Plan:
        """A straight with one sine of curvature."""
        schedule = Schedule.of(self.speed, [Hold(self.settle + self.duration + self.calm)])
        time = np.arange(0.0, schedule.distance[-1] + STEP, STEP) / self.speed - self.settle
        wave = np.where(
            (time > 0.0) & (time < self.duration), np.sin(2.0 * np.pi * time / self.duration), 0.0
        )
        return Plan(self.name, car, Path.of_curvature(-self.peak / self.speed**2 * wave), schedule)
