"""Points fixed to the cab, which the turntable turns on the hexapod: Eqs. (14), (15), (30) to (40)."""

from __future__ import annotations

import warp as wp

from ..cues import GRAVITY
from ..precision import mat33, real, vec3
from .frames import angular_acceleration, angular_velocity, rotation, turntable_rotation


@wp.func
def gravity() -> vec3:
    """g_I: gravity in the inertial frame, m/s^2 (z down)."""
    return vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))


@wp.func
def point_on_platform(cab_offset: vec3, psi_t: real) -> vec3:
    """Eqs. (15), (32), (33): OP_HH of a point at ``cab_offset`` = D_o + OP_SS from the turntable's axis."""
    return turntable_rotation(psi_t) * cab_offset


@wp.func
def point_velocity(op: vec3, omega_t: real) -> vec3:
    """Eq. (34): time derivative of OP_HH as the turntable turns."""
    return vec3(-op[1] * omega_t, op[0] * omega_t, real(0.0))


@wp.func
def point_acceleration(op: vec3, omega_t: real, omega_t_dot: real) -> vec3:
    """Eq. (35): second time derivative of OP_HH, third component 0."""
    return vec3(
        -op[1] * omega_t_dot - op[0] * omega_t * omega_t,
        op[0] * omega_t_dot - op[1] * omega_t * omega_t,
        real(0.0),
    )


@wp.func
def relative_acceleration(
    op: vec3, omega_h: vec3, omega_h_dot: vec3, omega_t: real, omega_t_dot: real
) -> vec3:
    """Eq. (37): aa_H, the acceleration of a point of the cab relative to the origin of F_H, in F_H."""
    return (
        point_acceleration(op, omega_t, omega_t_dot)
        + real(2.0) * wp.cross(omega_h, point_velocity(op, omega_t))
        + wp.cross(omega_h, wp.cross(omega_h, op))
        + wp.cross(omega_h_dot, op)
    )


@wp.func
def centripetal_part(op: vec3, omega_t: real) -> vec3:
    """Eq. (47): aa1_H, the low-frequency part of aa_H."""
    return vec3(-op[0] * omega_t * omega_t, -op[1] * omega_t * omega_t, real(0.0))


@wp.func
def cab_angular_velocity(beta: vec3, beta_rate: vec3, psi_t: real, omega_t: real) -> vec3:
    """omega_SS = L_SH omega_HH + [0, 0, omega_T], which is R_S betadot_S by Eqs. (3) and (7)."""
    omega_h = angular_velocity(beta, beta_rate)
    return wp.transpose(turntable_rotation(psi_t)) * omega_h + vec3(real(0.0), real(0.0), omega_t)


@wp.func
def cab_to_inertial(beta: vec3, psi_t: real) -> mat33:
    """L_IS = L_IH L_HS."""
    return rotation(beta) * turntable_rotation(psi_t)


@wp.func
def specific_force(
    cab_offset: vec3,
    beta: vec3,
    beta_rate: vec3,
    beta_acceleration: vec3,
    psi_t: real,
    omega_t: real,
    omega_t_dot: real,
    origin_acceleration: vec3,
) -> vec3:
    """Eqs. (1), (36), (40): f_SS at a point fixed to the cab.

    ``origin_acceleration`` is a_HI: of the origin of F_H, carriage and hexapod together, in F_I.
    """
    op = point_on_platform(cab_offset, psi_t)
    omega_h = angular_velocity(beta, beta_rate)
    omega_h_dot = angular_acceleration(beta, beta_rate, beta_acceleration)
    aa_h = relative_acceleration(op, omega_h, omega_h_dot, omega_t, omega_t_dot)
    acceleration = origin_acceleration + rotation(beta) * aa_h
    return wp.transpose(cab_to_inertial(beta, psi_t)) * (acceleration - gravity())
