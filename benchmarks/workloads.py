"""What is timed: machines, drives and commands, prepared outside the clock."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motion_cueing.envs.platform import Platform, get_platform
from motion_cueing.envs.simulator.simulator import Simulator
from tests.reference import ReferenceSimulator
from tests.reference.comparison import restless_drive

PERIOD = 400
"""Steps after which the commands repeat; the machine is back where it was by then."""

DRIVE = restless_drive(1000)
AMPLITUDE = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.2, 0.2, 0.2, 0.3])
"""Accelerations of an everyday drive, m/s^2 and rad/s^2: the machine moves, and meets no limit."""


def commands(n: int, scale: float = 1.0) -> np.ndarray:
    """(PERIOD, n, 9) accelerations that integrate to a closed path."""
    rng = np.random.default_rng(0)
    turns = rng.integers(1, 6, size=(n, 9))
    # Taken in the middle of each step, so that the speed has no mean and the path closes for ever.
    phase = 2.0 * np.pi * (np.arange(PERIOD)[:, None, None] + 0.5) / PERIOD
    return scale * AMPLITUDE * np.cos(turns * phase)


def repeated(step: Callable[[np.ndarray], object], actions: np.ndarray) -> Callable[[], None]:
    """A call that takes the next step of an endless drive."""
    k = 0

    def call() -> None:
        nonlocal k
        step(actions[k])
        k = k + 1 if k + 1 < PERIOD else 0

    return call


def kernel(n: int, platform: Platform | None = None) -> Simulator:
    """A batch of the paper's machine, at rest."""
    batch = Simulator(platform or get_platform("paper"), DRIVE, drive_of=np.zeros(n, dtype=int))
    batch.reset()
    return batch


def reference(n: int, platform: Platform | None = None) -> ReferenceSimulator:
    """The same in NumPy."""
    batch = ReferenceSimulator(platform or get_platform("paper"), DRIVE, n)
    batch.reset()
    return batch
