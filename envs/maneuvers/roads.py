"""Random roads of several kinds, and the speed along a path.

A road is stretches of curvature, speed limits and stops, one behind another. The speed is as high as bends
and limits allow, with a driver's accelerations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ..car.plans import DT, HOLD, STEP, Schedule, bend
from ..errors import DataError

Floats = NDArray[np.float64]

SMOOTHING: Final = 0.7
"""Width of the moving average, taken twice, that bounds the planned jerk, s."""

CREEP: Final = 0.5
"""Below this planned speed, before and after a stop, the car is held by the brake, m/s."""


@dataclass(frozen=True)
class Style:
    """How briskly somebody drives, m/s^2.

    Args:
        accelerate: Largest acceleration.
        brake: Largest deceleration.
        lateral: Largest centripetal acceleration in a bend.
    """

    accelerate: float
    brake: float
    lateral: float


def speed_limit(curvature: Floats, limit: Floats, style: Style) -> Floats:
    """Limit (n,), m/s, at every point: the road's, and that of the bend, sqrt(a / |kappa|)."""
    return np.minimum(limit, np.sqrt(style.lateral / np.maximum(np.abs(curvature), 1e-9)))


def along_path(
    limit: Floats, style: Style, stops: Sequence[tuple[int, float]], duration: float | None
) -> Schedule:
    """The schedule of a path with a speed limit (n,), m/s, at each of its points.

    Args:
        limit: From the start on; the drive begins at the first limit.
        style: The driver's.
        stops: Point of the path and time to stand there, s, for each stop.
        duration: Of the drive, s: cut there; to the end of the path if None.

    Raises:
        DataError: the path ends before ``duration``.
    """
    speed = _reachable(limit, style, [point for point, _ in stops])
    step = 2.0 * STEP / np.maximum(speed[1:] + speed[:-1], 1e-6)
    arrival = np.concatenate(([0.0], np.cumsum(step)))
    nodes, speeds = arrival, speed
    for point, wait in sorted(stops, reverse=True):
        # A second node at the same place, `wait` later: the time between is spent standing.
        nodes = np.concatenate((nodes[: point + 1], nodes[point:] + wait))
        speeds = np.concatenate((speeds[: point + 1], speeds[point:]))
    end = nodes[-1] if duration is None else duration
    if nodes[-1] < end - DT:
        raise DataError(f"the path ends after {nodes[-1]:.1f} s, before the drive of {end:.1f} s")
    time = DT * np.arange(round(end / DT) + 1)
    return _smoothed(np.interp(time, nodes, speeds))


def _reachable(limit: Floats, style: Style, stops: Sequence[int]) -> Floats:
    """Forward and backward pass: v^2 grows by at most 2 a ds. (n,) m/s."""
    square = (limit**2).tolist()
    for point in stops:
        square[point] = 0.0
    gain, loss = 2.0 * style.accelerate * STEP, 2.0 * style.brake * STEP
    for i in range(1, len(square)):
        square[i] = min(square[i], square[i - 1] + gain)
    for i in range(len(square) - 2, -1, -1):
        square[i] = min(square[i], square[i + 1] + loss)
    return np.asarray(np.sqrt(np.array(square)))


def _smoothed(speed: Floats) -> Schedule:
    width = round(SMOOTHING / DT)
    for _ in range(2):
        speed = uniform_filter1d(speed, width, mode="nearest")
    acceleration = np.gradient(speed, DT)
    standing = speed < CREEP
    return Schedule(np.where(standing, 0.0, speed), np.where(standing, -HOLD, acceleration))


Range = tuple[float, float]


@dataclass(frozen=True)
class RoadKind:
    """What a kind of road is made of. Ranges are drawn from uniformly (radii by their logarithm).

    Args:
        speed: Limits of the road, m/s.
        accelerate: Largest acceleration of its drivers, m/s^2.
        brake: Largest deceleration, m/s^2.
        lateral: Largest centripetal acceleration, m/s^2.
        straight: Length between events, m.
        radius: Of bends, m.
        angle: Of bends, rad.
        transition: Length of their clothoids, m.
        lane_change: Duration of a lane change, s.
        grade: Amplitude of the slope, rad.
        waves: Lengths of the two waves of the slope, m.
        events: Relative frequency of each event.
        weave_period: Of a weave at the limit, s.
        weave_width: Amplitude of a weave, m.
    """

    speed: Range
    accelerate: Range
    brake: Range
    lateral: Range
    straight: Range
    radius: Range
    angle: Range
    transition: Range
    lane_change: Range
    grade: Range
    waves: tuple[Range, Range]
    events: dict[str, float]
    weave_period: Range = (2.6, 4.5)
    weave_width: Range = (0.4, 1.2)


