"""Cars as data: every number of the vehicle model with unit and meaning, and the cars of the package."""

from __future__ import annotations

from dataclasses import field
from dataclasses import replace as replaced
from typing import Annotated, Any, Final

from pydantic import Field

from ..cues import GRAVITY
from ..registry import Registry
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


MOST_GEARS: Final = 16
"""Of a gearbox."""


@configuration
class Gearbox:
    """Gears: interruptions of the drive force at shifts, and the engine's drag when coasting.

    The engine turns up with speed times ratio. A gear is left upwards where the engine turns as fast as the
    first gear does at ``shift_speed`` (1 + ``urgency`` x share of the drive force), and downwards where the
    gear below would turn it slower than ``down_share`` of that.

    Args:
        ratios: Of the gears, falling; only their quotients matter.
        shift_speed: Speed at which the first gear is left with little throttle, m/s.
        urgency: How much later shifts come at full throttle, as a share.
        down_share: Of the speed of the engine at which the driver shifts up: below it, down.
        gap: Duration of a shift, s: the force is lowered from its beginning to its end.
        depth: Share of the drive force that is missing meanwhile: 1 for a clutch that opens, less where one
            clutch hands over to another.
        closing: Time in which the force comes back, s. The shorter, the more jerk.
        dwell: Least time from the end of a shift to the next one, s.
        engine_braking: Deceleration by the engine's drag in the first gear, m/s^2; in others by their ratio.
        driveline_frequency: Of the elastic driveline with the car's mass, rad/s (about 3 Hz).
        driveline_damping: Its damping ratio; below 0.7 a shift ends with a shuffle.
        manual: Whether a driver shifts, each at a pace of their own.
    """

    ratios: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_GEARS)]
    shift_speed: Positive
    urgency: NonNegative = 0.8
    down_share: Annotated[float, Field(gt=0.0, lt=0.95)] = 0.75
    gap: Positive = 0.4
    depth: Share = 1.0
    closing: Positive = 0.1
    dwell: NonNegative = 0.5
    engine_braking: NonNegative = 1.0
    driveline_frequency: Annotated[float, Field(gt=0.0, le=100.0)] = 19.0
    driveline_damping: Positive = 0.5
    manual: bool = True

    def __post_init__(self) -> None:
        if any(after >= before for before, after in zip(self.ratios, self.ratios[1:], strict=False)):
            raise ValueError(f"ratios must fall from gear to gear, found {list(self.ratios)}")


@configuration
class Stability:
    """Stability control: single wheels are braked against a car that turns more than its wheel asks for.

    Args:
        stability_gain: Yaw moment per excess of the yaw rate, N m s/rad.
        stability_moment: Largest yaw moment, N m.
    """

    stability_gain: Positive
    stability_moment: Positive


