"""Whether a motion keeps a machine's limits: told from the motion alone, independent of the limiter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Exceeded(NamedTuple):
    """Which actuators are beyond which limit, each (..., 9)."""

    position: Flags
    velocity: Flags
    acceleration: Flags


def limits_exceeded(
    limits: Mapping[str, Floats], position: Floats, velocity: Floats, acceleration: Floats, tolerance: float
) -> Exceeded:
    """Hold the motion of actuators against their limits; a NaN exceeds every limit.

    Args:
        limits: As of :func:`~.parameters.actuator_limits`.
        position: (..., 9) m and rad, in the order of ``ACTUATORS``.
        velocity: (..., 9) m/s and rad/s.
        acceleration: (..., 9) m/s^2 and rad/s^2.
        tolerance: Of each limit, relative; of a position, of the whole stroke.
    """
    low, high = limits["position_min"], limits["position_max"]
    slack = tolerance * (high - low)
    return Exceeded(
        ~((position >= low - slack) & (position <= high + slack)),
        ~(np.abs(velocity) <= (1.0 + tolerance) * limits["velocity"]),
        ~(np.abs(acceleration) <= (1.0 + tolerance) * limits["acceleration"]),
    )
