"""What is felt in the cab: Eqs. (1), (7) and (33) to (40) for a batch."""

from __future__ import annotations

import numpy as np

from .frames import Floats, apply, cross, elementary, rate_matrix, rate_matrix_derivative, rotation
from .machine import MachineModel
from .setpoint import MotionState

GRAVITY = np.array([0.0, 0.0, 9.81])


def simulator_cues(machine: MachineModel, motion: MotionState, axes: Floats) -> tuple[Floats, Floats, Floats]:
    """Specific force at the cab's reference point, angular velocity, and specific force at the head, in F_S.

    ``axes`` (n, 9) are the accelerations of the nine axes.
    """
    beta, beta_rate = motion.pose[:, 3:], motion.pose_rate[:, 3:]
    psi_t, omega_t, omega_t_dot = motion.position[:, 8], motion.rate[:, 8], axes[:, 8]
    r_h = rate_matrix(beta)
    omega = apply(r_h, beta_rate)
    omega_dot = apply(r_h, axes[:, 5:8]) + apply(rate_matrix_derivative(beta, beta_rate), beta_rate)
    l_hs = elementary("z", psi_t)
    l_is = rotation(beta) @ l_hs
    a_hi = axes[:, 2:5].copy()
    a_hi[:, :2] += axes[:, :2]
    forces = []
    for point in (machine.cab, machine.head):
        aa_h = relative_acceleration(l_hs @ point, omega, omega_dot, omega_t, omega_t_dot)
        in_i = a_hi - GRAVITY
        forces.append(apply(np.swapaxes(l_is, 1, 2), in_i) + apply(np.swapaxes(l_hs, 1, 2), aa_h))
    rate = apply(np.swapaxes(l_hs, 1, 2), omega)
    rate[:, 2] += omega_t
    return forces[0], rate, forces[1]


def relative_acceleration(
    op: Floats, omega: Floats, omega_dot: Floats, omega_t: Floats, omega_t_dot: Floats
) -> Floats:
    """Eq. (37), with Eqs. (34) and (35)."""
    x, y = op[:, 0], op[:, 1]
    zero = np.zeros_like(x)
    op_dot = np.stack([-y * omega_t, x * omega_t, zero], axis=1)
    op_ddot = np.stack([-y * omega_t_dot - x * omega_t**2, x * omega_t_dot - y * omega_t**2, zero], axis=1)
    return np.asarray(
        op_ddot + 2.0 * cross(omega, op_dot) + cross(omega, cross(omega, op)) + cross(omega_dot, op)
    )
