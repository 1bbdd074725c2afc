"""Eqs. (2) to (10) for a batch of Euler angles (n, 3): products of elementary rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


def elementary(axis: str, angle: Floats) -> Floats:
    """(n, 3, 3) rotation about a coordinate axis."""
    i, j = _PLANES[axis]
    k = 3 - i - j
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., k, k] = 1.0
    matrix[..., i, i] = matrix[..., j, j] = np.cos(angle)
    matrix[..., j, i] = np.sin(angle)
    matrix[..., i, j] = -matrix[..., j, i]
    return matrix


def rotation(beta: Floats) -> Floats:
    """Eq. (4): L_IB = Rx(phi) Ry(theta) Rz(psi)."""
    x, y, z = (elementary(axis, beta[..., k]) for k, axis in enumerate("xyz"))
    return x @ y @ z


def rate_matrix(beta: Floats) -> Floats:
    """R_B of Eq. (7), column by column: each Euler rate turns about its axis, seen from F_B.

    Roll about the inertial x, pitch about the y between, yaw about the last z.
    """
    y, z = elementary("y", beta[..., 1]), elementary("z", beta[..., 2])
    matrix = np.zeros((*beta.shape[:-1], 3, 3))
    matrix[..., :, 0] = (y @ z)[..., 0, :]
    matrix[..., :, 1] = z[..., 1, :]
    matrix[..., 2, 2] = 1.0
    return matrix


def rate_matrix_derivative(beta: Floats, beta_rate: Floats) -> Floats:
    """Time derivative of R_B: R_B = [(Ry Rz)^T e_x, Rz^T e_y, e_z], and d/dt Rz^T = -psidot E_z Rz^T."""
    y, z = elementary("y", beta[..., 1]), elementary("z", beta[..., 2])
    theta_rate, psi_rate = beta_rate[..., 1, None], beta_rate[..., 2, None]
    roll_axis, pitch_axis = (y @ z)[..., 0, :], z[..., 1, :]
    about_y = cross(pitch_axis, roll_axis)  # turning by theta about the pitch axis carries the roll axis
    about_z = np.array([0.0, 0.0, 1.0])
    matrix = np.zeros((*beta.shape[:-1], 3, 3))
    matrix[..., :, 0] = -theta_rate * about_y - psi_rate * cross(about_z, roll_axis)
    matrix[..., :, 1] = -psi_rate * cross(about_z, pitch_axis)
    return matrix


def apply(matrix: Floats, vector: Floats) -> Floats:
    """(n, i, j) by (n, j)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def cross(a: Floats, b: Floats) -> Floats:
    """Vector product along the last axis; many times faster than NumPy's for small batches."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    product[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    product[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
