"""Maneuvers of everyday traffic: pulling away, stop and go, a roundabout, a hill."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from ..cues import GRAVITY
from ..settings import Positive, configuration
from .maneuver import DEGREE, KMH, Maneuver
from .paths import STEP, Path, bend, smooth_steps
from .schedules import Change, Hold, Schedule
from .simulation import Plan, straight
from .speed_planning import Style, along_path, speed_limit
from .vehicles import Car


@configuration
class Acceleration(Maneuver):
    """Pulling away from rest to 80 km/h with 0.25 g, the counterpart of braking.

    Args:
        speed: Reached, m/s.
        acceleration: m/s^2.
        jerk: m/s^3.
    """

    name: ClassVar[str] = "acceleration"
    summary: ClassVar[str] = "0.25 g from rest to 80 km/h"

    speed: Positive = 80.0 * KMH
    acceleration: Positive = 0.25 * GRAVITY
    jerk: Positive = 3.0

    def plan(self, car: Car) -> Plan:
        """Straight on, standing, accelerating, steady."""
        phases: list[Hold | Change] = [
            Hold(self.settle),
            Change(self.speed, self.acceleration, self.jerk),
            Hold(self.calm),
        ]
        return Plan(self.name, car, straight(), Schedule.of(0.0, phases))


@configuration
class StopAndGo(Maneuver):
    """A queue: rolling, stopping, waiting and pulling away again, each time a little faster.

    Args:
        speeds: Reached between the stops, m/s.
        acceleration: m/s^2.
        deceleration: m/s^2.
        jerk: m/s^3.
        wait: At every stop, s.
        roll: Steady driving between, s.
    """

    name: ClassVar[str] = "stop-and-go"
    summary: ClassVar[str] = "three stops in a queue, up to 40 km/h"

    speeds: tuple[Positive, ...] = (15.0 * KMH, 25.0 * KMH, 40.0 * KMH)
    acceleration: Positive = 1.5
    deceleration: Positive = 2.0
    jerk: Positive = 3.0
    wait: Positive = 3.0
    roll: Positive = 1.5

    def plan(self, car: Car) -> Plan:
        """From the first speed through a stop before each of the next, and a last stop."""
        phases: list[Hold | Change] = [Hold(self.settle)]
        for speed in (*self.speeds[1:], None):
            phases += [
                Change(0.0, self.deceleration, self.jerk),
                Hold(self.calm if speed is None else self.wait),
            ]
            if speed is not None:
                phases += [Change(speed, self.acceleration, self.jerk), Hold(self.roll)]
        return Plan(self.name, car, straight(), Schedule.of(self.speeds[0], phases))


@configuration
class Roundabout(Maneuver):
    """Into a roundabout (traffic on the right, round it anticlockwise), out at the exit on the left.

    Args:
        speed: On the road, m/s.
        radius: Of the circle driven, m.
        deflection_radius: Of the bends to the right at entry and exit, m.
        deflection: Their angle, rad.
        turn: Change of direction from road to road, rad; to the left positive.
        transition: Length of the clothoids, m.
        lateral_acceleration: In the circle, m/s^2: gives 26 km/h.
        acceleration: m/s^2.
        deceleration: m/s^2.
    """

    name: ClassVar[str] = "roundabout"
    summary: ClassVar[str] = "roundabout of 18 m at 26 km/h, third exit, from and to 50 km/h"

    speed: Positive = 50.0 * KMH
    radius: Positive = 18.0
    deflection_radius: Positive = 25.0
    deflection: Positive = 50.0 * DEGREE
    turn: float = 90.0 * DEGREE
    transition: Positive = 8.0
    lateral_acceleration: Positive = 2.9
    acceleration: Positive = 1.5
    deceleration: Positive = 2.0

    def plan(self, car: Car) -> Plan:
        """Straight, right, round to the left, right, straight."""
        before = self.speed * self.settle + self.speed**2 / (2.0 * self.deceleration) + 10.0
        circle = bend(-1.0 / self.radius, self.turn + 2.0 * self.deflection, self.transition)
        aside = bend(1.0 / self.deflection_radius, self.deflection, self.transition)
        after = self.speed**2 / (2.0 * self.acceleration) + self.speed * self.calm + 20.0
        pieces = [np.zeros(round(before / STEP)), aside, circle, aside, np.zeros(round(after / STEP))]
        path = Path.of_curvature(np.concatenate(pieces))
        style = Style(self.acceleration, self.deceleration, self.lateral_acceleration)
        limit = speed_limit(path.curvature, np.full(len(path), self.speed), style)
        return Plan(self.name, car, path, along_path(limit, style, [], None))


@configuration
class Hill(Maneuver):
    """Up, over the crest, and down again at constant speed.

    Args:
        speed: m/s.
        grade: Steepest slope up and down, rad (8 %).
        transition: Length over which the slope changes by one grade, m.
        slope: Length of constant slope, m.
    """

    name: ClassVar[str] = "hill"
    summary: ClassVar[str] = "8 % up and down at 60 km/h"

    speed: Positive = 60.0 * KMH
    grade: Positive = math.atan(0.08)
    transition: Positive = 50.0
    slope: Positive = 60.0

    def plan(self, car: Car) -> Plan:
        """A straight whose slope follows cosines between level, up and down."""
        start = self.speed * self.settle
        knots = np.cumsum(
            [start, self.transition, self.slope, 2.0 * self.transition, self.slope, self.transition]
        )
        length = float(knots[-1]) + self.speed * self.calm
        stations = np.arange(0.0, length + STEP, STEP)
        grade = smooth_steps(stations, knots, [0.0, self.grade, self.grade, -self.grade, -self.grade, 0.0])
        schedule = Schedule.of(self.speed, [Hold(length / self.speed)])
        return Plan(self.name, car, Path.of_curvature(np.zeros_like(stations), grade), schedule)
