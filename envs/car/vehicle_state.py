"""State, parameters and inputs of the vehicle model, as the kernel holds them (Warp)."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..precision import real, vec3

State: Any = wp.types.vector(15, real)
"""Integrated quantities of one car, by the indices below."""

X, Y, HEADING = wp.constant(0), wp.constant(1), wp.constant(2)
FORWARD, LATERAL, YAW_RATE = wp.constant(3), wp.constant(4), wp.constant(5)
ROLL, ROLL_RATE, PITCH, PITCH_RATE = wp.constant(6), wp.constant(7), wp.constant(8), wp.constant(9)
SLIP_FRONT, SLIP_REAR = wp.constant(10), wp.constant(11)
WHEEL, DRIVE, BRAKE = wp.constant(12), wp.constant(13), wp.constant(14)


@wp.struct
class CarParameters:
    """The numbers of :class:`~.vehicles.Car`, under the same names, flat."""

    mass: real
    front_axle: real
    rear_axle: real
    yaw_inertia: real
    cg_height: real
    reference_point: vec3
    sprung_mass: real
    roll_inertia: real
    pitch_inertia: real
    arm: real
    roll_stiffness: real
    roll_damping: real
    pitch_stiffness: real
    pitch_damping: real
    front_cornering_stiffness: real
    rear_cornering_stiffness: real
    friction: real
    shape_factor: real
    relaxation_length: real
    low_speed: real
    low_speed_damping: real
    ratio: real
    max_angle: real
    max_rate: real
    max_drive_force: real
    max_power: real
    max_brake_force: real
    drive_front_share: real
    brake_front_share: real
    drive_lag: real
    brake_lag: real
    drag_area: real
    rolling_resistance: real
    standstill_stiffness: real
    standstill_damping: real


@wp.struct
class Commands:
    """What acts on the car during one integration step."""

    wheel: real  # steering-wheel angle asked for, rad
    wheel_lag: real  # time constant of the arms (or the robot), s
    drive: real  # drive force asked for, N
    brake: real  # brake force asked for, N
    resistance: real  # brakes and rolling resistance, opposing the motion, N, see (C8)
    grade: real  # slope of the road along the path, rad, uphill positive
    grade_per_metre: real  # rad/m


@wp.struct
class Forces:
    """Of the tires and the air, in the road's plane, and the rates of the relaxed slips."""

    x: real  # N
    front_y: real
    rear_y: real
    slip_rate_front: real  # 1/s
    slip_rate_rear: real
