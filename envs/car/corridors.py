"""Cones on a test track: where a car's body may be, the smoothest way through, and how near it came."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import linprog

from ..cues import CueTrace
from ..errors import ConfigurationError
from .vehicles import Car

Floats = NDArray[np.float64]

GRID: Final = 1.0
"""Distance between the points of a planned way, m."""

JERK_TIME: Final = 0.15
"""Weight of lateral jerk against lateral acceleration, s: about the time a car needs to follow the wheel."""

SIDE_POINTS: Final = 80
"""Points along each side of the body whose distance to the cones is measured."""


@dataclass(frozen=True)
class Gate:
    """Cones from ``start`` to ``end`` along the track; bounds to the left and right (positive). In m."""

    start: float
    end: float
    left: float
    right: float

    def cones(self) -> Floats:
        """Where its cones stand: at its ends and at most 2 m apart between, m."""
        return np.linspace(self.start, self.end, 2 + int((self.end - self.start) / 2.0))

    @classmethod
    def lane(cls, start: float, length: float, middle: float, width: float) -> Gate:
        """A lane between two rows of cones."""
        return cls(start, start + length, middle - 0.5 * width, middle + 0.5 * width)


def smoothest_way(
    gates: Sequence[Gate], car: Car, speed: float, length: float, margin: float
) -> tuple[Floats, Floats]:
    """Offsets y over x, m, that keep the body inside the gates with the least lateral acceleration and jerk.

    A linear program: min p + T q with |v^2 y"| <= p and |v^3 y"'| <= q, while for every cone at x_c that is
    beside the body (l = x_c - x between its rear and front) left + w/2 + margin <= y + l psi <= right - w/2 -
    margin, with the heading psi of a car in a steady turn, y' - beta, beta = (b - m a v^2 / (L C_r)) y".

    Raises:
        ConfigurationError: the car does not fit.
    """
    x = np.arange(0.0, length + GRID, GRID)
    n = len(x)
    first, second = _differences(n, 1), _differences(n, 2)
    third = sparse.csr_matrix(np.diff(np.eye(n), 3, axis=0) / GRID**3)
    load = car.mass * car.front_axle * speed**2 / car.wheelbase
    slip = car.rear_axle - load / car.tires.rear_cornering_stiffness
    rows, bounds = _body_bounds(gates, car, x, first - slip * second, margin)
    smooth = [_peak(speed**2 * second, 0), _peak(speed**3 * third, 1)]
    upper = sparse.vstack([*smooth, sparse.hstack([rows, sparse.csr_matrix((rows.shape[0], 2))])])
    right = np.concatenate([np.zeros(2 * (second.shape[0] + third.shape[0])), bounds])
    still = sparse.hstack([_ends(n), sparse.csr_matrix((6, 2))])
    cost = np.concatenate([np.zeros(n), [1.0, JERK_TIME]])
    result = linprog(cost, upper, right, still, np.zeros(6), (None, None))  # type: ignore[call-overload]  # sparse
    if not result.success:
        raise ConfigurationError(
            f"{car.name} does not fit between the cones with a margin of {margin} m; lower it"
        )
    return x, np.asarray(result.x[:n])


def _peak(matrix: sparse.csr_matrix, which: int) -> sparse.csr_matrix:
    """Rows of |matrix y| <= peak, for one of the two peaks that follow y in the program's variables."""
    column = np.zeros((1, 2))
    column[0, which] = -1.0
    peak = sparse.csr_matrix(np.repeat(column, matrix.shape[0], axis=0))
    return sparse.csr_matrix(sparse.vstack([sparse.hstack([matrix, peak]), sparse.hstack([-matrix, peak])]))


def _differences(n: int, order: int) -> sparse.csr_matrix:
    """Central first or second derivative, one-sided (first) or zero (second) at the ends."""
    eye = np.eye(n)
    if order == 1:
        return sparse.csr_matrix(np.gradient(eye, GRID, axis=0))
    inner = np.diff(eye, 2, axis=0) / GRID**2
    return sparse.csr_matrix(np.vstack([np.zeros((1, n)), inner, np.zeros((1, n))]))


def _ends(n: int) -> sparse.csr_matrix:
    """Rows that put the first three points on the axis and keep the last four level."""
    rows = np.zeros((6, n))
    rows[[0, 1, 2], [0, 1, 2]] = 1.0
    rows[3, [-1, -2]] = 1.0, -1.0
    rows[4, [-2, -3]] = 1.0, -1.0
    rows[5, [-3, -4]] = 1.0, -1.0
    return sparse.csr_matrix(rows)


def _body_bounds(
    gates: Sequence[Gate], car: Car, x: Floats, heading: sparse.csr_matrix, margin: float
) -> tuple[sparse.csr_matrix, Floats]:
    """Rows G and bounds h, G y <= h: every cone beside the body is outside it."""
    position = sparse.identity(len(x), format="csr")
    rear, front = -car.rear_axle - car.rear_overhang, car.front_axle + car.front_overhang
    rows, bounds = [], []
    for gate in gates:
        for cone in gate.cones():
            beside = np.flatnonzero((x + rear - 0.5 * GRID <= cone) & (cone <= x + front + 0.5 * GRID))
            point = position[beside] + sparse.diags(cone - x[beside]) @ heading[beside]
            for sign, edge in ((1.0, gate.right), (-1.0, -gate.left)):
                if np.isfinite(edge):
                    rows.append(sign * point)
                    bounds.append(np.full(len(beside), edge - 0.5 * car.width - margin))
    return sparse.csr_matrix(sparse.vstack(rows)), np.concatenate(bounds)


def clearance(trace: CueTrace, car: Car, gates: Sequence[Gate]) -> float:
    """Least distance between the body's sides and the cones' rows, m; negative where cones were hit."""
    x, y, heading = (trace.channels[key] for key in ("x_m", "y_m", "heading_rad"))
    least = np.inf
    rear, front = -car.rear_axle - car.rear_overhang, car.front_axle + car.front_overhang
    for station in np.linspace(rear, front, SIDE_POINTS):
        for side in (-0.5 * car.width, 0.5 * car.width):
            px = x + station * np.cos(heading) - side * np.sin(heading)
            py = y + station * np.sin(heading) + side * np.cos(heading)
            for gate in gates:
                inside = (px >= gate.start) & (px <= gate.end)
                gaps = np.minimum(gate.right - py[inside], py[inside] - gate.left)
                least = min(least, float(gaps.min(initial=np.inf)))
    return least
