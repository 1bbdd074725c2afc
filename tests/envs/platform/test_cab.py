"""Points fixed to the cab, Eqs. (15) and (30) to (40), against differences of where the point is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from .probes import cab_rows

N = 200
RNG = np.random.default_rng(6)
OFFSET, ORIGIN = RNG.uniform(-3.0, 3.0, size=(2, N, 3))
BETA, RATE, ACCELERATION, TABLE = RNG.uniform(-1.2, 1.2, size=(4, N, 3))
STILL = np.zeros((1, 3))


def quadratic(value: np.ndarray, rate: np.ndarray, acceleration: np.ndarray, t: float) -> np.ndarray:
    return np.asarray(value + rate * t + 0.5 * acceleration * t**2)


def second_difference(path: Callable[[float], np.ndarray], h: float = 1e-3) -> np.ndarray:
    """Second derivative at 0, to fourth order."""
    near, far = path(h) + path(-h), path(2.0 * h) + path(-2.0 * h)
    return np.asarray((16.0 * near - far - 30.0 * path(0.0)) / (12.0 * h**2))


def rows(offset=OFFSET, beta=STILL, rate=STILL, acceleration=STILL, table=STILL, origin=STILL):
    return cab_rows(offset, beta, rate, acceleration, table, origin)


def test_equations_33_to_35():
    def op(t: float) -> np.ndarray:
        turned = TABLE.copy()
        turned[:, 0] = quadratic(*TABLE.T, t)
        return rows(table=turned)["op"]

    found = rows(table=TABLE)
    d, gamma = np.hypot(*OFFSET[:, :2].T), np.arctan2(OFFSET[:, 1], OFFSET[:, 0])
    printed = np.stack(
        [d * np.cos(TABLE[:, 0] + gamma), d * np.sin(TABLE[:, 0] + gamma), OFFSET[:, 2]], axis=1
    )
    np.testing.assert_allclose(found["op"], printed, atol=1e-13)
    np.testing.assert_allclose(found["velocity"], (op(1e-5) - op(-1e-5)) / 2e-5, atol=1e-8)
    np.testing.assert_allclose(found["acceleration"], second_difference(op), atol=1e-7)
    np.testing.assert_array_equal(found["acceleration"][:, 2], 0.0)


def test_specific_force_is_the_second_derivative_of_the_points_position_less_gravity():
    def attitude(t: float) -> np.ndarray:
        hexapod = Rotation.from_euler("XYZ", quadratic(BETA, RATE, ACCELERATION, t))
        table = Rotation.from_euler("z", quadratic(*TABLE.T, t)[:, None])
        return np.asarray((hexapod * table).as_matrix())

    def position(t: float) -> np.ndarray:
        return np.asarray(0.5 * ORIGIN * t**2 + (attitude(t) @ OFFSET[..., None])[..., 0])

    inertial = second_difference(position) - [0.0, 0.0, 9.81]
    expected = (np.swapaxes(attitude(0.0), 1, 2) @ inertial[..., None])[..., 0]
    found = rows(OFFSET, BETA, RATE, ACCELERATION, TABLE, ORIGIN)["force"]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_angular_velocity_of_the_cab_is_that_of_the_summed_angles():
    yaw = np.array([0.0, 0.0, 1.0])
    found = rows(beta=BETA, rate=RATE, table=TABLE)["omega"]
    summed = rows(beta=BETA + TABLE[:, :1] * yaw, rate=RATE + TABLE[:, 1:2] * yaw)["omega"]
    np.testing.assert_allclose(found, summed, atol=1e-13)


def test_at_rest_the_cab_feels_gravity_alone():
    table = TABLE * [1.0, 0.0, 0.0]
    force = rows(beta=BETA, table=table)["force"]
    np.testing.assert_allclose(np.linalg.norm(force, axis=1), 9.81, rtol=1e-13)
    np.testing.assert_allclose(force[:, 2], -9.81 * np.cos(BETA[:, 1]) * np.cos(BETA[:, 0]), atol=1e-13)


def test_nose_up_feels_like_speeding_up_and_right_side_down_like_a_left_turn():
    right, up = rows(offset=STILL, beta=0.1 * np.eye(3)[:2])["force"]
    assert up[0] == pytest.approx(9.81 * np.sin(0.1), rel=1e-13)
    assert right[1] == pytest.approx(-9.81 * np.sin(0.1), rel=1e-13)


def test_equation_47_is_the_part_of_equation_35_without_angular_acceleration():
    found = rows(table=TABLE * [1.0, 1.0, 0.0])
    np.testing.assert_allclose(found["centripetal"], found["acceleration"], atol=1e-14)
