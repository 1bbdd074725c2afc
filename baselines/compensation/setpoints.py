r"""Set-points of a late machine: those of an ideal one, led or delayed subsystem by subsystem.

A lag omega^2 / (s^2 + 2 zeta omega s + omega^2) is led to the natural frequency p by

    (s^2 / omega^2 + 2 zeta s / omega + 1) / (s / p + 1)^2,

discretized by Tustin's rule. Subsystems that are less late than the latest wait for it, in whole steps.
Both are linear, so positions, rates and accelerations go through the same filter and stay those of one
motion. Where a limit of the machine holds a set-point back, it is led to where it should be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform.kernels.step import CARRIAGE, TURNTABLE
from .options import CompensationOptions, Lateness, SubsystemLateness

Floats = NDArray[np.float64]

_SUBSYSTEM: Final = np.array([0, 0, 1, 1, 1, 1, 1, 1, 2])
"""Of each of the nine axes."""


def axes_motion(state: NDArray[Any]) -> tuple[Floats, Floats, Floats]:
    """Positions, rates and accelerations (n, 9) of the set-points in a simulator's state."""
    motion = state["setpoint"]
    position, rate = motion["position"], motion["rate"]
    return (
        np.hstack([position[:, CARRIAGE], motion["displacement"], motion["beta"], position[:, TURNTABLE:]]),
        np.hstack([rate[:, CARRIAGE], motion["velocity"], motion["beta_rate"], rate[:, TURNTABLE:]]),
        np.array(state["setpoint_acceleration"], dtype=np.float64),
    )


class SetPointLead:
    """Accelerations for n late machines, from the set-points of n ideal ones.

    Args:
        lateness: (n) of each machine.
        options: Gains.
        time_step: s.
    """

    def __init__(self, lateness: Sequence[Lateness], options: CompensationOptions, time_step: float) -> None:
        self._dt, self._gains = time_step, (options.position_gain, options.rate_gain)
        delays = [[round(one.delay(k) / time_step) for k in range(3)] for one in lateness]
        self._delay = np.array(delays)[:, _SUBSYSTEM]
        filters = [[_coefficients(part, time_step) for part in one.subsystems] for one in lateness]
        self._filter = np.moveaxis(np.array(filters)[:, _SUBSYSTEM], -1, 0)  # (5, n, 9)
        led = np.array([[part.led is not None for part in one.subsystems] for one in lateness])
        self._passes = ~(led[:, _SUBSYSTEM] | (self._delay > 0))
        """(n, 9) axes whose set-points are those of the ideal machine."""
        self._deep = int(self._delay.max()) + 1
        self._rows, self._columns = np.indices(self._delay.shape)
        # Contents: positions, rates and accelerations of the last steps; the filter's two states.
        self._past = np.zeros((self._deep, 3, *self._delay.shape))
        self._states = np.zeros((2, 3, *self._delay.shape))
        self._newest = 0

    def begin(self, state: NDArray[Any]) -> None:
        """Begin at the set-points of a state, taken to have rested there."""
        resting = np.zeros((3, *self._delay.shape))
        resting[0] = axes_motion(state)[0]
        self._past[...] = resting
        _, b1, b2, a1, a2 = self._filter
        self._states[1] = (b2 - a2) * resting
        self._states[0] = (b1 - a1) * resting + self._states[1]

    def follow(self, leader: SetPointLead) -> None:
        """Take over the memory of another one that was made alike."""
        self._past[...], self._states[...], self._newest = leader._past, leader._states, leader._newest

    def __call__(self, requested: Floats, ideal: NDArray[Any], late: NDArray[Any]) -> Floats:
        """(n, 9) accelerations for the next step of the late machines.

        Args:
            requested: (n, 9) accelerations requested in the step the ideal machines have just taken.
            ideal: Their state after it.
            late: State of the late machines before theirs.
        """
        if self._passes.all():
            return requested
        self._newest = (self._newest + 1) % self._deep
        self._past[self._newest] = axes_motion(ideal)
        at = (self._newest - self._delay) % self._deep
        given = np.moveaxis(self._past[at, :, self._rows, self._columns], -1, 0)  # (3, n, 9)
        b0, b1, b2, a1, a2 = self._filter
        wanted = b0 * given + self._states[0]
        self._states[0] = b1 * given - a1 * wanted + self._states[1]
        self._states[1] = b2 * given - a2 * wanted
        place, rate, acceleration = wanted
        now_place, now_rate, _ = axes_motion(late)
        next_rate = now_rate + self._dt * acceleration
        next_place = now_place + self._dt * now_rate + 0.5 * self._dt**2 * acceleration
        led = acceleration + self._gains[0] * (place - next_place) + self._gains[1] * (rate - next_rate)
        return np.where(self._passes, requested, led)


def _coefficients(part: SubsystemLateness, time_step: float) -> Floats:
    """(5,) b0, b1, b2, a1, a2 of the lead of a subsystem."""
    omega, led = part.dynamics.natural_frequency, part.led
    if omega is None or led is None:
        return np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    # Tustin's rule, s = 2 (z - 1) / (T (z + 1)), of c2 s^2 + c1 s + 1.
    rate = 2.0 / time_step
    above, below = (
        np.array([c2 + c1 + 1.0, 2.0 - 2.0 * c2, c2 - c1 + 1.0])
        for c2, c1 in (
            ((rate / omega) ** 2, 2.0 * part.dynamics.damping * rate / omega),
            ((rate / led) ** 2, 2.0 * rate / led),
        )
    )
    return np.asarray(np.concatenate([above, below[1:]]) / below[0])
