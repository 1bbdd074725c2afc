"""The four channels of the optimal washout as linear-quadratic problems.

Surge with pitch and sway with roll, where a tilt stands in for a force; heave; yaw. Perception sees the
difference of car and machine, so one set of its states is enough: the filters are linear.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, signal

from ...envs.cues import GRAVITY
from ...envs.perception import Canals, Otoliths
from .parameters import HeaveWeights, PlaneWeights, YawWeights
from .regulator import Problem

Matrix = NDArray[np.float64]
Block = tuple[Matrix, Matrix, Matrix, Matrix]

PLANE_STATES: Final = 10
"""Canal 3, otolith 2, integral of the displacement, displacement, velocity, tilt, tilt rate."""
LINE_STATES: Final = 5
"""Heave: otolith 2, integral, displacement, velocity. Yaw: canal 3, angle, rate."""
DISPLACEMENT, VELOCITY, TILT, TILT_RATE = 6, 7, 8, 9
"""Where the machine's states stand in a plane."""
LINE_POSITION, LINE_VELOCITY = 3, 4
"""Where they stand in heave and yaw."""


def _state_space(numerator: Matrix, denominator: Matrix) -> Block:
    a, b, c, d = (np.asarray(m, dtype=np.float64) for m in signal.tf2ss(numerator, denominator))
    return a, b, c, d


def plane(
    w: PlaneWeights,
    canals: Canals,
    otoliths: Otoliths,
    axis: int,
    sign: float,
    bandwidth: tuple[float, float],
) -> Problem:
    """Surge and pitch (axis 1, sign 1) or sway and roll (axis 0, sign -1).

    u = [tilt acceleration, acceleration], w = [angular velocity, specific force], felt force
    x'' + sign g tilt. y = [sensed rate, sensed force, integral, displacement, velocity, tilt rate, u].

    Args:
        w: Weights.
        canals: Perception of the angular velocity.
        otoliths: Perception of the specific force.
        axis: Of the canals: 0 roll, 1 pitch.
        sign: Of the specific force that a positive tilt gives.
        bandwidth: Of the car's angular velocity and specific force, rad/s.
    """
    canal, otolith = (
        _state_space(*canals.transfer_function(axis)),
        _state_space(*otoliths.transfer_function()),
    )
    a = linalg.block_diag(canal[0], otolith[0], np.zeros((5, 5)))
    a[5, DISPLACEMENT] = a[DISPLACEMENT, VELOCITY] = a[TILT, TILT_RATE] = 1.0
    b, e = np.zeros((PLANE_STATES, 2)), np.zeros((PLANE_STATES, 2))
    b[TILT_RATE, 0] = b[VELOCITY, 1] = 1.0
    e[:3, 0], e[3:5, 1] = canal[1][:, 0], otolith[1][:, 0]
    c, d, h = np.zeros((8, PLANE_STATES)), np.zeros((8, 2)), np.zeros((8, 2))
    c[0, :3], h[0, 0] = canal[2][0], canal[3][0, 0]
    c[1, 3:5], h[1, 1] = otolith[2][0], otolith[3][0, 0]
    # What perception sees is the car's motion less the machine's.
    for rows, inputs in ((a, e), (c, h)):
        rows[:, TILT_RATE] -= inputs[:, 0]
        rows[:, TILT] -= sign * GRAVITY * inputs[:, 1]
    b[:, 1] -= e[:, 1]
    d[:, 1] -= h[:, 1]
    c[2, 5] = c[3, DISPLACEMENT] = c[4, VELOCITY] = c[5, TILT_RATE] = d[6, 0] = d[7, 1] = 1.0
    sizes = (w.sensed_rate, w.sensed_force, w.integral, w.displacement, w.velocity, w.tilt_rate)
    return Problem(
        a, b, e, c, d, h, _weights(*sizes, w.tilt_acceleration, w.acceleration), np.array(bandwidth)
    )


def heave(w: HeaveWeights, otoliths: Otoliths, bandwidth: float) -> Problem:
    """Heave: u = acceleration, w = specific force; y = [sensed force, integral, position, velocity, u]."""
    otolith = _state_space(*otoliths.transfer_function())
    a = linalg.block_diag(otolith[0], np.zeros((3, 3)))
    a[2, LINE_POSITION] = a[LINE_POSITION, LINE_VELOCITY] = 1.0
    e = np.vstack([otolith[1], np.zeros((3, 1))])
    b = -e + np.eye(LINE_STATES)[:, [LINE_VELOCITY]]
    c = np.zeros((5, LINE_STATES))
    c[0, :2], c[1:4, 2:] = otolith[2][0], np.eye(3)
    h = np.array([[otolith[3][0, 0]], [0.0], [0.0], [0.0], [0.0]])
    d = -h + np.eye(5)[:, [4]]
    q = _weights(w.sensed_force, w.integral, w.displacement, w.velocity, w.acceleration)
    return Problem(a, b, e, c, d, h, q, np.array([bandwidth]))


def yaw(w: YawWeights, canals: Canals, bandwidth: float) -> Problem:
    """Yaw: u = angular acceleration, w = angular velocity. y = [sensed rate, angle, rate, u]."""
    canal = _state_space(*canals.transfer_function(2))
    a = linalg.block_diag(canal[0], np.zeros((2, 2)))
    e = np.vstack([canal[1], np.zeros((2, 1))])
    a[:, LINE_VELOCITY] -= e[:, 0]
    a[LINE_POSITION, LINE_VELOCITY] = 1.0
    b = np.eye(LINE_STATES)[:, [LINE_VELOCITY]]
    c = np.zeros((4, LINE_STATES))
    c[0, :3], c[1:3, 3:] = canal[2][0], np.eye(2)
    h = np.array([[canal[3][0, 0]], [0.0], [0.0], [0.0]])
    c[0, LINE_VELOCITY] -= h[0, 0]
    d = np.eye(4)[:, [3]]
    return Problem(
        a, b, e, c, d, h, _weights(w.sensed_rate, w.angle, w.rate, w.acceleration), np.array([bandwidth])
    )


def _weights(*sizes: float) -> Matrix:
    """Bryson's rule: a quantity at its size costs 1."""
    return np.asarray(sizes, dtype=np.float64) ** -2
