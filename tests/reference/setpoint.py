"""From nine accelerations to limited set-points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .frames import Floats
from .kinematics import forward_kinematics, legs_of, pose_rates
from .limits import is_safe, keeps_clear, rate_bounds
from .machine import MachineModel

HEXAPOD = slice(2, 8)


@dataclass
class MotionState:
    """Actuators (n, 9) and pose of the hexapod (n, 6), with their rates."""

    position: Floats
    rate: Floats
    pose: Floats
    pose_rate: Floats

    def take(self, rows: np.ndarray) -> MotionState:
        """Copies of some rows."""
        return MotionState(self.position[rows], self.rate[rows], self.pose[rows], self.pose_rate[rows])

    def axis_rates(self) -> Floats:
        """(n, 9) rates of the nine axes an action commands."""
        return np.concatenate([self.rate[:, :2], self.pose_rate, self.rate[:, 8:]], axis=1)


@dataclass
class LegMotion:
    """Legs and pose of the hexapod after a step, (n, 6) each."""

    legs: Floats
    rates: Floats
    pose: Floats
    pose_rate: Floats

    def put(self, rows: np.ndarray, other: LegMotion) -> None:
        """Replace some rows."""
        self.legs[rows], self.rates[rows] = other.legs, other.rates
        self.pose[rows], self.pose_rate[rows] = other.pose, other.pose_rate


def command(machine: MachineModel, begin: MotionState, action: Floats, dt: float) -> MotionState:
    """The limited set-point one step later."""
    end = MotionState(begin.position.copy(), begin.rate.copy(), begin.pose, begin.pose_rate)
    for part, asked in ((slice(0, 2), action[:, :2]), (slice(8, 9), action[:, 8:])):
        rate = begin.rate[:, part]
        bounds = rate_bounds(machine, begin.position[:, part], rate, part, dt)
        end.rate[:, part] = np.clip(rate + asked * dt, *bounds) * machine.present[part]
        end.position[:, part] += 0.5 * (rate + end.rate[:, part]) * dt
    hexapod = step_hexapod(machine, begin, action[:, 2:8], dt)
    end.position[:, HEXAPOD], end.rate[:, HEXAPOD] = hexapod.legs, hexapod.rates
    end.pose, end.pose_rate = hexapod.pose, hexapod.pose_rate
    return end


def step_hexapod(machine: MachineModel, begin: MotionState, asked: Floats, dt: float) -> LegMotion:
    """The commanded motion where the legs can follow, else the nearest they can do, else braking legs."""
    result = candidate(machine, begin, asked, dt)
    asked_rates = result.rates.copy()
    lower, upper = rate_bounds(machine, begin.position[:, HEXAPOD], begin.rate[:, HEXAPOD], HEXAPOD, dt)
    accepted = ((result.rates >= lower) & (result.rates <= upper)).all(axis=1)
    accepted &= is_safe(machine, result.legs, result.rates, dt)
    accepted &= keeps_clear(machine, result.pose, result.legs, result.rates, begin.pose)
    for share in (1.0, 0.0):
        rows = np.flatnonzero(~accepted)
        if not len(rows):
            break
        before = begin.take(rows)
        rates = np.clip(share * asked_rates[rows], lower[rows], upper[rows])
        limited = follow_legs(machine, before, rates, dt)
        result.put(rows, limited)
        accepted[rows] = keeps_clear(machine, limited.pose, limited.legs, limited.rates, before.pose)
    return result


def candidate(machine: MachineModel, begin: MotionState, asked: Floats, dt: float) -> LegMotion:
    """What the commanded accelerations ask for, by Eqs. (12) and (13)."""
    pose_rate = begin.pose_rate + asked * dt
    pose = begin.pose + 0.5 * (begin.pose_rate + pose_rate) * dt
    return LegMotion(*legs_of(machine, pose, pose_rate), pose, pose_rate)


def follow_legs(machine: MachineModel, begin: MotionState, rates: Floats, dt: float) -> LegMotion:
    """Where the platform goes when its legs take these rates."""
    legs = begin.position[:, HEXAPOD] + 0.5 * (begin.rate[:, HEXAPOD] + rates) * dt
    pose, _ = forward_kinematics(machine, legs, begin.pose)
    return LegMotion(legs, rates, pose, pose_rates(machine, pose, rates))
