"""Eqs. (2) to (10), (52) and (54) against SciPy's rotations and finite differences."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ...reference import frames as plain
from .probes import frame_rows, tilt_rows

H = 1e-6
N = 400
RNG = np.random.default_rng(5)
BETA = RNG.uniform(-1.2, 1.2, size=(N, 3)) * [1.0, 1.0, 6.0]
RATE, ACCELERATION = RNG.uniform(-3.0, 3.0, size=(2, N, 3))


def rotation(beta: np.ndarray) -> np.ndarray:
    return frame_rows(np.atleast_2d(np.asarray(beta, dtype=float)))["rotation"]


def test_rotation_is_roll_then_pitch_then_yaw():
    np.testing.assert_allclose(rotation(BETA), Rotation.from_euler("XYZ", BETA).as_matrix(), atol=1e-14)


def test_signs_of_the_angles():
    # Positive roll: right side down; positive pitch: nose up; positive yaw: nose to the right.
    roll, pitch, yaw = rotation(0.1 * np.eye(3))
    assert (roll @ [0.0, 1.0, 0.0])[2] > 0.0
    assert (pitch @ [1.0, 0.0, 0.0])[2] < 0.0
    assert (yaw @ [1.0, 0.0, 0.0])[1] > 0.0


def test_a_turntable_adds_to_yaw():
    # Eqs. (3) and (6): L_IS = L_IH L_HS.
    psi_t = BETA[::-1, 2]
    table = frame_rows(BETA[::-1])["table"]
    summed = BETA + np.outer(psi_t, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(rotation(BETA) @ table, rotation(summed), atol=1e-14)


def test_rate_matrix_gives_the_angular_velocity():
    derivative = (rotation(BETA + H * RATE) - rotation(BETA - H * RATE)) / (2.0 * H)
    cross = np.swapaxes(rotation(BETA), 1, 2) @ derivative  # L^T Ldot = Omega, the matrix of Eq. (38)
    omega = np.stack([cross[:, 2, 1], cross[:, 0, 2], cross[:, 1, 0]], axis=1)
    found = frame_rows(BETA, RATE)
    np.testing.assert_allclose(found["omega"], omega, atol=2e-8)
    np.testing.assert_allclose(plain.apply(found["rate_matrix"], RATE), found["omega"], atol=1e-13)


def test_rate_matrices_are_inverse_and_the_third_row_is_right():
    found = frame_rows(BETA)
    np.testing.assert_allclose(
        found["inverse"] @ found["rate_matrix"], np.broadcast_to(np.eye(3), (N, 3, 3)), atol=1e-13
    )
    tangent, c, s = np.tan(BETA[:, 1]), np.cos(BETA[:, 2]), np.sin(BETA[:, 2])
    third = np.stack([-tangent * c, tangent * s, np.ones(N)], axis=1)
    np.testing.assert_allclose(found["inverse"][:, 2], third, atol=1e-13)


def test_angular_acceleration_is_the_derivative_of_the_angular_velocity():
    def omega(t: float) -> np.ndarray:
        return frame_rows(BETA + RATE * t + 0.5 * ACCELERATION * t**2, RATE + ACCELERATION * t)["omega"]

    found = frame_rows(BETA, RATE, ACCELERATION)["omega_dot"]
    np.testing.assert_allclose(found, (omega(H) - omega(-H)) / (2.0 * H), atol=1e-7)


def test_the_reference_derives_the_same_matrices_from_elementary_rotations():
    found = frame_rows(BETA, RATE)
    np.testing.assert_allclose(plain.rotation(BETA), found["rotation"], atol=1e-14)
    np.testing.assert_allclose(plain.rate_matrix(BETA), found["rate_matrix"], atol=1e-14)
    np.testing.assert_allclose(plain.rate_matrix_derivative(BETA, RATE), found["derivative"], atol=1e-13)


def test_tilt_angles_feel_like_the_force_they_stand_for():
    # Eq. (17) undoes Eqs. (19), (21) for small angles.
    force = 0.01 * RATE[:, :2]
    psi = BETA[:, 2:] * [1.0, 0.0]
    beta = np.column_stack([tilt_rows(force, force, psi)["angles"], psi[:, 0]])
    felt = -np.swapaxes(rotation(beta), 1, 2) @ [0.0, 0.0, 9.81]
    np.testing.assert_allclose(felt[:, :2], force, atol=1e-6)


def test_equation_52_is_the_rate_of_the_tilt_angles():
    force, rate, psi, psi_rate = RATE[:, :2], ACCELERATION[:, :2], BETA[:, 2], RATE[:, 2]

    def tilt(t: float) -> np.ndarray:
        return tilt_rows(force + rate * t, rate, np.stack([psi + psi_rate * t, psi_rate], axis=1))["angles"]

    found = tilt_rows(force, rate, np.stack([psi, psi_rate], axis=1))["rates"]
    np.testing.assert_allclose(found, (tilt(H) - tilt(-H)) / (2.0 * H), atol=1e-8)
    s, c = np.sin(psi), np.cos(psi)
    turning, along = force[:, 1] * psi_rate - rate[:, 0], force[:, 0] * psi_rate + rate[:, 1]
    printed = np.stack([s * turning - c * along, -c * turning - s * along], axis=1) / 9.81
    np.testing.assert_allclose(found, printed, atol=1e-13)


def test_equation_54_is_the_false_angular_velocity_of_a_turning_tilt():
    (f_x, f_y), theta, psi, omega_t = RATE[:, :2].T, BETA[:, 1], BETA[:, 2], RATE[:, 2]
    # Eq. (53) through Eq. (9), with k_T = 1.
    tilt = tilt_rows(RATE[:, :2], np.zeros((N, 2)), np.stack([psi, omega_t], axis=1))["rates"]
    omega = frame_rows(BETA, np.column_stack([tilt, np.zeros(N)]))["omega"]
    s, c, less = np.sin(psi), np.cos(psi), 1.0 - np.cos(theta)
    printed = [
        -f_x + less * (f_x * c**2 - f_y * s * c),
        -f_y + less * (f_y * s**2 - f_x * s * c),
        np.sin(theta) * (f_y * s - f_x * c),
    ]
    np.testing.assert_allclose(omega, (omega_t / 9.81 * np.array(printed)).T, atol=1e-13)
