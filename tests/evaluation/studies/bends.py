"""Drives and conditions for the tests of studies."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import get_platform

PAPER = get_platform("paper")
SEDAN = get_car("sedan")


def bend(name="bend", seconds=1.5, force=1.0):
    """A car that is pushed to the right a little while it turns."""
    time = 0.01 * np.arange(round(100 * seconds))
    wave = np.sin(4.0 * time)
    specific = np.stack([0.3 * force * wave, force * wave, np.full_like(time, -9.81)], axis=1)
    return CueTrace(name, time, specific, np.stack([0.02 * wave, 0.01 * wave, 0.1 * force * wave], axis=1))
