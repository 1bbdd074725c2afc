"""Eqs. (11) to (13) and their inverses for a batch; a pose (n, 6) is [s, beta], its rates [sdot, betadot]."""

from __future__ import annotations

import numpy as np

from .frames import Floats, apply, cross, rate_matrix, rotation
from .machine import MachineModel

ITERATIONS = 20
CONVERGED = 1e-13  # m
CLOSED = 1e-9  # m


def linearize(machine: MachineModel, pose: Floats) -> tuple[Floats, Floats]:
    """Extensions (n, 6) by Eqs. (12), (13), and their Jacobian (n, 6, 6) for [sdot, omega_HI]."""
    turned = machine.upper @ np.swapaxes(rotation(pose[:, 3:]), 1, 2)
    legs = turned - machine.lower + (machine.neutral + pose[:, None, :3])
    length = np.sqrt((legs * legs).sum(axis=2))
    twist = np.empty((len(pose), 6, 6))
    direction = twist[:, :, :3] = legs / length[..., None]
    twist[:, :, 3:] = cross(turned, direction)
    return length - machine.neutral_lengths, twist


def extensions(machine: MachineModel, pose: Floats) -> Floats:
    """Eq. (13), (n, 6), m."""
    return linearize(machine, pose)[0]


def to_pose_rates(twist: Floats, beta: Floats) -> Floats:
    """(n, 6, 6) leg rates for [sdot, betadot], of the Jacobian for [sdot, omega_HI]."""
    matrix = twist.copy()
    matrix[:, :, 3:] = twist[:, :, 3:] @ (rotation(beta) @ rate_matrix(beta))
    return matrix


def clearance(machine: MachineModel, pose: Floats) -> Floats:
    """(n,) det J over its value at neutral; 0 in a singular pose."""
    return np.asarray(np.linalg.det(linearize(machine, pose)[1]) / machine.neutral_determinant)


def forward_kinematics(machine: MachineModel, legs: Floats, guess: Floats) -> tuple[Floats, np.ndarray]:
    """Pose (n, 6) with these extensions near ``guess``, and whether each closes, by Newton iteration."""
    pose = guess.copy()
    closed = np.zeros(len(pose), dtype=bool)
    rows = np.arange(len(pose))
    for iteration in range(ITERATIONS + 1):
        lengths, twist = linearize(machine, pose[rows])
        error = legs[rows] - lengths
        largest = np.abs(error).max(axis=1)
        closed[rows] = largest <= CLOSED
        on = largest > CONVERGED
        rows = rows[on]
        if not len(rows) or iteration == ITERATIONS:
            break
        matrix = to_pose_rates(twist[on], pose[rows, 3:])
        pose[rows] += np.linalg.solve(matrix, error[on][..., None])[..., 0]
    return pose, closed


def pose_rates(machine: MachineModel, pose: Floats, leg_rates: Floats) -> Floats:
    """[sdot, betadot] (n, 6) of leg rates (n, 6)."""
    matrix = to_pose_rates(linearize(machine, pose)[1], pose[:, 3:])
    return np.asarray(np.linalg.solve(matrix, leg_rates[..., None])[..., 0])


def legs_of(machine: MachineModel, pose: Floats, rates: Floats) -> tuple[Floats, Floats]:
    """Extensions and their rates (n, 6) of a pose and its rates [sdot, betadot] (n, 6)."""
    lengths, twist = linearize(machine, pose)
    return lengths, apply(to_pose_rates(twist, pose[:, 3:]), rates)
