"""Plans of a drive: the path on the road with curvature and slope, and the speed over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ..errors import ConfigurationError, DataError

Floats = NDArray[np.float64]

STEP: Final = 0.5
"""Distance between the points of a path, m."""


@dataclass(frozen=True, eq=False)
class Path:
    """Points on a line, one every :data:`STEP` meters of it; after its end it goes straight on.

    Args:
        x: North, m.
        y: East (to the right of a car heading along x), m.
        heading: Positive to the right, rad.
        curvature: Positive in a right bend, 1/m.
        grade: Slope, rad, positive uphill.
        grade_per_meter: Derivative of the slope along the path, rad/m.
        bank: Cross slope, rad, right side down positive; level if None.
        bank_per_meter: Derivative of the cross slope along the path, rad/m.
    """

    x: Floats
    y: Floats
    heading: Floats
    curvature: Floats
    grade: Floats
    grade_per_meter: Floats
    bank: Floats | None = None
    bank_per_meter: Floats | None = None

    def __post_init__(self) -> None:
        table = self.table()
        if table.ndim != 2 or len(table) < 2 or not np.isfinite(table).all():
            raise DataError("a path needs at least 2 points, all of them finite")

    def __len__(self) -> int:
        return len(self.x)

    @property
    def length(self) -> float:
        """M."""
        return STEP * (len(self) - 1)

    def table(self) -> Floats:
        """(n, 8) all columns, in the order of the fields."""
        level = np.zeros_like(self.x)
        bank = level if self.bank is None else self.bank
        leaning = level if self.bank_per_meter is None else self.bank_per_meter
        columns = (self.x, self.y, self.heading, self.curvature, self.grade, self.grade_per_meter)
        return np.column_stack((*columns, bank, leaning))

    def delayed(self, distance: float) -> Path:
        """The same path after a straight of about ``distance`` meters (a whole number of steps)."""
        points = STEP * np.arange(-round(distance / STEP), 0)
        zero = np.zeros_like(points)
        c, s = np.cos(self.heading[0]), np.sin(self.heading[0])
        before = (self.x[0] + points * c, self.y[0] + points * s, zero + self.heading[0], *[zero] * 5)
        columns = [np.concatenate((new, old)) for new, old in zip(before, self.table().T, strict=True)]
        return Path(columns[0] - columns[0][0], *columns[1:])

    @classmethod
    def of_curvature(
        cls, curvature: ArrayLike, grade: ArrayLike = 0.0, bank: ArrayLike | None = None
    ) -> Path:
        """The path with curvatures (n,), 1/m, slopes and cross slopes (n,), rad, every :data:`STEP`.

        It begins along x.
        """
        kappa = np.asarray(curvature, dtype=np.float64)
        slope, change = _slope_of(grade, kappa)
        heading = _integral(kappa)
        # Exact for an arc: the chord has the mean heading, and sinc(dpsi / 2) of the arc's length.
        middle, turn = 0.5 * (heading[1:] + heading[:-1]), np.diff(heading)
        chord = STEP * np.sinc(turn / (2.0 * np.pi)) * np.cos(0.5 * (slope[1:] + slope[:-1]))
        x = np.concatenate(([0.0], np.cumsum(chord * np.cos(middle))))
        y = np.concatenate(([0.0], np.cumsum(chord * np.sin(middle))))
        lean = (None, None) if bank is None else _slope_of(bank, kappa)
        return cls(x, y, heading, kappa, slope, change, *lean)

    @classmethod
    def of_offset(cls, x: Floats, y: Floats) -> Path:
        """The level path through offsets ``y`` (n,) over ``x`` (n,), m, smooth to the curvature."""
        spline = CubicSpline(x, y)
        fine = np.linspace(x[0], x[-1], 20 * len(x))
        along = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(fine), np.diff(spline(fine))))))
        at = np.interp(np.arange(0.0, along[-1], STEP), along, fine)
        slope = spline(at, 1)
        curvature = spline(at, 2) / (1.0 + slope**2) ** 1.5
        zero = np.zeros_like(at)
        return cls(at - at[0], spline(at), np.arctan(slope), curvature, zero, zero)


def clothoids(knots: Sequence[tuple[float, float]], length: float) -> Floats:
    """Curvature every :data:`STEP` up to ``length``, m: linear between knots (m, 1/m)."""
    stations, curvatures = zip(*knots, strict=True)
    return np.asarray(np.interp(np.arange(0.0, length + STEP, STEP), stations, curvatures))


def bend(curvature: float, angle: float, transition: float) -> Floats:
    """Curvature every :data:`STEP` of a bend through ``angle``, rad, in the sense of ``curvature``, 1/m.

    Clothoids of ``transition`` meters lead in and out; a bend too short for them is flattened.
    """
    top = min(abs(curvature), abs(angle) / transition)
    arc = max(abs(angle) / top - transition, 0.0)
    length = arc + 2.0 * transition
    stations = np.arange(0.0, length, STEP)
    shape = np.interp(stations, [0.0, transition, transition + arc, length], [0.0, 1.0, 1.0, 0.0])
    # The sampled curvature, integrated as the path does, turns by exactly the angle.
    return np.asarray(np.copysign(abs(angle) / (STEP * shape.sum()), curvature) * shape)


def smooth_steps(stations: Floats, knots: ArrayLike, values: Sequence[float]) -> Floats:
    """Values at ``stations``, m, that pass from knot to knot along half a cosine."""
    index = np.interp(stations, np.asarray(knots, dtype=np.float64), np.arange(len(values)))
    below = np.clip(index.astype(int), 0, len(values) - 2)
    blend = 0.5 - 0.5 * np.cos(np.pi * (index - below))
    level = np.asarray(values, dtype=np.float64)
    return np.asarray(level[below] + (level[below + 1] - level[below]) * blend)


def _slope_of(slope: ArrayLike, points: Floats) -> tuple[Floats, Floats]:
    """A slope (n,), rad, and its derivative, rad/m.

    The slope is the exact integral of its (piecewise linear) derivative, as the kernel reads it.
    """
    change = np.gradient(np.broadcast_to(np.asarray(slope, dtype=np.float64), points.shape), STEP)
    return np.ravel(slope)[0] + _integral(change), change


def _integral(values: Floats) -> Floats:
    return np.concatenate(([0.0], np.cumsum(0.5 * STEP * (values[1:] + values[:-1]))))


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
