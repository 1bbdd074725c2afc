"""Cars as data: every number of the vehicle model, with unit and meaning."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated

from pydantic import Field

from ..cues import GRAVITY
from ..settings import NonNegative, Positive, Vector3, configuration

Share = Annotated[float, Field(ge=0.0, le=1.0)]


@configuration
class Suspension:
    """The sprung body: it rolls and pitches about a point under the c.g., as second-order masses.

    Args:
        sprung_mass: kg.
        roll_inertia: About the sprung c.g., x axis, kg m^2.
        pitch_inertia: About the sprung c.g., y axis, kg m^2.
        arm: Height of the sprung c.g. above the roll (and pitch) axis, m.
        roll_stiffness: N m/rad.
        roll_damping: N m s/rad.
        pitch_stiffness: N m/rad.
        pitch_damping: N m s/rad.
    """

    sprung_mass: Positive
    roll_inertia: Positive
    pitch_inertia: Positive
    arm: Positive
    roll_stiffness: Positive
    roll_damping: NonNegative
    pitch_stiffness: Positive
    pitch_damping: NonNegative

    def __post_init__(self) -> None:
        weight = self.sprung_mass * GRAVITY * self.arm
        for label in ("roll_stiffness", "pitch_stiffness"):
            if getattr(self, label) <= weight:
                raise ValueError(f"{label} must exceed the body's toppling moment, {weight:.0f} N m/rad")


@configuration
class Tires:
    """Tires of an axle (both wheels together): Magic Formula, friction ellipse, relaxation length.

    Args:
        front_cornering_stiffness: Front axle at its static load, N/rad.
        rear_cornering_stiffness: Rear axle at its static load, N/rad.
        friction: Peak friction coefficient, both directions.
        shape_factor: C of the Magic Formula (lateral); 1.3507 is p_Cy1 of commonroad-vehicle-models 3.0.2.
        relaxation_length: Distance rolled until the lateral force has risen to 63 %, m (engineering choice).
        low_speed: Below this speed tire damping is blended in, m/s (engineering choice).
        low_speed_damping: Slip angle added for each m/s of lateral velocity at standstill, s/m. It damps
            the sideways spring that a relaxing tire becomes when it stands (engineering choice, ratio 0.5).
    """

    front_cornering_stiffness: Positive
    rear_cornering_stiffness: Positive
    friction: Positive
    shape_factor: Annotated[float, Field(gt=1.0, lt=2.0)] = 1.3507
    relaxation_length: Positive = 0.5
    low_speed: Positive = 2.5
    low_speed_damping: NonNegative = 0.13


@configuration
class Steering:
    """From the steering wheel to the road wheels.

    Args:
        ratio: Steering-wheel angle over road-wheel angle.
        max_angle: Largest steering-wheel angle, rad (1.5 turns each way, usual for passenger cars).
        max_rate: Largest steering-wheel rate, rad/s (1000 deg/s: steering robots of FMVSS 126 need it).
    """

    ratio: Positive = 17.0
    max_angle: Positive = 9.42
    max_rate: Positive = 17.45


@configuration
class Drivetrain:
    """Engine, brakes and resistances. The defaults are engineering choices of the usual size.

    Args:
        max_drive_force: At the driven wheels at full throttle, N.
        max_power: At the driven wheels, W.
        max_brake_force: At all wheels at full pedal, N.
        drive_front_share: Share of the drive force at the front axle.
        brake_front_share: Share of the brake force at the front axle.
        drive_lag: Time constant from the throttle to the drive force, s.
        brake_lag: Time constant from the brake pedal to the brake force, s.
        drag_area: Drag coefficient times frontal area, m^2.
        rolling_resistance: Rolling-resistance coefficient.
        standstill_stiffness: Fore-and-aft stiffness of tires and axle guidance while the wheels are held, per
            unit of the car's mass, 1/s^2; 632 is a natural frequency of 4 Hz. It makes the jerk of a stop.
        standstill_damping: Damping of the same, per unit of mass, 1/s; 15 is a damping ratio of 0.3.
    """

    max_drive_force: Positive
    max_power: Positive
    max_brake_force: Positive
    drive_front_share: Share = 1.0
    brake_front_share: Share = 0.66
    drive_lag: Positive = 0.25
    brake_lag: Positive = 0.12
    drag_area: NonNegative = 0.66
    rolling_resistance: NonNegative = 0.012
    standstill_stiffness: Positive = 632.0
    standstill_damping: NonNegative = 15.0


@configuration
class Car:
    """A car. Lengths in metres, body axes x forward, y right, z down, origin at the c.g.

    Args:
        name: What it is called on the command line.
        description: One line for lists and reports.
        mass: With driver, kg.
        front_axle: From the c.g. to the front axle, m.
        rear_axle: From the c.g. to the rear axle, m.
        yaw_inertia: kg m^2.
        cg_height: Above the road, m.
        width: Of the body without mirrors, m.
        front_overhang: From the front axle to the front end, m.
        rear_overhang: From the rear axle to the rear end, m.
        suspension: The body's roll and pitch.
        tires: Both axles.
        drivetrain: Drive, brakes, resistances.
        steering: Steering gear.
        reference_point: Origin of F_A, where cues are given, from the c.g., m. The default is the seat
            (H-point) of a driver on the left, 1.45 m behind the front axle and 0.5 m above the road
            (engineering choice).
    """

    name: str
    mass: Positive
    front_axle: Positive
    rear_axle: Positive
    yaw_inertia: Positive
    cg_height: Positive
    width: Positive
    front_overhang: Positive
    rear_overhang: Positive
    suspension: Suspension
    tires: Tires
    drivetrain: Drivetrain
    steering: Steering = field(default_factory=Steering)
    reference_point: Vector3 = (-0.25, -0.37, 0.05)
    description: str = ""

    def __post_init__(self) -> None:
        if self.suspension.sprung_mass > self.mass:
            raise ValueError(f"suspension.sprung_mass must not exceed mass, {self.mass:g} kg")

    @property
    def wheelbase(self) -> float:
        """L = a + b, m."""
        return self.front_axle + self.rear_axle

    @property
    def length(self) -> float:
        """Of the body, m."""
        return self.front_overhang + self.wheelbase + self.rear_overhang

    @property
    def understeer_gradient(self) -> float:
        """K = (m / L) (b / C_f - a / C_r), rad of road-wheel angle per m/s^2 (Gillespie 1992, ch. 6)."""
        tires = self.tires
        front = self.rear_axle / tires.front_cornering_stiffness
        return self.mass / self.wheelbase * (front - self.front_axle / tires.rear_cornering_stiffness)

    @property
    def roll_gradient(self) -> float:
        """Steady roll angle per lateral acceleration, rad per m/s^2 (negative: the body leans outwards)."""
        body = self.suspension
        return -body.sprung_mass * body.arm / (body.roll_stiffness - body.sprung_mass * GRAVITY * body.arm)

    def steering_wheel_for(self, speed: float, lateral_acceleration: float) -> float:
        """Steering-wheel angle of a steady turn in the linear range, rad: i (L / R + K a_y)."""
        road_wheel = self.wheelbase / speed**2 + self.understeer_gradient
        return self.steering.ratio * road_wheel * lateral_acceleration

    def yaw_rate_gain(self, speed: float) -> float:
        """Steady yaw rate per steering-wheel angle in the linear range, 1/s: v / (i (L + K v^2))."""
        return speed / (self.steering.ratio * (self.wheelbase + self.understeer_gradient * speed**2))
