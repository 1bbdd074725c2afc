"""What the kernels know of a machine (constant) and of its motion (changing)."""

from __future__ import annotations

from typing import Final

import warp as wp

from ..precision import mat65, real, vec3, vec9
from .hexapod import HexapodGeometry

CARRIAGE = slice(0, 2)
LEGS = slice(2, 8)
TURNTABLE = 8
"""Order of the nine actuators: carriage x and y, legs 1 to 6, turntable."""

ACTUATORS = ("carriage_x", "carriage_y", "leg_1", "leg_2", "leg_3", "leg_4", "leg_5", "leg_6", "turntable")
"""Names of the nine actuators."""

AXES = ("carriage_x", "carriage_y", "surge", "sway", "heave", "roll", "pitch", "yaw", "turntable")
"""Names of the nine degrees of freedom an action commands, in its order."""

END_OF_TRAVEL: Final = 0x111111111
"""Bits of a step's limits that say an end of travel, one for each actuator."""

SINGULAR: Final = 0x888888888
"""Bits that say a nearly singular pose."""


@wp.struct
class Machine:
    """Constants of one machine. Actuator vectors are in the order of :data:`ACTUATORS`."""

    geometry: HexapodGeometry
    neutral_determinant: real  # det(J) at neutral
    position_min: vec9  # m, m, 6 x m, rad
    position_max: vec9
    velocity: vec9  # m/s, rad/s
    acceleration: vec9  # m/s^2, rad/s^2
    cab: vec3  # D_o: reference point of the cab from the turntable's axis, turntable at 0
    head: vec3  # D_o + OP_SS: the driver's head
    lag: mat65  # transition of the three actuator dynamics, see actuators.py
    lags: wp.vec3i  # whether carriage, legs, turntable lag
    dead_steps: wp.vec3i  # their dead times in steps
    has_dynamics: int  # whether any of them lags or has a dead time


@wp.struct
class Motion:
    """Where the machine is and how fast it moves."""

    position: vec9  # of the actuators: m, 6 x m from neutral, rad
    rate: vec9
    displacement: vec3  # s: origin of F_H from neutral, in F_V, m
    velocity: vec3  # sdot
    beta: vec3  # beta_H: roll, pitch, yaw of the hexapod, rad
    beta_rate: vec3


@wp.struct
class SetPoint:
    """Actuator set-points of an earlier step, for dead time and lag."""

    position: vec9
    rate: vec9


@wp.struct
class Step:
    """One step of the machine: where it came to, how it accelerated, what held it back."""

    motion: Motion
    acceleration: vec9  # mean over the step, in the order of AXES
    limits: wp.uint64  # 4 bits an actuator: 1 end of travel, 2 velocity, 4 acceleration, 8 singular pose
