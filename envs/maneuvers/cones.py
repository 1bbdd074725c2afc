"""Maneuvers between cones: both severe lane changes of ISO 3888 and the slalom.

The driver plans the smoothest way through the gates that the car's body fits through, and learns from a first
drive how far the car came from it.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Final

import numpy as np
from pydantic import Field
from scipy import sparse
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import linprog

from ..car.kernels.driver import Driver
from ..car.plans import Hold, Path, Schedule
from ..car.simulation import Plan, simulate
from ..car.vehicles import Car
from ..cues import CueTrace
from ..errors import ConfigurationError
from ..road import Route
from ..settings import Positive, configuration
from .roads import KMH, Floats
from .standard import Maneuver

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


TEST_DRIVER = Driver(preview_time=0.7)
"""Aims nearer than in traffic."""

RUN_UP = 15.0
"""Straight driving between the settling and the first cones, where the way may start to swerve, m."""


LAPS = 4
"""Practice runs before the one that counts."""

LEARNED = 0.5
"""Share of the deviation that the next run corrects."""

BLUR = 2.5
"""Standard deviation of the smoothing of that correction, m."""


@lru_cache(maxsize=64)
def practised_path(gates: tuple[Gate, ...], car: Car, speed: float, length: float, margin: float) -> Path:
    """The line to aim at so that the car, which lags behind its driver's aim, drives the smoothest way.

    As on a proving ground the driver practises: after every run the aim is shifted by the deviation of the
    car from the planned way (iterative learning).
    """
    x, way = smoothest_way(gates, car, speed, length, margin)
    aim = way
    schedule = Schedule.of(speed, [Hold(length / speed)])
    for _ in range(LAPS):
        trace = simulate([Plan("practice", car, Path.of_offset(x, aim), schedule, driver=TEST_DRIVER)])[0]
        missed = way - np.interp(x, trace.channels["x_m"], trace.channels["y_m"])
        missed[x > gates[-1].end] = 0.0
        aim = aim + LEARNED * gaussian_filter1d(missed, BLUR / GRID, mode="nearest")
    return Path.of_offset(x, aim)


@configuration
class ConeManeuver(Maneuver):
    """A drive between cones at constant speed, along the smoothest way through them.

    Args:
        speed: m/s.
        margin: Distance kept from the cones by the planned way, m.
    """

    speed: Positive = 80.0 * KMH
    margin: Positive = 0.05
    calm: Positive = 4.0

    @abstractmethod
    def track(self, car: Car) -> tuple[Gate, ...]:
        """The cones, from the first one at 0 m."""

    def gates(self, car: Car) -> tuple[Gate, ...]:
        """The cones where this drive finds them, from its start."""
        shift = self.speed * self.settle + RUN_UP
        return tuple(Gate(g.start + shift, g.end + shift, g.left, g.right) for g in self.track(car))

    def plan(self, car: Car) -> Plan:
        """The smoothest way through the gates, after a straight."""
        gates = self.gates(car)
        start = self.speed * self.settle
        length = gates[-1].end + 2.0 * RUN_UP
        near = tuple(Gate(g.start - start, g.end - start, g.left, g.right) for g in gates)
        path = practised_path(near, car, self.speed, length - start, self.margin).delayed(start)
        schedule = Schedule.of(self.speed, [Hold(length / self.speed + self.calm)])
        route = Route.of_cones(path.curvature, self.speed)
        return Plan(self.name, car, path, schedule, driver=TEST_DRIVER, route=route)


@configuration
class DoubleLaneChange(ConeManeuver):
    """ISO 3888-1: out to a lane 3.5 m to the left and back, at 80 km/h.

    Sections of 15, 30, 25, 25, 15 and 15 m; lanes 1.1 w + 0.25, 1.2 w + 0.25 and 1.3 w + 0.25 m wide (w:
    width of the car), their middles 3.5 m apart.

    Args:
        offset: Between the middles of the lanes, m.
    """

    name: ClassVar[str] = "double-lane-change"

    offset: Positive = 3.5

    def track(self, car: Car) -> tuple[Gate, ...]:
        """Lane 1, lane 2 (beside it), and lane 3 with the exit section."""
        w = car.width
        return (
            Gate.lane(0.0, 15.0, 0.0, 1.1 * w + 0.25),
            Gate.lane(45.0, 25.0, -self.offset, 1.2 * w + 0.25),
            Gate.lane(95.0, 30.0, 0.0, 1.3 * w + 0.25),
        )


@configuration
class ObstacleAvoidance(ConeManeuver):
    """ISO 3888-2: round an obstacle to the left and back, sections of 12, 13.5, 11, 12.5 and 12 m.

    Lanes 1.1 w + 0.25, w + 1 and at least 3 m (1.3 w + 0.25) wide; 1 m between the near edges of lanes 1 and
    2; lane 3 in line with lane 1 at its outer edge. The standard leaves the speed to the test: the default is
    one that all cars of the package can drive cleanly, and the driver keeps it, where the standard lets the
    throttle go.

    Args:
        gap: Between the near edges of lanes 1 and 2, m.
    """

    name: ClassVar[str] = "obstacle-avoidance"

    speed: Positive = 45.0 * KMH
    margin: Positive = 0.1
    gap: Positive = 1.0

    def track(self, car: Car) -> tuple[Gate, ...]:
        """The three lanes."""
        first, second = 1.1 * car.width + 0.25, car.width + 1.0
        third = max(1.3 * car.width + 0.25, 3.0)
        near = -0.5 * first - self.gap
        return (
            Gate.lane(0.0, 12.0, 0.0, first),
            Gate(25.5, 36.5, near - second, near),
            Gate(49.0, 61.0, 0.5 * first - third, 0.5 * first),
        )


@configuration
class Slalom(ConeManeuver):
    """Round cones in a row, alternately to the left and to the right of them.

    Args:
        cones: How many.
        spacing: m.
        cone_width: Diameter of the cones' base, m.
    """

    name: ClassVar[str] = "slalom"

    speed: Positive = 50.0 * KMH
    margin: Positive = 0.2
    cones: Annotated[int, Field(ge=2)] = 8
    spacing: Positive = 18.0
    cone_width: Positive = 0.3

    def track(self, car: Car) -> tuple[Gate, ...]:
        """One-sided gates: left of the first cone, right of the second, and so on."""
        half = 0.5 * self.cone_width
        places = [(k * self.spacing, k % 2 == 0) for k in range(self.cones)]
        return tuple(
            Gate(x - half, x + half, -math.inf, -half) if left else Gate(x - half, x + half, half, math.inf)
            for x, left in places
        )
