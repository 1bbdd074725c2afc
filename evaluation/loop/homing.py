"""The way home: accelerations that bring the machine to rest at its start pose, whatever it did before."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import Platform
from ...envs.platform.state import TURNTABLE
from ...envs.settings import Positive, configuration
from ...envs.task.scaling import acceleration_scale

Floats = NDArray[np.float64]

_ARRIVED: Final = 0.01
"""Distance and speed of each axis that count as none, m, rad, m/s, rad/s."""


@configuration
class HomingOptions:
    """How the machine goes home.

    Args:
        frequency: Of the spring to the start pose, critically damped, rad/s.
        share: Of the largest acceleration of each axis alone that it uses at most.
    """

    frequency: Positive = 1.0
    share: Positive = 0.5


class Homing:
    """A spring on each axis, critically damped: it brakes first, and then goes home.

    Args:
        platform: The machine.
        start: (9,) pose to go to; a turntable without ends takes the shorter way round.
        options: How fast.
    """

    def __init__(self, platform: Platform, start: Floats, options: HomingOptions) -> None:
        self._start, self._frequency = start, options.frequency
        self._most = options.share * acceleration_scale(platform)
        self._round = platform.turntable is not None and platform.turntable.travel is None

    def accelerations(self, motion: Floats) -> Floats:
        """(9,) m/s^2 and rad/s^2 for a motion of :class:`~.track.MotionView`."""
        away, rate = self._away(motion)
        w = self._frequency
        return np.asarray(np.clip(-w * w * away - 2.0 * w * rate, -self._most, self._most))

    def arrived(self, motion: Floats) -> bool:
        """Whether the machine rests at the start pose."""
        away, rate = self._away(motion)
        return bool(np.abs(away).max() <= _ARRIVED and np.abs(rate).max() <= _ARRIVED)

    def _away(self, motion: Floats) -> tuple[Floats, Floats]:
        """(9,) distances from the start pose, and rates."""
        axes = slice(len(self._start))
        away, rate = motion[0, axes] - self._start, motion[1, axes]
        if self._round:
            away[TURNTABLE] = np.remainder(away[TURNTABLE] + np.pi, 2.0 * np.pi) - np.pi
        return away, rate
