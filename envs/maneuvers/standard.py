"""Maneuvers: their base class, and the standard ones: the paper's, steering tests and everyday traffic."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from dataclasses import field
from typing import ClassVar, Final

import numpy as np

from ..car.kernels.driver import Driver
from ..car.plans import DT, STEP, Change, Hold, Path, Schedule, bend, clothoids, smooth_steps
from ..car.simulation import Plan, simulate, straight
from ..car.vehicles import SEDAN, Car
from ..cues import GRAVITY, CueTrace
from ..errors import ConfigurationError
from ..road import Route
from ..settings import Positive, configuration
from .roads import KMH, Floats, Style, along_path, sine_with_dwell, speed_limit

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
        offset = off_path(plan, trace)
        if offset:
            values = {item.name: getattr(self, item.name) for item in dataclasses.fields(self)}
            numbers = [
                f"{name} {value:g}" for name, value in values.items() if isinstance(value, int | float)
            ]
            raise ConfigurationError(
                f"{plan.car.name} cannot drive {self.name} with {', '.join(numbers)}: "
                f"it came {offset:.1f} m off its path (at most {LARGEST_OFFSET:g} m); "
                "ask for less speed or gentler bends"
            )
        return trace


def off_path(plan: Plan, trace: CueTrace) -> float:
    """Largest distance from the path, m; 0 within :data:`LARGEST_OFFSET`, and in open-loop steering tests."""
    offset = float(np.abs(trace.channels["path_offset_m"]).max())
    return offset if plan.follows.any() and offset > LARGEST_OFFSET else 0.0


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
        path = Path.of_curvature(-self.peak / self.speed**2 * wave)
        # Nobody knows it ahead but the driver.
        return Plan(self.name, car, path, schedule, route=Route.unknown(path.curvature, self.speed))


# Open-loop steering tests: a robot turns the wheel, the driver only keeps the speed.


@configuration
class StepSteer(Maneuver):
    """ISO 7401: the wheel is turned to the right at a constant rate, held, and turned back.

    The angle is that of a steady turn with this acceleration in the linear range, i (L / R + K a_y).
    The standard ends with the hold; turning back is added, so that the drive ends in calm.

    Args:
        speed: m/s.
        lateral_acceleration: m/s^2.
        rate: Of the steering wheel, rad/s; the standard asks for at least 200 deg/s.
        hold: How long the angle is held, s.
    """

    name: ClassVar[str] = "step-steer"

    speed: Positive = 80.0 * KMH
    lateral_acceleration: Positive = 4.0
    rate: Positive = 300.0 * DEGREE
    hold: Positive = 4.0

    def plan(self, car: Car) -> Plan:
        """A trapezoid of the steering wheel."""
        angle = car.steering_wheel_for(self.speed, self.lateral_acceleration)
        schedule = Schedule.of(
            self.speed, [Hold(self.settle + self.hold + 2.0 * angle / self.rate + self.calm)]
        )
        time = DT * np.arange(len(schedule)) - self.settle
        rising, falling = self.rate * time, angle - self.rate * (time - angle / self.rate - self.hold)
        steering = np.clip(np.minimum(rising, falling), 0.0, angle)
        return Plan(self.name, car, straight(), schedule, steering=steering)


@configuration
class SineWithDwell(Maneuver):
    """FMVSS 126: one sine of steering at 0.7 Hz with a pause of 0.5 s at its second peak.

    The amplitude is a multiple of the angle that gives 0.3 g in a steady turn (linear range). The standard
    raises the multiple until 6.5 and tests stability control, which these cars do not have; the default stays
    where all of them remain controllable. The speed is kept, where the standard lets the throttle go.

    Args:
        speed: m/s.
        frequency: Hz.
        dwell: s.
        multiple: Amplitude over the angle at 0.3 g.
    """

    name: ClassVar[str] = "sine-with-dwell"

    speed: Positive = 80.0 * KMH
    frequency: Positive = 0.7
    dwell: Positive = 0.5
    multiple: Positive = 1.5

    def wave(self, time: Floats) -> Floats:
        """Shape of the steering over time from its onset, within [-1, 1]."""
        return sine_with_dwell(time, self.frequency, self.dwell)

    def plan(self, car: Car) -> Plan:
        """The sine with its dwell, to the right first."""
        amplitude = self.multiple * car.steering_wheel_for(self.speed, 0.3 * GRAVITY)
        duration = self.settle + 1.0 / self.frequency + self.dwell + self.calm
        schedule = Schedule.of(self.speed, [Hold(duration)])
        time = np.asarray(DT * np.arange(len(schedule)) - self.settle, dtype=np.float64)
        steering = amplitude * self.wave(time)
        return Plan(self.name, car, straight(), schedule, steering=steering)


@configuration
class Acceleration(Maneuver):
    """Pulling away from rest to 80 km/h with 0.25 g, the counterpart of braking.

    Args:
        speed: Reached, m/s.
        acceleration: m/s^2.
        jerk: m/s^3.
    """

    name: ClassVar[str] = "acceleration"

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
