"""Eqs. (4) to (9) in symbols: rotations and Euler rates, as ``envs.platform.frames`` has them in numbers.

The order of rotation is roll, pitch, yaw, beta = [phi, theta, psi]; V_I = L_IB V_B.
"""

from __future__ import annotations

from .library import Expression, cs


def rotation(beta: Expression) -> Expression:
    """Eq. (4): (3, 3) L_IB = Rx(phi) Ry(theta) Rz(psi)."""
    sp, cp = cs.sin(beta[0]), cs.cos(beta[0])
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    rows = (
        (ct * c, -ct * ss, st),
        (cp * ss + sp * st * c, cp * c - sp * st * ss, -sp * ct),
        (sp * ss - cp * st * c, sp * c + cp * st * ss, cp * ct),
    )
    return _matrix(rows)


def turntable_rotation(psi_t: Expression) -> Expression:
    """Eq. (6), transposed: (3, 3) L_HS = Rz(psi_T), from the cab to the hexapod's platform."""
    s, c = cs.sin(psi_t), cs.cos(psi_t)
    return _matrix(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def rate_matrix(beta: Expression) -> Expression:
    """Eq. (9): (3, 3) R_B, with omega_BB = R_B betadot."""
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    return _matrix(((ct * c, ss, 0.0), (-ct * ss, c, 0.0), (st, 0.0, 1.0)))


def rate_matrix_derivative(beta: Expression, beta_rate: Expression) -> Expression:
    """(3, 3) time derivative of R_B of Eq. (9)."""
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    dt, ds = beta_rate[1], beta_rate[2]
    rows = (
        (-st * c * dt - ct * ss * ds, c * ds, 0.0),
        (st * ss * dt - ct * c * ds, -ss * ds, 0.0),
        (ct * dt, 0.0, 0.0),
    )
    return _matrix(rows)


def angular_velocity(beta: Expression, beta_rate: Expression) -> Expression:
    """Eqs. (7) and (28): (3,) omega_BB = R_B betadot."""
    return rate_matrix(beta) @ beta_rate


def angular_acceleration(
    beta: Expression, beta_rate: Expression, beta_acceleration: Expression
) -> Expression:
    """(3,) omegadot_BB = R_B betaddot + Rdot_B betadot."""
    return rate_matrix(beta) @ beta_acceleration + rate_matrix_derivative(beta, beta_rate) @ beta_rate


def _matrix(rows: tuple[tuple[Expression, ...], ...]) -> Expression:
    return cs.vertcat(*(cs.horzcat(*row) for row in rows))
