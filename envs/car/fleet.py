"""More cars, from a kei car to a truck and a race car, with gearboxes and stability control.

All numbers are engineering choices of the usual size of their class. Cornering stiffness is written as the
static axle load times a factor per radian; bodies by their roll and pitch per g and natural frequencies.
"""

from __future__ import annotations

import math
from typing import Final

from ..cues import GRAVITY
from .vehicles import Car, Drivetrain, Gearbox, Stability, Steering, Suspension, Tires

MANUAL: Final = Gearbox(ratios=(3.6, 2.0, 1.35, 1.0, 0.8, 0.66), shift_speed=4.8)
"""A manual gearbox of a passenger car: 0.4 s without traction, more or less by the driver."""

AUTOMATIC: Final = Gearbox(
    ratios=(4.7, 3.1, 2.1, 1.65, 1.3, 1.0, 0.84, 0.67),
    shift_speed=4.2,
    gap=0.3,
    depth=0.35,
    closing=0.15,
    dwell=0.4,
    engine_braking=0.7,
    driveline_damping=0.7,
    manual=False,
)
"""A torque-converter automatic: the clutches hand over with a dip of a third of the force."""

DOUBLE_CLUTCH: Final = Gearbox(
    ratios=(3.9, 2.4, 1.65, 1.2, 0.95, 0.78, 0.64),
    shift_speed=5.5,
    gap=0.12,
    depth=0.5,
    closing=0.06,
    dwell=0.3,
    engine_braking=1.2,
    driveline_damping=0.4,
    manual=False,
)
"""A double-clutch gearbox: a short, sharp dip."""


def _suspension(
    mass: float, arm: float, roll: float, roll_rate: float, pitch: float, pitch_rate: float
) -> Suspension:
    """A body by its roll and pitch, deg per g, and their natural frequencies, Hz; damping ratio 0.28."""
    moment = mass * GRAVITY * arm
    values = []
    for gradient, frequency in ((roll, roll_rate), (pitch, pitch_rate)):
        net, omega = moment / math.radians(gradient), 2.0 * math.pi * frequency
        total = net / omega**2
        values.append((net + moment, total - mass * arm**2, 0.56 * total * omega))
    (roll_k, roll_i, roll_c), (pitch_k, pitch_i, pitch_c) = values
    return Suspension(mass, roll_i, pitch_i, arm, roll_k, roll_c, pitch_k, pitch_c)


def _tires(mass: float, front: float, rear: float, grip: tuple[float, float], friction: float) -> Tires:
    """Axles with ``grip`` times their static load per radian."""
    load = mass * GRAVITY / (front + rear)
    return Tires(grip[0] * load * rear, grip[1] * load * front, friction)


KEI_CAR: Final = Car(
    name="kei-car",
    description="kei car, 900 kg, 47 kW, manual",
    mass=900.0,
    front_axle=1.00,
    rear_axle=1.46,
    yaw_inertia=1050.0,
    cg_height=0.58,
    width=1.48,
    front_overhang=0.50,
    rear_overhang=0.44,
    suspension=_suspension(780.0, 0.48, 7.0, 1.5, 2.6, 1.5),
    tires=_tires(900.0, 1.00, 1.46, (15.0, 17.5), 0.9),
    drivetrain=Drivetrain(3.6e3, 47e3, 9e3, drag_area=0.62),
    steering=Steering(ratio=16.0),
    reference_point=(-0.15, -0.31, 0.0),
    gearbox=Gearbox(ratios=(3.5, 1.95, 1.3, 0.95, 0.78), shift_speed=4.2, urgency=1.2, engine_braking=1.1),
    stability=Stability(3e4, 2.5e3),
)

COMPACT: Final = Car(
    name="compact",
    description="compact car, 1280 kg, 85 kW, manual",
    mass=1280.0,
    front_axle=1.04,
    rear_axle=1.58,
    yaw_inertia=2000.0,
    cg_height=0.54,
    width=1.79,
    front_overhang=0.86,
    rear_overhang=0.78,
    suspension=_suspension(1120.0, 0.44, 5.5, 1.4, 2.1, 1.4),
    tires=_tires(1280.0, 1.04, 1.58, (16.0, 19.0), 0.95),
    drivetrain=Drivetrain(5.2e3, 85e3, 13e3),
    steering=Steering(ratio=15.5),
    gearbox=MANUAL,
    stability=Stability(5e4, 4.5e3),
)

