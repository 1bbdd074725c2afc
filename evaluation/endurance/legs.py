"""Legs of a hexapod's pose, in NumPy and on its own: what the machine's step computes is checked with it.

A leg is l = L_IH A - B + S_0 + s, Eq. (12), and its length changes at l . (ds/dt + omega x L_IH A) / |l|.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...envs.platform.machines import Hexapod

Floats = NDArray[np.float64]
Vector = list[Floats]
"""Three components."""


class Legs(NamedTuple):
    """Legs of n poses.

    Args:
        extension: (n, 6) from neutral, m.
        rate: (n, 6) m/s.
        clearance: (n,) det of the Jacobian over that at neutral: 0 in a singular pose, negative behind it.
    """

    extension: Floats
    rate: Floats
    clearance: Floats


def legs_of(hexapod: Hexapod, pose: Floats, pose_rate: Floats) -> Legs:
    """Legs of poses; of those that are not finite, not a number.

    Args:
        hexapod: With its joints.
        pose: (n, 6) displacement from neutral, m; roll, pitch, yaw, rad.
        pose_rate: (n, 6) their rates.
    """
    with np.errstate(invalid="ignore"):
        length, rate, determinant = _legs(hexapod, pose, pose_rate)
    neutral, _, at_neutral = _legs(hexapod, np.zeros((1, 6)), np.zeros((1, 6)))
    return Legs(length - neutral, rate, determinant / at_neutral)


def _legs(hexapod: Hexapod, pose: Floats, pose_rate: Floats) -> tuple[Floats, Floats, Floats]:
    """Lengths, rates, and the determinant of the Jacobian."""
    upper, lower = np.array(hexapod.upper_joints), np.array(hexapod.lower_joints)
    # Vectors of three arrays (6, n): their sums and products are those of long rows.
    angles = np.ascontiguousarray(pose[:, 3:].T)
    origin = (np.array(hexapod.neutral) + pose[:, :3]).T
    arm = [upper @ row for row in _rotation(angles)]
    leg = [arm[k] + origin[k] - lower[:, k, None] for k in range(3)]
    turning = _cross(_angular_velocity(angles, pose_rate[:, 3:].T), arm)
    length = np.sqrt(leg[0] ** 2 + leg[1] ** 2 + leg[2] ** 2)
    direction = [component / length for component in leg]
    rate = sum(direction[k] * (turning[k] + pose_rate[:, k]) for k in range(3))
    jacobian = np.array([*direction, *_cross(arm, direction)])
    determinant: Floats = np.linalg.det(jacobian.transpose(2, 1, 0))
    return length.T, np.asarray(rate).T, determinant


def _rotation(angles: Floats) -> Floats:
    """(3, 3, n) Rx(roll) Ry(pitch) Rz(yaw), Eq. (4)."""
    (sp, st, ss), (cp, ct, cs) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [ct * cs, -ct * ss, st],
            [cp * ss + sp * st * cs, cp * cs - sp * st * ss, -sp * ct],
            [sp * ss - cp * st * cs, sp * cs + cp * st * ss, cp * ct],
        ]
    )


def _angular_velocity(angles: Floats, rates: Floats) -> Vector:
    """In inertial axes: roll turns about x, pitch about Rx y, yaw about Rx Ry z."""
    (sp, st, _), (cp, ct, _) = np.sin(angles), np.cos(angles)
    roll, pitch, yaw = rates
    return [roll + st * yaw, cp * pitch - sp * ct * yaw, sp * pitch + cp * ct * yaw]


def _cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
