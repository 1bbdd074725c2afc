"""What the cab feels: specific force and rotation, from the model's own derivatives (Warp)."""

from __future__ import annotations

import warp as wp

from ..cues import GRAVITY
from ..precision import mat33, real, vec3
from .vehicle_state import (
    FORWARD,
    LATERAL,
    PITCH,
    PITCH_RATE,
    ROLL,
    ROLL_RATE,
    YAW_RATE,
    CarParameters,
    State,
)

wp.set_module_options({"enable_backward": False})


@wp.struct
class Slope:
    """The road under the car, along its path."""

    grade: real  # rad, uphill positive
    per_metre: real  # rad/m
    per_square_metre: real  # rad/m^2


@wp.struct
class Cue:
    """Cues at the origin of F_A, in F_A."""

    specific_force: vec3  # m/s^2
    angular_velocity: vec3  # rad/s
    angular_acceleration: vec3  # rad/s^2
    road_acceleration: vec3  # of point B in the road's frame, m/s^2


@wp.func
def road_to_body(roll: real, pitch: real) -> mat33:
    """Components in the road's frame to those in the body's: pitch first, then roll."""
    cr, sr, cp, sp = wp.cos(roll), wp.sin(roll), wp.cos(pitch), wp.sin(pitch)
    zero = real(0.0)
    return mat33(cp, zero, -sp, sr * sp, cr, sr * cp, cr * sp, -sr, cr * cp)


@wp.func
def cues(car: CarParameters, state: State, rate: State, slope: Slope) -> Cue:
    """(C13), (C14) Rigid-body kinematics from point B to the reference point; exact for any angle."""
    u, v, r = state[FORWARD], state[LATERAL], state[YAW_RATE]
    zero = real(0.0)
    turn = road_to_body(state[ROLL], state[PITCH])

    # The road's frame yaws with the car and pitches with the slope.
    tilt = slope.per_metre * u
    tilting = slope.per_square_metre * u * u + slope.per_metre * rate[FORWARD]
    carried = turn * vec3(zero, tilt, r)
    carried_rate = turn * vec3(zero, tilting, rate[YAW_RATE])
    acceleration = vec3(rate[FORWARD] - v * r, rate[LATERAL] + u * r, -tilt * u)

    # The body's own rotation in that frame.
    c, s = wp.cos(state[ROLL]), wp.sin(state[ROLL])
    p, q = state[ROLL_RATE], state[PITCH_RATE]
    own = vec3(p, q * c, -q * s)
    own_rate = vec3(rate[ROLL_RATE], rate[PITCH_RATE] * c - q * s * p, -rate[PITCH_RATE] * s - q * c * p)

    cue = Cue()
    cue.angular_velocity = carried + own
    cue.angular_acceleration = carried_rate - wp.cross(own, carried) + own_rate
    gravity = real(GRAVITY) * vec3(-wp.sin(slope.grade), zero, wp.cos(slope.grade))
    point = car.reference_point - vec3(zero, zero, car.arm)
    swing = wp.cross(cue.angular_velocity, wp.cross(cue.angular_velocity, point))
    cue.specific_force = turn * (acceleration - gravity) + wp.cross(cue.angular_acceleration, point) + swing
    cue.road_acceleration = acceleration
    return cue