@configuration
class Car:
    """A car. Lengths in meters, body axes x forward, y right, z down, origin at the c.g.

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
        gearbox: Gears; None for a drive force without interruption.
        stability: Stability control; None for none.
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
    gearbox: Gearbox | None = None
    stability: Stability | None = None

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

    def steering_wheel_for(self, speed: float, lateral_acceleration: float) -> float:
        """Steering-wheel angle of a steady turn in the linear range, rad: i (L / R + K a_y)."""
        road_wheel = self.wheelbase / speed**2 + self.understeer_gradient
        return self.steering.ratio * road_wheel * lateral_acceleration


SEDAN: Final = Car(
    name="sedan",
    description="1814 kg sedan, the car of the paper",
    mass=1814.0,
    front_axle=1.20,
    rear_axle=1.55,
    yaw_inertia=3200.0,
    cg_height=0.55,
    width=1.85,
    front_overhang=0.95,
    rear_overhang=1.15,
    suspension=Suspension(
        sprung_mass=1600.0,
        roll_inertia=700.0,
        pitch_inertia=2900.0,
        arm=0.45,
        roll_stiffness=88e3,
        roll_damping=5.1e3,
        pitch_stiffness=224e3,
        pitch_damping=15e3,
    ),
    tires=Tires(front_cornering_stiffness=95e3, rear_cornering_stiffness=115e3, friction=1.0),
    drivetrain=Drivetrain(max_drive_force=7.5e3, max_power=150e3, max_brake_force=20e3),
)
"""The paper gives the mass alone. The other numbers are an engineering choice: understeer 2.2 deg/g, roll
5 deg/g at 1.4 Hz and a damping ratio of 0.28, pitch 1.9 deg/g; body sizes of a large sedan."""

BMW_320I: Final = Car(
    name="bmw-320i",
    description="BMW 320i, 1093 kg, of commonroad-vehicle-models",
    mass=1093.2952334674046,
    front_axle=1.1561957064,
    rear_axle=1.4227170936,
    yaw_inertia=1791.5995300122856,
    cg_height=0.5748689544,
    width=1.61,
    front_overhang=0.96,
    rear_overhang=0.97,
    suspension=Suspension(
        sprung_mass=965.7108098804363,
        roll_inertia=207.26524557936952,
        pitch_inertia=1565.8178787125541,
        arm=0.61373004,
        roll_stiffness=51.34e3,
        roll_damping=3.25e3,
        pitch_stiffness=144.9e3,
        pitch_damping=11.45e3,
    ),
    tires=Tires(front_cornering_stiffness=129.697e3, rear_cornering_stiffness=105.400e3, friction=1.0489),
    drivetrain=Drivetrain(
        max_drive_force=5.5e3, max_power=100e3, max_brake_force=12e3, drive_front_share=0.0
    ),
    steering=Steering(ratio=16.0),
    reference_point=(-0.29, -0.35, 0.07),
)
"""commonroad-vehicle-models 3.0.2 (BSD-3), vehicle 2: masses, lengths, inertias, sizes. Roll stiffness,
damping are (K_s T^2 / 2) of both axles and the anti-roll bars, pitch ones 2 (K_sf a^2 + K_sr b^2), with
the arm h_s (its roll axis lies on the ground). Cornering stiffness is 21.92 (p_Ky1) times the static
axle load: a neutral car. Drive force, power, brake force, steering ratio, overhangs and seat are
engineering choices."""

VOLVO_V40: Final = Car(
    name="volvo-v40",
    description="Volvo V40, 1395 kg, of a public KTH model",
    mass=1395.0,
    front_axle=1.046,
    rear_axle=1.505,
    yaw_inertia=2380.0,
    cg_height=0.51,
    width=1.717,
    front_overhang=0.90,
    rear_overhang=1.03,
    suspension=Suspension(
        sprung_mass=1230.0,
        roll_inertia=540.0,
        pitch_inertia=2100.0,
        arm=0.42,
        roll_stiffness=63.14e3,
        roll_damping=3.71e3,
        pitch_stiffness=157.9e3,
        pitch_damping=10.5e3,
    ),
    tires=Tires(front_cornering_stiffness=70e3, rear_cornering_stiffness=70e3, friction=1.0),
    drivetrain=Drivetrain(max_drive_force=6e3, max_power=110e3, max_brake_force=15.4e3),
    reference_point=(-0.40, -0.36, 0.01),
)
"""Mass, axles, yaw inertia, c.g. height, cornering stiffness, steering ratio, 5 deg/g of roll: a public
KTH model. Engineering choices: sprung mass and its inertias, arm, 1.4 Hz in roll and 1.9 deg/g of pitch
at 1.3 Hz (both damped with 0.28), drivetrain, seat; width and length of the first V40 (from memory)."""

E_CLASS_SUV: Final = Car(
    name="e-class-suv",
    description="E-class SUV, 1860 kg, of CarSim data in public repositories",
    mass=1860.0,
    front_axle=1.18,
    rear_axle=1.77,
    yaw_inertia=3438.0,
    cg_height=0.72,
    width=1.88,
    front_overhang=0.90,
    rear_overhang=1.00,
    suspension=Suspension(
        sprung_mass=1590.0,
        roll_inertia=894.4,
        pitch_inertia=2687.1,
        arm=0.55,
        roll_stiffness=90.5e3,
        roll_damping=5.94e3,
        pitch_stiffness=232e3,
        pitch_damping=14.9e3,
    ),
    tires=Tires(front_cornering_stiffness=90.7e3, rear_cornering_stiffness=109e3, friction=0.95),
    drivetrain=Drivetrain(max_drive_force=8e3, max_power=160e3, max_brake_force=20e3, drag_area=0.95),
    reference_point=(-0.27, -0.38, 0.02),
)
"""Masses, axles, yaw inertia, c.g. height, cornering stiffness: CarSim data in public repositories; the
roll and pitch inertia are its sprung-mass data (from memory). Engineering choices: arm, 6 deg/g of roll
at 1.2 Hz, 2.2 deg/g of pitch at 1.3 Hz (both damped with 0.28), friction, drivetrain, body sizes, seat."""

_CARS: Final[Registry[Any]] = Registry("car", "motion_cueing.cars")

for _car in (SEDAN, BMW_320I, VOLVO_V40, E_CLASS_SUV):
    _CARS.register(_car.name, _car, _car.description)

for _name, _about in (
    ("kei-car", "kei car, 900 kg, 47 kW, manual"),
    ("compact", "compact car, 1280 kg, 85 kW, manual"),
    ("executive", "executive saloon, 1750 kg, 180 kW, automatic"),
    ("sports-car", "sports car, 1500 kg, 290 kW, double clutch"),
    ("electric-car", "electric car, 1900 kg, 200 kW, one gear, strong recuperation"),
    ("van", "delivery van, 2700 kg loaded, 103 kW, manual"),
    ("truck", "truck of two axles, 12 t, 184 kW, automated 9-speed gearbox"),
    ("race-car", "GT race car, 1300 kg, 370 kW, sequential gearbox"),
    ("pickup", "pickup, 2250 kg, 150 kW, automatic; reserved for held-out drives"),
    ("hot-hatch", "hot hatch, 1400 kg, 190 kW, manual; reserved for held-out drives"),
    ("city-bus", "city bus, 14 t, 210 kW, four-speed automatic; reserved for held-out drives"),
):
    _CARS.register(_name, f"{__package__}.fleet:{_name.upper().replace('-', '_')}", _about)

STANDARD_CARS: Final = ("sedan", "bmw-320i", "volvo-v40", "e-class-suv")
"""The cars without gears, which drive every standard maneuver."""

RESERVED_CARS: Final = ("pickup", "hot-hatch", "city-bus")
"""Cars of held-out drives, in no distribution that trains or tunes."""


register = _CARS.register
"""Give a car, or what makes it, a name, see :meth:`~motion_cueing.envs.registry.Registry.register`."""

car_names = _CARS.names
"""Names that :func:`get_car` knows, the paper's car first."""


def describe_car(name: str) -> str:
    """One line about a car."""
    return _CARS.description(name) or get_car(name).description


def get_car(name: str) -> Car:
    """A car by name.

    Raises:
        UnknownNameError: no such car; the message lists the nearest names.
    """
    car: Car = _CARS.make(name)
    return car if car.name == name else replaced(car, name=name)
