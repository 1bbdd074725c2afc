"""Machines, poses and cues to draw."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.platform import Platform, legs_of_pose
from motion_cueing.envs.rendering import CueHistory, MotionView

SIZE = (640, 360)
DT = 0.01


def moment(
    platform: Platform,
    pose: tuple[float, ...] = (0.0,) * 6,
    carriage: tuple[float, float] = (0.0, 0.0),
    turntable: float = 0.0,
) -> MotionView:
    """A machine in a pose, with the legs that belong to it."""
    return MotionView(
        np.array(carriage), np.array(pose), turntable, legs_of_pose(platform.hexapod, np.array(pose))
    )


def weaving(samples: int, gain: float = 0.8) -> CueHistory:
    """A car that weaves, and a simulator that follows in part."""
    history = CueHistory("weaving", "follower", DT)
    for k in range(samples):
        sway = np.sin(0.03 * k)
        wanted = np.array([0.4 * np.cos(0.02 * k), 2.0 * sway, -9.81, 0.0, 0.0, 0.1 * sway])
        history.append(k * DT, wanted, wanted * [gain, gain, 1.0, 1.0, 1.0, gain])
    return history
