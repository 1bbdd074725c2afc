"""The state of one environment: what a batch holds a row of for each environment."""

from __future__ import annotations

import warp as wp

from .perception.filters import Sensed, VestibularState
from .platform.state import Motion
from .precision import vec3, vec9


@wp.struct
class Cues:
    """Specific force at the cab's reference point and at the head, and angular velocity; in F_S or F_A."""

    force: vec3  # m/s^2
    rate: vec3  # rad/s
    head_force: vec3  # m/s^2


@wp.struct
class State:
    """Everything that changes in one environment."""

    sample: int  # index of the car's cue that is wanted now
    setpoint: Motion  # limited commands
    motion: Motion  # the true machine: the set-point after dead time and lag
    acceleration: vec9  # of the true machine over the last step, in the order of AXES
    setpoint_acceleration: vec9  # of the set-points, likewise
    limits: wp.uint64  # limits met in the last step, see platform.state.Step
    wanted: Cues
    felt: Cues
    vestibular_wanted: VestibularState
    vestibular_felt: VestibularState
    sensed_wanted: Sensed
    sensed_felt: Sensed


@wp.struct
class Drives:
    """Cue traces of all drives, one behind another."""

    force: wp.array(dtype=vec3)
    rate: wp.array(dtype=vec3)
    rate_derivative: wp.array(dtype=vec3)
    first: wp.array(dtype=int)  # of each drive
    length: wp.array(dtype=int)
