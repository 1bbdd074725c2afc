"""Command sequences that try to drive a machine out of its limits, and the check that they fail to."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product

import numpy as np

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import Platform, actuator_limits
from motion_cueing.envs.simulator.simulator import Simulator

from ...reference import MachineModel
from ...reference.comparison import motion_of
from ...reference.kinematics import clearance, extensions
from .platforms_under_test import DT

STANDSTILL = CueTrace("standstill", DT * np.arange(3), np.tile([0.0, 0.0, -9.81], (3, 1)), np.zeros((3, 3)))
CLOSES = 1e-11
"""Largest distance of a leg from what its pose asks for, m."""


@lru_cache
def simulator(platform: Platform, n: int) -> Simulator:
    """A batch of one machine at a standing car; made once, as tests reset it."""
    return Simulator(platform, STANDSTILL, drive_of=np.zeros(n, dtype=int))


def every_direction(scale: float) -> np.ndarray:
    """(530, 9) full acceleration along each axis alone and along each combination of all nine."""
    single = np.concatenate([np.eye(9), -np.eye(9)])
    return scale * np.concatenate([single, np.array(list(product((-1.0, 1.0), repeat=9)))])


def storm(n: int, steps: int, scale: float, seed: int) -> Iterator[np.ndarray]:
    """(n, 9) accelerations a step: a quarter of the batch each constant, alternating, white and wandering."""
    rng = np.random.default_rng(seed)
    base = scale * rng.normal(size=(n, 9)) * (rng.random((n, 9)) < 0.7)
    period = rng.integers(2, 150, size=(n, 1))
    kind = np.arange(n)[:, None] * 4 // n
    wander = base.copy()
    for k in range(steps):
        noise = scale * rng.normal(size=(n, 9))
        wander = 0.98 * wander + 0.2 * noise
        alternating = np.where((k // period) % 2 == 0, base, -base)
        yield np.choose(kind, [base, alternating, noise, wander])


class Watch:
    """Holds a batch against the limits of its machine, step by step.

    Args:
        platform: The machine.
        tolerance: Relative to each limit (travel: to the whole stroke).
    """

    def __init__(self, platform: Platform, tolerance: float) -> None:
        self.machine, self.tolerance = MachineModel.of(platform), tolerance
        self.limits = actuator_limits(platform)
        self.before: dict[str, np.ndarray] = {}
        self.least_clearance = np.inf

    def check(self, state: np.ndarray) -> None:
        """Positions, rates and accelerations of set-point and true machine are within limits."""
        for name in ("setpoint", "motion"):
            position, rate = state[name]["position"], state[name]["rate"].copy()
            assert np.isfinite(position).all(), name
            assert np.isfinite(rate).all(), name
            low, high = self.limits["position_min"], self.limits["position_max"]
            slack = self.tolerance * np.minimum(high - low, 1e3)
            assert (position <= high + slack).all(), name
            assert (position >= low - slack).all(), name
            assert (np.abs(rate) <= self.limits["velocity"] * (1.0 + self.tolerance)).all(), name
            change = np.abs(rate - self.before.get(name, np.zeros_like(rate))) / DT
            assert (change <= self.limits["acceleration"] * (1.0 + self.tolerance)).all(), name
            self.before[name] = rate

    def check_pose(self, state: np.ndarray) -> None:
        """The platform is where its legs hold it, on neutral's side of every singular pose."""
        for name in ("setpoint", "motion"):
            motion = motion_of(state[name])
            error = extensions(self.machine, motion.pose) - motion.position[:, 2:8]
            assert np.abs(error).max() <= CLOSES, name
            least = clearance(self.machine, motion.pose).min()
            assert least > 0.0, name
            self.least_clearance = min(self.least_clearance, float(least))
