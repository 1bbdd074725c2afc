"""Euler angles, transformation matrices and angular rates: Eqs. (2) to (10).

The order of rotation is roll, pitch, then yaw, beta = [phi, theta, psi]: with a turntable on top of
the hexapod its angle simply adds to psi, Eq. (3). V_I = L_IB V_B. Every function also runs in plain
Python, with Warp's vectors and matrices as arguments.
"""

from __future__ import annotations

import warp as wp

from ..precision import mat33, real, vec3


@wp.func
def rotation(beta: vec3) -> mat33:
    """Eq. (4): L_IB = Rx(phi) Ry(theta) Rz(psi), from frame F_B to the inertial frame."""
    sp = wp.sin(beta[0])
    cp = wp.cos(beta[0])
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    return mat33(
        ct * cs, -ct * ss, st,
        cp * ss + sp * st * cs, cp * cs - sp * st * ss, -sp * ct,
        sp * ss - cp * st * cs, sp * cs + cp * st * ss, cp * ct,
    )  # fmt: skip


@wp.func
def turntable_rotation(psi_t: real) -> mat33:
    """Eq. (6), transposed: L_HS = Rz(psi_T), from the cab to the hexapod's platform."""
    s = wp.sin(psi_t)
    c = wp.cos(psi_t)
    zero = real(0.0)
    return mat33(c, -s, zero, s, c, zero, zero, zero, real(1.0))


@wp.func
def rate_matrix(beta: vec3) -> mat33:
    """Eq. (9): R_B, with omega_BB = R_B betadot (Eq. (7))."""
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    zero = real(0.0)
    return mat33(ct * cs, ss, zero, -ct * ss, cs, zero, st, zero, real(1.0))


@wp.func
def rate_matrix_inverse(beta: vec3) -> mat33:
    """Eq. (10): T_B = R_B^-1, with betadot = T_B omega_BB (Eq. (8)); singular at theta = +-90 deg."""
    ct = wp.cos(beta[1])
    tt = wp.tan(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    zero = real(0.0)
    return mat33(cs / ct, -ss / ct, zero, ss, cs, zero, -tt * cs, tt * ss, real(1.0))


@wp.func
def rate_matrix_derivative(beta: vec3, beta_rate: vec3) -> mat33:
    """Time derivative of R_B of Eq. (9)."""
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    dt = beta_rate[1]
    ds = beta_rate[2]
    zero = real(0.0)
    return mat33(
        -st * cs * dt - ct * ss * ds, cs * ds, zero,
        st * ss * dt - ct * cs * ds, -ss * ds, zero,
        ct * dt, zero, zero,
    )  # fmt: skip


@wp.func
def angular_velocity(beta: vec3, beta_rate: vec3) -> vec3:
    """Eqs. (7) and (28): omega_BB = R_B betadot."""
    return rate_matrix(beta) * beta_rate


@wp.func
def angular_acceleration(beta: vec3, beta_rate: vec3, beta_acceleration: vec3) -> vec3:
    """Time derivative of Eq. (28): omegadot_BB = R_B betaddot + Rdot_B betadot."""
    return rate_matrix(beta) * beta_acceleration + rate_matrix_derivative(beta, beta_rate) * beta_rate
