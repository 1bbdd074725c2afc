"""Maneuvers of the second suite: gears, a racing circuit, the limit of the tires, a long surge."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar, Final

import numpy as np

from ..car.fleet import MANUAL
from ..car.kernels.driver import Driver
from ..car.plans import DT, STEP, Change, Hold, Path, Schedule, bend
from ..car.simulation import Plan, straight
from ..car.vehicles import Car, Gearbox
from ..cues import GRAVITY
from ..road import Route
from ..settings import Positive, configuration
from .roads import KMH, Ability, Floats, Style, along_path, sine_with_dwell, speed_limit
from .sampling import stabilized
from .standard import DEGREE, Maneuver

SLOW_MANUAL: Final = replace(MANUAL, gap=0.5)
"""The gearbox of cars that have none of their own: half a second without traction."""


@configuration
class GearChange(Maneuver):
    """Pulling away with 2 m/s^2 through the gears of a manual gearbox.

    A car with a gearbox keeps its own.

    Args:
        speed: Reached, m/s.
        acceleration: m/s^2.
        jerk: m/s^3.
        gearbox: Of cars that have none.
        driver: Adds at most 0.5 m/s^2 to make up for the time without traction.
    """

    name: ClassVar[str] = "gear-change"

    speed: Positive = 100.0 * KMH
    acceleration: Positive = 2.0
    jerk: Positive = 4.0
    gearbox: Gearbox = SLOW_MANUAL
    driver: Driver = Driver(catch_up=0.5)

    def plan(self, car: Car) -> Plan:
        """Standing, accelerating straight on, steady."""
        if car.gearbox is None:
            car = replace(car, gearbox=self.gearbox)
        phases: list[Hold | Change] = [
            Hold(self.settle),
            Change(self.speed, self.acceleration, self.jerk),
            Hold(self.calm + 4.0),
        ]
        return Plan(self.name, car, straight(), Schedule.of(0.0, phases), driver=self.driver)


CORNERS: Final = (
    (180.0, 60.0, 95.0),
    (120.0, 45.0, 60.0),
    (90.0, 40.0, -75.0),
    (80.0, 35.0, 80.0),
    (140.0, 25.0, 110.0),
    (90.0, 70.0, -50.0),
    (110.0, 50.0, 85.0),
    (120.0, 90.0, 55.0),
)
"""Of the circuit: about how much straight before each, m, radius, m, and angle, degrees, right positive."""


def closed_lap(corners: tuple[tuple[float, float, float], ...], transition: float) -> Floats:
    """Curvature of a lap every :data:`~..car.plans.STEP`; straights are changed as little as closes it."""
    pieces = [bend(math.copysign(1.0 / r, angle), angle * DEGREE, transition) for _, r, angle in corners]
    before = np.array([length for length, _, _ in corners])
    heading, moved = 0.0, np.zeros(2)
    directions = []
    for piece in pieces:
        directions.append((math.cos(heading), math.sin(heading)))
        path = Path.of_curvature(np.append(piece, 0.0))
        c, s = math.cos(heading), math.sin(heading)
        moved += (path.x[-1] * c - path.y[-1] * s, path.x[-1] * s + path.y[-1] * c)
        heading += STEP * float(piece.sum())
    matrix = np.array(directions).T
    lengths = before - np.linalg.pinv(matrix) @ (matrix @ before + moved)
    parts = [
        part
        for length, piece in zip(lengths, pieces, strict=True)
        for part in (np.zeros(max(round(length / STEP), 1)), piece)
    ]
    return np.concatenate(parts)


@configuration
class CircuitLap(Maneuver):
    """One lap of a racing circuit of eight corners, as fast as the car and 0.75 g allow.

    The driver brakes into the corners and accelerates out of them within an ellipse of both accelerations.

    Args:
        speed: Before and after the lap, m/s.
        top_speed: m/s.
        acceleration: m/s^2.
        deceleration: m/s^2.
        lateral_acceleration: m/s^2.
        transition: Length of the clothoids, m.
        smoothing: Width of the moving average of the speed, taken twice, s.
    """

    name: ClassVar[str] = "circuit"

    speed: Positive = 60.0 * KMH
    top_speed: Positive = 160.0 * KMH
    acceleration: Positive = 4.0
    deceleration: Positive = 7.0
    lateral_acceleration: Positive = 7.4
    transition: Positive = 15.0
    smoothing: Positive = 0.4

    def plan(self, car: Car) -> Plan:
        """A straight, the lap, and a straight on which the car slows down."""
        car = stabilized(car)
        before = np.zeros(round(self.speed * self.settle / STEP))
        slowing = (self.top_speed**2 - self.speed**2) / (2.0 * self.deceleration)
        after = np.zeros(round((slowing + self.speed * (self.calm + 1.0)) / STEP))
        lap = closed_lap(CORNERS, self.transition)
        path = Path.of_curvature(np.concatenate((before, lap, after)))
        style = Ability.style(Style(self.acceleration, self.deceleration, self.lateral_acceleration), car)
        top = np.full(len(path), self.top_speed)
        top[: len(before)] = top[-round(self.speed * (self.calm + 1.0) / STEP) :] = self.speed
        limit = speed_limit(path.curvature, top, style)
        ability = Ability(car, path.curvature, path.grade)
        schedule = along_path(limit, style, [], None, self.smoothing, ability)
        return Plan(self.name, car, path, schedule, route=Route.of_road(path.curvature, self.top_speed))


@configuration
class LimitHandling(Maneuver):
    """Steering tests at full severity: sine with dwell, then a J-turn, by a car with stability control.

    The sine with dwell is that of FMVSS 126 with its largest amplitude, 6.5 times the angle at 0.3 g. The
    J-turn is a step to four times that angle, held. A driver goes on straight after each.

    Args:
        speed: m/s.
        frequency: Of the sine, Hz.
        dwell: s.
        multiple: Amplitude of the sine over the angle at 0.3 g.
        turn: Amplitude of the J-turn over that angle.
        rate: Of the steering wheel in the J-turn, rad/s.
        hold: How long its angle is held, s.
        between: Time for the driver after each test, s.
    """

    name: ClassVar[str] = "limit-handling"

    speed: Positive = 80.0 * KMH
    frequency: Positive = 0.7
    dwell: Positive = 0.5
    multiple: Positive = 6.5
    turn: Positive = 4.0
    rate: Positive = 700.0 * DEGREE
    hold: Positive = 2.0
    between: Positive = 4.0

    def plan(self, car: Car) -> Plan:
        """Both tests by a robot, with a driver before, between and after them."""
        car = stabilized(car)
        unit = car.steering_wheel_for(self.speed, 0.3 * GRAVITY)
        sine = 1.0 / self.frequency + self.dwell + 0.5
        rise = self.turn * unit / self.rate
        starts = self.settle, self.settle + sine + self.between
        ends = starts[0] + sine, starts[1] + 2.0 * rise + self.hold
        schedule = Schedule.of(self.speed, [Hold(ends[1] + self.between + self.calm)])
        time = np.asarray(DT * np.arange(len(schedule)), dtype=np.float64)
        steering = np.full(len(schedule), np.nan)
        first, second = ((time >= a) & (time < b) for a, b in zip(starts, ends, strict=True))
        steering[first] = (
            self.multiple * unit * sine_with_dwell(time[first] - starts[0], self.frequency, self.dwell)
        )
        into, left = time[second] - starts[1], ends[1] - time[second]
        steering[second] = self.turn * unit * np.clip(np.minimum(into, left) / rise, 0.0, 1.0)
        return Plan(self.name, car, straight(), schedule, steering=steering)


@configuration
class SurgeAndBrake(Maneuver):
    """A minute of acceleration from rest, then full braking to a stop.

    Args:
        duration: Of the surge, s.
        acceleration: m/s^2.
        deceleration: m/s^2.
        jerk: At the onset of braking, m/s^3.
    """

    name: ClassVar[str] = "surge-and-brake"

    duration: Positive = 60.0
    acceleration: Positive = 0.75
    deceleration: Positive = 8.0
    jerk: Positive = 40.0
    calm: Positive = 8.0

    def plan(self, car: Car) -> Plan:
        """Standing, surging, braking, standing."""
        phases: list[Hold | Change] = [
            Hold(self.settle),
            Change(self.acceleration * self.duration, self.acceleration, 3.0),
            Change(0.0, self.deceleration, self.jerk, math.inf),
            Hold(self.calm, brake=self.deceleration),
        ]
        path = straight()
        # The stop is an emergency, which nobody knows ahead.
        route = Route.unknown(path.curvature, self.acceleration * self.duration)
        return Plan(self.name, car, path, Schedule.of(0.0, phases), route=route)
