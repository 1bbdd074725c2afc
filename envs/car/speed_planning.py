"""Speed along a path: as fast as bends and limits allow, with a driver's accelerations, and stops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ..errors import DataError
from .paths import STEP
from .schedules import DT, HOLD, Schedule

Floats = NDArray[np.float64]

SMOOTHING: Final = 0.7
"""Width of the moving average, taken twice, that bounds the planned jerk, s."""

CREEP: Final = 0.5
"""Below this planned speed, before and after a stop, the car is held by the brake, m/s."""


@dataclass(frozen=True)
class Style:
    """How briskly somebody drives, m/s^2.

    Args:
        accelerate: Largest acceleration.
        brake: Largest deceleration.
        lateral: Largest centripetal acceleration in a bend.
    """

    accelerate: float
    brake: float
    lateral: float


def speed_limit(curvature: Floats, limit: Floats, style: Style) -> Floats:
    """Limit (n,), m/s, at every point: the road's, and that of the bend, sqrt(a / |kappa|)."""
    return np.minimum(limit, np.sqrt(style.lateral / np.maximum(np.abs(curvature), 1e-9)))


def along_path(
    limit: Floats, style: Style, stops: Sequence[tuple[int, float]], duration: float | None
) -> Schedule:
    """The schedule of a path with a speed limit (n,), m/s, at each of its points.

    Args:
        limit: From the start on; the drive begins at the first limit.
        style: The driver's.
        stops: Point of the path and time to stand there, s, for each stop.
        duration: Of the drive, s: cut there; to the end of the path if None.

    Raises:
        DataError: the path ends before ``duration``.
    """
    speed = _reachable(limit, style, [point for point, _ in stops])
    step = 2.0 * STEP / np.maximum(speed[1:] + speed[:-1], 1e-6)
    arrival = np.concatenate(([0.0], np.cumsum(step)))
    nodes, speeds = arrival, speed
    for point, wait in sorted(stops, reverse=True):
        # A second node at the same place, `wait` later: the time between is spent standing.
        nodes = np.concatenate((nodes[: point + 1], nodes[point:] + wait))
        speeds = np.concatenate((speeds[: point + 1], speeds[point:]))
    end = nodes[-1] if duration is None else duration
    if nodes[-1] < end - DT:
        raise DataError(f"the path ends after {nodes[-1]:.1f} s, before the drive of {end:.1f} s")
    time = DT * np.arange(round(end / DT) + 1)
    return _smoothed(np.interp(time, nodes, speeds))


def _reachable(limit: Floats, style: Style, stops: Sequence[int]) -> Floats:
    """Forward and backward pass: v^2 grows by at most 2 a ds. (n,) m/s."""
    square = (limit**2).tolist()
    for point in stops:
        square[point] = 0.0
    gain, loss = 2.0 * style.accelerate * STEP, 2.0 * style.brake * STEP
    for i in range(1, len(square)):
        square[i] = min(square[i], square[i - 1] + gain)
    for i in range(len(square) - 2, -1, -1):
        square[i] = min(square[i], square[i + 1] + loss)
    return np.asarray(np.sqrt(np.array(square)))


def _smoothed(speed: Floats) -> Schedule:
    width = round(SMOOTHING / DT)
    for _ in range(2):
        speed = uniform_filter1d(speed, width, mode="nearest")
    acceleration = np.gradient(speed, DT)
    standing = speed < CREEP
    return Schedule(np.where(standing, 0.0, speed), np.where(standing, -HOLD, acceleration))
