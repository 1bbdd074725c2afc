"""Open-loop steering tests: a robot turns the wheel, the driver only keeps the speed."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..cues import GRAVITY
from ..settings import Positive, configuration
from .maneuver import DEGREE, KMH, Maneuver
from .schedules import DT, Hold, Schedule
from .simulation import Plan, straight
from .vehicles import Car

Floats = NDArray[np.float64]


@configuration
class StepSteer(Maneuver):
    """ISO 7401: the wheel is turned to the right at a constant rate, held, and turned back.

    The angle is that of a steady turn with the wanted acceleration in the linear range, i (L / R + K a_y).
    The standard ends with the hold; turning back is added, so that the drive ends in calm.

    Args:
        speed: m/s.
        lateral_acceleration: m/s^2.
        rate: Of the steering wheel, rad/s; the standard asks for at least 200 deg/s.
        hold: How long the angle is held, s.
    """

    name: ClassVar[str] = "step-steer"
    summary: ClassVar[str] = "step of the steering wheel to 4 m/s^2 at 80 km/h (ISO 7401)"

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
    summary: ClassVar[str] = "sine with dwell at 80 km/h (FMVSS 126)"

    speed: Positive = 80.0 * KMH
    frequency: Positive = 0.7
    dwell: Positive = 0.5
    multiple: Positive = 1.5

    def wave(self, time: Floats) -> Floats:
        """Shape of the steering over time from its onset, within [-1, 1]."""
        peak = 0.75 / self.frequency
        phase = np.where(time < peak, time, np.maximum(time - self.dwell, peak))
        inside = (time >= 0.0) & (time <= 1.0 / self.frequency + self.dwell)
        return np.where(inside, np.sin(2.0 * math.pi * self.frequency * phase), 0.0)

    def plan(self, car: Car) -> Plan:
        """The sine with its dwell, to the right first."""
        amplitude = self.multiple * car.steering_wheel_for(self.speed, 0.3 * GRAVITY)
        duration = self.settle + 1.0 / self.frequency + self.dwell + self.calm
        schedule = Schedule.of(self.speed, [Hold(duration)])
        time = np.asarray(DT * np.arange(len(schedule)) - self.settle, dtype=np.float64)
        steering = amplitude * self.wave(time)
        return Plan(self.name, car, straight(), schedule, steering=steering)
