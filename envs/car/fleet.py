"""The cars of the package, by name."""

from __future__ import annotations

from typing import Final

from ..errors import look_up
from .vehicles import Car, Drivetrain, Steering, Suspension, Tires

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

_FLEET: Final = {car.name: car for car in (SEDAN, BMW_320I, VOLVO_V40, E_CLASS_SUV)}


def car_names() -> list[str]:
    """Names that :func:`get_car` knows, the paper's car first."""
    return list(_FLEET)


def get_car(name: str) -> Car:
    """A car of the package by name.

    Raises:
        UnknownNameError: no such car; the message lists the nearest names.
    """
    return look_up("car", name, _FLEET)
