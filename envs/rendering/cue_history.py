"""The last seconds of what a driver should feel and does feel, and J over the whole drive."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cue_cost import CueCost
from ..errors import ConfigurationError, DataError

Floats = NDArray[np.float64]

WINDOW: Final = 8.0
"""Seconds a chart shows."""


class CueHistory:
    """Cues wanted and felt, at the cab's reference point: [f_x, f_y, f_z, w_x, w_y, w_z], m/s^2 and rad/s.

    Only the last :attr:`window` seconds are kept; J and the largest values are of the whole drive.

    Args:
        maneuver: Name to show.
        policy: Name to show.
        dt: Time between two samples, s.
        window: Seconds kept.
        cost: The indifference zone of J.

    Raises:
        ConfigurationError: ``dt`` or ``window`` is not positive.
    """

    def __init__(
        self,
        maneuver: str,
        policy: str,
        dt: float,
        window: float = WINDOW,
        cost: CueCost | None = None,
    ) -> None:
        if not (dt > 0.0 and window > dt):
            raise ConfigurationError(f"dt must be positive and below window, found {dt} and {window}")
        self.maneuver, self.policy, self.dt, self.window = maneuver, policy, dt, window
        cost = cost or CueCost()
        self._scales = np.array([cost.force] * 3 + [cost.rate] * 3)
        self._capacity = int(np.ceil(window / dt)) + 1
        # Every row stands twice, so that the last ones are always in one piece.
        self._ring = np.zeros((2 * self._capacity, 13))
        self.clear()

    def clear(self) -> None:
        """Forget everything: a new drive begins."""
        self._count = 0
        self._cost_sum = 0.0
        self.peak = np.zeros(6)
        """(6,) Largest magnitude of each cue, wanted or felt."""

    def __len__(self) -> int:
        return min(self._count, self._capacity)

    def append(self, time: float, wanted: ArrayLike, felt: ArrayLike) -> None:
        """Add a sample.

        Args:
            time: s, later than the last one.
            wanted: (6,) what the car does.
            felt: (6,) what the simulator does.

        Raises:
            DataError: a shape is wrong, a value is not finite, or time does not increase.
        """
        row = np.concatenate([[time], np.ravel(wanted), np.ravel(felt)]).astype(np.float64)
        if row.shape != (13,) or not np.isfinite(row).all():
            raise DataError("wanted and felt must each be 6 finite numbers at a finite time")
        if self._count and time <= self.time:
            raise DataError(f"time must increase, found {time} after {self.time}; clear() begins a new drive")
        k = self._count % self._capacity
        self._ring[k] = self._ring[k + self._capacity] = row
        self._count += 1
        self._cost_sum += float(np.sum(((row[7:] - row[1:7]) / self._scales) ** 2))
        self.peak = np.maximum(self.peak, np.abs(row[1:].reshape(2, 6)).max(axis=0))

    @property
    def time(self) -> float:
        """Time of the last sample, s; 0 before the first."""
        return float(self._ring[(self._count - 1) % self._capacity, 0]) if self._count else 0.0

    @property
    def cue_error(self) -> float:
        """J of the drive so far; 0 before the first sample."""
        return self._cost_sum / self._count if self._count else 0.0

    @property
    def times(self) -> Floats:
        """(m,) Times kept, s, oldest first."""
        return self._rows()[:, 0]

    @property
    def wanted(self) -> Floats:
        """(m, 6) Cues of the car."""
        return self._rows()[:, 1:7]

    @property
    def felt(self) -> Floats:
        """(m, 6) Cues of the simulator."""
        return self._rows()[:, 7:]

    def _rows(self) -> Floats:
        begin = self._count % self._capacity if self._count > self._capacity else 0
        rows = self._ring[begin : begin + len(self)]
        rows.setflags(write=False)
        return rows
