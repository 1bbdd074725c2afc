"""Trajectories made of known signals, without a machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from motion_cueing.evaluation.trajectory import LimitTable, Trajectory

GRAVITY = 9.81


def limits() -> LimitTable:
    travel = np.array([13.72, 13.72, *[0.67] * 6, np.inf])
    return LimitTable(-travel, travel, np.array([6.0, 6.0, *[1.0] * 6, np.inf]), np.full(9, 10.0))


def trajectory(n: int = 201, dt: float = 0.05, **columns: Any) -> Trajectory:
    """A machine at rest in a car at rest, with the given columns instead."""
    rest = np.tile([0.0, 0.0, -GRAVITY], (n, 1))
    values: dict[str, Any] = {
        "maneuver": "drive",
        "policy": "still",
        "platform": "base",
        "car": "sedan",
        "time": dt * np.arange(n),
        "limits_active": np.zeros((n, 9), dtype=np.uint8),
        "step_time": np.full(n, np.nan),
        "limits": limits(),
    }
    for name in (
        "f_reference",
        "head_f_reference",
        "f_simulator",
        "head_f_simulator",
        "perceived_f_reference",
        "perceived_f_simulator",
    ):
        values[name] = rest
    for name in ("w_reference", "w_simulator", "perceived_w_reference", "perceived_w_simulator"):
        values[name] = np.zeros((n, 3))
    for name, width in (("carriage", 2), ("hexapod", 6), ("legs", 6)):
        values[name] = values[name + "_rate"] = np.zeros((n, width))
    values["turntable"] = values["turntable_rate"] = np.zeros(n)
    values["action"] = values["applied"] = np.zeros((n, 9))
    return Trajectory(**(values | columns))


def drive(gain: float = 0.8, lag: float = 0.2, policy: str = "washout") -> Trajectory:
    """A car that weaves for 20 s, and a simulator that follows with a gain and a lag."""
    n, dt = 801, 0.025
    time = dt * np.arange(n)

    def motion(at: Any) -> tuple[Any, Any]:
        sway = 2.0 * np.sin(2.0 * np.pi * 0.2 * at) * (at > 0.0)
        f = np.stack([0.5 * np.cos(0.4 * at), sway, np.full(n, -GRAVITY)], axis=1)
        return f, np.stack([0.03 * sway, 0.0 * sway, 0.08 * sway], axis=1)

    f_reference, w_reference = motion(time)
    f_late, w_late = motion(time - lag)
    rest = np.array([0.0, 0.0, -GRAVITY])
    f_simulator = gain * (f_late - rest) + rest
    wave = np.sin(2.0 * np.pi * 0.2 * time)
    active = np.zeros((n, 9), dtype=np.uint8)
    active[100:140, 1] = 1
    return trajectory(
        n,
        dt,
        maneuver="weave",
        policy=policy,
        f_reference=f_reference,
        w_reference=w_reference,
        head_f_reference=f_reference,
        f_simulator=f_simulator,
        w_simulator=gain * w_late,
        head_f_simulator=f_simulator,
        perceived_f_reference=f_reference,
        perceived_f_simulator=f_simulator,
        perceived_w_reference=w_reference,
        perceived_w_simulator=gain * w_late,
        carriage=gain * np.outer(wave, [2.0, 9.0]),
        hexapod=gain * np.outer(wave, [0.1, 0.3, 0.0, 0.1, 0.02, 0.05]),
        legs=gain * np.outer(wave, [0.2, -0.3, 0.4, 0.5, -0.1, 0.3]),
        limits_active=active,
        step_time=np.r_[np.nan, np.full(n - 1, 2e-5)],
    )
