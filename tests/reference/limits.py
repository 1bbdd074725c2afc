"""Output limiting: how fast an actuator may be to stop before its end, and singular poses."""

from __future__ import annotations

import numpy as np

from .frames import Floats
from .kinematics import clearance, forward_kinematics
from .machine import MachineModel

FAR = 0.75  # clearance from which a pose needs no further look
LEAST = 0.15  # clearance no pose goes below
NEAR = 0.35  # largest change of an Euler angle while the legs brake, rad


def braking_rate(distance: Floats, rate: Floats, limit: Floats, dt: float) -> Floats:
    """Greatest rate after a step from which braking at ``limit`` ends within ``distance``."""
    left = distance - 0.5 * rate * dt
    near = left <= limit * dt**2 / 8.0
    root = np.sqrt(2.0 * limit * np.where(near, 0.0, left)) - 0.5 * limit * dt
    return np.where(near, 0.0, root)


def rate_bounds(
    machine: MachineModel, position: Floats, rate: Floats, part: slice, dt: float
) -> tuple[Floats, Floats]:
    """Least and greatest rate (n, k) after a step, for the actuators of ``part``."""
    limit, speed = machine.acceleration[part], machine.speed[part]
    change = limit * dt
    to_max = braking_rate(machine.q_max[part] - position, rate, limit, dt)
    to_min = braking_rate(position - machine.q_min[part], -rate, limit, dt)
    upper = np.minimum(np.minimum(speed, rate + change), to_max)
    lower = -np.minimum(np.minimum(speed, change - rate), to_min)
    return np.minimum(lower, rate + change), np.maximum(upper, rate - change)


def is_safe(machine: MachineModel, legs: Floats, rates: Floats, dt: float) -> np.ndarray:
    """(n,) whether every leg is within its travel and can stop there."""
    limit = machine.acceleration[2:8]
    low, high = machine.q_min[2:8], machine.q_max[2:8]
    distance = np.where(rates > 0.0, high - legs, legs - low)
    needed = np.where(rates != 0.0, rates**2 / (2.0 * limit) + limit * dt**2 / 8.0, 0.0)
    return np.asarray(((legs >= low) & (legs <= high) & (distance >= needed)).all(axis=1))


def keeps_clear(
    machine: MachineModel, pose: Floats, legs: Floats, rates: Floats, before: Floats
) -> np.ndarray:
    """(n,) whether a pose, and the way the legs take to stop from it, stay away from singular poses."""
    here = clearance(machine, pose)
    clear = np.asarray(here >= FAR)
    look = np.flatnonzero(~clear & np.isfinite(here))
    if not len(look):
        return clear
    least = np.minimum(LEAST, clearance(machine, before[look]))
    clear[look] = here[look] >= least
    keep = clear[look]
    look, least = look[keep], least[keep]
    guess = start = pose[look]
    way = rates[look] * np.abs(rates[look]) / (2.0 * machine.acceleration[2:8])
    for share in (0.5, 1.0):
        guess, closed = forward_kinematics(machine, legs[look] + share * way, guess)
        near = np.abs(guess[:, 3:] - start[:, 3:]).max(axis=1, initial=0.0) <= NEAR
        clear[look] &= closed & near & (clearance(machine, guess) >= least)
    return clear
