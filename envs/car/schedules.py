"""Speed schedules: what the speed should be over time, from steps a person would name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError, DataError

Floats = NDArray[np.float64]

DT: Final = 0.01
"""Time step of schedules and of the cues, s."""

HOLD: Final = 0.8
"""Deceleration that the brake of a standing car would make; a gentle stop ends with it. In m/s^2."""


@dataclass(frozen=True)
class Hold:
    """Keep the speed for ``duration`` seconds; a standing car is held with the brake of ``brake`` m/s^2."""

    duration: float
    brake: float = HOLD


@dataclass(frozen=True)
class Change:
    """Change to ``speed``, m/s, with at most ``acceleration``, m/s^2, reached with ``jerk``, m/s^3.

    The acceleration ends with ``release_jerk``: that of the onset if None, at once if infinite.
    """

    speed: float
    acceleration: float
    jerk: float = 2.0
    release_jerk: float | None = None


@dataclass(frozen=True, eq=False)
class Schedule:
    """Speed, m/s, and acceleration, m/s^2, every :data:`DT`; at speed 0 the acceleration is the brake's."""

    speed: Floats
    acceleration: Floats

    def __post_init__(self) -> None:
        both = np.stack((self.speed, self.acceleration))
        if both.shape[1] < 2 or not np.isfinite(both).all() or np.any(self.speed < 0.0):
            raise DataError("a schedule needs at least 2 finite speeds, none negative")

    def __len__(self) -> int:
        return len(self.speed)

    @property
    def distance(self) -> Floats:
        """(n,) m."""
        steps = 0.5 * DT * (self.speed[1:] + self.speed[:-1])
        return np.concatenate(([0.0], np.cumsum(steps)))

    @classmethod
    def of(cls, start: float, phases: Sequence[Hold | Change]) -> Schedule:
        """From ``start``, m/s, through the phases in turn.

        Raises:
            ConfigurationError: a duration, speed, acceleration or jerk is not positive.
        """
        pieces, speed = [np.array([[start], [0.0 if start > 0.0 else -HOLD]])], start
        for phase in phases:
            if isinstance(phase, Hold):
                pieces.append(_hold(speed, phase))
            else:
                pieces.append(_change(speed, phase))
                speed = phase.speed
        table = np.concatenate(pieces, axis=1)
        return cls(table[0], table[1])


def _hold(speed: float, phase: Hold) -> Floats:
    if not phase.duration >= 0.0 or not speed >= 0.0:
        raise ConfigurationError(f"duration and speed must not be negative (found {phase.duration}, {speed})")
    n = round(phase.duration / DT)
    return np.stack((np.full(n, speed), np.full(n, -phase.brake if speed <= 0.0 else 0.0)))


def _change(start: float, phase: Change) -> Floats:
    """A trapezoid of acceleration, lowered where the speed change is too small to reach its top."""
    release = phase.jerk if phase.release_jerk is None else phase.release_jerk
    if not min(phase.acceleration, phase.jerk, release) > 0.0 or not phase.speed >= 0.0:
        raise ConfigurationError(
            "a speed change needs positive acceleration and jerk and a speed not below 0"
        )
    change, sign = abs(phase.speed - start), np.sign(phase.speed - start)
    if change < 1e-9:
        return np.zeros((2, 0))
    top = min(phase.acceleration, float(np.sqrt(2.0 * change / (1.0 / phase.jerk + 1.0 / release))))
    rise, fall = top / phase.jerk, top / release
    corners = np.cumsum([0.0, rise, change / top - 0.5 * (rise + fall), fall])
    time = DT * np.arange(1, int(np.ceil(corners[-1] / DT - 1e-9)) + 1)
    level = np.interp(time, corners, [0.0, top, top, 0.0], right=0.0)
    gained = np.array([_gain(t, corners, top) for t in time])
    return np.stack((np.maximum(start + sign * gained, 0.0), sign * level))


def _gain(t: float, corners: Floats, top: float) -> float:
    """Integral of the trapezoid of acceleration from 0 to ``t``."""
    _, rise, steady, end = corners
    up = min(t, rise)
    down = min(max(t - steady, 0.0), end - steady)
    gain = 0.5 * top * up**2 / rise + top * (min(max(t, rise), steady) - rise)
    return float(gain + (top * (down - 0.5 * down**2 / (end - steady)) if down > 0.0 else 0.0))
