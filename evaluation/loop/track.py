"""Set-points between two time steps of the machine, at a higher rate.

Within a step an actuator moves with constant acceleration. Velocity goes in a straight line from one step to
the next, acceleration is its slope, and position follows Hermite's cubic, which is the parabola itself where
the motion is that of constant acceleration. So velocities and accelerations keep the limits the steps keep.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform.state import CARRIAGE, LEGS, TURNTABLE
from ...envs.simulator import Simulator
from .packets import MOTION, MOTION_SIZE

Floats = NDArray[np.float64]

AXES_AND_LEGS: Final = 15
"""Entries of a :class:`MotionView`."""


class MotionView:
    """Reads where a machine's set-point is, fast: its memory is found once, not field by field each time.

    Args:
        simulator: With one environment on the CPU.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._parts = [_parts_of(states.numpy()[0]["setpoint"]) for states, _ in simulator.copies]

    def __call__(self) -> Floats:
        """(2, 15) positions and rates of the nine axes and the six legs; m, rad, from neutral."""
        positions, rates = self._parts[self._simulator.current]
        return np.concatenate(positions + rates).reshape(2, AXES_AND_LEGS)


def _parts_of(motion: Any) -> tuple[list[Floats], list[Floats]]:
    """Views of positions and rates of a ``Motion``: axes in the order of ``AXES``, then legs."""
    position, rate = motion["position"], motion["rate"]
    table = slice(TURNTABLE, TURNTABLE + 1)
    return (
        [position[CARRIAGE], motion["displacement"], motion["beta"], position[table], position[LEGS]],
        [rate[CARRIAGE], motion["velocity"], motion["beta_rate"], rate[table], rate[LEGS]],
    )


class Track:
    """Set-points of one time step, for the end of each of its periods.

    Args:
        periods: In a time step.
        dt: Time step, s.
    """

    def __init__(self, periods: int, dt: float) -> None:
        s = np.arange(1, periods + 1)[:, None] / periods
        self._share, self._dt = s, dt
        # Hermite's basis for p0, p1 and the rates at both ends.
        self._basis = np.hstack(
            [(1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s), dt * s * (1 - s) ** 2, dt * s**2 * (s - 1)]
        )

    def between(self, begin: Floats, end: Floats) -> Floats:
        """(periods, 39) numbers of the set-points between two motions of :class:`MotionView`."""
        position = self._basis @ np.vstack([begin[0], end[0], begin[1], end[1]])
        rate = begin[1] + self._share * (end[1] - begin[1])
        # To the bit: the last set-point is the step's end.
        position[-1], rate[-1] = end
        out = np.empty((len(position), MOTION_SIZE))
        out[:, MOTION["position"]], out[:, MOTION["legs"]] = position[:, :9], position[:, 9:]
        out[:, MOTION["velocity"]], out[:, MOTION["leg_rates"]] = rate[:, :9], rate[:, 9:]
        out[:, MOTION["acceleration"]] = (end[1, :9] - begin[1, :9]) / self._dt
        return out