EXECUTIVE: Final = Car(
    name="executive",
    description="executive saloon, 1750 kg, 180 kW, automatic",
    mass=1750.0,
    front_axle=1.42,
    rear_axle=1.52,
    yaw_inertia=3050.0,
    cg_height=0.54,
    width=1.87,
    front_overhang=0.85,
    rear_overhang=1.12,
    suspension=_suspension(1550.0, 0.43, 4.2, 1.3, 1.7, 1.3),
    tires=_tires(1750.0, 1.42, 1.52, (17.0, 20.0), 1.0),
    drivetrain=Drivetrain(9e3, 180e3, 18e3, drive_front_share=0.0),
    steering=Steering(ratio=15.0),
    reference_point=(-0.05, -0.37, 0.04),
    gearbox=AUTOMATIC,
    stability=Stability(6e4, 6e3),
)

SPORTS_CAR: Final = Car(
    name="sports-car",
    description="sports car, 1500 kg, 290 kW, double clutch",
    mass=1500.0,
    front_axle=1.44,
    rear_axle=1.01,
    yaw_inertia=2050.0,
    cg_height=0.46,
    width=1.85,
    front_overhang=1.00,
    rear_overhang=1.05,
    suspension=_suspension(1320.0, 0.36, 2.6, 1.8, 1.2, 1.7),
    tires=_tires(1500.0, 1.44, 1.01, (19.0, 23.0), 1.12),
    drivetrain=Drivetrain(10.5e3, 290e3, 19e3, drive_front_share=0.2, brake_front_share=0.62, drive_lag=0.15),
    steering=Steering(ratio=14.0),
    reference_point=(0.1, -0.36, 0.0),
    gearbox=DOUBLE_CLUTCH,
    stability=Stability(6e4, 6e3),
)

ELECTRIC_CAR: Final = Car(
    name="electric-car",
    description="electric car, 1900 kg, 200 kW, one gear, strong recuperation",
    mass=1900.0,
    front_axle=1.46,
    rear_axle=1.44,
    yaw_inertia=3000.0,
    cg_height=0.47,
    width=1.85,
    front_overhang=0.85,
    rear_overhang=0.95,
    suspension=_suspension(1680.0, 0.36, 3.5, 1.5, 1.6, 1.4),
    tires=_tires(1900.0, 1.46, 1.44, (17.0, 20.0), 1.0),
    drivetrain=Drivetrain(9.5e3, 200e3, 19e3, drive_front_share=0.3, drive_lag=0.08, drag_area=0.55),
    steering=Steering(ratio=14.5),
    reference_point=(-0.02, -0.37, -0.02),
    gearbox=Gearbox(ratios=(1.0,), shift_speed=6.0, engine_braking=1.8, driveline_damping=0.8, manual=False),
    stability=Stability(7e4, 6e3),
)

VAN: Final = Car(
    name="van",
    description="delivery van, 2700 kg loaded, 103 kW, manual",
    mass=2700.0,
    front_axle=1.75,
    rear_axle=1.55,
    yaw_inertia=6000.0,
    cg_height=0.85,
    width=2.0,
    front_overhang=1.0,
    rear_overhang=1.1,
    suspension=_suspension(2350.0, 0.62, 6.5, 1.2, 2.6, 1.4),
    tires=_tires(2700.0, 1.75, 1.55, (11.0, 13.0), 0.85),
    drivetrain=Drivetrain(8e3, 103e3, 25e3, drag_area=1.6),
    steering=Steering(ratio=18.0),
    reference_point=(0.85, -0.45, -0.25),
    gearbox=Gearbox(
        ratios=(4.2, 2.2, 1.4, 1.0, 0.8, 0.65), shift_speed=3.6, gap=0.5, closing=0.15, engine_braking=1.2
    ),
    stability=Stability(1.2e5, 9e3),
)

TRUCK: Final = Car(
    name="truck",
    description="truck of two axles, 12 t, 184 kW, automated 9-speed gearbox",
    mass=12000.0,
    front_axle=2.6,
    rear_axle=1.9,
    yaw_inertia=55000.0,
    cg_height=1.25,
    width=2.5,
    front_overhang=1.4,
    rear_overhang=2.2,
    suspension=_suspension(10300.0, 0.75, 6.0, 0.9, 1.6, 1.3),
    tires=_tires(12000.0, 2.6, 1.9, (6.5, 8.0), 0.75),
    drivetrain=Drivetrain(
        32e3, 184e3, 75e3, drive_front_share=0.0, brake_front_share=0.5, brake_lag=0.25, drag_area=5.5
    ),
    steering=Steering(ratio=20.0, max_angle=14.0),
    reference_point=(3.0, -0.7, -0.85),
    gearbox=Gearbox(
        ratios=(9.5, 6.9, 5.1, 3.75, 2.75, 2.0, 1.5, 1.15, 0.85),
        shift_speed=2.2,
        urgency=0.5,
        gap=0.7,
        closing=0.25,
        dwell=1.0,
        engine_braking=0.9,
        driveline_frequency=14.0,
        manual=False,
    ),
    stability=Stability(3e5, 3e4),
)

