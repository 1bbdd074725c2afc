"""Eqs. (12) and (13) in symbols, with their first and second time derivatives.

A leg's vector is d = L_IH A - B + S, so with v = ddot and a = dddot

    l = |d| - L,    ldot = d.v / |d|,    lddot = (v.v + d.a - ldot^2) / |d|.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import Hexapod
from .frames import angular_acceleration, angular_velocity, rotation
from .library import Expression, cs


class Pose(NamedTuple):
    """Motion of the platform: each (3,), displacement in F_V, Euler angles; SI units, radians."""

    displacement: Expression
    beta: Expression
    velocity: Expression
    beta_rate: Expression
    acceleration: Expression
    beta_acceleration: Expression


class Legs(NamedTuple):
    """Extensions, rates and accelerations of the six legs, each (6,), m, m/s, m/s^2."""

    extension: Expression
    rate: Expression
    acceleration: Expression


def leg_motion(hexapod: Hexapod, pose: Pose) -> Legs:
    """The legs of a moving platform."""
    l_ih = rotation(pose.beta)
    omega = angular_velocity(pose.beta, pose.beta_rate)
    omega_dot = angular_acceleration(pose.beta, pose.beta_rate, pose.beta_acceleration)
    extensions, rates, accelerations = [], [], []
    for upper, offset, neutral_length in _joints(hexapod):
        d = l_ih @ upper + offset + pose.displacement
        turning = cs.cross(omega, upper)
        v = pose.velocity + l_ih @ turning
        a = pose.acceleration + l_ih @ (cs.cross(omega_dot, upper) + cs.cross(omega, turning))
        length = cs.norm_2(d)
        rate = cs.dot(d, v) / length
        extensions.append(length - neutral_length)
        rates.append(rate)
        accelerations.append((cs.dot(v, v) + cs.dot(d, a) - rate**2) / length)
    return Legs(cs.vertcat(*extensions), cs.vertcat(*rates), cs.vertcat(*accelerations))


def clearance(hexapod: Hexapod, displacement: Expression, beta: Expression) -> Expression:
    """Determinant of J over its value at neutral: 1 there, 0 in a singular pose."""
    jacobian = _jacobian(hexapod, displacement, beta)
    neutral = _jacobian(hexapod, cs.DM.zeros(3), cs.DM.zeros(3))
    return _determinant(jacobian) / float(cs.det(neutral))


def _determinant(matrix: Expression) -> Expression:
    """Of a 6 x 6 matrix, by Laplace's expansion along its first three columns: 20 products of 3 x 3 minors.

    Half the operations of an expansion row by row, also in its derivatives.
    """
    left, right = matrix[:, :3], matrix[:, 3:]
    total: Expression = 0.0
    for rows in combinations(range(6), 3):
        others = [row for row in range(6) if row not in rows]
        sign = (-1.0) ** (sum(rows) - sum(range(3)))
        total += sign * cs.det(left[list(rows), :]) * cs.det(right[others, :])
    return total


def _jacobian(hexapod: Hexapod, displacement: Expression, beta: Expression) -> Expression:
    """(6, 6) leg rates for [Sdot, omega_HI]: rows [u, (L_IH A) x u], u along the leg."""
    l_ih = rotation(beta)
    rows = []
    for upper, offset, _ in _joints(hexapod):
        arm = l_ih @ upper
        d = arm + offset + displacement
        u = d / cs.norm_2(d)
        rows.append(cs.horzcat(u.T, cs.cross(arm, u).T))
    return cs.vertcat(*rows)


def _joints(hexapod: Hexapod) -> list[tuple[Expression, Expression, float]]:
    """A_i, S_0 - B_i and L_i of every leg."""
    neutral: NDArray[np.float64] = np.array(hexapod.neutral)
    parts = zip(hexapod.upper_joints, hexapod.lower_joints, hexapod.neutral_lengths, strict=True)
    return [(cs.DM(upper), cs.DM(neutral - np.array(lower)), float(length)) for upper, lower, length in parts]
