"""Short drives with known answers."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.cues import GRAVITY, CueTrace

DT = 0.01


def drive_of(force: np.ndarray, rate: np.ndarray | None = None, name: str = "test") -> CueTrace:
    """A drive with a specific force (n, 3) besides gravity, m/s^2, and an angular velocity (n, 3), rad/s."""
    n = len(force)
    total = np.asarray(force, dtype=float) - np.array([0.0, 0.0, GRAVITY])
    return CueTrace(name, DT * np.arange(n), total, np.zeros((n, 3)) if rate is None else rate)


def surge(seconds: float, peak: float) -> CueTrace:
    """One sine of longitudinal acceleration: the car is fast again where it began, but further on."""
    time = DT * np.arange(round(seconds / DT) + 1)
    force = np.zeros((len(time), 3))
    force[:, 0] = peak * np.sin(2.0 * np.pi * time / seconds)
    return drive_of(force, name="surge")


def hard_braking(seconds: float, deceleration: float = 9.0) -> CueTrace:
    """More than a machine can do: a deceleration that stays."""
    time = DT * np.arange(round(seconds / DT) + 1)
    force = np.zeros((len(time), 3))
    force[:, 0] = -deceleration * np.clip((time - 0.3) / 0.3, 0.0, 1.0)
    return drive_of(force, name="hard-braking")


def gentle(seconds: float) -> CueTrace:
    """Well within what the machine can do."""
    return weaving(seconds, size=0.2)


def weaving(seconds: float, seed: int = 0, size: float = 1.0) -> CueTrace:
    """A few sines of force and rate on every axis that begin at rest."""
    rng = np.random.default_rng(seed)
    time = DT * np.arange(round(seconds / DT) + 1)
    signals = np.zeros((len(time), 6))
    for axis, largest in enumerate((2.5, 2.5, 0.5, 0.15, 0.1, 0.3)):
        for frequency in rng.uniform(0.1, 0.5, size=2):
            signals[:, axis] += (
                size * largest * rng.uniform(0.5, 1.0) * np.sin(2.0 * np.pi * frequency * time)
            )
    return drive_of(signals[:, :3], signals[:, 3:], name="weaving")


def turning(seconds: float, rate: float) -> CueTrace:
    """A yaw rate that sets in and stays, rad/s, with no force."""
    time = DT * np.arange(round(seconds / DT) + 1)
    rates = np.zeros((len(time), 3))
    rates[:, 2] = rate * np.clip(time, 0.0, 1.0)
    return drive_of(np.zeros((len(time), 3)), rates, name="turning")