RACE_CAR: Final = Car(
    name="race-car",
    description="GT race car, 1300 kg, 370 kW, sequential gearbox",
    mass=1300.0,
    front_axle=1.35,
    rear_axle=1.25,
    yaw_inertia=1650.0,
    cg_height=0.40,
    width=1.98,
    front_overhang=1.0,
    rear_overhang=0.9,
    suspension=_suspension(1130.0, 0.30, 1.0, 2.8, 0.6, 2.6),
    tires=_tires(1300.0, 1.35, 1.25, (24.0, 28.0), 1.35),
    drivetrain=Drivetrain(
        11.5e3,
        370e3,
        22e3,
        drive_front_share=0.0,
        brake_front_share=0.6,
        drive_lag=0.08,
        brake_lag=0.06,
        drag_area=0.95,
    ),
    steering=Steering(ratio=12.0),
    reference_point=(-0.2, -0.35, 0.02),
    gearbox=Gearbox(
        ratios=(2.6, 2.0, 1.6, 1.35, 1.15, 1.0),
        shift_speed=11.0,
        urgency=1.0,
        gap=0.06,
        closing=0.03,
        dwell=0.2,
        engine_braking=2.0,
        driveline_frequency=30.0,
        driveline_damping=0.35,
        manual=False,
    ),
    stability=Stability(6e4, 6e3),
)

# Reserved: never in a distribution that trains or tunes, see RESERVED_CARS.

PICKUP: Final = Car(
    name="pickup",
    description="pickup, 2250 kg, 150 kW, automatic; reserved for held-out drives",
    mass=2250.0,
    front_axle=1.45,
    rear_axle=1.77,
    yaw_inertia=5000.0,
    cg_height=0.75,
    width=1.86,
    front_overhang=0.9,
    rear_overhang=1.25,
    suspension=_suspension(1900.0, 0.56, 6.3, 1.3, 2.4, 1.4),
    tires=_tires(2250.0, 1.45, 1.77, (12.5, 15.5), 0.9),
    drivetrain=Drivetrain(9e3, 150e3, 21e3, drive_front_share=0.0, drag_area=1.15),
    steering=Steering(ratio=18.0),
    reference_point=(0.0, -0.38, -0.1),
    gearbox=Gearbox(
        ratios=(4.0, 2.4, 1.5, 1.15, 0.85, 0.67),
        shift_speed=4.5,
        gap=0.4,
        depth=0.45,
        closing=0.2,
        engine_braking=0.8,
        driveline_damping=0.6,
        manual=False,
    ),
    stability=Stability(9e4, 7e3),
)

HOT_HATCH: Final = Car(
    name="hot-hatch",
    description="hot hatch, 1400 kg, 190 kW, manual; reserved for held-out drives",
    mass=1400.0,
    front_axle=1.02,
    rear_axle=1.60,
    yaw_inertia=2150.0,
    cg_height=0.51,
    width=1.82,
    front_overhang=0.88,
    rear_overhang=0.80,
    suspension=_suspension(1230.0, 0.41, 3.6, 1.7, 1.5, 1.6),
    tires=_tires(1400.0, 1.02, 1.60, (18.0, 22.0), 1.05),
    drivetrain=Drivetrain(7.5e3, 190e3, 16e3, drive_lag=0.18),
    steering=Steering(ratio=14.0),
    gearbox=Gearbox(
        ratios=(3.4, 2.1, 1.5, 1.15, 0.92, 0.76),
        shift_speed=6.0,
        gap=0.3,
        closing=0.07,
        dwell=0.4,
        engine_braking=1.4,
        driveline_damping=0.35,
    ),
    stability=Stability(5.5e4, 5e3),
)

CITY_BUS: Final = Car(
    name="city-bus",
    description="city bus, 14 t, 210 kW, four-speed automatic; reserved for held-out drives",
    mass=14000.0,
    front_axle=3.7,
    rear_axle=2.2,
    yaw_inertia=130000.0,
    cg_height=1.1,
    width=2.55,
    front_overhang=2.7,
    rear_overhang=3.4,
    suspension=_suspension(12000.0, 0.6, 4.5, 0.9, 1.2, 1.1),
    tires=_tires(14000.0, 3.7, 2.2, (6.5, 8.5), 0.75),
    drivetrain=Drivetrain(
        30e3, 210e3, 85e3, drive_front_share=0.0, brake_front_share=0.45, brake_lag=0.25, drag_area=5.0
    ),
    steering=Steering(ratio=20.0, max_angle=16.0),
    reference_point=(5.0, -0.8, -0.35),
    gearbox=Gearbox(
        ratios=(3.4, 1.9, 1.4, 1.0),
        shift_speed=4.5,
        urgency=0.6,
        gap=0.6,
        depth=0.5,
        closing=0.3,
        engine_braking=1.2,
        driveline_frequency=14.0,
        driveline_damping=0.6,
        manual=False,
    ),
    stability=Stability(4e5, 3e4),
)