KMH: Final = 1.0 / 3.6
"""One km/h in m/s."""

ROLLING: Final[tuple[Range, Range]] = ((300.0, 600.0), (700.0, 1500.0))
"""Waves of an ordinary road's slope, m."""

KINDS: Final = {
    "urban": RoadKind(
        speed=(30 * KMH, 60 * KMH),
        accelerate=(1.0, 2.4),
        brake=(1.2, 3.0),
        lateral=(1.5, 3.0),
        straight=(15.0, 120.0),
        radius=(25.0, 150.0),
        angle=(0.2, 1.2),
        transition=(8.0, 20.0),
        lane_change=(2.8, 5.0),
        grade=(0.0, 0.02),
        waves=ROLLING,
        events={"bend": 3, "corner": 3, "stop": 2.5, "slow": 2, "lane_change": 2, "roundabout": 1},
    ),
    "rural": RoadKind(
        speed=(60 * KMH, 100 * KMH),
        accelerate=(0.8, 2.0),
        brake=(1.0, 2.5),
        lateral=(1.5, 3.0),
        straight=(30.0, 250.0),
        radius=(70.0, 500.0),
        angle=(0.2, 1.3),
        transition=(20.0, 60.0),
        lane_change=(3.5, 6.0),
        grade=(0.0, 0.05),
        waves=ROLLING,
        events={"bend": 6, "corner": 0.5, "stop": 0.5, "slow": 2, "lane_change": 1.5, "roundabout": 0.5},
    ),
    "highway": RoadKind(
        speed=(85 * KMH, 130 * KMH),
        accelerate=(0.4, 1.2),
        brake=(0.6, 1.8),
        lateral=(0.6, 1.5),
        straight=(60.0, 400.0),
        radius=(500.0, 2000.0),
        angle=(0.1, 0.6),
        transition=(60.0, 150.0),
        lane_change=(4.5, 8.0),
        grade=(0.0, 0.03),
        waves=ROLLING,
        events={"bend": 3, "slow": 2.5, "lane_change": 3},
    ),
    "track": RoadKind(
        speed=(35 * KMH, 100 * KMH),
        accelerate=(1.5, 3.5),
        brake=(3.0, 6.0),
        lateral=(2.0, 4.0),
        straight=(5.0, 80.0),
        radius=(15.0, 200.0),
        angle=(0.3, 1.6),
        transition=(10.0, 25.0),
        lane_change=(2.4, 4.0),
        grade=(0.0, 0.02),
        waves=ROLLING,
        events={"bend": 3, "corner": 2, "stop": 1, "slow": 2, "lane_change": 3, "roundabout": 1, "weave": 2},
    ),
    "hilly": RoadKind(
        speed=(40 * KMH, 90 * KMH),
        accelerate=(0.8, 2.0),
        brake=(1.0, 2.5),
        lateral=(1.0, 2.5),
        straight=(60.0, 400.0),
        radius=(70.0, 500.0),
        angle=(0.2, 1.0),
        transition=(20.0, 60.0),
        lane_change=(3.5, 6.0),
        grade=(0.05, 0.12),
        waves=((150.0, 300.0), (300.0, 700.0)),
        events={"bend": 2, "slow": 1, "lane_change": 1},
    ),
    "strip": RoadKind(
        speed=(80 * KMH, 150 * KMH),
        accelerate=(2.0, 4.5),
        brake=(3.0, 7.0),
        lateral=(1.5, 2.5),
        straight=(50.0, 500.0),
        radius=(300.0, 600.0),
        angle=(0.1, 0.4),
        transition=(30.0, 60.0),
        lane_change=(4.5, 8.0),
        grade=(0.0, 0.01),
        waves=ROLLING,
        events={"stop": 4, "slow": 3, "bend": 1},
    ),
    "cones": RoadKind(
        speed=(40 * KMH, 90 * KMH),
        accelerate=(1.0, 3.0),
        brake=(2.0, 5.0),
        lateral=(3.5, 6.0),
        straight=(10.0, 80.0),
        radius=(40.0, 250.0),
        angle=(0.2, 1.2),
        transition=(5.0, 15.0),
        lane_change=(2.2, 3.5),
        grade=(0.0, 0.01),
        waves=ROLLING,
        events={"weave": 4, "lane_change": 3, "bend": 3, "slow": 1},
        weave_period=(2.3, 4.5),
        weave_width=(0.4, 1.4),
    ),
}
"""Engineering choices: speed limits of European roads, accelerations of ordinary to brisk drivers; on the
handling track those of a test driver, in the hills slopes and crests of mountain roads, on the strip standing
starts and full braking, among cones weaves, sudden bends and lane changes close to what tires hold."""

CORNER_RADIUS: Final[Range] = (9.0, 18.0)
"""Of a right-angled turn at a crossing, m."""

