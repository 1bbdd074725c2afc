"""Steady gains of a car in the linear range, from its data."""

from __future__ import annotations

from motion_cueing.envs.car import Car
from motion_cueing.envs.cues import GRAVITY


def roll_gradient(car: Car) -> float:
    """Roll angle per lateral acceleration, rad per m/s^2 (negative: the body leans outwards)."""
    body = car.suspension
    return -body.sprung_mass * body.arm / (body.roll_stiffness - body.sprung_mass * GRAVITY * body.arm)


def yaw_rate_gain(car: Car, speed: float) -> float:
    """Yaw rate per steering-wheel angle, 1/s: v / (i (L + K v^2))."""
    return speed / (car.steering.ratio * (car.wheelbase + car.understeer_gradient * speed**2))
