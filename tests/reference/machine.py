"""Constants of one machine for the reference, read off the configuration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motion_cueing.envs.platform import Platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics

from .frames import Floats, cross


@dataclass(frozen=True)
class MachineModel:
    """Arrays of a configured platform; actuators in the order carriage x, y; legs; turntable."""

    platform: Platform
    upper: Floats  # (6, 3) A_i
    lower: Floats  # (6, 3) B_i
    neutral: Floats  # (3,) S_0
    neutral_lengths: Floats  # (6,) L_i
    q_min: Floats  # (9,)
    q_max: Floats  # (9,)
    speed: Floats  # (9,) V
    acceleration: Floats  # (9,) A
    neutral_determinant: float  # det of leg rates for [sdot, omega] at neutral
    present: Floats  # (9,) 1.0 where the actuator exists
    cab: Floats  # (3,) D_o
    head: Floats  # (3,) D_o + OP_SS
    dynamics: tuple[ActuatorDynamics, ...]  # of carriage, hexapod, turntable

    @classmethod
    def of(cls, platform: Platform) -> MachineModel:
        carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
        upper, lower = np.array(hexapod.upper_joints), np.array(hexapod.lower_joints)
        neutral = np.array(hexapod.neutral)
        travel = [(0.0, 0.0)] * 9
        travel[2:8] = [hexapod.extension] * 6
        speed, acceleration, present = np.ones(9), np.ones(9), np.ones(9)
        speed[2:8], acceleration[2:8] = hexapod.velocity, hexapod.acceleration
        if carriage:
            travel[:2] = [carriage.travel_x, carriage.travel_y]
            speed[:2], acceleration[:2] = carriage.velocity, carriage.acceleration
        if turntable:
            travel[8] = turntable.travel or (-np.inf, np.inf)
            speed[8], acceleration[8] = turntable.velocity, turntable.acceleration
        present[:2], present[8] = carriage is not None, turntable is not None
        q_min, q_max = np.array(travel).T
        d_o = np.array(platform.cab.reference_point)
        unity = ActuatorDynamics()
        legs = upper - lower + neutral
        lengths = np.linalg.norm(legs, axis=1)
        lines = np.hstack([legs, cross(upper, legs)]) / lengths[:, None]
        return cls(
            platform=platform,
            upper=upper,
            lower=lower,
            neutral=neutral,
            neutral_lengths=lengths,
            neutral_determinant=float(np.linalg.det(lines)),
            q_min=q_min,
            q_max=q_max,
            speed=speed,
            acceleration=acceleration,
            present=present,
            cab=d_o,
            head=d_o + np.array(platform.cab.head),
            dynamics=(
                carriage.dynamics if carriage else unity,
                hexapod.dynamics,
                turntable.dynamics if turntable else unity,
            ),
        )
