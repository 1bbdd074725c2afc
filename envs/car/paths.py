"""Paths: the line on the road that the driver follows, with curvature and slope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ..errors import DataError

Floats = NDArray[np.float64]

STEP: Final = 0.5
"""Distance between the points of a path, m."""


@dataclass(frozen=True, eq=False)
class Path:
    """Points on a line, one every :data:`STEP` metres of it; after its end it goes straight on.

    Args:
        x: North, m.
        y: East (to the right of a car heading along x), m.
        heading: Positive to the right, rad.
        curvature: Positive in a right bend, 1/m.
        grade: Slope, rad, positive uphill.
        grade_per_metre: Derivative of the slope along the path, rad/m.
    """

    x: Floats
    y: Floats
    heading: Floats
    curvature: Floats
    grade: Floats
    grade_per_metre: Floats

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
        """(n, 6) all columns, in the order of the fields."""
        columns = (self.x, self.y, self.heading, self.curvature, self.grade, self.grade_per_metre)
        return np.column_stack(columns)

    def delayed(self, distance: float) -> Path:
        """The same path after a straight of about ``distance`` metres (a whole number of steps)."""
        points = STEP * np.arange(-round(distance / STEP), 0)
        zero = np.zeros_like(points)
        c, s = np.cos(self.heading[0]), np.sin(self.heading[0])
        before = (self.x[0] + points * c, self.y[0] + points * s, zero + self.heading[0], zero, zero, zero)
        columns = [np.concatenate((new, old)) for new, old in zip(before, self.table().T, strict=True)]
        return Path(columns[0] - columns[0][0], *columns[1:])

    @classmethod
    def of_curvature(cls, curvature: ArrayLike, grade: ArrayLike = 0.0) -> Path:
        """The path with curvatures (n,), 1/m, and slopes (n,), rad, every :data:`STEP`; along x at first."""
        kappa = np.asarray(curvature, dtype=np.float64)
        change = np.gradient(np.broadcast_to(np.asarray(grade, dtype=np.float64), kappa.shape), STEP)
        # The slope is the exact integral of its (piecewise linear) derivative, as the kernel reads it.
        slope = np.ravel(grade)[0] + _integral(change)
        heading = _integral(kappa)
        # Exact for an arc: the chord has the mean heading, and sinc(dpsi / 2) of the arc's length.
        middle, turn = 0.5 * (heading[1:] + heading[:-1]), np.diff(heading)
        chord = STEP * np.sinc(turn / (2.0 * np.pi)) * np.cos(0.5 * (slope[1:] + slope[:-1]))
        x = np.concatenate(([0.0], np.cumsum(chord * np.cos(middle))))
        y = np.concatenate(([0.0], np.cumsum(chord * np.sin(middle))))
        return cls(x, y, heading, kappa, slope, change)

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

    Clothoids of ``transition`` metres lead in and out; a bend too short for them is flattened.
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


def _integral(values: Floats) -> Floats:
    return np.concatenate(([0.0], np.cumsum(0.5 * STEP * (values[1:] + values[:-1]))))
