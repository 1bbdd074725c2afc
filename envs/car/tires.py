"""Axle forces: Magic Formula with friction ellipse and relaxation length, valid down to standstill (Warp)."""

from __future__ import annotations

import math

import warp as wp

from ..precision import real

wp.set_module_options({"enable_backward": False})

_LEAST_CAPACITY = 0.05
"""Share of the friction that stays lateral when all of it is used longitudinally."""


@wp.struct
class Axle:
    """One axle at one moment."""

    load: real  # F_z, N
    force: real  # F_x along the wheels, N
    stiffness: real  # C_alpha at this load, N/rad


@wp.func
def limited(value: real, bound: real) -> real:
    """The value within [-bound, bound]."""
    return wp.clamp(value, -bound, bound)


@wp.func
def lateral_capacity(axle: Axle, friction: real) -> real:
    """(C1) Friction ellipse: D = sqrt((mu F_z)^2 - F_x^2), N."""
    grip = friction * axle.load
    least = real(_LEAST_CAPACITY) * grip
    return wp.sqrt(wp.max(grip * grip - axle.force * axle.force, least * least))


@wp.func
def lateral_force(axle: Axle, friction: real, shape: real, slip: real) -> real:
    """(C2) Magic Formula F_y = D sin(C atan(B alpha)), B = C_alpha / (C D); Pacejka 2012, ch. 4. In N."""
    capacity = wp.max(lateral_capacity(axle, friction), real(1.0))
    return capacity * wp.sin(shape * wp.atan(axle.stiffness * slip / (shape * capacity)))


@wp.func
def slip_for(force: real, capacity: real, stiffness: real, shape: real) -> real:
    """(C2) inverted: the slip angle that gives this lateral force, held at 95 % of the capacity, rad."""
    share = wp.clamp(force / capacity, real(-0.95), real(0.95))
    return shape * capacity / stiffness * wp.tan(wp.asin(share) / shape)


@wp.func
def slip_rate(slip: real, along: real, across: real, relaxation_length: real) -> real:
    """(C3) Relaxation sigma dalpha/dt + |v_x| alpha = -v_y (Bernard and Clover 1995), 1/s.

    ``along`` and ``across`` are the contact patch's velocity in the wheel's plane and across it, m/s.
    """
    return (-across - wp.abs(along) * slip) / relaxation_length


@wp.func
def damped_slip(slip: real, along: real, across: real, low_speed: real, damping: real) -> real:
    """(C4) Slip with the damping a standing tire needs, fading out at ``low_speed`` (Pacejka 2012, ch. 8)."""
    speed = wp.abs(along)
    result = slip
    if speed < low_speed:
        weight = real(0.5) * (real(1.0) + wp.cos(real(math.pi) * speed / low_speed))
        result = slip - damping * weight * across
    return result