ROUNDABOUT_RADIUS: Final[Range] = (14.0, 25.0)
"""Of the circle driven, m."""

LANE_WIDTH: Final[Range] = (2.8, 3.75)
"""m."""

WEAVE_PERIODS: Final[Range] = (2.0, 5.0)
"""Of a weave."""


@dataclass
class Road:
    """A road under construction: what to drive, how fast, and where to stop.

    Args:
        kind: Of road.
        rng: Source of chance.
        limit: Speed limit in force, m/s.
    """

    kind: RoadKind
    rng: np.random.Generator
    limit: float
    curvature: list[Floats] = field(default_factory=list)
    limits: list[Floats] = field(default_factory=list)
    stops: list[tuple[int, float]] = field(default_factory=list)
    points: int = 0

    def draw(self, bounds: Range) -> float:
        """Uniform within the bounds."""
        return float(self.rng.uniform(*bounds))

    def sign(self) -> float:
        """Left (-1) or right (1)."""
        return float(self.rng.choice((-1.0, 1.0)))

    def add(self, curvature: Floats, limit: float | None = None) -> None:
        """Append a stretch, with a limit of its own or the road's."""
        self.curvature.append(curvature)
        self.limits.append(np.full(len(curvature), self.limit if limit is None else limit))
        self.points += len(curvature)

    def add_straight(self, length: float) -> None:
        """Append a straight, m."""
        self.add(np.zeros(max(round(length / STEP), 1)))

    def add_event(self) -> None:
        """Append one random event and the straight after it."""
        names = list(self.kind.events)
        weights = np.array([self.kind.events[name] for name in names])
        EVENTS[str(self.rng.choice(names, p=weights / weights.sum()))](self)
        self.add_straight(self.draw(self.kind.straight))


def add_bend(road: Road) -> None:
    """A bend of the road's kind."""
    low, high = np.log(road.kind.radius)
    radius = float(np.exp(road.rng.uniform(low, high)))
    road.add(bend(road.sign() / radius, road.draw(road.kind.angle), road.draw(road.kind.transition)))


def add_corner(road: Road) -> None:
    """A right-angled turn at a crossing."""
    angle = road.draw((0.4 * np.pi, 0.6 * np.pi))
    road.add(bend(road.sign() / road.draw(CORNER_RADIUS), angle, road.draw((5.0, 9.0))))


def add_stop(road: Road) -> None:
    """A stop of 2 to 8 s."""
    road.stops.append((road.points, road.draw((2.0, 8.0))))


def add_slow(road: Road) -> None:
    """Another speed limit, or for a while the slower one of traffic ahead."""
    if road.rng.random() < 0.5:
        road.limit = road.draw(road.kind.speed)
    else:
        road.add(
            np.zeros(round(road.draw((1.0, 4.0)) * road.limit / STEP)), road.draw((0.4, 0.8)) * road.limit
        )


def add_lane_change(road: Road) -> None:
    """To the next lane, by one sine of curvature: offset A T^2 / (2 pi) at the limit."""
    length = road.draw(road.kind.lane_change) * road.limit
    stations = np.arange(0.0, length, STEP)
    peak = 2.0 * np.pi * road.draw(LANE_WIDTH) / length**2
    road.add(road.sign() * peak * np.sin(2.0 * np.pi * stations / length))


def add_weave(road: Road) -> None:
    """To and fro within the road, some periods of a sine of curvature."""
    length = road.draw(road.kind.weave_period) * road.limit
    stations = np.arange(0.0, length * round(road.draw(WEAVE_PERIODS)), STEP)
    # The car sways by peak (length / 2 pi)^2 to either side.
    peak = road.draw(road.kind.weave_width) * (2.0 * np.pi / length) ** 2
    road.add(road.sign() * peak * np.sin(2.0 * np.pi * stations / length))


def add_roundabout(road: Road) -> None:
    """Round a roundabout to one of its exits (traffic on the right)."""
    deflection = road.draw((0.6, 1.0))
    turn = float(road.rng.choice((-0.5, 0.0, 0.5))) * np.pi
    aside = bend(1.0 / road.draw((20.0, 35.0)), deflection, 7.0)
    circle = bend(-1.0 / road.draw(ROUNDABOUT_RADIUS), max(turn + 2.0 * deflection, 0.3), 7.0)
    for piece in (aside, circle, aside):
        road.add(piece)


EVENTS: Final[dict[str, Callable[[Road], None]]] = {
    "bend": add_bend,
    "corner": add_corner,
    "stop": add_stop,
    "slow": add_slow,
    "lane_change": add_lane_change,
    "roundabout": add_roundabout,
    "weave": add_weave,
}
"""What can happen on a road, by name."""
